"""Checks and data of the assignment ``gap_pipeline``: see :mod:`mocaplab.assignments.grading`."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor

from mocaplab.assignments.contest import Contest, call_or_refuse
from mocaplab.assignments.grading import NotRight, student_rng
from mocaplab.assignments.judges import judge_function, judge_numbers
from mocaplab.corruption import corrupt
from mocaplab.gap_fillers.curves import lerp_columns, lerp_gaps
from mocaplab.measures.gaps import gap_rms_deg
from mocaplab.motion import BoolArray, Corrupted, FloatArray, Motion
from mocaplab.synthesis import synthesize

STRIDE = 4


@dataclass(frozen=True)
class GapWork:
    """A student's own gap."""

    gap_frames: int
    fps: int
    seed: int

    @property
    def gap_s(self) -> float:
        """The length of the gap in seconds."""
        return self.gap_frames / self.fps


def draw_work(student: str) -> GapWork:
    """Draw the work of a student."""
    rng = student_rng(student, "gap_pipeline")
    frames = STRIDE * int(rng.integers(12, 60)) + int(rng.integers(1, STRIDE))
    return GapWork(frames, int(rng.choice([60, 100, 120])), int(rng.integers(999)))


# ------------------------------------------------------------------ 1: steps of an LSTM


def check_steps(answer: Any, work: GapWork) -> str:
    """Check how many steps an LSTM with a stride of 4 frames takes to cross a gap."""
    right = math.ceil(work.gap_frames / STRIDE)
    mistakes = {
        "These are frames. The LSTM steps over 4 of them at once.": work.gap_frames,
        "The last step is missing: round up, so that the far end is reached.": right - 1,
        "A step is a whole step: round up.": work.gap_frames / STRIDE,
        "You multiplied by 4. A step covers 4 frames.": work.gap_frames * STRIDE,
        "That is the gap in seconds divided by 4. How many frames has the gap?": work.gap_s
        / STRIDE,
        "That is the frame rate divided by 4.": work.fps / STRIDE,
    }
    return judge_numbers(
        answer,
        right,
        mistakes,
        rtol=0.0,
        atol=0.01,
        otherwise="It is another number. First: how many frames has the gap?",
    )


# ------------------------------------------------------------------ 2: straight lines


def _curve(seed: int, n_frames: int = 90) -> FloatArray:
    rng = np.random.default_rng(seed)
    t = np.arange(n_frames) / 30
    swing: FloatArray = 20 * np.sin(2 * np.pi * t * rng.uniform(0.5, 1))
    return 40 + swing + np.cumsum(rng.normal(0, 0.3, n_frames))


def _with_gaps(values: FloatArray, *gaps: tuple[int, int]) -> FloatArray:
    hidden = values.copy()
    for first, after in gaps:
        hidden[first:after] = np.nan
    return hidden


def _line(values: FloatArray) -> Any:
    return lerp_columns(values[:, None])[:, 0]


def check_line(answer: Any, work: GapWork) -> str:
    """Check a function (values) that fills the NaN of one channel by straight lines, (T,)."""
    curve = _curve(work.seed)
    cases = {
        "two gaps": (_with_gaps(curve, (10, 25), (50, 51)),),
        "gaps at the ends": (_with_gaps(curve, (0, 6), (80, 90)),),
        "no gap": (curve,),
    }

    def hold(values: FloatArray) -> Any:
        seen = np.flatnonzero(~np.isnan(values))
        return values[
            seen[np.maximum(np.searchsorted(seen, np.arange(len(values)), "right") - 1, 0)]
        ]

    def onward(values: FloatArray) -> Any:
        filled, seen = _line(values), np.flatnonzero(~np.isnan(values))
        first, last, frames = seen[0], seen[-1], np.arange(len(values))
        before = values[first] + (frames - first) * (values[first + 1] - values[first])
        after = values[last] + (frames - last) * (values[last] - values[last - 1])
        return np.where(frames < first, before, np.where(frames > last, after, filled))

    mistakes: dict[str, Callable[..., Any]] = {
        "You put 0 into the gaps. 0 degrees is an angle like any other.": np.nan_to_num,
        "You hold the last value until the gap ends. Go in a straight line to the next one.": hold,
        "You put the mean of the channel into the gaps.": lambda v: np.where(
            np.isnan(v), np.nanmean(v), v
        ),
        "At the ends of the clip take the nearest observed value; a line that goes on beyond it "
        "soon goes astray.": onward,
    }
    return judge_function(
        answer,
        cases,
        _line,
        mistakes,
        nan_hint="A gap at the start or at the end has one neighbour only: take its value.",
    )


