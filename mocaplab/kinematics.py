"""From channels to positions: forward kinematics, and what follows from it."""

from __future__ import annotations

import numpy as np

from mocaplab.motion import FloatArray, Motion
from mocaplab.rotations import euler_to_matrix, matrix_to_rotation_vector


def local_transforms(motion: Motion) -> tuple[FloatArray, FloatArray]:
    """Turn channels into each joint's translation and rotation relative to its parent.

    A position channel replaces that coordinate of the joint's OFFSET (it is not added
    to it): this is what files with positions on every joint mean.

    Parameters
    ----------
    motion : Motion

    Returns
    -------
    translations : array, shape (T, J, 3), file length units
    rotations : array, shape (T, J, 3, 3)
    """
    skeleton = motion.skeleton
    n_frames, n_joints = motion.n_frames, skeleton.n_joints
    translations = np.broadcast_to(skeleton.offsets, (n_frames, n_joints, 3)).copy()
    rotations = np.broadcast_to(np.eye(3), (n_frames, n_joints, 3, 3)).copy()

    for channel in np.flatnonzero(~skeleton.is_rotation):
        axis = "XYZ".index(skeleton.channel_kind[channel][0])
        translations[:, skeleton.channel_joint[channel], axis] = motion.channels[:, channel]

    # All joints with the same rotation order are turned into matrices at once.
    joints_of_order: dict[str, list[int]] = {}
    columns_of_order: dict[str, list[list[int]]] = {}
    for joint in range(n_joints):
        columns = np.flatnonzero((skeleton.channel_joint == joint) & skeleton.is_rotation)
        order = "".join(skeleton.channel_kind[c][0] for c in columns)
        if order:
            joints_of_order.setdefault(order, []).append(joint)
            columns_of_order.setdefault(order, []).append(columns.tolist())
    for order, joints in joints_of_order.items():
        angles = motion.channels[:, columns_of_order[order]]  # (T, joints, len(order))
        rotations[:, joints] = euler_to_matrix(angles, order)
    return translations, rotations


def forward_kinematics(motion: Motion) -> tuple[FloatArray, FloatArray]:
    """Position and orientation of every joint in the world.

    Parameters
    ----------
    motion : Motion

    Returns
    -------
    positions : array, shape (T, J, 3), file length units
    orientations : array, shape (T, J, 3, 3)
        Matrices that take a vector from the joint's own axes to the world's.
    """
    positions, orientations = local_transforms(motion)
    for joint, parent in enumerate(motion.skeleton.parents.tolist()):
        if parent >= 0:
            turn = orientations[:, parent]
            positions[:, joint] = (
                positions[:, parent] + (turn @ positions[:, joint, :, None])[..., 0]
            )
            orientations[:, joint] = turn @ orientations[:, joint]
    return positions, orientations


def end_site_positions(motion: Motion) -> FloatArray:
    """Positions of the End Sites (fingertips, toes, top of the head).

    Returns
    -------
    array, shape (T, E, 3), file length units
    """
    positions, orientations = forward_kinematics(motion)
    parents = motion.skeleton.end_site_parents
    offsets = motion.skeleton.end_site_offsets[..., None]
    return positions[:, parents] + (orientations[:, parents] @ offsets)[..., 0]


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
    positions, _ = forward_kinematics(motion)
    if motion.n_frames < 4:
        return 0.0
    jerk = np.diff(positions, n=3, axis=0) / motion.frame_time**3
    return float(np.linalg.norm(jerk, axis=-1).mean())


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
