"""What a stream learns about its channels as it goes: mean, deviation, noise."""

from __future__ import annotations

import math

import numpy as np

from mocaplab.motion import FloatArray

LEAST_NOISE_DEG = 1e-3
"""So little noise is taken for none."""


class RunningScale:
    """Mean and deviation of all frames so far (Welford 1962).

    Parameters
    ----------
    n_channels : int
    """

    def __init__(self, n_channels: int):
        self.n_frames = 0
        self.mean = np.zeros(n_channels)
        self.squares = np.zeros(n_channels)  # sum of squared distances from the mean

    def add(self, frame: FloatArray) -> None:
        """Take one more frame, shape (C,), into account."""
        self.n_frames += 1
        distance = frame - self.mean
        self.mean = self.mean + distance / self.n_frames
        self.squares = self.squares + distance * (frame - self.mean)

    @property
    def std(self) -> FloatArray:
        """Standard deviation, shape (C,)."""
        deviation: FloatArray = np.sqrt(self.squares / self.n_frames)
        return deviation


class RunningNoise:
    """The standard deviation of white noise, from the third differences of all frames so far.

    In them a smooth movement almost vanishes, while noise has 20 times its variance. A single
    jump counts no more than four times the noise known before.

    Parameters
    ----------
    n_channels : int
    """

    def __init__(self, n_channels: int):
        self.frames = np.zeros((4, n_channels))  # the last four
        self.n_frames = 0
        self.noise = np.zeros(n_channels)

    def add(self, frame: FloatArray) -> None:
        """Take one more frame, shape (C,), degrees, into account."""
        self.frames[:-1] = self.frames[1:]
        self.frames[-1] = frame
        self.n_frames += 1
        n = self.n_frames - 3  # third differences so far
        if n < 1:
            return
        a, b, c, d = self.frames
        # The mean size of a normal variable is sqrt(2 / pi) of its deviation.
        size = np.abs(d - 3 * c + 3 * b - a) * math.sqrt(math.pi / 2 / 20)
        if n > 8:
            size = np.minimum(size, 4 * self.noise)
        self.noise = self.noise + (size - self.noise) / n

    @property
    def std(self) -> FloatArray:
        """Noise of each channel, shape (C,), degrees, at least ``LEAST_NOISE_DEG``."""
        return np.maximum(self.noise, LEAST_NOISE_DEG)
