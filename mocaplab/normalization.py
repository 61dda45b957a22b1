"""Bring channels to a common scale before a network sees them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from mocaplab.motion import CONSTANT_STD_DEG, BoolArray, FloatArray, Motion


@dataclass(frozen=True, eq=False)
class Normalizer:
    """Per-channel mean and scale, fitted on training clips only.

    Parameters
    ----------
    mean, std : array, shape (C,), degrees
        ``std`` is the mean over clips of the standard deviation within a clip.
    constant : array, shape (C,), bool
        True where ``std`` is below ``CONSTANT_STD_DEG``; these become 0.
    """

    mean: FloatArray
    std: FloatArray
    constant: BoolArray

    @classmethod
    def fit(cls, clips: Sequence[Motion]) -> Normalizer:
        """Measure mean and scale on training clips.

        Raises
        ------
        ValueError
            If there are no clips.
        """
        if not clips:
            raise ValueError("a normalizer needs at least one training clip")
        mean = np.mean([clip.channels.mean(axis=0) for clip in clips], axis=0)
        std = np.mean([clip.channels.std(axis=0) for clip in clips], axis=0)
        return cls(mean, std, std < CONSTANT_STD_DEG)

    def normalize(self, channels: ArrayLike, center: ArrayLike | None = None) -> FloatArray:
        """Subtract a centre and divide by the scale.

        Parameters
        ----------
        channels : array, shape (..., C), degrees
        center : array broadcastable to it, degrees; the training mean if None

        Returns
        -------
        array, shape (..., C), without unit, 0 in constant channels
        """
        middle = self.mean if center is None else np.asarray(center, dtype=np.float64)
        scale = np.where(self.constant, 1.0, self.std)
        result = (np.asarray(channels, dtype=np.float64) - middle) / scale
        return np.where(self.constant, 0.0, result)
