"""Checks and data of the assignment ``smoothing``: see :mod:`mocaplab.assignments.grading`."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from mocaplab.assignments.contest import Contest, call_or_refuse
from mocaplab.assignments.grading import NotRight, quiet_call, student_rng
from mocaplab.assignments.judges import judge_function, judge_numbers
from mocaplab.corruption import corrupt
from mocaplab.exercises.answers import NOT_YET, as_array
from mocaplab.filters import GaussianDenoiser
from mocaplab.measures.by_name import rms_moving_deg
from mocaplab.motion import BoolArray, Corrupted, FloatArray, Motion
from mocaplab.resampling import resample
from mocaplab.synthesis import synthesize

WIDTH_OF_SIGMA = 2 * math.sqrt(2 * math.log(2))
"""A Gaussian is this many sigma wide at half of its height: 2.355."""
CONTEST_FPS = 60.0


@dataclass(frozen=True)
class SmoothingWork:
    """A student's own numbers and curve."""

    width_ms: float  # of a window, at half of its height
    fps: float
    clean: FloatArray  # (T,), degrees
    seed: int


def draw_work(student: str) -> SmoothingWork:
    """Draw the work of a student."""
    rng = student_rng(student, "smoothing")
    seconds = np.arange(200) / 120
    swing = 25 * np.sin(2 * np.pi * 1.3 * seconds) + 9 * np.sin(2 * np.pi * 3.1 * seconds + 2)
    return SmoothingWork(
        width_ms=float(rng.integers(60, 240)),
        fps=float(rng.choice([50, 60, 100, 120])),
        clean=-np.abs(rng.normal(1, 0.1)) * swing,
        seed=int(rng.integers(1000)),
    )


# ------------------------------------------------------------------ 1: widths


def check_sigma(answer: Any, work: SmoothingWork) -> str:
    """Check the sigma, in seconds, of a Gaussian of a given width at half of its height."""
    right = work.width_ms / 1000 / WIDTH_OF_SIGMA
    mistakes = {
        "That is in milliseconds. Give seconds.": 1000 * right,
        "That is in frames. Give seconds: the frame rate does not matter here.": right * work.fps,
        "That is the whole width at half of the height. How many sigma is it?": work.width_ms
        / 1000,
        "That is half of the width. The Gaussian has fallen to a half there, but not at 1 "
        "sigma.": work.width_ms / 2000,
        "You multiplied by 2.355. Sigma is narrower than the width.": work.width_ms
        / 1000
        * WIDTH_OF_SIGMA,
        "You took the width on one side for the whole one.": 2 * right,
    }
    return judge_numbers(answer, right, mistakes, rtol=0.01)


# ------------------------------------------------------------------ 2: a measure


def check_peak_loss(answer: Any, work: SmoothingWork) -> str:
    """Check a function (smooth, clean) that returns the loss of peak speed in percent."""
    smooth = np.convolve(np.pad(work.clean, 15, mode="edge"), np.ones(31) / 31, "valid")
    falls = np.concatenate([np.linspace(0, 30, 60), np.linspace(30, 0, 3), np.zeros(12)])
    cases = {
        "your curve": (smooth, work.clean),
        "a curve that was not changed": (work.clean, work.clean.copy()),
        "a curve that got faster": (1.1 * work.clean, work.clean),
        "a curve that falls fast": (np.convolve(falls, np.ones(5) / 5, "valid"), falls[2:-2]),
    }

    def peak(x: FloatArray) -> Any:
        return np.abs(np.diff(x)).max()

    def by_gradient(smooth: FloatArray, clean: FloatArray) -> Any:
        ratio = np.abs(np.gradient(smooth)).max() / np.abs(np.gradient(clean)).max()
        return 100 * (1 - ratio)

    mistakes = {
        "That is a share. In percent it is 100 times as much.": lambda s, c: 1 - peak(s) / peak(c),
        "That is what is left of the peak speed. The loss is 100 minus that.": lambda s, c: (
            100 * peak(s) / peak(c)
        ),
        "A loss is above 0 when the smooth curve is slower: the sign is the wrong way "
        "round.": lambda s, c: 100 * (peak(s) / peak(c) - 1),
        "You divided by the speed of the smooth curve. The clean one is the "
        "measure.": lambda s, c: 100 * (peak(c) / peak(s) - 1),
        "That is the loss of the largest angle, not of the highest speed.": lambda s, c: (
            100 * (1 - np.abs(s).max() / np.abs(c).max())
        ),
        "A fast way down is a negative velocity. Take the absolute value before the "
        "largest.": lambda s, c: 100 * (1 - np.diff(s).max() / np.diff(c).max()),
        "That is the loss of the mean speed. The peak was asked for.": lambda s, c: (
            100 * (1 - np.abs(np.diff(s)).mean() / np.abs(np.diff(c)).mean())
        ),
    }
    right = (lambda s, c: 100 * (1 - peak(s) / peak(c)), by_gradient)
    return judge_function(answer, cases, right, mistakes, rtol=1e-4, atol=1e-6)


