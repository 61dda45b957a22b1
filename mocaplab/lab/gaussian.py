"""The Gaussian of the lab: any width and any look-ahead, and the errors of all of them at once."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mocaplab.filters import GaussianDenoiser, Smoother, gaussian_filter
from mocaplab.live.filters import LiveGaussian, whole_frames
from mocaplab.motion import FloatArray
from mocaplab.tuning import SIGMA_GRID_S

WIDTHS_S = SIGMA_GRID_S[(SIGMA_GRID_S >= 0.002) & (SIGMA_GRID_S <= 0.16)]
"""The widths that the lab offers, in seconds; at 120 frames a second the narrowest one leaves
a clip nearly as it is."""
LOOK_AHEADS_S = (0.0, 1 / 120, 1 / 60, 1 / 30, 1 / 15, 1 / 8, 1 / 4, None)
"""How far into the future the Gaussian may look, in seconds; None: as far as it reaches."""


def gaussian(sigma_s: float, look_ahead_s: float | None = None) -> Smoother:
    """Return the library's Gaussian of this width and look-ahead, seconds; None cuts nothing."""
    if look_ahead_s is None:
        return GaussianDenoiser(sigma_s)
    return LiveGaussian(sigma_s, look_ahead_s)


def squared_error_table(values: FloatArray, clean: FloatArray, frame_time: float) -> FloatArray:
    """Measure the Gaussian at every look-ahead and every width, with little work.

    Filtering at one width after the other with each look-ahead would take seconds. But a
    window that reaches further into the future only adds samples to one that reaches less
    far, so one way through the window meets all look-aheads.

    Parameters
    ----------
    values, clean : arrays, shape (T, C), degrees; values without gaps
    frame_time : float, seconds

    Returns
    -------
    array, shape (look-aheads, widths, C), squared degrees, the mean over frames
        For ``LOOK_AHEADS_S`` and ``WIDTHS_S``.
    """
    ahead = [whole_frames(s, frame_time) for s in LOOK_AHEADS_S if s is not None]
    table = np.empty((len(LOOK_AHEADS_S), len(WIDTHS_S), values.shape[1]))
    for column, sigma_s in enumerate(WIDTHS_S):
        smooth = [*_at_each_cut(values, sigma_s / frame_time, ahead)]
        smooth.append(gaussian_filter(values, sigma_s, frame_time))
        for row, result in enumerate(smooth):
            table[row, column] = np.mean((result - clean) ** 2, axis=0)
    return table


def _at_each_cut(values: FloatArray, sigma: float, ahead: list[int]) -> Iterator[FloatArray]:
    """Yield the smoothed values for each look-ahead; all numbers are frames, ahead rises."""
    radius = int(np.ceil(4 * sigma))
    samples = np.column_stack([values, np.ones(len(values))])  # the last column counts weights
    padded = np.pad(samples, ((radius, max(ahead)), (0, 0)))
    total = np.zeros_like(samples)
    next_tap = -radius
    for cut in ahead:
        for tap in range(next_tap, cut + 1):
            weight = np.exp(-0.5 * (tap / sigma) ** 2)
            if weight > 1e-15:  # less would not change a sum of 16 digits
                total += weight * padded[radius + tap : radius + tap + len(samples)]
        next_tap = cut + 1
        yield total[:, :-1] / total[:, -1:]
