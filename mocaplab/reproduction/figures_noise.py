"""Paper A's figures 6 and 7: amounts and kinds of noise."""

from __future__ import annotations

from functools import partial

import numpy as np
from matplotlib.axes import Axes

from mocaplab.comparison.bootstrap import Interval
from mocaplab.noise.draws import draw_test
from mocaplab.reproduction.claims import Claim, Evidence, every_claim, make_claim, ratio_claim
from mocaplab.reproduction.figure import Drawing, Figure, Lines, Row, draw_motions, new_picture
from mocaplab.reproduction.needs import NOISE, SPATIAL, Need
from mocaplab.reproduction.networks_inside import bias_share
from mocaplab.reproduction.plots import plot_by_motion
from mocaplab.reproduction.scores import label_of
from mocaplab.reproduction.verdicts import judge_alike, judge_size

AMOUNTS = ("angular:0.1", NOISE, "angular:0.9")
TRAINED_ON = tuple(f"ebf@{recipe}" for recipe in AMOUNTS)
POSITIONS = ("spatial:0.1", SPATIAL, "spatial:1", "spatial:3")
ON_POSITIONS = "ebf@spatial:0.5"
KINDS = {
    "uniform:0.5": "uniform noise",
    "biased:0.5": "0.5 noise and a constant bias",
    "wavering:0.5": "0.5 noise and a sinusoidal bias",
}
AMOUNT_COLORS = {"angular:0.1": "#009E73", NOISE: "#0072B2", "angular:0.9": "#D55E00"}
DASHES = ("--", "-.", ":")


def _draw_6(evidence: Evidence) -> Drawing:
    picture, axes = new_picture(3, width=6.5, height=5.4)
    scores = evidence.scores
    rows = _draw_amounts(evidence, axes[0])
    axes[0].set_title("EBF trained on one amount, or on all", pad=18)
    lines: Lines = {}
    order = scores.numbered([scores.by_clip("ebf")])
    for recipe in ("angular:0.1", "angular:0.9"):
        # The paper: "a Gaussian with higher standard deviation [...] for higher noise".
        fixed = "gaussian_58" if recipe == "angular:0.1" else "gaussian_125"
        network, color = f"ebf@{recipe}", AMOUNT_COLORS[recipe]
        for method, line in ((network, "-"), (fixed, "--"), ("gaussian_tuned", ":")):
            errors = scores.by_clip(method, recipe)
            values = np.array([errors.get(clip, np.nan) for clip in order])
            lines[f"{recipe}: {label_of(method)}"] = (values, color, line)
    _draw_lines(evidence, lines, order, axes[1], rows, "middle")
    axes[1].set_title("angular noise: EBF and Gaussians", pad=18)
    lines = {}
    for recipe, color in zip(POSITIONS, ("#009E73", "#0072B2", "#E69F00", "#D55E00"), strict=True):
        for method, line in ((ON_POSITIONS, "-"), ("gaussian_58", "--"), ("gaussian_tuned", ":")):
            errors = scores.by_clip(method, recipe)
            values = np.array([errors.get(clip, np.nan) for clip in order])
            lines[f"{recipe} cm: {label_of(method)}"] = (values, color, line)
    _draw_lines(evidence, lines, order, axes[2], rows, "right")
    axes[2].set_title("spatial noise: EBF and Gaussians", pad=18)
    return rows, picture


def _draw_amounts(evidence: Evidence, ax: Axes) -> list[Row]:
    scores = evidence.scores
    rows: list[Row] = []
    lines: Lines = {}
    order = scores.numbered([scores.by_clip("ebf")])
    for recipe in AMOUNTS:
        for method, line in (("ebf", "-"), *zip(TRAINED_ON, DASHES, strict=True)):
            errors = scores.by_clip(method, recipe)
            values = np.array([errors.get(clip, np.nan) for clip in order])
            trained = method.partition("@")[2] or "all amounts"
            lines[f"tested on {recipe}, trained on {trained}"] = (
                values,
                AMOUNT_COLORS[recipe],
                line,
            )
    _draw_lines(evidence, lines, order, ax, rows, "left")
    return rows


def _draw_lines(
    evidence: Evidence, lines: Lines, order: list[str], ax: Axes, rows: list[Row], panel: str
) -> None:
    actions = [evidence.scores.actions[clip] for clip in order]
    plot_by_motion(lines, actions, ax)
    for label, (values, _, _) in lines.items():
        for number, clip in enumerate(order):
            rows.append(
                {
                    "panel": panel,
                    "line": label,
                    "motion": number,
                    "clip": clip,
                    "action": actions[number],
                    "rms_all_deg": values[number],
                }
            )


