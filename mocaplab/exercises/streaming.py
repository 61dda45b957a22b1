"""Checks for the exercises of notebook 08, on streams: see :mod:`mocaplab.exercises`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from mocaplab.exercises.answers import (
    NOT_YET,
    NOTHING,
    as_array,
    as_number,
    call,
    known,
    not_a_number,
)
from mocaplab.motion import FloatArray

CASES = ((4, 2, 30), (6, 0, 25), (0, 3, 12))
"""For the live average: frames back, frames ahead, frames of the signal."""


def check_look_ahead_frames(answer: Any, *, delay_s: float, fps: Sequence[float]) -> str:
    """Check how many whole frames of look-ahead fit into a delay, at two frame rates."""
    if answer is None:
        return NOT_YET
    pair = as_array(answer)
    if pair is None or pair.shape != (2,):
        return "Give two whole numbers: (frames at the first rate, frames at the second)."
    right = [int(delay_s * rate + 1e-9) for rate in fps]
    if np.array_equal(pair, right):
        return "Right: the same delay is another number of frames at every frame rate."
    if np.array_equal(pair[::-1], right):
        return "Both numbers are right, but in the wrong order."
    if np.allclose(pair, [delay_s * rate for rate in fps]):
        return "So many frames fit, but a stream can only wait for whole ones: which are they?"
    for got, whole, rate in zip(pair, right, fps, strict=True):
        if got == whole:
            continue
        hints = {
            float(whole + 1): f"At {rate:g} frames per second that takes longer than the delay "
            "that is allowed. Round down.",
            1000 * delay_s: "That is the delay in milliseconds. How long does one frame last?",
            1000 * delay_s * rate: "You multiplied milliseconds by a rate per second.",
            rate / delay_s: "You divided by the delay. A frame lasts 1 / rate seconds.",
            float(right[0]): "The number of frames of the other rate is another time here.",
        }
        return known(float(got), hints, rel_tol=1e-6) or (
            f"{got:g} frames at {rate:g} per second last {1000 * got / rate:.4g} ms. The delay is "
            f"{1000 * delay_s:g} ms."
        )
    return NOT_YET


def check_live_average(answer: Any) -> str:
    """Check a function ``f(values, n_past, n_ahead)``: the mean of what a stream may see."""
    if answer is None:
        return NOT_YET
    for n_past, n_ahead, n_frames in CASES:
        values = 10 + 5 * np.sin(0.7 * np.arange(n_frames)) + 0.3 * np.arange(n_frames)
        result, problem = call(answer, values.copy(), n_past, n_ahead)
        if problem:
            return problem
        if result is None:
            return NOTHING
        problem = _wrong_average(as_array(result), values, n_past, n_ahead)
        if problem:
            return problem
    return "Right: the mean of what is there, with windows that get shorter at both ends."


def _average(values: FloatArray, n_past: int, n_ahead: int) -> FloatArray:
    """Return the mean of each frame's window, cut at the ends."""
    windows = [values[max(0, t - n_past) : t + n_ahead + 1] for t in range(len(values))]
    return np.array([window.mean() for window in windows])


