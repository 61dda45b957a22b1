"""Find samples that a capture made up: frozen frames and single-frame spikes.

What is odd is measured by the clip's own statistics, never in fixed degrees: a step that is
violent in a slow walk is usual in a kick. What is found can be hidden and filled like a gap.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mocaplab.euler import make_continuous
from mocaplab.motion import BoolArray, FloatArray, Motion, moving_channels

STILL_SHARE = 1e-3
"""A channel stands still in a step that is below this share of its median step."""
LEAST_STEP_DEG = 1e-6
"""Or below this: the digits of a file."""
SPIKE_FACTOR = 7.0
"""How far a spike is off, in units of how far the other samples around it are off."""
SPIKE_STD = 2.0
"""And in standard deviations of its channel. Recorded clips are full of smaller ones, in fingers
and toes most of all, which do little harm."""
NEIGHBOURS_S = 0.04
"""Neighbours that say where a sample should be, seconds to each side; two at least."""
SURROUNDINGS_S = 0.1
"""How far around a sample the others are looked at, seconds to each side."""
PASSES = 3
"""A spike beside a larger one is seen when that is gone."""


@dataclass(frozen=True, eq=False)
class Faults:
    """Samples that look made up.

    Parameters
    ----------
    frozen : array, shape (T,), bool: frames that repeat the one before, in all moving angles
    spikes : array, shape (T, C), bool
    """

    frozen: BoolArray
    spikes: BoolArray

    def hidden(self, motion: Motion) -> BoolArray:
        """Mark all samples to be filled, shape (T, C): a frozen frame is one in every angle."""
        marked: BoolArray = self.spikes | (self.frozen[:, None] & motion.skeleton.is_cleaned)
        return marked


def detect_faults(motion: Motion) -> Faults:
    """Look for frozen frames and spikes in the angles of a motion.

    **Frozen frames.** A frame in which every moving angle repeats the frame before, to
    ``STILL_SHARE`` of its own median step. Movement never does that in all angles at once; a
    person who stands still in a file with few digits may, but then what fills the gap is the
    same as what was there.

    **Spikes.** Each sample is compared with the parabola nearest to its neighbours. It is a spike
    if it is off by more than ``SPIKE_FACTOR`` times the median of how far the samples around it
    are off, and than the same of the whole clip; by more than ``SPIKE_STD`` deviations of its
    channel; by more than the samples beside it; and if these two are nearer to each other than
    half of that. For white noise the factor is 4.7 deviations: one false alarm in 400,000 samples.

    In strong noise, single spikes drown; those are left to the network.

    Parameters
    ----------
    motion : Motion; NaN where samples are known to be missing

    Returns
    -------
    Faults
    """
    values = make_continuous(motion).channels
    moving = moving_channels(motion)
    spikes = np.zeros(values.shape, dtype=bool)
    frozen = _frozen(motion.channels[:, moving])
    reach = max(2, round(NEIGHBOURS_S / motion.frame_time))
    radius = max(reach, round(SURROUNDINGS_S / motion.frame_time))
    for column in np.flatnonzero(moving):
        spikes[:, column] = _spikes(values[:, column], reach, radius)
    return Faults(frozen, spikes & ~frozen[:, None])


def _frozen(values: FloatArray) -> BoolArray:
    """Find the frames that repeat the one before, shape (T,), in channels that move, (T, N)."""
    frozen = np.zeros(len(values), dtype=bool)
    if len(values) < 3 or values.shape[1] == 0:
        return frozen
    steps = np.abs(np.diff(values, axis=0))
    seen = ~np.isnan(steps)
    usual = np.array(
        [
            np.median(s[~np.isnan(s)]) if k.any() else 0.0
            for s, k in zip(steps.T, seen.T, strict=True)
        ]
    )
    still = ~seen | (steps <= np.maximum(LEAST_STEP_DEG, STILL_SHARE * usual))
    frozen[1:] = still.all(axis=1) & seen.any(axis=1)
    return frozen


def _spikes(values: FloatArray, reach: int, radius: int) -> BoolArray:
    """Find single samples that stand out of one channel, shape (T,).

    Parameters
    ----------
    values : array, shape (T,), continuous; NaN where nothing was observed
    reach : int, neighbours on each side that say where a sample should be
    radius : int, samples on each side that say how far off is usual
    """
    from scipy.ndimage import correlate1d, median_filter

    found = np.zeros(len(values), dtype=bool)
    if len(values) < 2 * reach + 1:
        return found
    frames, weights = np.arange(len(values)), _parabola_without_middle(reach)
    for _ in range(PASSES):
        bad = found | np.isnan(values)
        if bad.sum() > len(values) / 2:
            break
        line = np.interp(frames, frames[~bad], values[~bad])
        off = np.abs(line - correlate1d(line, weights, mode="mirror"))
        apart = np.abs(np.roll(line, -1) - np.roll(line, 1))
        usual = np.maximum(median_filter(off, 2 * radius + 1, mode="nearest"), np.median(off))
        limit = np.maximum(SPIKE_FACTOR * usual, SPIKE_STD * line.std())
        highest = np.maximum(np.maximum(np.roll(off, 1), np.roll(off, -1)), off)
        new = (off > limit) & (off == highest) & (apart < off / 2) & ~bad
        new[[0, 1, -2, -1]] = False
        if not new.any():
            break
        found |= new
    return found


def _parabola_without_middle(reach: int) -> FloatArray:
    """Return the weights of the neighbours for the parabola nearest to them, in the middle."""
    steps = np.arange(-reach, reach + 1)
    others = steps != 0
    weights = np.zeros(len(steps))
    weights[others] = np.linalg.pinv(steps[others, None] ** np.arange(3))[0]
    return weights
