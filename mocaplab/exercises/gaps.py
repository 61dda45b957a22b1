"""Checks for the exercises of notebook 06, gaps: they answer at once, with a hint.

None means that the exercise has not been tried yet. Nothing here raises.
"""

from __future__ import annotations

import math
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
    short,
)
from mocaplab.measures.gaps import gap_rms_deg, shares_within
from mocaplab.motion import BoolArray, FloatArray, Motion

LINE = ((20, 10.0), (50, 46.0), 30)
"""Two observed samples, (frame, degrees), and the frame between them that is asked for."""
CALIBRATED, TOLERANCE = 0.68, 0.03
"""The share of errors within the expected one, and how far off it may be."""
SCALES = (1.6, 1.0, 0.6)
"""Errors of the calibration exercise over expected ones."""


def check_line(answer: Any) -> str:
    """Check what a straight line says inside a gap."""
    if answer is None:
        return NOT_YET
    got = as_number(answer)
    if got is None:
        return not_a_number(answer)
    (start, low), (stop, high), frame = LINE
    share = (frame - start) / (stop - start)
    if math.isclose(got, low + share * (high - low), abs_tol=1e-6):
        return f"Right: frame {frame} is a third of the way from {start} to {stop}."
    hints = {
        high - share * (high - low): "You counted the way from the far end of the gap.",
        (low + high) / 2: f"That is the middle. Frame {frame} is nearer to frame {start}.",
        low: f"That holds the last value. A line is on its way to {high:g} degrees.",
        high: f"That is the value after the gap, in frame {stop}.",
        share * high: f"A line from 0. It begins at {low:g} degrees: add them.",
        share * (high - low): f"That is the way gone since the gap began: add {low:g} degrees.",
        share: "That is the share of the way. How many degrees are it?",
    }
    hint = known(got, hints, rel_tol=1e-3)
    return hint or "Not yet. Which share of the frames is behind, and how many degrees is that?"


def check_gap_rms(answer: Any, filled: Motion, clean: Motion, mask: BoolArray) -> str:
    """Check a hand-made RMS error inside gaps: a function of filled, clean and mask."""
    if answer is None:
        return NOT_YET
    if not callable(answer):
        return "Give the function itself: def my_gap_rms(filled, clean, mask): and no call of it."
    result, sentence = call(answer, filled.channels, clean.channels, mask)
    if sentence:
        return sentence
    got = as_number(result)
    if got is None:
        return f"Your function should return one number, it returns {short(result)}."
    error = (filled.channels - clean.channels)[~mask]
    right = gap_rms_deg(filled, clean, mask)
    if math.isclose(got, right, rel_tol=1e-6):
        return f"Right: {got:.2f} degrees, the same as the library's gap_rms_deg."
    everywhere = filled.channels - clean.channels
    hints = {
        float(np.sqrt(np.mean(everywhere[mask] ** 2))): "That is the error where samples were "
        "observed. The mask is True there: turn it round with ~mask.",
        float(np.sqrt(np.mean(everywhere**2))): "You took all samples. Those that were observed "
        "are right anyway and hide the error: pick the hidden ones with ~mask.",
        float(np.mean(error**2)): "That is the mean square. Take the square root.",
        float(np.mean(np.abs(error))): "That is the mean absolute error. Square before the mean.",
        float(np.sqrt(np.sum(error**2))): "That is the root of the sum. Take the mean.",
        float(np.radians(right)): "That is in radians. The channels are in degrees already.",
    }
    hint = known(got, hints, rel_tol=1e-6)
    return hint or (
        "Not yet. Take the differences, keep those where mask is False, square, mean, root."
    )


def check_conditional_mean(answer: Any) -> str:
    """Check the conditional mean of a Gaussian: a function of covariance, hidden and values."""
    if answer is None:
        return NOT_YET
    if not callable(answer):
        return "Give the function itself: def conditional_mean(C, hidden, x): and no call of it."
    covariance, hidden, x = _example()
    for mask in (hidden, ~hidden):
        given = np.where(mask, np.nan, x)
        result, sentence = call(answer, covariance.copy(), mask.copy(), given)
        if sentence:
            return sentence
        hint = _about_mean(result, covariance, mask, x)
        if hint:
            return hint
    return "Right: this is how the visible channels tell what the hidden ones do."


def _example() -> tuple[FloatArray, BoolArray, FloatArray]:
    """Return a covariance of 5 channels, which of them are hidden, and their values."""
    rng = np.random.default_rng(0)
    root = rng.normal(size=(5, 7))
    return root @ root.T, np.array([True, False, True, False, False]), rng.normal(size=5)


