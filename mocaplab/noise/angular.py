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


def uniform_noise(motion: Motion, k: float, *, rng: np.random.Generator) -> Motion:
    """Add noise that is spread evenly, with the deviation of :func:`angular_noise`.

    It lies between plus and minus sqrt(3) k deviations of the channel, and nothing lies
    further out. Paper A (section 4, Figure 7) tests uniform noise without its size; with
    this one, it differs from "k noise" by its shape alone.

    Parameters
    ----------
    motion : Motion
    k : float in [0, 100]
    rng : numpy.random.Generator
    """
    check_amount(k, 100, "the noise amount k")
    noise = rng.uniform(-np.sqrt(3.0), np.sqrt(3.0), size=motion.channels.shape)
    return motion.with_channels(motion.channels + k * movement_std(motion) * noise)


def biased_noise(
    motion: Motion, k: float, *, bias_std: float = BIAS_STD, rng: np.random.Generator
) -> Motion:
    """Add "k noise" and the same constant to every frame (paper A, section 4, Figure 7).

    The paper does not say how large its bias is or which sign it has. Here it is
    ``bias_std`` times the channel's deviation and positive in every channel of every
    clip: no cleaner could learn a bias that is drawn anew for each clip, because a bias
    cannot be told from another posture.

    Parameters
    ----------
    motion : Motion
    k : float in [0, 100], the noise around the bias
    bias_std : float in [-100, 100], default 0.5
    rng : numpy.random.Generator
    """
    check_amount(abs(bias_std), 100, "the size of the bias")
    noisy = angular_noise(motion, k, rng=rng)
    return noisy.with_channels(noisy.channels + bias_std * movement_std(motion))


def wavering_noise(
    motion: Motion,
    k: float,
    *,
    amplitude_std: float = BIAS_STD,
    period_s: float = WAVER_PERIOD_S,
    rng: np.random.Generator,
) -> Motion:
    """Add "k noise" and a bias that swings as a sine (paper A, section 4, Figure 7).

    The paper gives no numbers. Here the bias swings by ``amplitude_std`` deviations of the
    channel to both sides, once in ``period_s``. Where in its swing it begins is random,
    and is the same for all channels of a clip.

    Parameters
    ----------
    motion : Motion
    k : float in [0, 100], the noise around the bias
    amplitude_std : float in [0, 100], default 0.5
    period_s : float over 0, seconds, default 1
    rng : numpy.random.Generator
    """
    check_amount(amplitude_std, 100, "the amplitude of the bias")
    if not 0 < period_s < np.inf:
        raise ValueError(f"the period must be over 0 seconds, got {period_s}")
    noisy = angular_noise(motion, k, rng=rng)
    swing = np.sin(2 * np.pi * (motion.time_s / period_s + rng.random()))[:, None]
    return noisy.with_channels(noisy.channels + amplitude_std * swing * movement_std(motion))
