"""Paper B's figures 4 and 5: one motion out of two noisy sources."""

from __future__ import annotations

from functools import partial

import numpy as np

from mocaplab.comparison.bootstrap import Interval
from mocaplab.reproduction.claims import Claim, Evidence, make_claim, of_motions
from mocaplab.reproduction.figure import Drawing, Figure, new_picture
from mocaplab.reproduction.scores import NOTHING, ByClip
from mocaplab.reproduction.sources import GATED, NETWORK, Row, source_rows
from mocaplab.reproduction.verdicts import judge_every

COLORS = {
    "input A": "#0072B2",  # blue, red and green in the paper
    "input B": "#D55E00",
    NETWORK: "#009E73",
    "mean": "#999999",
    GATED: "#E69F00",
}
AXIS = "L1 distance between quaternions"


def _rows(evidence: Evidence) -> list[Row]:
    split = evidence.groups["holdout"]["holdout_1"]
    make = partial(source_rows, evidence.dataset, split, evidence.plan, evidence.models)
    return evidence.cached("sources", make)


def _by_clip(rows: list[Row], method: str) -> ByClip:
    clips = dict.fromkeys(row["clip"] for row in rows)
    return {c: float(np.mean([r[method] for r in rows if r["clip"] == c])) for c in clips}


def _draw_4(evidence: Evidence) -> Drawing:
    rows = _rows(evidence)
    picture, (ax,) = new_picture(width=7)
    boxes = ax.boxplot([[row[m] for row in rows] for m in COLORS], patch_artist=True, whis=(0, 100))
    for box, color in zip(boxes["boxes"], COLORS.values(), strict=True):
        box.set_facecolor(color)
    ax.set_xticks(range(1, 1 + len(COLORS)), list(COLORS))
    ax.set_ylim(0, None)
    ax.set_ylabel(AXIS)
    return rows, picture


def _draw_5(evidence: Evidence) -> Drawing:
    rows = _rows(evidence)
    picture, (ax,) = new_picture(width=9)
    errors = {method: _by_clip(rows, method) for method in COLORS}
    order = sorted(
        errors[NETWORK], key=lambda clip: errors["input A"][clip] + errors["input B"][clip]
    )
    for method, color in COLORS.items():
        line = "-" if method in ("input A", "input B", NETWORK) else "--"
        ax.plot([errors[method][c] for c in order], line, marker=".", color=color, label=method)
    ax.set_xticks(range(len(order)), order, rotation=90)
    ax.set_ylim(0, None)
    ax.set(xlabel="motion, in the order of its inputs' distance", ylabel=AXIS)
    ax.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3, frameon=False)
    return rows, picture


def _claims(evidence: Evidence) -> list[Claim]:
    rows = _rows(evidence)
    scores, ours = evidence.scores, _by_clip(rows, NETWORK)
    inputs = {name: _by_clip(rows, name) for name in ("input A", "input B")}
    verdict, won, n = judge_every(ours, inputs)
    count = Interval(won, won, won) if n else NOTHING
    claims = [
        make_claim(
            evidence,
            "b5",
            "the network is nearer to the truth than both of its inputs",
            "on every motion",
            count,
            of_motions(n),
            n,
            ("ebf",),
            lambda: verdict,
        )
    ]
    for rival in ("mean", GATED):
        ratio, n = scores.ratio(ours, _by_clip(rows, rival))
        text = f"the network's distance against that of the {rival}"
        claims.append(make_claim(evidence, "b5", text, "-", ratio, "times", n, ("ebf",), None))
    return claims


def _no_claims(evidence: Evidence) -> list[Claim]:
    """Both figures show the same numbers; they are judged once."""
    return []


SOURCE_FIGURES = (
    Figure(
        "b4",
        "Paper B, Figure 4: distance of two sources and of the network to the truth",
        "Does the network take noise away? The paper shows no opponent but the inputs.",
        (),
        _draw_4,
        _no_claims,
        sources=True,
    ),
    Figure(
        "b5",
        "Paper B, Figure 5: the same by motion",
        "Is it nearer on every motion? And nearer than what costs nothing, the mean of the two?",
        (),
        _draw_5,
        _claims,
        sources=True,
    ),
)
