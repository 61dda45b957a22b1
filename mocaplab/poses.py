"""Poses as quaternions: from the channels of a motion, in whatever Euler orders, and back."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from mocaplab.euler import channels_of_order
from mocaplab.motion import FloatArray, Motion, Skeleton
from mocaplab.quaternions import TOLERANCE, as_shape
from mocaplab.rotations import euler_to_quaternion, quaternion_to_euler


def motion_to_quaternions(motion: Motion) -> FloatArray:
    """Each joint's rotation relative to its parent, whatever the Euler orders are.

    Returns
    -------
    array, shape (T, J, 4)
        No turn, (1, 0, 0, 0), for joints without rotation channels.
    """
    quaternions = np.zeros((motion.n_frames, motion.skeleton.n_joints, 4))
    quaternions[..., 0] = 1.0
    for order, (joints, columns) in channels_of_order(motion.skeleton).items():
        quaternions[:, joints] = euler_to_quaternion(motion.channels[:, columns], order)
    return quaternions


def quaternions_to_channels(quaternions: ArrayLike, skeleton: Skeleton) -> FloatArray:
    """Rotation channels from each joint's rotation, each joint in its own Euler order.

    The angles are those of :func:`mocaplab.rotations.matrix_to_euler`, so they may jump from
    frame to frame: :func:`mocaplab.euler.make_continuous` joins them up.

    Parameters
    ----------
    quaternions : array, shape (T, J, 4)
    skeleton : Skeleton

    Returns
    -------
    array, shape (T, R), degrees
        For the R rotation channels: ``channels[:, skeleton.is_rotation] = ...``

    Raises
    ------
    ValueError
        If a joint has one or two rotation channels, which cannot hold every rotation, or
        has none and is to be turned.
    """
    q = as_shape(quaternions, (skeleton.n_joints, 4), "quaternions")
    if q.ndim != 3:
        raise ValueError(f"expected quaternions of shape (T, J, 4), got {q.shape}")
    channels = np.zeros((len(q), skeleton.n_channels))
    fixed = np.ones(skeleton.n_joints, dtype=bool)
    for order, (joints, columns) in channels_of_order(skeleton).items():
        if len(order) != 3:
            raise ValueError(
                f"expected three rotation channels or none for every joint, got {order!r} for "
                f"joint {skeleton.joint_names[joints[0]]!r}"
            )
        channels[:, columns] = quaternion_to_euler(q[:, joints], order)
        fixed[joints] = False
    turned = fixed & (np.abs(q[..., 1:]) > TOLERANCE).any(axis=(0, 2))
    if turned.any():
        name = skeleton.joint_names[int(np.argmax(turned))]
        raise ValueError(f"expected no turn of joint {name!r}, which has no rotation channels")
    return channels[:, skeleton.is_rotation]
