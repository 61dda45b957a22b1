"""Leaving one action out and timing, and what the paper did not try and a reader would ask."""

from __future__ import annotations

from functools import partial

import numpy as np

from mocaplab.comparison.bootstrap import Interval
from mocaplab.reproduction.claims import Claim, Evidence, make_claim, ratio_claim
from mocaplab.reproduction.figure import Drawing, Figure, Row, new_picture
from mocaplab.reproduction.needs import NOISE, Need
from mocaplab.reproduction.plots import plot_bars, plot_points, style_of
from mocaplab.reproduction.scores import label_of
from mocaplab.reproduction.verdicts import judge_below

CLEAN = "angular:0"


def _bars(evidence: Evidence, values: dict[str, Interval], unit: str) -> Drawing:
    picture, (ax,) = new_picture(width=8, height=1.3 + 0.4 * len(values))
    plot_bars(values, unit, ax)
    rows: list[Row] = [
        {"of": label, "value": v.value, "low": v.low, "high": v.high, "unit": unit}
        for label, v in values.items()
    ]
    return rows, picture


def _draw_actions(evidence: Evidence) -> Drawing:
    """Draw all bars of an action over the same clips: those that all three have."""
    scores, values = evidence.scores, {}
    left_out = scores.by_clip("ebf", group="without")
    several = {
        "trained on all actions": scores.by_clip("ebf"),
        "trained without it": left_out,
        "Gaussian 58 ms": scores.by_clip("gaussian_58"),
    }
    common = scores.numbered(list(several.values()))
    for action in dict.fromkeys(scores.actions[clip] for clip in common):
        for label, errors in several.items():
            mine = {clip: errors[clip] for clip in common if scores.actions[clip] == action}
            values[f"{action}: {label}"] = scores.mean(mine)
    return _bars(evidence, values, "RMS error over all joints, degrees")


def _claims_actions(evidence: Evidence) -> list[Claim]:
    groups = ("without", "holdout")
    claim = partial(ratio_claim, evidence, "actions")
    return [
        claim("an action never seen: EBF against the Gaussian", 1.76 / 2.25, "ebf", "gaussian_58",
              groups=groups),
        claim("an action never seen costs EBF something", 1.76 / 1.42, "ebf", "ebf",
              groups=groups),
        claim("an action never seen: EBF against the tuned Gaussian, which saw it", None, "ebf",
              "gaussian_tuned", groups=groups),
    ]  # fmt: skip


def _timed(evidence: Evidence) -> dict[str, Interval]:
    methods = ("gaussian_58", "gaussian_tuned", "wiener", "example_based", "ebf", "blend")
    named = [evidence.plan.headline(method) for method in methods]
    found = {label_of(m): evidence.scores.ms_per_frame(m) for m in named}
    return {label: time for label, time in found.items() if not np.isnan(time.value)}


def _draw_timing(evidence: Evidence) -> Drawing:
    rows, picture = _bars(
        evidence, _timed(evidence), "milliseconds a frame: median, fastest and slowest clip"
    )
    picture.axes[0].axvline(1.0, color="black", linestyle="--")
    return rows, picture


def _claims_timing(evidence: Evidence) -> list[Claim]:
    ebf = evidence.plan.headline("ebf")
    time = evidence.scores.ms_per_frame(ebf)
    n = len(evidence.scores.by_clip(ebf))
    return [
        make_claim(
            evidence,
            "timing",
            "EBF cleans in real time, whole clips on one core (median, fastest and slowest clip)",
            "< 1 ms a frame",
            time,
            "ms a frame",
            n,
            (f"{ebf}+",),  # speed does not depend on how long it was trained
            lambda: judge_below(1.0, time),
        )
    ]


def _draw_amount(evidence: Evidence) -> Drawing:
    scores = evidence.scores
    picture, (ax,) = new_picture(width=7)
    series, rows = {}, []
    for number, method in enumerate(("ebf", "gaussian_tuned", "wiener")):
        points = []
        for group in ("quarter", "half", "holdout"):
            tests = scores.by_clip(method, group=group)
            first = scores.by_clip(method, group="half")
            mine = {clip: e for clip, e in tests.items() if clip in first}
            if mine:
                n = next(
                    len(job.split.train)
                    for job in scores.results
                    if job.method == method and job.holdout == f"{group}_1"
                )
                points.append((n, scores.mean(mine)))
        if points:
            amounts, means = zip(*points, strict=True)
            series[label_of(method)] = (amounts, means, *style_of(method, number))
            rows += [
                {"method": label_of(method), "training_clips": n, "rms_all_deg": m.value}
                | {"low": m.low, "high": m.high}
                for n, m in points
            ]
    plot_points(series, "training clips", "RMS error, degrees", ax)
    return rows, picture


