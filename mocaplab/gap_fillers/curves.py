"""Gap filling one channel at a time: straight lines and cubic curves between observed samples.

A gap is a run of NaN. Every filler is ``fill(motion) -> Motion`` and changes nothing but gaps.
Angles must be continuous (:func:`mocaplab.euler.make_continuous`): between 179 and -179 degrees
a line would go the long way round. All fillers share three rules:

- A gap at the start or the end of a clip takes the nearest observed value: a curve that goes on
  beyond its last sample soon goes astray.
- A channel that was observed only once takes that value everywhere.
- A channel that was never observed takes its rest value, and a :class:`GapWarning` names it.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from mocaplab.motion import CHANNEL_NAMES, BoolArray, FloatArray, IntArray, Motion, Skeleton

SHOWN_LABELS = 5
"""How many channels a warning names before it only counts."""


class GapWarning(UserWarning):
    """Something about a gap that the user should know."""


def never_observed(motion: Motion) -> BoolArray:
    """Tell which channels have no observed sample at all, shape (C,)."""
    observed = np.count_nonzero(np.isfinite(motion.channels), axis=0)
    return np.asarray(observed == 0)


def rest_values(skeleton: Skeleton) -> FloatArray:
    """Return the channels of the rest pose, shape (C,).

    An angle is 0 degrees; a position is the joint's OFFSET, in file length units.
    """
    axis = [CHANNEL_NAMES.index(kind) % 3 for kind in skeleton.channel_kind]
    return np.where(skeleton.is_rotation, 0.0, skeleton.offsets[skeleton.channel_joint, axis])


def rest_never_observed(motion: Motion) -> Motion:
    """Put channels that were never observed at rest, and warn which ones these are.

    Warns
    -----
    GapWarning
        Names the channels.
    """
    missing = never_observed(motion)
    if not missing.any():
        return motion
    labels = [motion.skeleton.channel_labels[c] for c in np.flatnonzero(missing)]
    warnings.warn(
        f"motion {motion.name!r}: never observed, so left at rest: {_some(labels)}",
        GapWarning,
        stacklevel=3,
    )
    return motion.with_channels(np.where(missing, rest_values(motion.skeleton), motion.channels))


def _some(labels: Sequence[str]) -> str:
    more = len(labels) - SHOWN_LABELS
    return ", ".join(labels[:SHOWN_LABELS]) + (f" and {more} more" if more > 0 else "")


def lerp_columns(values: FloatArray) -> FloatArray:
    """Draw straight lines across the NaN of every column, all columns at once.

    Parameters
    ----------
    values : array, shape (T, N)
        Every column needs one number at least, or it stays NaN.
    """
    left, right = gap_ends(values)
    frames = np.arange(len(values))[:, None]
    share = (frames - left) / np.maximum(right - left, 1)
    start, stop = (np.take_along_axis(values, index, axis=0) for index in (left, right))
    return np.where(np.isnan(values), start + share * (stop - start), values)


def gap_ends(values: FloatArray) -> tuple[IntArray, IntArray]:
    """Find the observed samples between which each sample lies.

    Parameters
    ----------
    values : array, shape (T, N); NaN inside gaps

    Returns
    -------
    left, right : arrays, shape (T, N), frames
        Of an observed sample, both are its own frame. At the ends of a clip both are the
        nearest observed sample; in a column without any they mean nothing.
    """
    observed = ~np.isnan(values)
    frames = np.arange(len(values))[:, None]
    before = np.maximum.accumulate(np.where(observed, frames, -1), axis=0)
    after = np.minimum.accumulate(np.where(observed, frames, len(values))[::-1], axis=0)[::-1]
    left = np.where(before < 0, after, before).clip(max=len(values) - 1)
    right = np.where(after == len(values), before, after).clip(min=0)
    return left, right


def lerp_gaps(motion: Motion) -> Motion:
    """Fill gaps by straight lines between their ends; the rules are at the top of this file.

    Warns
    -----
    GapWarning
        If a channel was never observed; it is left at rest.
    """
    known = rest_never_observed(motion)
    if not np.isnan(known.channels).any():
        return known
    return known.with_channels(lerp_columns(known.channels))


def pchip_gaps(motion: Motion) -> Motion:
    """Fill gaps by cubic curves that never swing beyond the samples at their ends.

    The slope at an end is a mean of the slopes to its two neighbours, and 0 at a peak:
    monotone cubic interpolation (Fritsch and Butland 1984; ``scipy.interpolate``).

    Warns
    -----
    GapWarning
        If a channel was never observed; it is left at rest.
    """
    from scipy.interpolate import PchipInterpolator

    return _fill_by_curve(motion, PchipInterpolator)


def spline_gaps(motion: Motion) -> Motion:
    """Fill gaps by the natural cubic spline through all observed samples of a channel.

    Its first and second derivative are continuous, and it bends as little as any such curve
    can. Very good over short gaps without noise; but it goes on with the slope at the ends of a
    gap, so that it swings far out over long gaps, and with noise over all gaps.

    Warns
    -----
    GapWarning
        If a channel was never observed; it is left at rest.
    """
    from scipy.interpolate import CubicSpline

    return _fill_by_curve(motion, lambda x, y: CubicSpline(x, y, bc_type="natural"))


def _fill_by_curve(motion: Motion, interpolator: Callable[[Any, Any], Any]) -> Motion:
    """Fill each channel by its own curve, evaluated no further than its outermost samples."""
    known = rest_never_observed(motion)
    channels = known.channels.copy()
    for column in np.flatnonzero(np.isnan(channels).any(axis=0)):
        values = channels[:, column]  # a view
        hidden = np.isnan(values)
        frames = np.flatnonzero(~hidden)
        if len(frames) == 1:
            values[hidden] = values[frames]
            continue
        curve = interpolator(frames, values[frames])
        values[hidden] = curve(np.flatnonzero(hidden).clip(frames[0], frames[-1]))
    return motion.with_channels(channels)