def _claims_6(evidence: Evidence) -> list[Claim]:
    scores = evidence.scores
    ratios = {
        (method, recipe): scores.ratio(
            scores.by_clip(method, recipe), scores.by_clip("ebf", recipe)
        )
        for method in TRAINED_ON
        for recipe in AMOUNTS
    }
    tested = {key: ratio for key, (ratio, n) in ratios.items() if n}
    n = min((n for _, n in ratios.values() if n), default=0)
    far = max(tested, key=lambda key: abs(np.log(tested[key].value)), default=None)
    furthest = tested[far] if far else Interval(np.nan, np.nan, np.nan)
    text = "all amounts train alike"
    if far:
        text += f" (furthest apart: trained on {far[0].partition('@')[2]}, tested on {far[1]})"
    claims = [
        make_claim(
            evidence,
            "6",
            text,
            "almost similarly",
            furthest,
            "times the error of the one trained on all",
            n,
            TRAINED_ON,
            lambda: judge_alike(list(tested.values())),
        )
    ]
    for recipe, fixed in (("angular:0.1", "gaussian_58"), ("angular:0.9", "gaussian_125")):
        text = f"EBF always beats the paper's Gaussian at {recipe}"
        claims.append(every_claim(evidence, "6", text, f"ebf@{recipe}", (fixed,), recipe))
        text = f"EBF against the tuned Gaussian at {recipe}"
        claims.append(
            ratio_claim(evidence, "6", text, None, f"ebf@{recipe}", "gaussian_tuned", recipe)
        )
    for recipe in POSITIONS:
        text = f"EBF always beats the paper's Gaussian at {recipe} cm"
        claims.append(every_claim(evidence, "6", text, ON_POSITIONS, ("gaussian_58",), recipe))
        text = f"EBF against the tuned Gaussian at {recipe} cm"
        claims.append(
            ratio_claim(evidence, "6", text, None, ON_POSITIONS, "gaussian_tuned", recipe)
        )
    return claims


def _draw_7(evidence: Evidence) -> Drawing:
    picture, axes = new_picture(3, width=5.5, height=4.8)
    rows: list[Row] = []
    for (recipe, title), ax in zip(KINDS.items(), axes, strict=True):
        methods = (f"ebf_bias@{recipe}", "gaussian_58", "gaussian_tuned")
        rows += draw_motions(evidence, methods, recipe, ax)
        ax.set_title(title, pad=18)
    return rows, picture


def _bias(evidence: Evidence, recipe: str) -> tuple[Interval, int]:
    """Measure the bias that a network with a bias head subtracts from test clips."""
    method = f"ebf_bias@{recipe}"
    jobs = [job for job in evidence.scores.results if job.method == method]
    shares = []
    for job in jobs:
        clips = [
            draw_test(evidence.dataset.clips[i], recipe, seed=job.seed, repetition=0)
            for i in job.split.test
        ]
        shares.append(bias_share(evidence.models / f"{job.network_name}.safetensors", clips))
    if not shares:
        return Interval(np.nan, np.nan, np.nan), 0
    n = sum(len(job.split.test) for job in jobs)
    return Interval(float(np.mean(shares)), min(shares), max(shares)), n


def _claims_7(evidence: Evidence) -> list[Claim]:
    claims = []
    for recipe, title in KINDS.items():
        network = f"ebf_bias@{recipe}"
        text = f"EBF with bias beats the Gaussian on {title}"
        claims.append(every_claim(evidence, "7", text, network, ("gaussian_58",), recipe))
        text = f"EBF with bias against the tuned Gaussian on {title}"
        claims.append(ratio_claim(evidence, "7", text, None, network, "gaussian_tuned", recipe))
        share, n = _bias(evidence, recipe)
        without = recipe.startswith("uniform")
        claims.append(
            make_claim(
                evidence,
                "7",
                "the bias term vanishes without bias" if without else f"bias learnt on {title}",
                "almost exactly zero" if without else "-",
                share,
                "of the movement (mean and range of holdouts)",
                n,
                (network,),
                partial(judge_size, share.value, 0.02, 0.1) if without else None,
            )
        )
    return claims


NOISE_FIGURES = (
    Figure(
        "6",
        "Figure 6: amounts of angular and of spatial noise",
        "Does it matter which amount a network was trained on? And is the Gaussian a fair one?",
        (
            Need(("ebf", *TRAINED_ON), AMOUNTS),
            Need(("gaussian_58",), ("angular:0.1", *POSITIONS)),
            Need(("gaussian_125",), ("angular:0.9",)),
            Need(("gaussian_tuned",), ("angular:0.1", "angular:0.9", *POSITIONS)),
            Need((ON_POSITIONS,), POSITIONS),
        ),
        _draw_6,
        _claims_6,
    ),
    Figure(
        "7",
        "Figure 7: uniform noise, and two kinds of bias",
        "Is a bias found and taken away? And is none invented where there is none?",
        tuple(
            Need((f"ebf_bias@{recipe}", "gaussian_58", "gaussian_tuned"), (recipe,))
            for recipe in KINDS
        ),
        _draw_7,
        _claims_7,
    ),
)