# ------------------------------------------------------------------ 3: a window


def check_window(answer: Any, seed: int = 3) -> str:
    """Check a function (sigma_s, frame_time) that returns the weights of a Gaussian window."""
    if answer is None or answer is ...:
        return NOT_YET
    rng = np.random.default_rng(seed)
    for frame_time in (1 / 120, 1 / 30):
        sigma_s = float(rng.uniform(0.09, 0.14))
        result, problem = quiet_call(answer, sigma_s, frame_time)
        if problem:
            return problem
        if result is None or result is ...:
            return f"{NOT_YET} So far, your function returns nothing."
        weights = as_array(result)
        if weights is None or weights.ndim != 1 or not np.isfinite(weights).all():
            return "Return the weights, one number a frame of the window."
        problem = _judge_window(weights, sigma_s / frame_time, sigma_s)
        if problem:
            return problem
    return "Right: at 120 and at 30 frames per second."


def _judge_window(weights: FloatArray, sigma: float, sigma_s: float) -> str:
    """Judge a window for a sigma in frames; nothing if it is right."""
    if len(weights) % 2 == 0:
        return "Your window has an even number of frames, so that it has no middle."
    radius = len(weights) // 2
    taps = np.arange(-radius, radius + 1)
    gaussian = np.exp(-0.5 * (taps / sigma) ** 2)
    known = {
        "Your window takes sigma for frames. It is in seconds: divide it by the frame "
        "time.": np.exp(-0.5 * (taps / sigma_s) ** 2),
        "The exponent needs sigma squared.": np.exp(-0.5 * taps**2 / sigma),
        "The factor 1/2 in the exponent is missing.": np.exp(-((taps / sigma) ** 2)),
        "The exponent needs the distance squared.": np.exp(-0.5 * np.abs(taps) / sigma),
    }
    for hint, other in known.items():
        if np.allclose(weights / weights.sum(), other / other.sum(), atol=1e-6):
            return hint
    if radius < 3 * sigma - 1:
        return (
            f"Your window reaches {radius} frames to each side, with a sigma of {sigma:.1f} "
            f"frames. Let it reach 3 sigma at least: is sigma in seconds or in frames here?"
        )
    if not np.allclose(weights / weights.sum(), gaussian / gaussian.sum(), atol=1e-6):
        return "That is not the Gaussian of this sigma. Its weights are exp(-d^2 / (2 sigma^2))."
    if not math.isclose(weights.sum(), 1.0, rel_tol=0.01):
        return f"The weights add up to {weights.sum():.3g}: divide them by their sum."
    return ""


# ------------------------------------------------------------------ 4: smoothing over gaps


def check_over_gaps(answer: Any, work: SmoothingWork) -> str:
    """Check a function (values, mask, weights) that smooths what was observed, shape (T,)."""
    rng = np.random.default_rng(work.seed)
    weights = np.exp(-0.5 * (np.arange(-12, 13) / 4) ** 2)
    weights /= weights.sum()
    values = work.clean + 30 + rng.normal(0, 2, len(work.clean))
    mask = np.ones(len(values), dtype=bool)
    mask[40:47] = mask[90:99] = mask[150] = False
    hidden = np.where(mask, values, np.nan)
    cases = {
        "a curve with gaps": (hidden, mask, weights),
        "a curve without gaps": (values, np.ones_like(mask), weights),
    }

    def total(x: FloatArray, m: BoolArray, w: FloatArray) -> Any:
        return np.convolve(np.where(m, x, 0.0), w, "same")

    def share(m: BoolArray, w: FloatArray) -> Any:
        return np.convolve(m.astype(float), w, "same")

    def right(x: FloatArray, m: BoolArray, w: FloatArray) -> Any:
        return total(x, m, w) / share(m, w)

    def lines(x: FloatArray, m: BoolArray, w: FloatArray) -> Any:
        frames = np.arange(len(x))
        filled = np.interp(frames, frames[m], x[m])
        return right(filled, np.ones_like(m), w)

    mistakes = {
        "Hidden samples count as 0 here and pull the curve down. Divide by the weight of what was "
        "observed.": total,
        "You divided by the weights of all frames. Only the observed ones count.": lambda x, m, w: (
            total(x, m, w) / share(np.ones_like(m), w)
        ),
        "You smoothed a curve that was filled by straight lines. Here only observed samples shall "
        "count.": lines,
        "The result is not smoothed.": lambda x, m, w: x,
    }
    return judge_function(
        answer,
        cases,
        right,
        mistakes,
        nan_hint="NaN times 0 is NaN, and a sum with it too: put a number in its place first, "
        "and give it the weight 0. True in the mask means observed.",
    )


