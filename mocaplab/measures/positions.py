"""How far the joints of a motion are from the clean ones, in centimetres and seconds.

Angles hide what an eye sees: one degree at the hip moves the foot by more than one degree at
the ankle does. Positions are in the world, in file units; ``cm_per_unit`` is the number of
centimetres in one (:func:`mocaplab.skeletons.units.cm_per_unit`). The root is clean, so nothing is
moved to a common root first.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from mocaplab.kinematics import forward_kinematics
from mocaplab.measures.angles import check_complete, check_pair
from mocaplab.measures.movement import bone_lengths
from mocaplab.motion import FloatArray, Motion
from mocaplab.quaternions import as_shape

STEP_S = 1 / 30
"""Speeds, accelerations and jerks are taken over this time, in seconds: a frame of most
of the field's data."""
RESTING_CM_S = 1e-6
"""A clip whose fastest joint is slower than this has no peak speed to lose."""


def mpjpe_cm(motion: Motion, clean: Motion, *, cm_per_unit: float) -> float:
    """Mean distance between joints and where they should be (MPJPE).

    The mean is over frames and all joints, the root among them; no End Sites (Ionescu et al.
    2014, "Human3.6M").

    Parameters
    ----------
    motion, clean : Motion
        Of one skeleton, length and frame time, without gaps; ValueError otherwise.
    cm_per_unit : float, centimetres in one file unit

    Returns
    -------
    float, centimetres
    """
    positions, truth = _positions_cm(motion, clean, cm_per_unit)
    return float(np.linalg.norm(positions - truth, axis=-1).mean())


def pa_mpjpe_cm(motion: Motion, clean: Motion, *, cm_per_unit: float) -> float:
    """Mean distance between joints after each pose was laid over the clean one (PA-MPJPE).

    As the field does it, each frame by itself is moved, turned and scaled to fit best
    (:func:`procrustes_align`). What is left is the error of the pose's form; a slow drift, a
    lean of the whole body, and trembling of the whole body are not seen. Otherwise as
    :func:`mpjpe_cm`.
    """
    positions, truth = _positions_cm(motion, clean, cm_per_unit)
    return float(np.linalg.norm(procrustes_align(positions, truth) - truth, axis=-1).mean())


def _positions_cm(
    motion: Motion, clean: Motion, cm_per_unit: float
) -> tuple[FloatArray, FloatArray]:
    check_pair(motion, clean)
    positions, truth = forward_kinematics(motion)[0], forward_kinematics(clean)[0]
    return positions * cm_per_unit, truth * cm_per_unit


def procrustes_align(points: ArrayLike, reference: ArrayLike) -> FloatArray:
    """Move, turn and scale clouds of points so that they fit others best.

    The squared distances are the least possible. Mirror images are not allowed: a left hand
    does not fit a right one (Umeyama 1991, "Least-squares estimation of transformation
    parameters").

    Parameters
    ----------
    points, reference : array, shape (..., J, 3)
        Point j belongs to reference point j. Each cloud is fitted by itself.

    Returns
    -------
    array, shape (..., J, 3); all in the reference's centre if the points all coincide
    """
    x, y = (as_shape(each, (3,), "points") for each in (points, reference))
    if x.shape != y.shape or x.ndim < 2:
        raise ValueError(f"expected two arrays of one shape (..., J, 3), got {x.shape}, {y.shape}")
    centre = y.mean(axis=-2, keepdims=True)
    x = x - x.mean(axis=-2, keepdims=True)
    u, stretch, vt = np.linalg.svd(np.swapaxes(x, -1, -2) @ (y - centre))
    turn_only = np.sign(np.linalg.det(u @ vt))  # -1: the best fit would be a mirror image,
    stretch[..., 2] *= turn_only  # so give up the axis along which least is lost
    u[..., 2] *= turn_only[..., None]
    size = np.sum(x * x, axis=(-1, -2))
    scale = stretch.sum(axis=-1) / np.where(size > 0, size, 1.0)
    fitted: FloatArray = scale[..., None, None] * (x @ (u @ vt)) + centre
    return fitted