def _wrong_average(got: FloatArray | None, values: FloatArray, n_past: int, n_ahead: int) -> str:
    if got is None:
        return "Your function must return one number a frame."
    right, n = _average(values, n_past, n_ahead), len(values)
    if got.shape != right.shape:
        if got.size == n - n_ahead:
            return "The last frames are missing: at the end, a stream is flushed."
        return f"{n} frames went in, and an array of shape {got.shape} came out."
    if np.allclose(got, right):
        return ""
    full = n_past + 1 + n_ahead
    zeros = np.convolve(np.pad(values, (n_past, n_ahead)), np.ones(full) / full, "valid")
    edges = np.pad(values, (n_past, n_ahead), mode="edge")
    late = np.concatenate([np.full(n_ahead, right[0]), right[: n - n_ahead]])
    wrong = {
        "That is the sum. Divide by the number of frames.": right * full,
        "At the ends you divide by the full length of the window, though fewer frames are "
        "there: divide by the number that you have.": zeros,
        "You repeat the first and last frame. Here the window gets shorter instead.": np.convolve(
            edges, np.ones(full) / full, "valid"
        ),
        "Your window does not look ahead.": _average(values, n_past, 0),
        "You see more of the future than the look-ahead allows: back and ahead are "
        "mixed up.": _average(values, n_ahead, n_past),
        "One frame is missing: the window holds n_past frames, the frame itself, and n_ahead "
        "more.": _average(values, n_past - (n_ahead == 0), max(n_ahead - 1, 0)),
        "Your window begins one frame too early.": _average(values, n_past + 1, n_ahead),
        "Your window ends one frame too late.": _average(values, n_past, n_ahead + 1),
    }
    for hint, numbers in wrong.items():
        if np.allclose(got, numbers):
            return hint
    if n_ahead and np.allclose(got[n_ahead:], late[n_ahead:]):
        return "The answers are right but come late: put answer t at frame t, not at t + n_ahead."
    inner = slice(n_past, n - n_ahead)
    if np.allclose(got[inner], right[inner]):
        return "Right inside, but not at the ends: take the mean of the frames that are there."
    return (
        f"Frame {n_past} should be the mean of frames 0 to {n_past + n_ahead}; yours is off by "
        f"{abs(got[n_past] - right[n_past]):.3g}."
    )


def check_late_frames(answer: Any, *, share: float, fps: float, minutes: float) -> str:
    """Check how many frames come late if a share of them takes too long."""
    if answer is None:
        return NOT_YET
    got = as_number(answer)
    if got is None:
        return not_a_number(answer)
    right = share * fps * 60 * minutes
    if abs(got - right) < 0.5:
        return f"Right: {right:.0f} frames. A median says nothing about them, a p99 does."
    hints = {
        share * fps: "That is in one second.",
        share * fps * 60: "That is in one minute.",
        share * minutes * 60: "You counted seconds, not frames: how many frames has a second?",
        fps * 60 * minutes: "That is all frames. Which share of them takes longer than the p99?",
        (1 - share) * fps * 60 * minutes: "That is how many come in time.",
        0.5 * fps * 60 * minutes: "Above the median lies one half. Above the p99 lies 1 %.",
    }
    return known(got, hints, rel_tol=1e-3) or (
        f"{got:g} is not it. First count all frames, then take the share above the p99."
    )


def check_look_ahead_choice(
    answer: Any, look_aheads_s: Sequence[float], errors: Sequence[float], *, within: float
) -> str:
    """Check the shortest look-ahead whose error is within a share of the smallest one."""
    if answer is None:
        return NOT_YET
    got = as_number(answer)
    if got is None:
        return not_a_number(answer)
    ahead, error = np.asarray(look_aheads_s), np.asarray(errors)
    good = np.flatnonzero(error <= (1 + within) * error.min())
    right = float(ahead[good[0]])
    place = int(np.argmin(np.abs(ahead - got)))
    if abs(ahead[place] - got) > 6e-4:
        hints = {
            1000 * right: "That is in milliseconds. The answer is wanted in seconds.",
            float(good[0]): "That is a place in the list. Which look-ahead stands there?",
        }
        return known(got, hints, rel_tol=0.01) or (
            "That is none of the look-aheads that were measured: "
            + ", ".join(f"{1000 * s:.0f}" for s in ahead)
            + " ms."
        )
    above = 100 * (error[place] / error.min() - 1)
    if place == good[0]:
        return (
            f"Right: {1000 * right:.0f} ms, {above:.0f} % above the smallest error. All that is "
            f"longer costs delay and wins little."
        )
    if place in good:
        return f"{1000 * got:.0f} ms is good enough, but a shorter look-ahead is, too."
    return f"With {1000 * got:.0f} ms the error is {above:.0f} % above the smallest: too much."
