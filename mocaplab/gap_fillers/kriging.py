"""Kriging: interpolate a signal from its samples around a gap, with the variance of the error.

A signal with mean 0 whose samples h seconds apart have the covariance K(h) is best estimated
from samples x_o, observed with noise of variance n, by

    K_qo (K_oo + n I)^-1 x_o,   with the error variance  K(0) - K_qo (K_oo + n I)^-1 K_oq

(Gaussian process regression; geostatistics calls it simple kriging). Without noise the curve
goes through all observed samples, so a filled gap meets both its ends; between them it bends as
smoothly as K says; far from any sample it returns to 0 and the variance to K(0).

K is a mixture of Matern functions of fixed widths. How much of each is in a signal is read from
how far it moves within a frame, two, four, up to 0.7 s (:class:`Smoothness`).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from mocaplab.gap_fillers.filled import mean_squared_increments
from mocaplab.motion import BoolArray, FloatArray

WIDTHS_S = np.array([0.02, 0.05, 0.12, 0.3, 0.8])
"""Widths of the Matern functions, seconds."""
LAGS_S = np.geomspace(1 / 120, 0.72, 14)
"""Increments are compared over these times."""
LEAST_SHARE = 1e-5
"""No increment is taken for less than this share of a signal's variance."""
TRUST = 10.0
"""As many samples as the variance from the whole clip is worth, against those at a gap."""


def matern(lag_s: FloatArray) -> FloatArray:
    """Return the correlation at a lag for each of ``WIDTHS_S``, shape (..., 5): Matern 5/2."""
    a = np.sqrt(5.0) * np.abs(lag_s)[..., None] / WIDTHS_S
    return np.asarray((1 + a + a**2 / 3) * np.exp(-a))


@dataclass(frozen=True, eq=False)
class Smoothness:
    """The shares of the Matern functions in a signal; together 1.

    Parameters
    ----------
    shares : array, shape (5,), 0 or more
    """

    shares: FloatArray

    def correlation(self, lag_s: FloatArray) -> FloatArray:
        """Return the correlation of samples so many seconds apart."""
        return matern(lag_s) @ self.shares

    @classmethod
    def fit(cls, increments: FloatArray, lags_s: FloatArray) -> Smoothness:
        """Find the shares whose increments come nearest, by their ratio, to measured ones.

        Parameters
        ----------
        increments : array, shape (L,): half the mean squared increment, per variance
        lags_s : array, shape (L,), seconds
        """
        from scipy.optimize import nnls

        model = 1.0 - matern(lags_s)
        shares = nnls(model / increments[:, None], np.ones(len(lags_s)))[0] + LEAST_SHARE
        shares[-1] += max(0.0, 1.0 - shares.sum())  # what moves even more slowly
        return cls(shares / shares.sum())


def relative_increments(
    values: FloatArray, noise: FloatArray, frame_time: float
) -> tuple[FloatArray, FloatArray]:
    """Measure how far signals of unlike size move within short times, a typical one of them.

    Parameters
    ----------
    values : array, shape (T, N), around 0; NaN where not observed
    noise : array, shape (N,), standard deviation of the noise
    frame_time : float, seconds

    Returns
    -------
    increments : array, shape (L,)
        Half the mean squared increment without noise, as a share of the variance; the geometric
        mean over the signals that are not mostly noise. Empty if there is none.
    lags_s : array, shape (L,), seconds
    """
    lags = np.unique(np.round(LAGS_S / frame_time).astype(int))
    lags = lags[(lags > 0) & (lags < len(values))]
    power = variances(values, noise)
    clear = power > 4 * noise**2
    if not clear.any() or not len(lags):
        return np.zeros(0), np.zeros(0)
    half = mean_squared_increments(values)[lags] / 2 - noise**2
    logarithm = np.log(np.maximum(half / power, LEAST_SHARE))[:, clear].mean(axis=1)
    return np.exp(logarithm), lags * frame_time


def variances(values: FloatArray, noise: FloatArray) -> FloatArray:
    """Return the mean square of each signal without its noise, shape (N,), above 0."""
    observed = ~np.isnan(values)
    square = np.where(observed, values, 0.0) ** 2
    mean = square.sum(axis=0) / np.maximum(observed.sum(axis=0), 1)
    return np.asarray(np.maximum(mean - noise**2, LEAST_SHARE))


def krige(
    values: FloatArray,
    times_s: FloatArray,
    wanted_s: FloatArray,
    smoothness: Smoothness,
    noise: float,
    sizes: tuple[FloatArray, FloatArray],
) -> tuple[FloatArray, FloatArray]:
    """Estimate a signal with mean 0 at some times from its samples at others.

    The variance is corrected by how large the samples are against what was expected of them
    (a Student-t process; Shah, Wilson and Ghahramani 2014): a clip has quiet and violent moments.

    Parameters
    ----------
    values : array, shape (O,), observed at times_s, shape (O,), seconds
    wanted_s : array, shape (Q,), seconds
    smoothness : Smoothness
    noise : float, standard deviation
    sizes : the standard deviations of the signal, shapes (O,) and (Q,)

    Returns
    -------
    estimate, variance : arrays, shape (Q,)
    """
    size, wanted_size = sizes
    if not len(values):
        return np.zeros(len(wanted_s)), wanted_size**2
    between = smoothness.correlation(times_s[:, None] - times_s) * np.outer(size, size)
    across = smoothness.correlation(wanted_s[:, None] - times_s) * np.outer(wanted_size, size)
    # A millionth keeps the matrix from being singular where there is no noise.
    between += np.diag(noise**2 + 1e-6 * size**2)
    solved = np.linalg.solve(between, np.column_stack([values, across.T]))
    surprise = (TRUST + values @ solved[:, 0]) / (TRUST + len(values))
    variance = wanted_size**2 - np.sum(across * solved[:, 1:].T, axis=1)
    return across @ solved[:, 0], np.maximum(variance, 1e-8 * wanted_size**2) * surprise


def runs(hidden: BoolArray) -> Iterator[tuple[int, int]]:
    """Yield the first frame of each gap, and the frame after its last; hidden has shape (T,)."""
    steps = np.diff(hidden.astype(np.int8), prepend=np.int8(0), append=np.int8(0))
    yield from zip(np.flatnonzero(steps == 1), np.flatnonzero(steps == -1), strict=True)
