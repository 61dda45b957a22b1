"""From channels to positions: forward kinematics, and what follows from it."""

from __future__ import annotations

import numpy as np

from mocaplab.motion import FloatArray, Motion
from mocaplab.rotations import euler_to_matrix, matrix_to_rotation_vector


_BLOCK = 8192  # angles turned into matrices at once: 64 kB an entry stay in the cache


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
    transforms = _joint_transforms(motion)
    return _split(transforms)


def _joint_transforms(motion: Motion) -> FloatArray:
    """Each joint's rotation and translation side by side, shape (J, 3, 4, T).

    Frames come last: then an entry over time lies in one piece in memory, and numpy goes
    along the frames when it multiplies, not along three numbers.
    """
    skeleton, values = motion.skeleton, np.ascontiguousarray(motion.channels.T)
    transforms = np.empty((skeleton.n_joints, 3, 4, motion.n_frames))
    transforms[:, :, 3] = skeleton.offsets[..., None]
    joints_of_order: dict[str, list[int]] = {}  # so that many of one order go together
    turns_of_order: dict[str, list[list[int]]] = {}
    first = 0  # the joint's first channel
    for joint, kinds in enumerate(skeleton.channel_names):
        order, turns = "", []
        for channel, kind in enumerate(kinds, start=first):
            if kind.endswith("rotation"):
                order += kind[0]
                turns.append(channel)
            else:
                transforms[joint, "XYZ".index(kind[0]), 3] = values[channel]
        joints_of_order.setdefault(order, []).append(joint)
        turns_of_order.setdefault(order, []).append(turns)
        first += len(kinds)
    block = max(1, _BLOCK // motion.n_frames)
    for order, all_joints in joints_of_order.items():
        for start in range(0, len(all_joints), block):
            joints = all_joints[start : start + block]
            turns = turns_of_order[order][start : start + block]
            if order:
                angles = values[np.transpose(turns)]  # (len(order), joints, T)
                matrices = euler_to_matrix(angles.transpose(1, 2, 0), order)
                transforms[joints, :, :3] = matrices.transpose(0, 2, 3, 1)
            else:
                transforms[joints, :, :3] = np.eye(3)[..., None]
    return transforms


def _split(transforms: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Bring the frames to the front and take translations and rotations apart; views."""
    frames_first = transforms.transpose(3, 0, 1, 2)
    return frames_first[..., 3], frames_first[..., :3]


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
    transforms = _joint_transforms(motion)
    for joint, parent in enumerate(motion.skeleton.parents.tolist()):
        if parent >= 0:
            turn = transforms[parent, :, :3]
            transforms[joint] = np.einsum("ijt,jkt->ikt", turn, transforms[joint])
            transforms[joint, :, 3] += transforms[parent, :, 3]
    positions, orientations = _split(transforms)
    return np.ascontiguousarray(positions), orientations


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