def _about_mean(result: Any, covariance: FloatArray, hidden: BoolArray, values: FloatArray) -> str:
    """Return what is wrong with a conditional mean, or nothing."""
    got = as_array(result)
    if got is None:
        return f"Your function should return numbers, it returns {short(result)}."
    n = int(hidden.sum())
    got = got.ravel()
    if got.size == len(hidden):
        got = got[hidden]
    if got.size != n:
        return f"{n} channels are hidden, your function returns {got.size} numbers."
    if np.isnan(got).any():
        return "The answer is NaN. Hidden values are NaN: use x[~hidden] alone."
    across = covariance[np.ix_(hidden, ~hidden)]
    own = covariance[np.ix_(~hidden, ~hidden)]
    seen = values[~hidden]
    if np.allclose(got, across @ np.linalg.solve(own, seen)):
        return ""
    wrong = {
        "You left out the inverse of the visible channels' covariance.": across @ seen,
        "You multiplied by the visible channels' covariance: divide by it (np.linalg.solve).": (
            across @ own @ seen
        ),
        "You divided by the variances alone. The visible channels tell in part the same: "
        "use their whole covariance.": across @ (seen / np.diag(own)),
        "The sign is wrong. (With the inverse of the whole covariance there is a minus.)": (
            -across @ np.linalg.solve(own, seen)
        ),
    }
    for hint, value in wrong.items():
        if np.allclose(got, value):
            return hint
    return (
        "Not yet. Cut two blocks out of C: hidden rows with visible columns, and visible rows "
        "with visible columns."
    )


def check_calibration(answer: Any) -> str:
    """Check ``f(error, std)``: shares within one and two expected errors, and a word for it."""
    if answer is None:
        return NOT_YET
    if not callable(answer):
        return "Give the function itself: def my_shares(error, std): and no call of it."
    for seed, scale in enumerate(SCALES):
        rng = np.random.default_rng(seed)
        std = rng.uniform(0.5, 3.0, size=1000)
        error = scale * std * rng.normal(size=1000)
        result, sentence = call(answer, error.copy(), std.copy())
        if sentence:
            return sentence
        sentence = _about_shares(result, error, std)
        if sentence:
            return sentence
    return "Right: both shares, and a word that the first one deserves."


def _about_shares(result: Any, error: FloatArray, std: FloatArray) -> str:
    """Return what is wrong with two shares and a word, or nothing."""
    if result is None:
        return NOTHING
    if not isinstance(result, Sequence) or isinstance(result, str) or len(result) != 3:
        return f"Return three things, (share, share, word). This is {short(result)}."
    got, word = as_array(result[:2]), result[2]
    if got is None or got.shape != (2,):
        return f"The first two should be numbers, they are {short(result[:2])}."
    right = np.array(shares_within(error, std))
    if not np.allclose(got, right):
        return _wrong_shares(got, right, error, std)
    low, high = CALIBRATED - TOLERANCE, CALIBRATED + TOLERANCE
    expected = "too sure" if right[0] < low else "too careful" if right[0] > high else "calibrated"
    if word == expected:
        return ""
    if word not in ("too sure", "too careful", "calibrated"):
        return f"The shares are right. There is no word {short(word)}: see the three in the task."
    if "calibrated" in (word, expected):
        return (
            f"The shares are right, the word is not: {right[0]:.2f} is not {word!r}. Within "
            f"{TOLERANCE:g} of {CALIBRATED:g}, on both sides, is calibrated."
        )
    return (
        "The shares are right; the words are the wrong way round. Who is too sure of himself "
        "expects small errors, and few errors are as small as that."
    )


def _wrong_shares(got: FloatArray, right: FloatArray, error: FloatArray, std: FloatArray) -> str:
    """Say what two wrong shares may have come from."""

    def shares(size: FloatArray, one: FloatArray, two: FloatArray) -> list[float]:
        return [float(np.mean(size <= one)), float(np.mean(size <= two))]

    size = np.abs(error)
    mean, spread = np.full_like(std, std.mean()), np.full_like(std, error.std())
    hints = (
        (shares(error, std, 2 * std), "An error of -5 is as large as one of 5: take np.abs."),
        (1 - right, "Those are the shares outside. Turn the comparison round."),
        (100 * right, "Those are percent. Give shares from 0 to 1."),
        (len(error) * right, "You counted. Divide by the number of samples: np.mean."),
        (right[::-1], "Both shares are right, but in the wrong order."),
        ([right[0], right[1] - right[0]], "Within two deviations lie those within one, too."),
        ([right[0], right[0]], "For the second share, compare with twice the deviation."),
        (shares(size**2, std, 2 * std), "You squared the errors. The deviation is no variance."),
        (shares(size, std**2, 2 * std**2), "You squared the deviation. Compare it as it is."),
        (shares(size, np.sqrt(std), 2 * np.sqrt(std)), "The deviation is no variance: no root."),
        (shares(size, mean, 2 * mean), "You took one deviation for all. Each sample has its own."),
        (
            shares(size, spread, 2 * spread),
            "Compare with std, what was expected, sample by sample.",
        ),
    )
    for value, hint in hints:
        if np.allclose(got, value):
            return hint
    return "Not yet. np.mean of an array of True and False is the share that is True."
