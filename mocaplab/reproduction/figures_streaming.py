"""Streaming: error by look-ahead, and the time for a frame that has just come."""

from __future__ import annotations

from time import process_time
from typing import Any

import numpy as np

from mocaplab.cleaning import Cleaner
from mocaplab.comparison.bootstrap import Interval
from mocaplab.live.ebf import LiveEBF
from mocaplab.live.filters import LiveFilter, LiveGaussian
from mocaplab.measures.by_name import rms_all_deg
from mocaplab.noise.draws import draw_test, draw_training
from mocaplab.reproduction.claims import Claim, Evidence, make_claim
from mocaplab.reproduction.figure import Drawing, Figure, new_picture
from mocaplab.reproduction.needs import NOISE, Need
from mocaplab.reproduction.plots import plot_points, style_of
from mocaplab.reproduction.scores import ByClip
from mocaplab.reproduction.verdicts import judge_alike, judge_below
from mocaplab.streaming import stream_motion
from mocaplab.tuning import tune

FRAMES = (0, 3, 6, 15)
"""Look-aheads; the paper's is 15 frames."""
CLIPS = 6
"""Clips of the first holdout that are streamed: a stream takes about a millisecond a frame."""
WIDTHS_S = (0.004, 0.008, 0.012, 0.017, 0.025, 0.035, 0.05, 0.07)
GAUSSIAN = "tuned Gaussian"
WHOLE = "EBF, whole clip"
Row = dict[str, Any]


def _stream(evidence: Evidence) -> list[Row]:
    """Stream some clips of the first holdout; each width is tuned for its look-ahead."""
    jobs = [
        job
        for job in evidence.scores.results
        if (job.method, job.holdout, job.corruption) == ("ebf", "holdout_1", NOISE)
    ]
    # The fully trained network, if there is one, has no number of epochs of its own.
    job = min(jobs, key=lambda job: job.epochs is not None)
    cleaner = Cleaner(evidence.models / f"{job.network_name}.safetensors")
    clips = evidence.dataset.clips
    training = [draw_training(clips[i], NOISE, seed=job.seed) for i in job.split.train[:8]]
    rows: list[Row] = []
    for frames in FRAMES:
        ahead_s = frames * clips[0].frame_time
        widths = [LiveGaussian(sigma, ahead_s) for sigma in WIDTHS_S]
        filters: dict[str, LiveFilter] = {
            "EBF": LiveEBF(cleaner.checkpoint, ahead_s),
            GAUSSIAN: tune(widths, training),
        }
        for i in job.split.test[:CLIPS]:
            clip = draw_test(clips[i], NOISE, seed=job.seed, repetition=0)
            whole = cleaner.denoise(clip.observed, clip.mask)
            for name, live in filters.items():
                began = process_time()
                cleaned = stream_motion(clip.observed, live)
                milliseconds = 1000 * (process_time() - began) / cleaned.n_frames
                rows.append(
                    {"method": name, "look_ahead_frames": frames, "look_ahead_ms": 1000 * ahead_s}
                    | {"clip": clips[i].name, "rms_all_deg": rms_all_deg(cleaned, clip.clean)}
                    | {"ms_per_frame": milliseconds, "whole_deg": rms_all_deg(whole, clip.clean)}
                )
    return rows


def _rows(evidence: Evidence) -> list[Row]:
    return evidence.cached("streaming", lambda: _stream(evidence))


def _by_clip(rows: list[Row], method: str, frames: int, key: str = "rms_all_deg") -> ByClip:
    return {
        row["clip"]: row[key]
        for row in rows
        if (row["method"], row["look_ahead_frames"]) == (method, frames)
    }


def _draw(evidence: Evidence) -> Drawing:
    rows, scores = _rows(evidence), evidence.scores
    picture, (ax,) = new_picture(width=7)
    ahead = [1000 * frames * evidence.dataset.clips[0].frame_time for frames in FRAMES]
    series = {
        method: (
            ahead,
            [scores.mean(_by_clip(rows, method, frames)) for frames in FRAMES],
            *style_of(style, 0),
        )
        for method, style in (("EBF", "ebf"), (GAUSSIAN, "gaussian_tuned"))
    }
    plot_points(series, "look-ahead, ms", "RMS error over all joints, degrees", ax)
    whole = scores.mean(_by_clip(rows, "EBF", FRAMES[-1], "whole_deg")).value
    ax.axhline(whole, color="#D55E00", linestyle=":", label=WHOLE)
    ax.legend(fontsize="small")
    return rows, picture


def _claims(evidence: Evidence) -> list[Claim]:
    rows, scores = _rows(evidence), evidence.scores
    full = evidence.plan.headline("ebf")
    last = FRAMES[-1]
    ours = _by_clip(rows, "EBF", last)
    ratio, n = scores.ratio(ours, _by_clip(rows, "EBF", last, "whole_deg"))
    times = list(_by_clip(rows, "EBF", last, "ms_per_frame").values())
    time = Interval(float(np.median(times)), min(times), max(times))
    claims = [
        make_claim(
            evidence,
            "lookahead",
            "EBF works in a stream, as well as on whole clips (15 frames of look-ahead)",
            "yes",
            ratio,
            "times the error on whole clips",
            n,
            (full,),
            lambda: judge_alike([ratio]),
        ),
        make_claim(
            evidence,
            "lookahead",
            "EBF streams in real time on one core (median, fastest and slowest clip)",
            "< 1 ms a frame",
            time,
            "ms a frame",
            n,
            (f"{full}+",),
            lambda: judge_below(1.0, time),
        ),
    ]
    for frames in (0, last):
        ratio, n = scores.ratio(_by_clip(rows, "EBF", frames), _by_clip(rows, GAUSSIAN, frames))
        text = f"EBF against a Gaussian tuned for the same look-ahead, {frames} frames"
        claims.append(
            make_claim(evidence, "lookahead", text, "-", ratio, "times", n, (full,), None)
        )
    return claims


STREAMING = (
    Figure(
        "lookahead",
        "Not in the paper: error by look-ahead, frame by frame",
        "What does it cost to wait less? The paper always looks 15 frames ahead.",
        (Need(("ebf",), headline=True),),
        _draw,
        _claims,
    ),
)
