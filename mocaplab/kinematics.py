"""From channels to positions: forward kinematics."""

from __future__ import annotations

import numpy as np

from mocaplab.motion import FloatArray, Motion
from mocaplab.rotations import euler_to_matrix

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
            columns = turns_of_order[order][start : start + block]
            if order:
                angles = values[np.transpose(columns)]  # (len(order), joints, T)
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
