"""From channels to positions: forward kinematics."""

from __future__ import annotations

from itertools import groupby

import numpy as np

from mocaplab.motion import FloatArray, Motion
from mocaplab.rotations import fill_matrix

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
    """Each joint's rotation and translation side by side, shape (3, 4, J, T).

    Frames come last: then an entry over time lies in one piece in memory, and numpy goes
    along the frames when it multiplies, not along three numbers.
    """
    skeleton, values = motion.skeleton, np.ascontiguousarray(motion.channels.T)
    transforms = np.empty((3, 4, skeleton.n_joints, motion.n_frames))
    transforms[:, 3] = skeleton.offsets.T[..., None]
    orders, turns = [], []
    first = 0  # the joint's first channel
    for joint, kinds in enumerate(skeleton.channel_names):
        order, mine = "", []
        for channel, kind in enumerate(kinds, start=first):
            if kind.endswith("rotation"):
                order += kind[0]
                mine.append(channel)
            else:
                transforms["XYZ".index(kind[0]), 3, joint] = values[channel]
        orders.append(order)
        turns.append(mine)
        first += len(kinds)
    block = max(1, _BLOCK // motion.n_frames)
    for order, run in groupby(range(skeleton.n_joints), key=orders.__getitem__):
        joints = list(run)  # neighbours of one order go together
        for start in range(joints[0], joints[-1] + 1, block):
            some = slice(start, min(start + block, joints[-1] + 1))
            if order:
                angles = values[np.transpose(turns[some])]  # (len(order), joints, T)
                fill_matrix(transforms[:, :3, some], angles, order)
            else:
                transforms[:, :3, some] = np.eye(3)[..., None, None]
    return transforms


def _split(transforms: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Bring the frames to the front and take translations and rotations apart; views."""
    frames_first = transforms.transpose(3, 2, 0, 1)
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
            above = transforms[:, :, parent]  # (3, 4, T)
            here = np.einsum("ijt,jkt->ikt", above[:, :3], transforms[:, :, joint])
            here[:, 3] += above[:, 3]
            transforms[:, :, joint] = here
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
