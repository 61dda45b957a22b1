"""Fusing two sources without learning: the opponents of the networks of paper B.

The paper compares its network with its own inputs only. Whoever has two sources would first take
their mean, or the better of the two; and whoever knows filters would smooth the mean. All of
these take two arrays of shape (T, J, 4), unit quaternions, and return one.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from mocaplab.filters import gaussian_filter
from mocaplab.motion import FloatArray
from mocaplab.quaternions import as_quaternion, follow_hemisphere

WIDTHS_S = np.round(np.geomspace(0.004, 0.25, 25), 4)
"""The Gaussian widths that tuning tries, in seconds."""


def mean_of_sources(a: ArrayLike, b: ArrayLike) -> FloatArray:
    """Take the rotation half way between the two.

    The sum of two quaternions in one hemisphere, scaled to length 1, is the middle of the turn
    from one to the other: for two rotations that is the exact geodesic mean.
    """
    p, q = _pair(a, b)
    return _unit(p + q)


def shake(quaternions: ArrayLike) -> FloatArray:
    """Tell how much each joint trembles, shape (..., T, J).

    This is the distance of each quaternion from the middle of those before and after; the
    first and the last frame repeat their neighbours.
    """
    q = follow_hemisphere(as_quaternion(quaternions))
    if len(q) < 3:
        return np.zeros(q.shape[:-1])
    inside = np.linalg.norm(q[1:-1] - _unit(q[:-2] + q[2:]), axis=-1)
    return np.concatenate([inside[:1], inside, inside[-1:]])


def steadier_source(a: ArrayLike, b: ArrayLike) -> FloatArray:
    """Take, for each joint, the source that trembles less over the whole clip."""
    p, q = _pair(a, b)
    better = shake(p).mean(axis=0) <= shake(q).mean(axis=0)  # (J,)
    return np.where(better[:, None], p, q)


def steadier_frames(a: ArrayLike, b: ArrayLike) -> FloatArray:
    """Take, for each joint in each frame, the source that trembles less there.

    Where a source lost track, the other one is taken; elsewhere this is as noisy as one source.
    """
    p, q = _pair(a, b)
    return np.where((shake(p) <= shake(q))[..., None], p, q)


def gaussian_mean(a: ArrayLike, b: ArrayLike, sigma_s: float, frame_time: float) -> FloatArray:
    """Smooth the mean of the two with a Gaussian, and scale to length 1.

    Rotations within the window are near to each other, where this weighted mean and the
    geodesic one agree (Gramkow 2001, "On averaging rotations").
    """
    return smooth_rotations(mean_of_sources(a, b), sigma_s, frame_time)


def gated_gaussian_mean(
    a: ArrayLike, b: ArrayLike, sigma_s: float, frame_time: float
) -> FloatArray:
    """Leave out samples that a source lost, then take the smoothed mean of the others.

    A sample is lost if it is more than three times as far from the median of the five frames
    around it, of its own source, as is usual for that joint (Hampel's rule). Nobody in the paper
    or the issue asked for this opponent; it is the strongest one that learns nothing.
    """
    p, q = _pair(a, b)
    total, weight = np.zeros_like(p), np.zeros((*p.shape[:-1], 1))
    for source in (p, q):
        kept = ~lost_samples(source)[..., None]
        total += np.where(kept, source, 0.0)
        weight += kept
    flat = np.concatenate([total, weight], axis=-1).reshape(len(p), -1)
    smooth = gaussian_filter(flat, sigma_s, frame_time).reshape(*weight.shape[:-1], 5)
    # Where all samples near by are lost, there is nothing better than their mean.
    return _unit(np.where(smooth[..., 4:] > 1e-6, smooth[..., :4], p + q))


def lost_samples(quaternions: ArrayLike) -> np.ndarray:
    """Tell which samples are far from the frames around them, shape (T, J), bool."""
    q = np.asarray(quaternions, dtype=np.float64)
    padded = np.pad(q, ((2, 2), (0, 0), (0, 0)), mode="symmetric")
    around = np.stack([padded[i : i + len(q)] for i in range(5)])
    away = np.linalg.norm(q - np.median(around, axis=0), axis=-1)
    usual = np.median(away, axis=0) / 0.6745  # the deviation, if they were normal
    lost: np.ndarray = away > np.maximum(3 * usual, 0.02)
    return lost


def smooth_rotations(quaternions: ArrayLike, sigma_s: float, frame_time: float) -> FloatArray:
    """Smooth rotations over time, shape (T, J, 4), with a Gaussian."""
    q = follow_hemisphere(as_quaternion(quaternions))
    flat = gaussian_filter(q.reshape(len(q), -1), sigma_s, frame_time)
    return _unit(flat.reshape(q.shape))


def quaternion_distance(q: ArrayLike, truth: ArrayLike) -> FloatArray:
    """L1 distance of rotations, q and -q being one, shape (..., J); paper B, Eq. 1."""
    estimate, clean = np.asarray(q, dtype=np.float64), np.asarray(truth, dtype=np.float64)
    opposite = np.sum(estimate * clean, axis=-1, keepdims=True) < 0
    distance: FloatArray = np.abs(np.where(opposite, -estimate, estimate) - clean).sum(axis=-1)
    return distance


def tune_width(
    pairs: Sequence[tuple[FloatArray, FloatArray, FloatArray]],
    frame_time: float,
    *,
    gated: bool = False,
) -> float:
    """Find the Gaussian width with the smallest L1 distance on training clips.

    Parameters
    ----------
    pairs : list of (a, b, clean), each of shape (T, J, 4)
    frame_time : float, seconds
    gated : bool, for :func:`gated_gaussian_mean`

    Returns
    -------
    float, seconds
    """
    if not pairs:
        raise ValueError("tuning needs at least one training clip")
    smooth = gated_gaussian_mean if gated else gaussian_mean
    errors = [
        sum(
            quaternion_distance(smooth(a, b, width, frame_time), clean).mean()
            for a, b, clean in pairs
        )
        for width in WIDTHS_S
    ]
    return float(WIDTHS_S[int(np.argmin(errors))])


def _pair(a: ArrayLike, b: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Return both with signs that do not jump over time, b in the hemisphere of a."""
    p, q = as_quaternion(a), as_quaternion(b)
    if p.ndim != 3 or p.shape != q.shape:
        raise ValueError(f"expected two arrays of one shape (T, J, 4), got {p.shape} and {q.shape}")
    p = follow_hemisphere(p)
    return p, np.where(np.sum(p * q, axis=-1, keepdims=True) < 0, -q, q)


def _unit(q: FloatArray) -> FloatArray:
    unit: FloatArray = q / np.maximum(np.linalg.norm(q, axis=-1, keepdims=True), 1e-12)
    return unit