def derivative(points: ArrayLike, order: int, frame_time: float) -> FloatArray:
    """Differences over ``STEP_S``, once for velocity, twice for acceleration, thrice for jerk.

    Differences from frame to frame blow up what trembles in a single frame, 16 times as much
    at 120 frames per second as at 30 for an acceleration. Real clips tremble, at the root too,
    which no cleaner touches; over longer steps the errors of the cleaners come out, and
    recordings of both rates agree.

    Parameters
    ----------
    points : array, shape (T, ...)
    order : int, how many times
    frame_time : float, seconds

    Returns
    -------
    array, shape (T - order * step, ...), units of the points per second to the ``order``
        A step is the number of frames nearest to ``STEP_S``, at least 1.

    Raises
    ------
    ValueError
        If there are not more than ``order`` steps.
    """
    change = np.asarray(points, dtype=np.float64)
    step = max(1, round(STEP_S / frame_time))
    if len(change) <= order * step:
        raise ValueError(f"expected at least {order * step + 1} frames, got {len(change)}")
    for _ in range(order):
        change = change[step:] - change[:-step]
    return change / (step * frame_time) ** order


def acceleration_error_cm_s2(motion: Motion, clean: Motion, *, cm_per_unit: float) -> float:
    """Mean distance between the accelerations of joints and those they should have.

    It sees trembling, which hardly moves a joint. The mean is over frames and all joints
    (Kanazawa et al. 2019, "Learning 3D human dynamics from video"). Accelerations are taken
    over steps of ``STEP_S``: see :func:`derivative`.

    Parameters
    ----------
    motion, clean : Motion
        As for :func:`mpjpe_cm`; longer than two steps, ValueError otherwise.
    cm_per_unit : float

    Returns
    -------
    float, centimetres per second squared
    """
    positions, truth = _positions_cm(motion, clean, cm_per_unit)
    error = derivative(positions - truth, 2, clean.frame_time)
    return float(np.linalg.norm(error, axis=-1).mean())


def jitter_cm_s3(motion: Motion, *, cm_per_unit: float) -> float:
    """Mean jerk of the joints, over steps of ``STEP_S`` (:func:`derivative`).

    It needs no clean motion, and nearer to 0 is not always better: a value below that of
    the clean motion means too much smoothing. :func:`mocaplab.measures.movement.jitter` is the same
    from frame to frame, and in file units.

    Parameters
    ----------
    motion : Motion without gaps, longer than three steps; ValueError otherwise
    cm_per_unit : float, centimetres in one file unit

    Returns
    -------
    float, centimetres per second cubed
    """
    check_complete(motion)
    jerk = derivative(forward_kinematics(motion)[0], 3, motion.frame_time)
    return float(np.linalg.norm(jerk, axis=-1).mean() * cm_per_unit)


def peak_speed_loss_percent(motion: Motion, clean: Motion, *, cm_per_unit: float) -> float:
    """Share of the clean peak speed that is lost at the fastest joint.

    Smoothing takes the force out of kicks and jumps. The joint is the one with the highest
    speed, in the world, that any joint reaches in the clean motion; its own highest speed in
    the other motion, whenever that is, is what is left: 100 * (1 - left / clean). Speeds are
    taken over ``STEP_S``, or else the peak would be one bad frame (:func:`derivative`).

    Parameters
    ----------
    motion, clean : Motion
        As for :func:`mpjpe_cm`; longer than one step, ValueError otherwise.
    cm_per_unit : float

    Returns
    -------
    float, percent
        Below 0 if the peak grew, as noise makes it; NaN if the clean motion does not move,
        for then there is no speed to lose.
    """
    left, peak = (
        np.linalg.norm(derivative(each, 1, clean.frame_time), axis=-1).max(axis=0)
        for each in _positions_cm(motion, clean, cm_per_unit)
    )
    fastest = int(np.argmax(peak))
    if peak[fastest] < RESTING_CM_S:
        return np.nan
    return float(100 * (1 - left[fastest] / peak[fastest]))


def bone_length_change_percent(
    positions: ArrayLike, clean_positions: ArrayLike, parents: ArrayLike
) -> float:
    """Mean change of the length of bones, as a share of their clean length.

    For positions that were measured or filtered as points; angles keep every length. The
    mean is over frames and bones. Bones that have no length are left out: some joints lie on
    their parents.

    Parameters
    ----------
    positions, clean_positions : array, shape (T, J, 3)
    parents : array, shape (J,); -1 for the root

    Returns
    -------
    float, percent; NaN if there is no bone
    """
    if np.shape(positions) != np.shape(clean_positions):
        raise ValueError(
            f"expected positions of shape {np.shape(clean_positions)}, as the clean ones, got "
            f"{np.shape(positions)}"
        )
    lengths, truth = bone_lengths(positions, parents), bone_lengths(clean_positions, parents)
    bones = truth > 1e-9 * truth.max(initial=0)
    if not bones.any():
        return np.nan
    return float(100 * np.mean(np.abs(lengths[bones] - truth[bones]) / truth[bones]))
