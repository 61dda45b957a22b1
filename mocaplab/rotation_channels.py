"""Write rotations into the channels of a motion, in the Euler triples that its file uses."""

from __future__ import annotations

import numpy as np

from mocaplab.euler import (
    align_to,
    alternate_euler,
    channels_of_order,
    make_continuous,
    rotation_triples,
)
from mocaplab.motion import BoolArray, FloatArray, Motion, Skeleton
from mocaplab.rotations import quaternion_to_euler


def rotations_to_channels(quaternions: FloatArray, skeleton: Skeleton) -> FloatArray:
    """Rotation channels of every joint, shape (T, C); positions are 0.

    A joint with one or two rotation channels gets the angles of the full triple of which
    theirs are the first; for one channel, and turns about its axis, that is exact.
    """
    channels = np.zeros((len(quaternions), skeleton.n_channels))
    for order, (joints, columns) in channels_of_order(skeleton).items():
        full = order + "".join(axis for axis in "XYZ" if axis not in order)
        angles = quaternion_to_euler(quaternions[:, joints], full if len(order) < 3 else order)
        channels[:, columns] = angles[..., : len(order)]
    return channels


def write_angles(quaternions: FloatArray, a: Motion, moves: BoolArray) -> Motion:
    """Put rotations into the channels of a motion; what does not move stays as it is.

    Parameters
    ----------
    quaternions : array, shape (T, J, 4)
    a : Motion, of T frames
        The angles are told in its Euler triples, as far as these do not jump.
    moves : array, shape (C,), bool, the channels to write
    """
    skeleton = a.skeleton
    of_moving_joint = np.isin(skeleton.channel_joint, skeleton.channel_joint[moves])
    turning = of_moving_joint & skeleton.is_rotation
    written = np.where(turning, rotations_to_channels(quaternions, skeleton), a.channels)
    # Not nearest to a from frame to frame: where a is lost, that would be any branch.
    fused = _nearer_branch(make_continuous(a.with_channels(written)), a)
    # A joint with an angle that stays must be told with that angle, so in the branch of a.
    stays = skeleton.channel_joint[turning & ~moves]
    hinge = turning & np.isin(skeleton.channel_joint, stays)
    channels = np.where(hinge, align_to(fused, a).channels, fused.channels)
    return a.with_channels(np.where(turning & moves, channels, a.channels))


def _nearer_branch(fused: Motion, a: Motion) -> Motion:
    """Tell each joint, over the whole clip, by the triple and full turns that are usual in a."""
    channels = fused.channels.copy()
    for _, columns, order in rotation_triples(a.skeleton):
        near, candidates = a.channels[:, columns], []
        for angles in (channels[:, columns], alternate_euler(channels[:, columns], order)):
            off = near - angles
            candidates.append(angles + 360.0 * np.round(np.median(off, axis=0) / 360.0))
        distance = [np.median(np.abs(each - near), axis=0).sum() for each in candidates]
        channels[:, columns] = candidates[int(np.argmin(distance))]
    return fused.with_channels(channels)
