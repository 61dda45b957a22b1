"""Find how much later one recording of a movement began than another: cross-correlation.

Two cameras are never started at the same moment. What both saw is the same, so their signals,
shifted against each other, agree best where the shift is right.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from mocaplab.motion import FloatArray
from mocaplab.quaternions import as_quaternion, follow_hemisphere

LARGEST_OFFSET_S = 1.0
"""Cyclic movements look the same again after a cycle, so no longer offset is looked for."""
LEAST_CORRELATION = 0.3
"""Below this two recordings do not show the same movement, or one of them is noise."""
LEAST_OVERLAP_S = 0.5
"""Two recordings that share less than this cannot be compared."""


class Offset(NamedTuple):
    """How two recordings lie in time."""

    frames: int  # frame t of the first shows what frame t + frames of the second shows
    seconds: float
    correlation: float  # of the two at this offset, from -1 to 1


def find_offset(
    a: ArrayLike, b: ArrayLike, frame_time: float, largest_s: float = LARGEST_OFFSET_S
) -> Offset:
    """Find the shift at which two recordings agree best.

    The signals are the numbers of all quaternions but the root's. Each is centred by its median
    and cut at three times its usual deviation, so that single lost frames count for little.
    At every shift the correlation coefficient of the frames that both have is taken.

    Parameters
    ----------
    a, b : arrays, shape (T, J, 4) and (T', J, 4), unit quaternions, the root first
    frame_time : float, seconds
    largest_s : float, seconds

    Returns
    -------
    Offset

    Raises
    ------
    ValueError
        If the recordings are too short, nothing but the root moves, or they agree nowhere.
    """
    first, second = _signals(a, b)
    reach = round(largest_s / frame_time)
    least = max(3, round(LEAST_OVERLAP_S / frame_time))
    shifts = [
        shift
        for shift in range(-reach, reach + 1)
        if min(len(first), len(second) - shift) - max(0, -shift) >= least
    ]
    if not shifts:
        raise ValueError(
            f"expected at least {least} frames ({LEAST_OVERLAP_S} s) in both recordings, got "
            f"{len(first)} and {len(second)}"
        )
    agreement = np.array([_correlation(first, second, shift) for shift in shifts])
    # Of equal ones, the smallest shift.
    best = max(range(len(shifts)), key=lambda i: (agreement[i].round(9), -abs(shifts[i])))
    if agreement[best] < LEAST_CORRELATION:
        raise ValueError(
            f"expected two recordings of one movement, found a correlation of at most "
            f"{agreement[best]:.2f} within {largest_s:g} s; if they are, say the offset yourself"
        )
    return Offset(shifts[best], shifts[best] * frame_time, float(agreement[best]))


def common_frames(n_a: int, n_b: int, shift: int) -> tuple[slice, slice]:
    """Return the frames of the first and of the second that show the same moments.

    Raises
    ------
    ValueError
        If there are none.
    """
    start, stop = max(0, -shift), min(n_a, n_b - shift)
    if stop <= start:
        raise ValueError(
            f"with an offset of {shift} frames, recordings of {n_a} and {n_b} frames share none"
        )
    return slice(start, stop), slice(start + shift, stop + shift)


def _signals(a: ArrayLike, b: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Return robustly centred and scaled signals, shape (T, 4 (J - 1)), in the same units."""
    p, q = follow_hemisphere(as_quaternion(a)), follow_hemisphere(as_quaternion(b))
    if p.shape[1:] != q.shape[1:]:
        raise ValueError(f"expected the same joints, got shapes {p.shape} and {q.shape}")
    middle = np.median(p, axis=0)
    opposite = np.sum(middle * np.median(q, axis=0), axis=-1, keepdims=True) < 0
    q = np.where(opposite, -q, q)
    pair = [x[:, 1:].reshape(len(x), -1) for x in (p, q)]
    centred = [x - np.median(x, axis=0) for x in pair]
    spread = 1.4826 * np.median(np.abs(np.concatenate(centred)), axis=0)
    if not (spread > 1e-6).any():
        raise ValueError("nothing but the root moves, so no time offset can be found")
    first, second = (np.clip(x, -3 * spread, 3 * spread) for x in centred)
    return first, second


def _correlation(first: FloatArray, second: FloatArray, shift: int) -> float:
    here, there = common_frames(len(first), len(second), shift)
    x, y = (values - values.mean(axis=0) for values in (first[here], second[there]))
    size = np.sqrt(np.sum(x * x) * np.sum(y * y))
    return float(np.sum(x * y) / size) if size > 0 else 0.0
