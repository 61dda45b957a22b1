"""Predicting motion without learning, and the error of predictions.

Standing still is hard to beat for the next half second: many networks were published that did not
(Martinez et al. 2017, "On human motion prediction using recurrent neural networks"). Quaternions
have shape (..., T, J, 4), in time order.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from mocaplab.euler import wrap_degrees
from mocaplab.motion import FloatArray
from mocaplab.quaternions import as_quaternion, slerp
from mocaplab.rotations import quaternion_to_euler

HORIZONS_MS = (80, 160, 320, 400)
"""How far ahead the field reports its errors: 2, 4, 8 and 10 frames at 25 per second."""


def zero_velocity(past: ArrayLike, n_future: int) -> FloatArray:
    """Predict that the last pose stays, shape (..., n_future, J, 4)."""
    last = _past(past, 1)[..., -1:, :, :]
    return np.repeat(last, n_future, axis=-3)


def constant_velocity(past: ArrayLike, n_future: int) -> FloatArray:
    """Predict that every joint goes on turning as between the last two frames."""
    q = _past(past, 2)
    before, last = q[..., -2:-1, :, :], q[..., -1:, :, :]
    steps = np.arange(2, n_future + 2).reshape(-1, 1)  # frame 1 is the last one
    return slerp(before, last, steps)


def mean_pose_predictor(mean: ArrayLike) -> Callable[[ArrayLike, int], FloatArray]:
    """Return a predictor that always answers with the mean pose of the training clips.

    Parameters
    ----------
    mean : array, shape (J, 4): see :func:`mocaplab.two_sources.segments.mean_pose`
    """
    pose = as_quaternion(mean)

    def predict(past: ArrayLike, n_future: int) -> FloatArray:
        q = _past(past, 1)
        return np.broadcast_to(pose, (*q.shape[:-3], n_future, *pose.shape)).copy()

    return predict


def prediction_error_rad(predicted: ArrayLike, truth: ArrayLike, order: str) -> FloatArray:
    """Absolute difference of Euler angles, wrapped to half a turn, summed over joints.

    This is paper B's Eq. 2 for every frame; there, the mean is then taken over frames.

    Parameters
    ----------
    predicted, truth : arrays, shape (..., T, J, 4), unit quaternions
    order : str, the Euler order, such as ``"ZYX"``

    Returns
    -------
    array, shape (..., T), radians
    """
    angles = [quaternion_to_euler(q, order) for q in (predicted, truth)]
    difference: FloatArray = np.radians(np.abs(wrap_degrees(angles[0] - angles[1])))
    total: FloatArray = difference.sum(axis=(-2, -1))
    return total


def horizon_frames(fps: float) -> dict[int, int]:
    """Tell which predicted frame, counted from 0, shows each of ``HORIZONS_MS``.

    Raises
    ------
    ValueError
        If one lies between two frames.
    """
    frames = {ms: ms * fps / 1000 for ms in HORIZONS_MS}
    for ms, frame in frames.items():
        if abs(frame - round(frame)) > 1e-6:
            raise ValueError(f"{ms} ms lies between two frames at {fps:g} frames per second")
    return {ms: round(frame) - 1 for ms, frame in frames.items()}


def _past(past: ArrayLike, least: int) -> FloatArray:
    q = as_quaternion(past)
    if q.ndim < 3 or q.shape[-3] < least:
        raise ValueError(
            f"expected past frames of shape (..., {least} or more, J, 4), got {q.shape}"
        )
    return q
