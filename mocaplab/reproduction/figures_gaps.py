"""Paper A's figures 9 and 10: gaps, short and long."""

from __future__ import annotations

from functools import partial
from itertools import product

import numpy as np
from matplotlib.axes import Axes

from mocaplab.comparison.job import Job
from mocaplab.measures.gaps import gap_rms_deg
from mocaplab.noise.draws import draw_test
from mocaplab.reproduction.claims import Claim, Evidence, every_claim, make_claim, ratio_claim
from mocaplab.reproduction.figure import Drawing, Figure, Row, draw_motions, new_picture
from mocaplab.reproduction.needs import NOISE, Need
from mocaplab.reproduction.networks_inside import FilledGap, fill_one_gap
from mocaplab.reproduction.plots import plot_points, style_of
from mocaplab.reproduction.scores import label_of
from mocaplab.reproduction.verdicts import judge_above, judge_below

GAPS = f"{NOISE}+gaps:0.001"
LENGTHS_S = (0.5, 1.0, 2.0, 4.0)
LONG = tuple(f"{NOISE}+long_gaps:{length:g}" for length in LENGTHS_S)
PIPELINE = "ebd_ebf"
"""EBD fills gaps, EBF cleans: the paper's method."""
OTHERS = ("gaussian_58", "ebf")
"""Lines fill gaps, then a Gaussian or EBF cleans: what the paper compares with."""
HONEST = ("gaussian_tuned", "lowrank", "gap_gaussian")
"""Not in the paper: a tuned Gaussian after lines, and gaps filled from the other joints."""
CLOSE = 0.5
"""A long gap is closed when the error in it is below half of what "does not move" leaves."""


def _draw_9(evidence: Evidence) -> Drawing:
    picture, (ax,) = new_picture(width=11, height=4.8)
    return draw_motions(evidence, (*OTHERS, PIPELINE, *HONEST), GAPS, ax), picture


def _claims_9(evidence: Evidence) -> list[Claim]:
    said = "on nearly all motions"
    claims = [every_claim(evidence, "9", "EBD+EBF is best", PIPELINE, OTHERS, GAPS, said)]
    text = "EBF after lines beats the Gaussian after lines"
    claims.append(every_claim(evidence, "9", text, "ebf", ("gaussian_58",), GAPS, "-"))
    for rival in HONEST:
        text = f"{label_of(PIPELINE)} against {label_of(rival)}, inside gaps"
        claims.append(
            ratio_claim(evidence, "9", text, None, PIPELINE, rival, GAPS, measure="gap_rms_deg")
        )
    return claims


def _filled(evidence: Evidence) -> list[FilledGap]:
    """Look at the longest gaps of up to three clips of the first holdout."""
    methods = (*OTHERS, PIPELINE)
    found: dict[str, FilledGap] = {}
    for recipe in reversed(LONG):
        jobs = [
            job
            for method in methods
            for job in evidence.scores.results
            if (job.method, job.corruption, job.holdout) == (method, recipe, "holdout_1")
        ]
        jobs = list({job.method: job for job in jobs}.values())
        for index in _longest(evidence, jobs):
            name = evidence.dataset.clips[index].name
            if name not in found and len(found) < 3:
                gap = fill_one_gap(evidence.dataset, jobs, index, evidence.models)
                if gap is not None:
                    found[name] = gap
    return list(found.values())


def _longest(evidence: Evidence, jobs: list[Job]) -> list[int]:
    """Return the test clips of some jobs, the longest first."""
    if not jobs:
        return []
    clips = evidence.dataset.clips
    return sorted(jobs[0].split.test, key=lambda i: -clips[i].n_frames)[:3]


