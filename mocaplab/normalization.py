"""Bring the channels of a clip to a common scale before a network sees them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from mocaplab.motion import CONSTANT_STD_DEG, BoolArray, FloatArray, Motion


def constant_channels(clips: Sequence[Motion]) -> BoolArray:
    """Tell which channels hardly move in any of the training clips.

    Parameters
    ----------
    clips : list of Motion, of one skeleton, without NaN

    Returns
    -------
    array, shape (C,), bool: True where the standard deviation within a clip is below
    ``CONSTANT_STD_DEG`` in all of them
    """
    if not clips:
        raise ValueError("training clips are needed to know the constant channels, got none")
    largest = np.max([clip.channels.std(axis=0) for clip in clips], axis=0)
    constant: BoolArray = largest < CONSTANT_STD_DEG
    return constant


def standardize(channels: ArrayLike, mean: ArrayLike, std: ArrayLike) -> FloatArray:
    """Subtract the mean of a clip and divide by its deviation, channel by channel.

    Each clip is measured by itself. With one mean for all clips, a clip whose Euler angles
    lie in another branch than those of the training clips would look like nothing that
    the network has seen; with one deviation, every new action would.

    Parameters
    ----------
    channels : array, shape (..., C), degrees, finite
    mean, std : array broadcastable to it, degrees; of the whole observed clip

    Returns
    -------
    array, shape (..., C), without unit; 0 where ``std`` is below ``CONSTANT_STD_DEG``
    """
    deviation = np.asarray(std, dtype=np.float64)
    # Anything divided by infinity is 0.
    divisor = np.where(deviation >= CONSTANT_STD_DEG, deviation, np.inf)
    difference = np.asarray(channels, dtype=np.float64) - np.asarray(mean, dtype=np.float64)
    return np.asarray(difference / divisor)
