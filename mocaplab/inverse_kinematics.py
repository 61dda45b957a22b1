"""From positions to angles: inverse kinematics by damped least squares.

Forward kinematics turns angles into positions. Here we go the other way: given where the
joints should be, find angles that bring them there, or as near as the bones allow. The
lengths of the bones stay, because only angles change.

The method is that of Levenberg (1944) and Marquardt (1963), which Wampler (1986) and
Nakamura and Hanafusa (1986) brought to inverse kinematics. All frames are solved at once,
each with its own damping.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from mocaplab.euler import channels_of_order
from mocaplab.kinematics import forward_kinematics
from mocaplab.motion import BoolArray, FloatArray, IntArray, Motion, Skeleton
from mocaplab.rotations import euler_to_matrix

PULL = 1e-7
"""Default pull to the starting pose, in mean bone lengths per radian."""

REACHED = 3e-7  # mean bone lengths: a frame whose joints are that near to their targets is done
CHUNK_FRAMES = 128  # solved at once, so that a long clip needs no more memory than a short one
LEAST_DAMPING = 1e-8  # keeps the equations solvable where no position tells an angle
MAX_STEPS = 100
STEP_TOLERANCE_RAD = 1e-6  # near the solution the next step is far smaller: then we are done


def descendants(skeleton: Skeleton) -> BoolArray:
    """Tell which joints hang below which, shape (J, J).

    Entry ``[a, b]`` is True if b hangs below a, at any depth; a joint not below itself.
    """
    below = np.zeros((skeleton.n_joints, skeleton.n_joints), dtype=bool)
    for joint, parent in enumerate(skeleton.parents.tolist()):
        if parent >= 0:
            below[:, joint] = below[:, parent]
            below[parent, joint] = True
    return below


def rotation_axes(motion: Motion, orientations: FloatArray) -> FloatArray:
    """Find the axis that each rotation channel turns about, in the world.

    With channels in the order "ZYX", Z turns about the parent's axis z, Y about the y that
    Z has turned, and X about the x that both have turned.

    Parameters
    ----------
    motion : Motion
    orientations : array, shape (T, J, 3, 3), from forward kinematics

    Returns
    -------
    array, shape (T, C, 3), unit vectors; zero for position channels
    """
    axes = np.zeros((*motion.channels.shape, 3))
    parents = motion.skeleton.parents
    for order, (joints, columns) in channels_of_order(motion.skeleton).items():
        upper = orientations[:, parents[joints]].copy()
        upper[:, parents[joints] < 0] = np.eye(3)
        for n, axis in enumerate(order):
            channels = np.array(columns)[:, n]
            axes[:, channels] = upper[..., "XYZ".index(axis)]
            upper = upper @ euler_to_matrix(motion.channels[:, channels, None], axis)
    return axes


def _cross_levers(axes: FloatArray, pivots: FloatArray, points: FloatArray) -> FloatArray:
    """Axis x lever arm: how points move when turned; (T, M, 3), (T, K, 3) -> (T, M, 3, K)."""
    lever = [points[:, None, :, i] - pivots[:, :, None, i] for i in range(3)]
    x, y, z = (axes[:, :, None, i] for i in range(3))
    return np.stack(
        [y * lever[2] - z * lever[1], z * lever[0] - x * lever[2], x * lever[1] - y * lever[0]],
        axis=2,
    )


def position_jacobian(motion: Motion) -> FloatArray:
    """Differentiate every joint's position by every angle.

    A point that turns about an axis moves at right angles to the axis and to the lever arm:
    the derivative is axis x (point - joint), for the points below the joint.

    Returns
    -------
    array, shape (T, C, 3, J), file length units per radian; zero for position channels
    """
    positions, orientations = forward_kinematics(motion)
    axes = rotation_axes(motion, orientations)
    joint = motion.skeleton.channel_joint
    turns = descendants(motion.skeleton)[joint]
    return _cross_levers(axes, positions[:, joint], positions) * turns[:, None]


@dataclass(frozen=True)
class _Branch:
    """What hangs on one child of the root: apart from the root, branches share no angle.

    M solved channels move K joints; ``turns`` (M, K) tells which, times the joints' weights.
    """

    channels: IntArray
    joints: IntArray
    turns: FloatArray
    root_weights: FloatArray


def _branches(skeleton: Skeleton, solved: BoolArray, weights: FloatArray) -> list[_Branch]:
    below = descendants(skeleton)
    found = []
    for child in np.flatnonzero(skeleton.parents == 0):
        member = below[child].copy()
        member[child] = True
        joints = np.flatnonzero(member & (weights > 0))
        turns = below[skeleton.channel_joint][:, joints]
        channels = np.flatnonzero(solved & turns.any(axis=1))
        if len(channels):
            root = np.sqrt(weights[joints])
            found.append(_Branch(channels, joints, np.where(turns[channels], root, 0.0), root))
    return found


def solve_angles(
    motion: Motion,
    targets: ArrayLike,
    *,
    weights: ArrayLike | None = None,
    channels: ArrayLike | None = None,
    pull: float | None = None,
    tolerance: float = 1e-8,
) -> tuple[Motion, FloatArray]:
    """Find the angles that bring the joints nearest to given positions.

    In each frame, the sum of ``weight * distance**2`` over the joints, plus
    ``pull**2 * change**2`` over the angles, becomes as small as it can near the pose that the
    frame starts from. So the Euler angles stay in the branch they start in. What no position
    tells, such as the turn of a last joint or the twist of a straight limb, stays as it is:
    that is what the pull is for.

    Only rotations change. Position channels, on whatever joint, stay, and so do the root's
    path and heading.

    Parameters
    ----------
    motion : Motion
        The poses to start from, without NaN.
    targets : array, shape (T, J, 3), file length units
    weights : array, shape (J,), optional
        How much each joint counts; 0 for a joint that may be anywhere. By default 1.
    channels : array, shape (C,), bool, optional
        The angles that may change; by default all but the root's.
    pull : float, file length units per radian, optional
        By default ``PULL`` mean bone lengths, too little to see.
    tolerance : float
        A frame is done when a step makes its sum smaller by less than this share. The sum falls
        slowly, over dozens of steps, where bones are much shorter than targets are off.

    Returns
    -------
    solved : Motion
    residual : array, shape (T, J), file length units
        The distance that is left between each joint and its target, whatever its weight.

    Raises
    ------
    ValueError
        If shapes do not fit, a number is NaN or infinite, a weight is negative, the pull is
        not positive, or a channel is chosen that is the root's or holds a position.
    """
    skeleton = motion.skeleton
    goal = _check_targets(motion, targets)
    weight = np.ones(skeleton.n_joints) if weights is None else np.asarray(weights, np.float64)
    if weight.shape != (skeleton.n_joints,) or not (np.isfinite(weight) & (weight >= 0)).all():
        raise ValueError(f"expected {skeleton.n_joints} weights of 0 or more, got {weights!r}")
    solved = skeleton.is_cleaned if channels is None else np.asarray(channels)
    if solved.dtype != bool or solved.shape != (skeleton.n_channels,):
        raise ValueError(f"expected channels of shape ({skeleton.n_channels},), true or false")
    if (solved & ~skeleton.is_cleaned).any():
        label = skeleton.channel_labels[int(np.argmax(solved & ~skeleton.is_cleaned))]
        raise ValueError(f"expected angles of joints below the root, got channel {label}")
    if pull is None:
        pull = PULL * _mean_bone(skeleton)
    if not 0 < pull < np.inf:
        raise ValueError(f"the pull must be a positive length, got {pull}")
    branches = _branches(skeleton, solved, weight)
    result = motion.channels.copy()
    for start in range(0, motion.n_frames if branches else 0, CHUNK_FRAMES):
        frames = slice(start, start + CHUNK_FRAMES)
        part = motion.slice_frames(start, start + CHUNK_FRAMES)
        result[frames] = _solve(part, goal[frames], branches, pull, tolerance)
    answer = motion.with_channels(result)
    return answer, np.linalg.norm(forward_kinematics(answer)[0] - goal, axis=-1)


def _mean_bone(skeleton: Skeleton) -> float:
    """Mean length of the bones; 1 where position channels make all of them."""
    lengths = np.linalg.norm(skeleton.offsets[1:], axis=1)
    return float(lengths[lengths > 0].mean()) if lengths.any() else 1.0


def _check_targets(motion: Motion, targets: ArrayLike) -> FloatArray:
    goal = np.asarray(targets, dtype=np.float64)
    skeleton, shape = motion.skeleton, (motion.n_frames, motion.skeleton.n_joints, 3)
    if np.isnan(motion.channels).any():
        frame, channel = np.argwhere(np.isnan(motion.channels))[0]
        raise ValueError(
            f"motion {motion.name!r}: {skeleton.channel_labels[channel]} is missing (NaN) in "
            f"frame {frame}; fill gaps first"
        )
    if goal.shape != shape:
        raise ValueError(f"expected targets of shape {shape}, got {goal.shape}")
    if not np.isfinite(goal).all():
        frame, joint, _ = np.argwhere(~np.isfinite(goal))[0]
        raise ValueError(
            f"the target of joint {skeleton.joint_names[joint]!r} is not finite in frame {frame}"
        )
    return goal


def _solve(
    motion: Motion, targets: FloatArray, branches: list[_Branch], pull: float, tolerance: float
) -> FloatArray:
    """Levenberg-Marquardt on all frames of a short motion; returns its channels."""
    start, angles = motion.channels, motion.channels.copy()
    left = np.arange(len(start))  # the frames that are not solved yet
    damping = np.full(len(start), 1e-3)
    reached = (REACHED * _mean_bone(motion.skeleton)) ** 2
    positions, axes = _pose(motion)
    cost = _cost(positions - targets, np.radians(angles - start), branches, pull)
    for _ in range(MAX_STEPS):
        change = np.radians(angles[left] - start[left])
        error = positions[left] - targets[left]
        step = np.zeros_like(change)
        for branch in branches:
            step[:, branch.channels] = _step(
                branch,
                motion.skeleton,
                positions[left],
                axes[left],
                error,
                change,
                damping[left],
                pull,
            )
        trial = motion.with_channels(angles[left] + np.degrees(step))
        trial_positions, trial_axes = _pose(trial)
        trial_cost = _cost(trial_positions - targets[left], change + step, branches, pull)
        better = trial_cost <= cost[left]
        damping[left] = np.where(
            better, np.maximum(damping[left] / 5, LEAST_DAMPING), damping[left] * 4
        )
        gain = cost[left] - trial_cost
        solved = better & ((gain < tolerance * cost[left]) | (trial_cost < reached))
        solved |= np.abs(step).max(axis=1) < STEP_TOLERANCE_RAD
        taken = left[better]
        angles[taken], cost[taken] = trial.channels[better], trial_cost[better]
        positions[taken], axes[taken] = trial_positions[better], trial_axes[better]
        left = left[~solved]
        if len(left) == 0:
            break
    return angles


def _pose(motion: Motion) -> tuple[FloatArray, FloatArray]:
    positions, orientations = forward_kinematics(motion)
    return positions, rotation_axes(motion, orientations)


def _cost(
    error: FloatArray, change: FloatArray, branches: list[_Branch], pull: float
) -> FloatArray:
    cost = pull**2 * np.sum(change**2, axis=1)
    for branch in branches:
        squared = np.sum(error[:, branch.joints] ** 2, axis=-1)
        cost += squared @ branch.root_weights**2
    return np.asarray(cost)


def _step(
    branch: _Branch,
    skeleton: Skeleton,
    positions: FloatArray,
    axes: FloatArray,
    error: FloatArray,
    change: FloatArray,
    damping: FloatArray,
    pull: float,
) -> FloatArray:
    """Solve (JJ' + pull^2 + damping diag(JJ')) step = -(J error + pull^2 change); (T, M)."""
    pivots = positions[:, skeleton.channel_joint[branch.channels]]
    points = positions[:, branch.joints]
    jacobian = _cross_levers(axes[:, branch.channels], pivots, points) * branch.turns[:, None]
    jacobian = jacobian.reshape(*jacobian.shape[:2], -1)  # (T, M, 3K)
    weighted = np.swapaxes(error[:, branch.joints] * branch.root_weights[:, None], 1, 2)
    slope = (jacobian @ weighted.reshape(len(error), -1, 1))[..., 0]
    slope += pull**2 * change[:, branch.channels]
    matrix = jacobian @ jacobian.swapaxes(1, 2)
    diagonal = np.einsum("tmm->tm", matrix)
    diagonal *= 1 + damping[:, None]
    diagonal += pull**2
    return np.asarray(np.linalg.solve(matrix, -slope[..., None])[..., 0], dtype=np.float64)