def _draw_10(evidence: Evidence) -> Drawing:
    gaps = _filled(evidence)
    picture, axes = new_picture(len(gaps) + 1, width=5.0, height=4.0)
    rows: list[Row] = []
    for gap, ax in zip(gaps, axes, strict=False):
        first, last = gap.frames
        shown = slice(max(0, first - 30), last + 31)
        frames = np.arange(len(gap.clean))[shown]
        ax.axvspan(first, last, color="#EEEEEE")
        ax.plot(frames, gap.clean[shown], "k--", label="clean", linewidth=1.2)
        for number, (method, values) in enumerate(gap.filled.items()):
            color, line = style_of(method, number)
            ax.plot(frames, values[shown], line, color=color, label=label_of(method))
        ax.set(xlabel="frame", ylabel="angle, degrees", title=f"{gap.clip}\n{gap.channel}")
        ax.legend(fontsize="x-small")
        for method, values in {"clean": gap.clean, **gap.filled}.items():
            name = method if method == "clean" else label_of(method)
            rows += [
                {"clip": gap.clip, "channel": gap.channel, "line": name, "frame": int(f)}
                | {"hidden": int(first <= f <= last), "degrees": float(values[f])}
                for f in frames
            ]
    _draw_lengths(evidence, axes[-1])
    return rows, picture


def _draw_lengths(evidence: Evidence, ax: Axes) -> None:
    scores = evidence.scores
    series = {}
    for number, method in enumerate((*OTHERS, PIPELINE, *HONEST[1:])):
        found = [
            (length, scores.by_clip(method, recipe, measure="gap_rms_deg"))
            for length, recipe in zip(LENGTHS_S, LONG, strict=True)
        ]
        found = [(length, errors) for length, errors in found if errors]
        if found:
            lengths, means = zip(*((n, scores.mean(e)) for n, e in found), strict=True)
            series[label_of(method)] = (lengths, means, *style_of(method, number))
    plot_points(series, "length of the gap, s", "RMS inside gaps, degrees", ax)


def _claims_10(evidence: Evidence) -> list[Claim]:
    scores, claims = evidence.scores, []
    for recipe, length in zip(LONG, LENGTHS_S, strict=True):
        rest = _at_rest(evidence, recipe)
        for method in (PIPELINE, *OTHERS):
            errors = scores.by_clip(method, recipe, measure="gap_rms_deg")
            share, n = scores.ratio(errors, rest)
            closes = method == PIPELINE  # "both the other methods mostly failed to do so"
            text = f"{label_of(method)} {'closes' if closes else 'fails in'} gaps of {length:g} s"
            judge = judge_below if closes else judge_above
            claims.append(
                make_claim(
                    evidence,
                    "10",
                    text,
                    f"{'below' if closes else 'above'} {CLOSE:g}, as we read it",
                    share,
                    "of the error of a pose that does not move",
                    n,
                    (method,),
                    partial(judge, CLOSE, share),
                )
            )
        for rival in HONEST[1:]:
            text = f"{label_of(PIPELINE)} against {label_of(rival)}, gaps of {length:g} s"
            claims.append(
                ratio_claim(
                    evidence, "10", text, None, PIPELINE, rival, recipe, measure="gap_rms_deg"
                )
            )
    return claims


def _at_rest(evidence: Evidence, recipe: str) -> dict[str, float]:
    """Measure what is left inside gaps when every hidden angle rests at its clip's mean."""
    found: dict[str, list[float]] = {}
    for job in evidence.scores.results:
        if (job.method, job.corruption) == (OTHERS[0], recipe):
            for index, repetition in product(job.split.test, range(job.repetitions)):
                clean = evidence.dataset.clips[index]
                clip = draw_test(clean, recipe, seed=job.seed, repetition=repetition)
                mean = np.broadcast_to(clean.channels.mean(axis=0), clean.channels.shape)
                left = gap_rms_deg(clean.with_channels(mean), clip.clean, clip.mask)
                found.setdefault(clean.name, []).append(left)
    return {clip: float(np.mean(errors)) for clip, errors in found.items()}


GAP_FIGURES = (
    Figure(
        "9",
        "Figure 9: three ways to clean noise with short gaps, every motion",
        "Does it matter how gaps are filled, when they are short?",
        (Need((*OTHERS, "ebd", PIPELINE, *HONEST), (GAPS,)),),
        _draw_9,
        _claims_9,
    ),
    Figure(
        "10",
        "Figure 10: gaps of up to 4 seconds",
        "Does the network know what happened in there? Compare with filling from other joints.",
        (Need((*OTHERS, "ebd", PIPELINE, *HONEST[1:]), LONG),),
        _draw_10,
        _claims_10,
    ),
)
