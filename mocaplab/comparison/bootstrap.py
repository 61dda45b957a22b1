"""Intervals that say how much a mean over test clips would change with other clips.

The clips are drawn again with replacement, many times, and the same draw serves every
method (a paired bootstrap): what makes a clip hard for one method makes it hard for the
others too, and drops out of their difference and their ratio.

The ends are percentiles (Efron and Tibshirani 1993, chapter 13). On few clips such intervals
are somewhat too short. In simulated data, those of 95 % held the true mean of a normal
distribution 95 times in 100 with 50 clips and 91 times with 10; of a log-normal one, in which
few clips have most of the error, 89 and 80 times.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from mocaplab.motion import FloatArray

RESAMPLES = 10_000


class Interval(NamedTuple):
    """An estimate and the ends of its interval; NaN where there is nothing to average."""

    value: float
    low: float
    high: float

    def excludes(self, value: float) -> bool:
        """Tell whether a value lies outside; False if the ends are NaN."""
        return bool(self.low > value or self.high < value)


def resampled_means(
    values: ArrayLike, *, rng: np.random.Generator, resamples: int = RESAMPLES
) -> FloatArray:
    """Draw the clips anew and return the mean of every method for each draw.

    Parameters
    ----------
    values : array, shape (methods, clips), no NaN
    rng : numpy.random.Generator
    resamples : int

    Returns
    -------
    array, shape (methods, resamples)

    Raises
    ------
    ValueError
        If there is no clip, or a value is NaN.
    """
    table = np.asarray(values, dtype=np.float64)
    if table.ndim != 2 or table.shape[1] == 0:
        raise ValueError(f"expected values of shape (methods, clips), got {table.shape}")
    if np.isnan(table).any():
        method, clip = np.argwhere(np.isnan(table))[0]
        raise ValueError(f"expected numbers, got NaN for method {method}, clip {clip}")
    n = table.shape[1]
    # How often each clip comes in each draw, the same for all methods; bincount counts all
    # draws at once, as if clip i of draw j were number j * n + i.
    drawn = rng.integers(n, size=(resamples, n)) + n * np.arange(resamples)[:, None]
    counts = np.bincount(drawn.ravel(), minlength=resamples * n).reshape(resamples, n)
    means: FloatArray = table @ counts.T / n
    return means


def percentile_interval(value: float, draws: FloatArray, confidence: float = 0.95) -> Interval:
    """Return a value with the percentiles of what the draws made of it.

    Parameters
    ----------
    value : float, of all clips
    draws : array, shape (resamples,)
    confidence : float between 0 and 1
    """
    if not 0 < confidence < 1:
        raise ValueError(f"the confidence must lie between 0 and 1, got {confidence}")
    tail = 50 * (1 - confidence)
    low, high = np.percentile(draws, [tail, 100 - tail])
    return Interval(float(value), float(low), float(high))


def mean_intervals(
    values: ArrayLike,
    *,
    rng: np.random.Generator,
    confidence: float = 0.95,
    resamples: int = RESAMPLES,
) -> list[Interval]:
    """Estimate the mean of every method.

    Parameters
    ----------
    values : array, shape (methods, clips)
    rng, confidence, resamples : see :func:`resampled_means`, :func:`percentile_interval`

    Returns
    -------
    list of Interval, one a method
    """
    table = np.asarray(values, dtype=np.float64)
    means = resampled_means(table, rng=rng, resamples=resamples)
    pairs = zip(table.mean(axis=1), means, strict=True)
    return [percentile_interval(value, draws, confidence) for value, draws in pairs]


def paired_interval(
    values: ArrayLike,
    baseline: ArrayLike,
    *,
    how: str,
    rng: np.random.Generator,
    confidence: float = 0.95,
    resamples: int = RESAMPLES,
) -> Interval:
    """Estimate how a method compares with a baseline on the same clips.

    Parameters
    ----------
    values, baseline : array, shape (clips,), in one order
    how : "difference" or "ratio"
        Of the two means: values - baseline, or values / baseline.
    rng, confidence, resamples : see :func:`resampled_means`, :func:`percentile_interval`

    Returns
    -------
    Interval
        NaN for a ratio to a baseline of 0.

    Raises
    ------
    ValueError
        If the lengths differ, or ``how`` is something else.
    """
    if how not in ("difference", "ratio"):
        raise ValueError(f"expected 'difference' or 'ratio', got {how!r}")
    if np.shape(values) != np.shape(baseline):
        raise ValueError(
            f"expected one value a clip for both, got shapes {np.shape(values)} and "
            f"{np.shape(baseline)}"
        )
    table = np.array([values, baseline], dtype=np.float64)
    ours, theirs = resampled_means(table, rng=rng, resamples=resamples)
    mean, base = table.mean(axis=1)
    if how == "difference":
        return percentile_interval(mean - base, ours - theirs, confidence)
    if not (theirs > 0).all():
        return Interval(np.nan, np.nan, np.nan)
    return percentile_interval(mean / base, ours / theirs, confidence)