# ------------------------------------------------------------------ 5: an honest score


def check_honest(answer: Any, seed: int = 3) -> str:
    """Check a function (errors, n_samples) that scores each clip with others' best width."""
    rng = np.random.default_rng(seed)
    widths, best = np.arange(12), rng.permutation([2, 3, 4, 6, 7, 9])
    n_samples = rng.integers(3_000, 9_000, len(best))
    curve = 4 + (widths - best[:, None]) ** 2 * rng.uniform(0.2, 1.0, (len(best), 1))
    errors = curve * n_samples[:, None]
    cases = {"6 clips": (errors, n_samples), "3 clips": (errors[:3], n_samples[:3])}

    def rms(errors: FloatArray, n: FloatArray, chosen: Any) -> Any:
        return np.sqrt(errors[np.arange(len(errors)), chosen] / n)

    def others(errors: FloatArray) -> Any:
        return np.argmin(errors.sum(axis=0) - errors, axis=1)

    mistakes = {
        "You chose each clip's width on the clip itself: nobody can do that without the truth. "
        "Add up the errors of the OTHER clips.": lambda e, n: rms(e, n, np.argmin(e, axis=1)),
        "You chose one width on all clips, the one under test too. Leave it out when you "
        "choose.": lambda e, n: rms(e, n, np.argmin(e.sum(axis=0))),
        "Those are mean squares. Take the root.": lambda e, n: rms(e, n, others(e)) ** 2,
        "You did not divide by the number of samples before the root.": lambda e, n: rms(
            e, np.ones(len(n)), others(e)
        ),
        "Those are the widths. Return the errors that they lead to.": lambda e, n: others(e),
        "That is the error on the clips that you tuned on. Score the clip that was left "
        "out.": lambda e, n: np.sqrt((e.sum(axis=0) - e).min(axis=1) / (n.sum() - n)),
        "That is the largest error: np.argmin, not np.argmax.": lambda e, n: rms(
            e, n, np.argmax(e.sum(axis=0) - e, axis=1)
        ),
    }
    return judge_function(answer, cases, lambda e, n: rms(e, n, others(e)), mistakes)


# ------------------------------------------------------------------ beat the score


def contest_clips(seed: int) -> list[Corrupted]:
    """Draw noisy clips at 60 frames per second, a rate that the shipped networks refuse."""
    clips = []
    for number, action in enumerate(("walk", "run", "jump", "kick")):
        rng = np.random.default_rng([seed, number])
        motion = synthesize(action, duration_s=2.4, rng=rng, name=f"{action}_{number}")
        clips.append(corrupt(resample(motion, CONTEST_FPS), "angular:0.5", rng=rng))
    return clips


def single_gaussian(observed: Motion) -> Motion:
    """Smooth with the one Gaussian that was best on other clips: the answer to beat."""
    return GaussianDenoiser(0.04).denoise(observed, ~np.isnan(observed.channels))


def _score_cleaning(answer: Any, seed: int) -> float:
    errors = []
    for clip in contest_clips(seed):
        cleaned = call_or_refuse(answer, clip.observed)
        if not isinstance(cleaned, Motion):
            raise NotRight("Return a motion: observed.with_channels(your array).")
        if cleaned.channels.shape != clip.clean.channels.shape:
            raise NotRight("Your motion has another shape than the one that came in.")
        if np.isnan(cleaned.channels).any():
            raise NotRight("There are NaN in your motion.")
        errors.append(rms_moving_deg(cleaned, clip.clean))
    return float(np.mean(errors))


CONTEST = Contest("smoothing", "degrees", _score_cleaning, single_gaussian, goal=0.93)
