"""Eleven estimates of one frame of a stream, and what each says of the others.

The observed frame, six Gaussians whose future is cut off, three straight lines fitted under such
Gaussians (they do not come late when a joint turns steadily), and one linear estimate from all
channels together. Offline, :mod:`mocaplab.estimate_bank` does the same with whole clips.

Letters in shapes: n frames in a window, C channels, M estimates, F clues, K cosines.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.fft import dct

from mocaplab.live.statistics import RunningNoise, RunningScale
from mocaplab.motion import CONSTANT_STD_DEG, FloatArray

MEANS = (1.5, 2.5, 4.0, 6.0, 9.0, 14.0)
"""Widths of the Gaussians, frames."""
LINES = (4.0, 8.0, 14.0)
"""Widths of the Gaussians under which a line is fitted, frames."""
N_PAST = 60
"""Frames that they reach back."""
N_ESTIMATES = len(MEANS) + len(LINES) + 2
PAIRS = ((0, 2), (1, 2), (2, 3), (3, 4), (4, 5), (5, 6), (3, 7), (7, 8), (8, 9), (3, 10), (8, 10))
"""Which estimates are compared, by number: 0 is the frame itself, 10 the linear estimate."""
MEMORY = (8.0, 30.0)
"""Frames over which comparisons are averaged."""
N_CLUES = (1 + len(MEMORY)) * len(PAIRS) + 3
LARGEST = 100.0
"""A squared comparison counts no more than this."""
LEVELS = (0.03, 0.06, 0.1, 0.15, 0.22, 0.32, 0.45, 0.65, 0.9, 1.3)
"""Amounts of noise, in deviations of a channel, for which the linear estimate is worked out."""


class Estimates(NamedTuple):
    """What a bank knows about one frame."""

    estimates: FloatArray  # (C, M), degrees
    clues: FloatArray  # (C, F)
    noise: FloatArray  # (C,), degrees


def kernels(look_ahead: int) -> FloatArray:
    """Return the weights of the frame itself, the Gaussians and the lines.

    Returns
    -------
    array, shape (M - 1, N_PAST + 1 + look_ahead); each row adds up to 1
    """
    distance = np.arange(-N_PAST, look_ahead + 1.0)
    rows = [np.where(distance == 0, 1.0, 0.0)]
    rows += [np.exp(-0.5 * (distance / sigma) ** 2) for sigma in MEANS]
    for sigma in LINES:
        weights = np.exp(-0.5 * (distance / sigma) ** 2)
        # The line fitted by weighted least squares, at distance 0.
        first, second = (weights * distance).sum(), (weights * distance**2).sum()
        rows.append(weights * (second - first * distance))
    return np.array([row / row.sum() for row in rows])


def linear_gains(
    covariance: FloatArray, look_ahead: int, radius: int, n_cosines: int
) -> FloatArray:
    """Work out how to estimate a frame from all channels in the window around it.

    A clean window is thought of as K cosines a channel, drawn with a known covariance. The frames
    from ``radius`` before to ``look_ahead`` after are seen through white noise. What is returned
    turns the seen frames, projected on the cosines, into the mean of the frame given these
    (:mod:`mocaplab.wiener` derives it for whole windows).

    Parameters
    ----------
    covariance : array, shape (C * K, C * K), of standardized clean windows
    look_ahead, radius : int, frames
    n_cosines : int, K

    Returns
    -------
    array, shape (levels, C * K, C)
    """
    n_channels = len(covariance) // n_cosines
    basis = window_basis(n_cosines, radius)
    seen = basis[: radius + 1 + look_ahead]
    # A little on the diagonal: some directions never occur in clean windows.
    precision = np.linalg.inv(covariance + 1e-4 * np.eye(len(covariance)))
    information = np.kron(np.eye(n_channels), seen.T @ seen)
    middle = np.kron(np.eye(n_channels), basis[radius][:, None])  # (C * K, C)
    gains = [
        np.linalg.solve(precision + information / level**2, middle) / level**2 for level in LEVELS
    ]
    return np.array(gains)


def window_basis(n_cosines: int, radius: int) -> FloatArray:
    """Return the first K cosines of the orthonormal DCT, shape (2 * radius + 1, K)."""
    basis: FloatArray = dct(np.eye(2 * radius + 1), norm="ortho")[:, :n_cosines]
    return basis


class RunningBank:
    """The estimates of one stream, frame by frame.

    Parameters
    ----------
    gains : array, shape (levels, C * K, C), see :func:`linear_gains`
    look_ahead, radius : int, frames
    """

    def __init__(self, gains: FloatArray, look_ahead: int, radius: int):
        self.gains = gains
        _, n_cosines, n_channels = gains.shape
        self.look_ahead, self.radius = look_ahead, radius
        self.kernels = kernels(look_ahead)
        basis = window_basis(n_cosines // n_channels, radius)
        self.seen_basis = basis[: radius + 1 + look_ahead]
        rows = np.vstack([self.kernels, np.zeros_like(self.kernels[0])])  # not known for the last
        self.expected = np.array([np.sqrt(((rows[a] - rows[b]) ** 2).sum()) for a, b in PAIRS])
        self.scale, self.noise = RunningScale(n_channels), RunningNoise(n_channels)
        self.averages: list[FloatArray] = []

    def observe(self, frame: FloatArray) -> None:
        """Take note of the newest frame, shape (C,)."""
        self.scale.add(frame)
        self.noise.add(frame)

    def estimate(self, window: FloatArray, middle: int) -> Estimates:
        """Estimate one frame; see :meth:`mocaplab.live.filters.Running.clean`."""
        missing = N_PAST - middle, self.look_ahead + 1 + middle - len(window)
        if any(missing):  # near the ends of the stream, which goes on as it is there
            window = np.pad(window, (missing, (0, 0)), mode="edge")
        noise = self.noise.std
        estimates = np.vstack([self.kernels @ window, self._linear(window, noise)]).T
        return Estimates(estimates, self._clues(estimates, noise), noise)

    def _linear(self, window: FloatArray, noise: FloatArray) -> FloatArray:
        """Return the linear estimate from all channels, shape (C,)."""
        std = np.maximum(self.scale.std, CONSTANT_STD_DEG)
        pose = (window[N_PAST - self.radius :] - self.scale.mean) / std
        projected = (self.seen_basis.T @ pose).T.reshape(-1)
        place = np.interp(np.log(noise / std), np.log(LEVELS), np.arange(len(LEVELS)))
        below = np.minimum(place.astype(int), len(LEVELS) - 2)
        for_levels = np.empty((len(LEVELS), len(std)))
        for level in range(below.min(), below.max() + 2):  # those that a channel needs
            for_levels[level] = projected @ self.gains[level]
        channel, part = np.arange(len(std)), place - below
        low, high = for_levels[below, channel], for_levels[below + 1, channel]
        linear: FloatArray = self.scale.mean + std * ((1 - part) * low + part * high)
        return linear

    def _clues(self, estimates: FloatArray, noise: FloatArray) -> FloatArray:
        """Compare estimates, in units of what noise alone would make of their difference."""
        first, second = np.array(PAIRS).T
        unit = noise[:, None] * self.expected
        apart = (estimates[:, first] - estimates[:, second]) / unit
        squares = np.minimum(apart**2, LARGEST)
        if not self.averages:
            self.averages = [squares] * len(MEMORY)
        self.averages = [
            average + (squares - average) / memory
            for average, memory in zip(self.averages, MEMORY, strict=True)
        ]
        std = np.maximum(self.scale.std, CONSTANT_STD_DEG)
        whole = np.empty((len(noise), 3))
        whole[:, 0] = np.log(noise / std)
        whole[:, 1] = self.look_ahead / 15
        whole[:, 2] = math.log(min(self.scale.n_frames, 600) / 60)  # how well all this is known
        around = [0.5 * np.log(np.maximum(average, 0.05)) for average in self.averages]
        return np.concatenate([np.arcsinh(apart), *around, whole], axis=1)
