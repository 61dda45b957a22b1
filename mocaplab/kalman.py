"""A Kalman smoother: movement with constant acceleration, but for random jerk.

Each channel is filtered forwards in time and smoothed backwards. To the model, a gap is some
frames without a measurement, and it can go on through it (:func:`kalman_smooth`). It does so well
for a tenth of a second. But it believes that acceleration goes on, so it swings far out in longer
gaps, further than a straight line is wrong. So :class:`KalmanSmoother` runs over straight lines.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from mocaplab.cosine_windows import estimate_noise_std
from mocaplab.filters import Smoother
from mocaplab.motion import CONSTANT_STD_DEG, BoolArray, Corrupted, FloatArray
from mocaplab.tuning import tune, tune_per_channel

JERK_GRID = np.geomspace(1e4, 1e16, 25)
"""The jerk densities that tuning tries, degrees² / second⁵. The largest smooth nothing."""

# State of a channel: angle, velocity and acceleration per frame (not per second), in units of
# the measurement noise. So numbers stay of one size, whatever the channel and the frame rate.
TRANSITION = np.array([[1.0, 1.0, 0.5], [0.0, 1.0, 1.0], [0.0, 0.0, 1.0]])
JERK_COVARIANCE = np.array([[1 / 20, 1 / 8, 1 / 6], [1 / 8, 1 / 3, 1 / 2], [1 / 6, 1 / 2, 1.0]])
"""What white jerk of density 1 adds to the state's covariance in a frame."""
START_VARIANCE = 1e4
"""Next to nothing is known about the state before the first measurement."""


def kalman_smooth(
    values: FloatArray, jerk_density: ArrayLike, variance: FloatArray, frame_time: float
) -> FloatArray:
    """Find the most likely course of each channel, given all its samples.

    The answer is that of Rauch, Tung and Striebel 1965. It is computed by the backward
    recursion of Bryson and Frazier, which needs no inverse of a matrix (Durbin and Koopman
    2012, "Time Series Analysis by State Space Methods", section 4.4). In the limit of small
    frames it is the quintic smoothing spline known from biomechanics (Woltring 1986).

    Parameters
    ----------
    values : array, shape (T, C), degrees; NaN where nothing was observed
    jerk_density : float or array, shape (C,), degrees² / second⁵
        Spectral density of the random jerk: more of it follows faster movement.
    variance : array, shape (C,), squared degrees
        Of the measurement noise.
    frame_time : float, seconds

    Returns
    -------
    array, shape (T, C), degrees
    """
    n_frames, n_channels = values.shape
    seen = ~np.isnan(values)
    unit = np.sqrt(variance)
    start = np.take_along_axis(values, np.argmax(seen, axis=0)[None], axis=0)
    measured = np.where(seen, (values - start) / unit, 0.0)
    # Channels come last. A covariance is 9 numbers: F P F' is one product for all channels.
    propagate = np.kron(TRANSITION, TRANSITION)
    added = np.outer(JERK_COVARIANCE, np.asarray(jerk_density) * frame_time**5 / variance)

    state = np.zeros((3, n_channels))
    covariance = np.tile(START_VARIANCE * np.eye(3).reshape(9, 1), n_channels)
    predicted = np.empty((n_frames, n_channels))
    reach = np.empty((n_frames, 3, n_channels))  # covariance of the angle with the state
    gain = np.empty((n_frames, 3, n_channels))
    surprise = np.empty((n_frames, n_channels))  # innovation over its variance
    for t in range(n_frames):
        predicted[t], reach[t] = state[0], covariance[:3]
        weight = seen[t] / (reach[t, 0] + 1.0)  # 0 where there is no measurement
        gain[t] = reach[t] * weight
        innovation = measured[t] - predicted[t]
        surprise[t] = weight * innovation
        state = TRANSITION @ (state + gain[t] * innovation)
        covariance -= (gain[t][:, None] * reach[t]).reshape(9, n_channels)
        covariance = propagate @ covariance + added

    smoothed = np.empty((n_frames, n_channels))
    later = np.zeros((3, n_channels))  # what all later measurements say about the state
    for t in reversed(range(n_frames)):
        later = TRANSITION.T @ later
        later[0] += surprise[t] - np.sum(gain[t] * later, axis=0)
        smoothed[t] = predicted[t] + np.sum(reach[t] * later, axis=0)
    return smoothed * unit + start


class KalmanSmoother(Smoother):
    """A constant-acceleration Kalman smoother for each channel, driven by white jerk.

    Only the jerk is tuned. The measurement noise is estimated from each observed clip, by
    its third differences (:func:`mocaplab.cosine_windows.estimate_noise_std`), so a noisier
    clip is smoothed more. It is ``CONSTANT_STD_DEG`` at least, also where no four samples in a
    row were observed. What was filled into gaps counts as observed: see the top of this file.

    Parameters
    ----------
    jerk_density : float or array, shape (C,), degrees² / second⁵

    Raises
    ------
    ValueError
        If a density is not positive, or (when it smooths) there is not one a channel.
    """

    def __init__(self, jerk_density: ArrayLike):
        self.jerk_density = np.asarray(jerk_density, dtype=np.float64)
        if not (np.isfinite(self.jerk_density).all() and (self.jerk_density > 0).all()):
            raise ValueError(f"jerk_density must be positive numbers, got {self.jerk_density}")

    def smooth(self, values: FloatArray, mask: BoolArray, frame_time: float) -> FloatArray:
        """Return the smoothed channels; see :meth:`mocaplab.filters.Smoother.smooth`."""
        if self.jerk_density.shape not in [(), values.shape[1:]]:
            raise ValueError(f"tuned for {self.jerk_density.size} channels, got {values.shape[1]}")
        noise_std = np.maximum(estimate_noise_std(values, mask), CONSTANT_STD_DEG)
        return kalman_smooth(values, self.jerk_density, noise_std**2, frame_time)


def fit_kalman(clips: Sequence[Corrupted], *, per_channel: bool = False) -> KalmanSmoother:
    """Tune the jerk density of a Kalman smoother on training clips."""
    candidates = [KalmanSmoother(density) for density in JERK_GRID]
    if per_channel:  # one recursion for all channels is faster than one for each density
        return KalmanSmoother(JERK_GRID[list(tune_per_channel(candidates, clips).choice)])
    return tune(candidates, clips)
