"""Left and right, and the mirror."""

import numpy as np
import pytest

from mocaplab.bvh import load_bvh
from mocaplab.kinematics import forward_kinematics
from mocaplab.motion import Motion, Skeleton
from mocaplab.skeletons.mirroring import left_right_pairs, mirror


def test_pairs_by_name(walk, data_dir):
    pairs = left_right_pairs(walk.skeleton)
    names = walk.skeleton.joint_names
    named = {(names[a], names[b]) for a, b in pairs}
    assert {("LHipJoint", "RHipJoint"), ("LeftLeg", "RightLeg"), ("LThumb", "RThumb")} <= named
    assert len(pairs) == 12
    daz = load_bvh(next((data_dir / "cmu_daz").glob("*.bvh"))).skeleton
    named = {(daz.joint_names[a], daz.joint_names[b]) for a, b in left_right_pairs(daz)}
    assert {("lThigh", "rThigh"), ("lPinky2", "rPinky2"), ("leftEye", "rightEye")} <= named
    assert len(named) == 19


def test_a_mirrored_motion_has_mirrored_positions():
    """By the definition of a mirror: the other side's positions with another x."""
    body = Skeleton(
        joint_names=("Hips", "LeftLeg", "RightLeg", "Head"),
        parents=np.array([-1, 0, 0, 0]),
        offsets=np.array([[0, 0, 0], [9, -5, 1], [-9, -5, 1], [0, 30, 2]]),
        channel_names=(
            ("Xposition", "Yposition", "Zposition", "Yrotation", "Xrotation", "Zrotation"),
            ("Zrotation", "Yrotation", "Xrotation"),
            ("Zrotation", "Yrotation", "Xrotation"),
            ("Xrotation", "Zrotation", "Yrotation"),
        ),
        end_site_parents=np.array([1, 2, 3]),
        end_site_offsets=np.array([[2.0, -40, 0], [-2, -40, 0], [0, 10, 3]]),
    )
    channels = 30 * np.random.default_rng(0).normal(size=(50, body.n_channels))
    motion = Motion(body, 1 / 60, channels)
    before, turns = forward_kinematics(motion)
    after, mirrored_turns = forward_kinematics(mirror(motion))
    order = [0, 2, 1, 3]
    np.testing.assert_allclose(after, before[:, order] * [-1, 1, 1], atol=1e-9)
    flip = np.diag([-1.0, 1, 1])
    np.testing.assert_allclose(mirrored_turns, flip @ turns[:, order] @ flip, atol=1e-12)
    np.testing.assert_array_equal(mirror(mirror(motion)).channels, channels)


def test_a_skeleton_without_sides_is_refused(small_motion):
    with pytest.raises(ValueError, match="LeftLeg and RightLeg"):
        mirror(small_motion)