# ------------------------------------------------------------------ 3: the error in gaps


def check_gap_error(answer: Any, work: GapWork) -> str:
    """Check a function (filled, clean, mask) that returns the RMS over the hidden samples."""
    rng = np.random.default_rng(work.seed)
    clean = rng.normal(0, 20, (60, 3))
    mask = np.ones(clean.shape, dtype=bool)
    mask[10:30, 0] = mask[40:45, 1] = False
    filled = clean + np.where(mask, rng.normal(0, 1, clean.shape), rng.normal(2, 4, clean.shape))
    cases = {
        "three channels": (filled, clean, mask),
        "one": (filled[:, :1], clean[:, :1], mask[:, :1]),
    }

    def rms(error: FloatArray) -> Any:
        return np.sqrt(np.mean(error**2))

    def each(f: FloatArray, c: FloatArray, m: BoolArray) -> Any:
        channels = [i for i in range(m.shape[1]) if not m[:, i].all()]
        return np.mean([rms((f - c)[~m[:, i], i]) for i in channels])

    mistakes = {
        "That is the error of the observed samples: the mask is inverted. True means "
        "observed.": lambda f, c, m: rms((f - c)[m]),
        "That is the error over all samples. Inside the gaps alone it is larger.": lambda f, c, m: (
            rms(f - c)
        ),
        "You set the error outside the gaps to 0 and counted it: divide by the hidden samples "
        "alone.": lambda f, c, m: rms((f - c) * ~m),
        "That is the mean square. Take the root.": lambda f, c, m: np.mean((f - c)[~m] ** 2),
        "That is the mean absolute error. Square first.": lambda f, c, m: np.mean(
            np.abs((f - c)[~m])
        ),
        "That is the mean of one RMS a channel. Take one mean over all hidden samples.": each,
        "That is the standard deviation: it takes the mean error away.": lambda f, c, m: np.std(
            (f - c)[~m]
        ),
    }
    return judge_function(answer, cases, lambda f, c, m: rms((f - c)[~m]), mistakes)


# ------------------------------------------------------------------ 4: meet the ends


def check_join(answer: Any, work: GapWork) -> str:
    """Check a function (prediction, observed) that lets a prediction meet the ends of gaps."""
    curve = _curve(work.seed)
    rng = np.random.default_rng(work.seed + 1)
    off = 8 + np.cumsum(rng.normal(0, 0.4, len(curve)))
    prediction = _curve(work.seed) * 0.8 + off
    cases = {
        "two gaps": (prediction, _with_gaps(curve, (12, 40), (55, 70))),
        "a long gap": (prediction[::-1].copy(), _with_gaps(curve, (5, 80))),
    }

    def right(p: FloatArray, o: FloatArray) -> Any:
        return np.where(np.isnan(o), p + _line(o - p), o)

    def left(p: FloatArray, o: FloatArray) -> Any:
        seen = np.flatnonzero(~np.isnan(o))
        before = seen[np.searchsorted(seen, np.arange(len(o)), "right") - 1]
        return np.where(np.isnan(o), p + (o - p)[before], o)

    mistakes = {
        "The prediction does not meet the observed curve: at both ends of the gap there is a "
        "step.": lambda p, o: np.where(np.isnan(o), p, o),
        "You moved the prediction to meet the left end only. Let the shift go in a straight line "
        "to what the right end needs.": left,
        "You subtract the shift. What is missing at an end is observed minus "
        "prediction.": lambda p, o: np.where(np.isnan(o), p - _line(o - p), o),
        "These are straight lines alone. Where is the prediction?": lambda p, o: _line(o),
        "You changed observed samples. They stay as they are.": lambda p, o: p,
        "You took one shift for the whole clip.": lambda p, o: np.where(
            np.isnan(o), p + np.nanmean(o - p), o
        ),
    }
    return judge_function(answer, cases, right, mistakes)