def _draw_subjects(evidence: Evidence) -> Drawing | None:
    scores, values = evidence.scores, {}
    for group, text in (("holdout", "people were seen"), ("subjects", "people never seen")):
        both = {m: scores.by_clip(m, group=group) for m in ("ebf", "gaussian_tuned")}
        common = scores.numbered(list(both.values()))
        if not common:  # nobody wrote down who moves
            return None
        for method, errors in both.items():
            mean = scores.mean({clip: errors[clip] for clip in common})
            values[f"{label_of(method)}, {text}"] = mean
    return _bars(evidence, values, "RMS error over all joints, degrees")


def _harm(evidence: Evidence) -> dict[str, Interval]:
    methods = ("gaussian_58", "gaussian_125", f"ebf@{NOISE}", "ebf", "blend")
    scores = evidence.scores
    found = {label_of(m): scores.by_clip(m, CLEAN, measure="harm_deg") for m in methods}
    return {label: scores.mean(errors) for label, errors in found.items() if errors}


def _draw_clean(evidence: Evidence) -> Drawing:
    return _bars(evidence, _harm(evidence), "change of a clean motion, RMS degrees")


def _only(
    evidence: Evidence, figure: str, comparisons: list[tuple[str, str, str, tuple[str, str], str]]
) -> list[Claim]:
    """Make findings of ours out of (text, method, rival, groups, noise)."""
    return [
        ratio_claim(evidence, figure, text, None, ours, theirs, recipe, groups)
        for text, ours, theirs, groups, recipe in comparisons
    ]


def _claims_amount(evidence: Evidence) -> list[Claim]:
    groups = ("quarter", "holdout")
    return _only(evidence, "amount", [
        ("EBF trained on a quarter of the clips against all", "ebf", "ebf", groups, NOISE),
        ("the tuned Gaussian, likewise", "gaussian_tuned", "gaussian_tuned", groups, NOISE),
    ])  # fmt: skip


def _claims_subjects(evidence: Evidence) -> list[Claim]:
    groups = ("subjects", "subjects")
    text = "people never seen: EBF against the tuned Gaussian"
    return _only(evidence, "subjects", [(text, "ebf", "gaussian_tuned", groups, NOISE)])


def _claims_clean(evidence: Evidence) -> list[Claim]:
    groups = ("holdout", "holdout")
    return _only(evidence, "clean", [
        ("harm to a clean motion: EBF trained on all amounts against the one trained on 0.5",
         "ebf", f"ebf@{NOISE}", groups, CLEAN),
        ("harm to a clean motion: EBF against the Gaussian of 58 ms", "ebf", "gaussian_58",
         groups, CLEAN),
    ])  # fmt: skip


OWN = (
    Figure(
        "actions",
        "Section 4.1: leave one action out",
        "Can EBF clean an action that it never saw? And what does that cost?",
        (Need(("ebf",), group="without"), Need(("ebf", "gaussian_58", "gaussian_tuned"))),
        _draw_actions,
        _claims_actions,
    ),
    Figure(
        "timing",
        "Section 4.3: milliseconds a frame",
        "Is it below 1 ms? On one core of this machine, busy or not, whole clips at once.",
        (
            Need(
                ("gaussian_58", "gaussian_tuned", "wiener", "example_based", "ebf", "blend"),
                headline=True,
            ),
        ),
        _draw_timing,
        _claims_timing,
    ),
    Figure(
        "amount",
        "Not in the paper: error by amount of training data",
        "Would more clips help, and which method needs most of them?",
        tuple(
            Need(("ebf", "gaussian_tuned", "wiener"), group=group)
            for group in ("holdout", "half", "quarter")
        ),
        _draw_amount,
        _claims_amount,
    ),
    Figure(
        "subjects",
        "Not in the paper: people who were never seen in training",
        "The paper's holdouts share people with the training clips. Does that matter?",
        tuple(Need(("ebf", "gaussian_tuned"), group=group) for group in ("holdout", "subjects")),
        _draw_subjects,
        _claims_subjects,
    ),
    Figure(
        "clean",
        "Not in the paper: harm done to a motion that was clean already",
        "A cleaner must know when to keep its hands off. Does it?",
        (Need(("gaussian_58", "gaussian_125", f"ebf@{NOISE}", "ebf", "blend"), (CLEAN,)),),
        _draw_clean,
        _claims_clean,
    ),
)  # fmt: skip
