"""Channels to quaternions and back, with a different Euler order for every joint."""

from __future__ import annotations

import numpy as np
import pytest

from mocaplab.kinematics import local_transforms
from mocaplab.motion import Motion, Skeleton
from mocaplab.poses import motion_to_quaternions, quaternions_to_channels
from mocaplab.quaternions import quaternion_to_matrix


def ball_jointed(orders):
    """A motion of joints with these rotation orders, on a chain, 30 random frames."""
    n = len(orders)
    skeleton = Skeleton(
        joint_names=tuple(f"J{j}" for j in range(n)),
        parents=np.arange(n) - 1,
        offsets=np.ones((n, 3)),
        channel_names=tuple(
            ("Yposition", *(f"{axis}rotation" for axis in order)) for order in orders
        ),
        end_site_parents=np.zeros(0),
        end_site_offsets=np.zeros((0, 3)),
    )
    channels = np.random.default_rng(6).uniform(-85, 85, (30, skeleton.n_channels))
    return Motion(skeleton, 0.01, channels)


def test_a_motion_of_mixed_orders_goes_to_quaternions_and_back():
    motion = ball_jointed(["ZYX", "XYZ", "", "YZX", "XYZ", "ZXY", "YXZ", "XZY"])
    quaternions = motion_to_quaternions(motion)
    assert quaternions.shape == (30, 8, 4)
    np.testing.assert_array_equal(quaternions[:, 2], [[1, 0, 0, 0]] * 30)
    rotations = motion.channels[:, motion.skeleton.is_rotation]
    np.testing.assert_allclose(quaternions_to_channels(quaternions, motion.skeleton), rotations)


def test_hinges_go_to_quaternions_but_not_back(small_motion):
    quaternions = motion_to_quaternions(small_motion)
    angle = np.radians(small_motion.channel("Leg.Xrotation"))
    np.testing.assert_allclose(quaternions[:, 4, 1], np.sin(angle / 2), atol=1e-15)
    with pytest.raises(ValueError, match=r"three rotation channels or none.* 'X' for joint 'Leg'"):
        quaternions_to_channels(quaternions, small_motion.skeleton)


def test_a_joint_without_rotation_channels_cannot_be_turned():
    motion = ball_jointed(["ZYX", ""])
    quaternions = motion_to_quaternions(motion)
    quaternions[3, 1] = [0, 1, 0, 0]
    with pytest.raises(ValueError, match="no turn of joint 'J1'"):
        quaternions_to_channels(quaternions, motion.skeleton)
    with pytest.raises(ValueError, match=r"\(..., 2, 4\), got \(30, 1, 4\)"):
        quaternions_to_channels(quaternions[:, :1], motion.skeleton)
    with pytest.raises(ValueError, match=r"\(T, J, 4\), got \(2, 4\)"):
        quaternions_to_channels(quaternions[0], motion.skeleton)


def test_quaternions_are_the_rotations_of_the_kinematics(small_motion, walk):
    for motion in (small_motion, walk):
        matrix = quaternion_to_matrix(motion_to_quaternions(motion))
        np.testing.assert_allclose(matrix, local_transforms(motion)[1], atol=1e-13)
