"""What positions over time tell: speeds, lengths, trembling, and which foot stands.

Lengths are in file units, and so speeds in file units per second. Only what compares with
centimetres asks how long a unit is; in CMU's files it is ``CM_PER_UNIT``.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from mocaplab.kinematics import forward_kinematics, local_transforms
from mocaplab.motion import BoolArray, FloatArray, Motion
from mocaplab.motion_model import CM_PER_UNIT
from mocaplab.rotations import matrix_to_rotation_vector

_BLOCK = 4096  # frames


def velocities(positions: ArrayLike, frame_time: float) -> FloatArray:
    """Velocity of points, by central differences.

    The first and the last frame have a neighbour on one side only; there, the slope of the
    parabola through the three frames at that end is taken. So a path that is a parabola in
    time has its exact velocity in every frame.

    Parameters
    ----------
    positions : array, shape (T, ...), T at least 3; NaN spreads to the neighbours
    frame_time : float, seconds

    Returns
    -------
    array, shape (T, ...), units of the positions per second

    Raises
    ------
    ValueError
        For fewer than three frames.
    """
    points = _at_least_three(positions)
    velocity = np.empty_like(points)
    velocity[1:-1] = points[2:] - points[:-2]
    velocity[0] = 4 * points[1] - 3 * points[0] - points[2]
    velocity[-1] = 3 * points[-1] - 4 * points[-2] + points[-3]
    return velocity / (2 * frame_time)


def accelerations(positions: ArrayLike, frame_time: float) -> FloatArray:
    """Acceleration of points, by central differences.

    The first and the last frame repeat their neighbour. A path that is a parabola in time
    has its exact acceleration in every frame; one that is a cubic, in all but these two.

    Parameters
    ----------
    positions : array, shape (T, ...), T at least 3; NaN spreads to the neighbours
    frame_time : float, seconds

    Returns
    -------
    array, shape (T, ...), units of the positions per second squared

    Raises
    ------
    ValueError
        For fewer than three frames.
    """
    points = _at_least_three(positions)
    acceleration = np.diff(points, n=2, axis=0) / frame_time**2
    return np.concatenate([acceleration[:1], acceleration, acceleration[-1:]])


def _at_least_three(positions: ArrayLike) -> FloatArray:
    points = np.asarray(positions, dtype=np.float64)
    if points.ndim == 0 or len(points) < 3:
        raise ValueError(f"expected positions of at least 3 frames, got shape {points.shape}")
    return points


def bone_lengths(positions: ArrayLike, parents: ArrayLike) -> FloatArray:
    """Distance of every joint from its parent.

    Angles keep these lengths; positions that were measured, or made noisy, do not. How much
    they vary tells how bad a positional recording is.

    Parameters
    ----------
    positions : array, shape (..., J, 3)
    parents : array, shape (J,); -1 for the root

    Returns
    -------
    array, shape (..., J), units of the positions; 0 for the root

    Raises
    ------
    ValueError
        If the shapes do not fit each other.
    """
    points, upper = np.asarray(positions, dtype=np.float64), np.asarray(parents)
    if points.shape[-2:] != (*upper.shape, 3):
        raise ValueError(
            f"expected positions of shape (..., J, 3) and parents of shape (J,), got "
            f"{points.shape} and {upper.shape}"
        )
    lengths: FloatArray = np.linalg.norm(points - points[..., upper, :], axis=-1)
    lengths[..., upper < 0] = 0.0
    return lengths


def root_angular_velocity(motion: Motion) -> FloatArray:
    """How fast the root turns, in its own axes.

    Paper A feeds these three numbers to its networks in place of the root's angles,
    so that the heading of a motion does not matter.

    Returns
    -------
    array, shape (T, 3), radians per second; the last frame repeats the one before
    """
    rotations = local_transforms(motion)[1][:, 0]
    if motion.n_frames == 1:
        return np.zeros((1, 3))
    turns = np.swapaxes(rotations[:-1], -1, -2) @ rotations[1:]
    velocity = matrix_to_rotation_vector(turns) / motion.frame_time
    return np.concatenate([velocity, velocity[-1:]])


def jitter(motion: Motion) -> float:
    """Mean jerk of the joints: how much a motion trembles.

    Jerk is the third derivative of position, here taken by differences, so it grows
    with frame rate and noise. Compare a motion only with itself, before and after.

    Returns
    -------
    float, file length units per second cubed; 0 for fewer than four frames
    """
    n_jerks = motion.n_frames - 3
    if n_jerks < 1:
        return 0.0
    total = 0.0
    for start in range(0, n_jerks, _BLOCK):  # a long clip takes no more memory than a short one
        block = motion.slice_frames(start, start + _BLOCK + 3)
        positions, _ = forward_kinematics(block)
        jerk = np.diff(positions, n=3, axis=0) / motion.frame_time**3
        total += float(np.linalg.norm(jerk, axis=-1).mean(axis=1).sum())
    return total / n_jerks


def foot_points(motion: Motion) -> FloatArray:
    """Positions of the ankle, the ball and the toe tip of both feet.

    Parameters
    ----------
    motion : Motion
        On a skeleton with joints LeftToeBase and RightToeBase (the balls of the feet),
        each with an End Site, as CMU's have.

    Returns
    -------
    array, shape (T, 2, 3, 3), file length units
        Left and right foot; ankle, ball, tip; x, y, z.

    Raises
    ------
    ValueError
        If the skeleton has no such joints.
    """
    skeleton = motion.skeleton
    positions, orientations = forward_kinematics(motion)
    feet = []
    for name in ("LeftToeBase", "RightToeBase"):
        ball = skeleton.joint_names.index(name) if name in skeleton.joint_names else -1
        sites = np.flatnonzero(skeleton.end_site_parents == ball)
        if len(sites) == 0:
            raise ValueError(f"expected a joint {name} with an End Site in motion {motion.name!r}")
        ankle = skeleton.parents[ball]
        tip = positions[:, ball] + orientations[:, ball] @ skeleton.end_site_offsets[sites[0]]
        feet.append(np.stack([positions[:, ankle], positions[:, ball], tip], axis=1))
    return np.stack(feet, axis=1)


def foot_heights(motion: Motion) -> FloatArray:
    """Height of the lowest point of each foot; the floor is not subtracted.

    Returns
    -------
    array, shape (T, 2), file length units
        Left and right foot.
    """
    return np.asarray(foot_points(motion)[..., 1].min(axis=-1))


def foot_contacts(
    motion: Motion,
    *,
    max_height_cm: float = 6.0,
    max_speed_cm_s: float = 80.0,
    cm_per_unit: float = CM_PER_UNIT,
    floor: float | None = None,
) -> BoolArray:
    """Tell when each foot stands: the ball or the tip of the foot is low, and slow.

    Parameters
    ----------
    motion : Motion, of at least 3 frames
        On a skeleton as :func:`foot_points` needs it.
    max_height_cm : float, centimetres above the floor
        With both defaults the feet of CMU's walks stand 50 to 70 % of the time, as those of
        walkers do (about 60 %), and nearly always one of them does.
    max_speed_cm_s : float, centimetres per second, in any direction
    cm_per_unit : float, centimetres in one file unit; 1 for files in centimetres
    floor : float, file length units, optional
        Height of the floor. By default the height below which the lower foot is in a
        twentieth of all frames: lower still is noise.

    Returns
    -------
    array, shape (T, 2), bool
        Left and right foot.

    Raises
    ------
    ValueError
        If the skeleton has no feet, there are fewer than three frames, or a sample is NaN.
    """
    if np.isnan(motion.channels).any():
        raise ValueError(f"motion {motion.name!r} has gaps (NaN); fill them first")
    points = foot_points(motion)[:, :, 1:]  # (T, 2, 2, 3): the heel leaves the floor first
    speed_cm_s = np.linalg.norm(velocities(points, motion.frame_time), axis=-1) * cm_per_unit
    if floor is None:
        floor = float(np.percentile(foot_heights(motion).min(axis=1), 5))
    height_cm = (points[..., 1] - floor) * cm_per_unit
    stands = (height_cm <= max_height_cm) & (speed_cm_s <= max_speed_cm_s)
    return np.asarray(stands.any(axis=-1))
