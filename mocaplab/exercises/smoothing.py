"""Checks for the exercises of notebook 03 that are about one curve: width, mean and lag.

Those that compare filters on clips are in :mod:`mocaplab.exercises.comparing`.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mocaplab.exercises.answers import NOT_YET
from mocaplab.motion import FloatArray

WINDOWS = ((0.075, 1 / 120), (0.1, 1 / 30))
"""Windows of 9 and of 3 frames, for the moving average: seconds and frame time."""
DELAYS = ((5, 1 / 120), (3, 1 / 30))
"""Known lags, for the lag: frames and frame time."""


def check_frames_to_seconds(answer: Any, *, frames: float, fps: float, other_fps: float) -> str:
    """Check a width of some frames, told as (seconds, frames at another frame rate)."""
    if answer is None:
        return NOT_YET
    pair = _numbers(answer)
    if pair is None or pair.shape != (2,):
        return "Give two numbers: (seconds, frames at the other rate)."
    seconds, there = pair
    right_s, right_there = frames / fps, frames / fps * other_fps
    if _near(seconds, right_s) and _near(there, right_there):
        return "Right: a width in seconds means the same at every frame rate, and frames do not."
    if _near(seconds, right_there) and _near(there, right_s):
        return "Both numbers are right, but in the wrong order: seconds first."
    first = {
        1000 * right_s: "The first number is in milliseconds. Divide by 1000.",
        fps / frames: "The first number is upside down: divide frames by frames per second.",
        frames * fps: "You multiplied. A frame lasts 1 / fps seconds.",
        frames: "The first number is still in frames. A frame lasts 1 / fps seconds.",
        frames / other_fps: "The first number uses the wrong frame rate: which one was it "
        "measured at?",
    }
    second = {
        frames: "The same number of frames at another rate is another time. Begin with the "
        "seconds.",
        frames * fps / other_fps: "The second number went the wrong way: with fewer frames in a "
        "second, do more or fewer frames fit into the same time?",
        float(round(right_there)): "A width need not be a whole number of frames: do not round "
        "the second number.",
    }
    if not _near(seconds, right_s):
        return _known(seconds, first) or "The first number is off: how long does one frame last?"
    return _known(there, second) or "The first is right. The second: seconds times which rate?"


def check_moving_average(answer: Any) -> str:
    """Check a moving average ``f(values, window_s, frame_time)`` of one channel."""
    if answer is None:
        return NOT_YET
    if not callable(answer):
        return "Give the function itself: def my_average(values, window_s, frame_time):"
    for window_s, frame_time in WINDOWS:
        values = _smooth_signal(60, frame_time) + 20.0
        half = round((window_s / frame_time - 1) / 2)
        result, problem = _call(answer, values.copy(), window_s, frame_time)
        problem = problem or _wrong_average(result, values, half)
        if problem:
            return problem
    return "Right: the mean of the window around each frame, at 120 and at 30 frames per second."


def _wrong_average(result: Any, values: FloatArray, half: int) -> str:
    got, n = _numbers(result), 2 * half + 1
    if got is None:
        return "Your function must return an array of numbers, one a frame."
    got = got.ravel()
    if len(got) != len(values):
        return (
            f"{len(values)} frames went in and {len(got)} came out. Continue the channel at both "
            f"ends by half a window first (np.pad), then use mode 'valid'."
        )
    ends = {
        mode: np.convolve(np.pad(values, half, mode=mode), np.ones(n) / n, "valid")
        for mode in ("symmetric", "reflect", "edge", "constant")
    }
    inner, right = slice(n, -n), ends["symmetric"]
    if any(np.allclose(got, ends[mode]) for mode in ("symmetric", "reflect")):
        return ""
    if np.allclose(got[inner], right[inner]):
        if np.allclose(got, ends["constant"]):
            return "Right inside, but the ends sink towards 0: continue by the mirror image."
        return "Right inside, but not at the ends: continue by the mirror image ('symmetric')."
    late = np.roll(right, half)[inner]
    wrong = (
        (right[inner] * n, "That is the sum. Divide by the number of frames in the window."),
        (values[inner], "Nothing was smoothed. Is the window in seconds? You need frames."),
        (late, "Your window lies in the past only, so the curve comes late. Centre it."),
        (np.roll(right, -half)[inner], "Your window lies in the future only. Centre it."),
    )
    for other, hint in wrong:
        if np.allclose(got[inner], other):
            return hint
    return (
        f"The numbers differ by up to {np.max(np.abs(got - right)):.3g} degrees. The window here "
        f"has {n} frames: {half} on each side and the frame itself."
    )


def check_lag(answer: Any) -> str:
    """Check a function ``f(smooth, clean, frame_time)`` that returns a lag in milliseconds."""
    if answer is None:
        return NOT_YET
    if not callable(answer):
        return "Give the function itself: def my_lag_ms(smooth, clean, frame_time):"
    for delay, frame_time in DELAYS:
        signal = _smooth_signal(300 + delay, frame_time)
        result, problem = _call(answer, signal[:-delay].copy(), signal[delay:].copy(), frame_time)
        got = _numbers(result)
        if problem or got is None or got.size != 1:
            return problem or "Your function must return one number: milliseconds."
        lag, right = float(got.ravel()[0]), 1000 * delay * frame_time
        if abs(lag - right) <= 1001 * frame_time:  # a frame more or less
            continue
        known = {
            float(delay): "That is in frames. Times frame_time it is seconds, times 1000 more "
            "milliseconds.",
            right / 1000: "That is in seconds. Times 1000 it is milliseconds.",
            -right: "The sign is wrong: a curve that comes late has a lag above 0.",
            0.0: "You found no lag in a curve that comes late. Which shift fits best?",
            1000 * delay / 120: "At 30 frames per second it goes wrong. Use frame_time instead "
            "of 1/120.",
        }
        return _known(lag, known, rtol=1e-6) or (
            f"{lag:.4g} ms for a curve that comes another time late. Shift the smooth curve "
            f"back by 0, 1, 2, ... frames, and see which shift leaves the smallest RMS."
        )
    return "Right: 5 frames at 120 and 3 frames at 30 per second are found, in milliseconds."


def _call(function: Any, *arguments: Any) -> tuple[Any, str]:
    """Return what a student's function returns, or a sentence that says what went wrong."""
    try:
        result = function(*arguments)
    except Exception as error:
        return None, f"Your function stopped with {type(error).__name__}: {error}"
    return result, "" if result is not None else "Your function returns nothing: return?"


def _numbers(value: Any) -> FloatArray | None:
    """Return finite real numbers as an array, or None for anything else."""
    try:
        if np.iscomplexobj(value):
            return None
        numbers = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        return None
    return numbers if np.isfinite(numbers).all() else None


def _near(value: ArrayLike, target: float, rtol: float = 0.01) -> bool:
    return bool(np.isclose(value, target, rtol=rtol, atol=0.0 if target else 1e-12))


def _known(value: float, hints: dict[float, str], rtol: float = 0.01) -> str:
    """Return the hint that was written for a wrong value, or nothing."""
    return next((hint for wrong, hint in hints.items() if _near(value, wrong, rtol)), "")


def _smooth_signal(n_frames: int, frame_time: float) -> FloatArray:
    """Make something like a joint angle, which hardly repeats itself within the clip."""
    t = np.arange(n_frames) * frame_time
    angle: FloatArray = 20 * np.sin(2 * np.pi * 0.9 * t) + 8 * np.sin(2 * np.pi * 2.3 * t + 1)
    return angle