# ------------------------------------------------------------------ 5: four frames at once


def check_interleave(answer: Any, seed: int = 3) -> str:
    """Check a function (x, stride): (B, T, n) -> (B * stride, T / stride, n), rounded up."""
    rng = np.random.default_rng(seed)
    cases = {
        "2 clips of 12 frames": (torch.from_numpy(rng.normal(size=(2, 12, 3))), 4),
        "10 frames, which 4 does not divide": (torch.from_numpy(rng.normal(size=(2, 10, 3))), 4),
        "a stride of 3": (torch.from_numpy(rng.normal(size=(1, 7, 2))), 3),
    }

    def padded(x: Tensor, stride: int, *, zeros: bool = False) -> Tensor:
        extra = x[:, -1:].expand(-1, -x.shape[1] % stride, -1)
        return torch.cat([x, extra * 0 if zeros else extra], dim=1)

    def rows(x: Tensor, stride: int) -> Tensor:
        return torch.cat([clip[start::stride][None] for clip in x for start in range(stride)])

    def other_order(x: Tensor, stride: int) -> Tensor:
        x = padded(x, stride)
        return torch.cat([x[:, start::stride] for start in range(stride)])

    def blocks(x: Tensor, stride: int) -> Tensor:
        x = padded(x, stride)
        return x.reshape(len(x) * stride, -1, x.shape[-1])

    mistakes = {
        "These are blocks of neighbours. A sequence has every 4th frame: 0, 4, 8, ...": blocks,
        "The right sequences in another order: first all of clip 0, then all of clip "
        "1.": other_order,
        "You filled up with zeros. Repeat the last frame.": lambda x, s: rows(
            padded(x, s, zeros=True), s
        ),
        "You dropped the frames that are left over. Repeat the last frame until the stride divides "
        "the length.": lambda x, s: rows(x[:, : len(x[0]) // s * s], s),
    }
    return judge_function(answer, cases, lambda x, s: rows(padded(x, s), s), mistakes)


# ------------------------------------------------------------------ beat the score


def contest_clips(seed: int) -> list[Corrupted]:
    """Draw clips with gaps of about half a second in whole joints, and no noise."""
    clips = []
    for number, action in enumerate(("walk", "run", "kick")):
        rng = np.random.default_rng([seed, number])
        motion = synthesize(action, duration_s=2.4, rng=rng, name=f"{action}_{number}")
        clips.append(corrupt(motion, "long_gaps:0.5+long_gaps:0.3", rng=rng))
    return clips


def _score_filling(answer: Any, seed: int) -> float:
    errors = []
    for clip in contest_clips(seed):
        filled = call_or_refuse(answer, clip.observed)
        if not isinstance(filled, Motion):
            raise NotRight("Return a motion: observed.with_channels(your array).")
        if filled.channels.shape != clip.clean.channels.shape:
            raise NotRight("Your motion has another shape than the one that came in.")
        if np.isnan(filled.channels).any():
            raise NotRight("There are still NaN in your motion.")
        if not np.allclose(filled.channels[clip.mask], clip.clean.channels[clip.mask], atol=1e-6):
            raise NotRight("You changed observed samples. There is no noise: leave them alone.")
        errors.append(gap_rms_deg(filled, clip.clean, clip.mask))
    return float(np.mean(errors))


CONTEST = Contest("gap_pipeline", "degrees", _score_filling, lerp_gaps, goal=0.6)
