"""Noise and gaps: what a bad capture does to a clean motion.

Only the channels in ``Skeleton.is_cleaned`` are touched: the root's path and heading
stay clean, as in paper A. Every function takes its own random generator, so that the
same seed gives the same corruption.
"""

from __future__ import annotations

import numpy as np

from mocaplab.euler import make_continuous
from mocaplab.motion import BoolArray, Corrupted, Motion, moving_channels


def angular_noise(motion: Motion, k: float, *, rng: np.random.Generator) -> Motion:
    """Add "k noise" to every joint angle (paper A, section 4).

    The noise of a channel is Gaussian with k times the standard deviation that the
    channel has in this clip: k = 0.1 / 0.5 / 0.9 is a signal-to-noise ratio of
    20 / 6 / 1 dB. Constant channels get none. The deviation is that of the continuous
    angles (:func:`mocaplab.euler.make_continuous`): a jump of 360 degrees in a file
    would blow it up, and the noise with it.

    Parameters
    ----------
    motion : Motion
    k : float in [0, 100]
    rng : numpy.random.Generator

    Raises
    ------
    ValueError
        If k is negative, or over 100 times the movement itself.
    """
    if not 0 <= k <= 100:
        raise ValueError(f"the noise amount k must lie in [0, 100], got {k}")
    scale = k * make_continuous(motion).channels.std(axis=0) * moving_channels(motion)
    return motion.with_channels(motion.channels + rng.normal(size=motion.channels.shape) * scale)


def gap_mask(
    motion: Motion, start_probability: float, mean_frames: float, *, rng: np.random.Generator
) -> BoolArray:
    """Choose which samples of a motion are hidden.

    In every channel, a gap starts in each frame with the given probability and has a
    geometric length, the discrete form of an exponential decay (paper A, section 4).
    The paper's own 10 % would hide most of a clip; 0.001 hides about 1.5 % at a mean
    length of 15 frames. The first and the last frame stay observed.

    Parameters
    ----------
    motion : Motion
    start_probability : float in [0, 1], per channel and frame
    mean_frames : float, at least 1, mean length of a gap
    rng : numpy.random.Generator

    Returns
    -------
    array, shape (T, C), bool: True = observed, False = hidden
    """
    if not 0 <= start_probability <= 1:
        raise ValueError(f"the gap probability must lie in [0, 1], got {start_probability}")
    if not mean_frames >= 1:
        raise ValueError(f"the mean gap length must be at least 1 frame, got {mean_frames}")
    mask = np.ones(motion.channels.shape, dtype=bool)
    starts = rng.random(mask.shape) < start_probability
    lengths = rng.geometric(1.0 / mean_frames, size=mask.shape)
    starts &= motion.skeleton.is_cleaned
    for frame, channel in np.argwhere(starts):
        mask[frame : frame + lengths[frame, channel], channel] = False
    mask[[0, -1]] = True
    return mask


def corrupt(
    motion: Motion,
    *,
    k: float = 0.5,
    gap_probability: float = 0.0,
    gap_frames: float = 15.0,
    rng: np.random.Generator,
) -> Corrupted:
    """Make a noisy motion with gaps out of a clean one.

    Parameters
    ----------
    motion : Motion
        The clean clip. It is made continuous first; its poses do not change.
    k : float
        Amount of noise, see :func:`angular_noise`.
    gap_probability, gap_frames : float
        Start probability and mean length of gaps, see :func:`gap_mask`.
    rng : numpy.random.Generator

    Returns
    -------
    Corrupted
        With NaN in ``observed`` where the mask is False.
    """
    clean = make_continuous(motion)
    noisy = angular_noise(clean, k, rng=rng)
    mask = gap_mask(clean, gap_probability, gap_frames, rng=rng)
    return Corrupted(clean, noisy.with_channels(np.where(mask, noisy.channels, np.nan)), mask)
