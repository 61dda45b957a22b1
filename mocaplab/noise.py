"""Noise on joint angles: paper A's "k noise" and its relatives.

Only the channels that move are touched: the root's path and heading stay clean, as in
paper A, and so do channels that never move. Every size is in units of a channel's own
standard deviation in this clip, so that a shoulder and a toe are spoiled alike.
"""

from __future__ import annotations

import numpy as np

from mocaplab.euler import make_continuous
from mocaplab.motion import FloatArray, Motion, moving_channels

BIAS_STD = 0.5
"""Size of the constant and of the wavering bias, in standard deviations of a channel."""
WAVER_PERIOD_S = 1.0
"""Time for one swing of the wavering bias, about that of two steps."""


def check_amount(value: float, largest: float, what: str) -> None:
    """Refuse, with a ValueError, an amount that is not in [0, largest]; NaN is refused too."""
    if not 0 <= value <= largest:
        raise ValueError(f"{what} must lie in [0, {largest:g}], got {value}")


def movement_std(motion: Motion) -> FloatArray:
    """Measure how much each channel moves, shape (C,), degrees; 0 where nothing is touched.

    The deviation is that of the continuous angles
    (:func:`mocaplab.euler.make_continuous`), because a jump of 360 degrees in a file would
    blow it up, and the noise with it. Samples that are NaN are left out.
    """
    channels = make_continuous(motion).channels
    observed = ~np.isnan(channels)
    count = np.maximum(observed.sum(axis=0), 1)
    mean = np.where(observed, channels, 0.0).sum(axis=0) / count
    variance = np.where(observed, (channels - mean) ** 2, 0.0).sum(axis=0) / count
    std: FloatArray = np.sqrt(variance) * moving_channels(motion)
    return std


def angular_noise(motion: Motion, k: float, *, rng: np.random.Generator) -> Motion:
    """Add "k noise" to every joint angle (paper A, section 4).

    The noise of a channel is Gaussian with k times the standard deviation that the
    channel has in this clip: k = 0.1 / 0.5 / 0.9 is a signal-to-noise ratio of
    20 / 6 / 1 dB. Constant channels get none.

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
    check_amount(k, 100, "the noise amount k")
    scale = k * movement_std(motion)
    return motion.with_channels(motion.channels + rng.normal(size=motion.channels.shape) * scale)
