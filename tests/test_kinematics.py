"""Forward kinematics against numbers worked out by hand, scipy and pybvh."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mocaplab.bvh import load_bvh, save_bvh
from mocaplab.kinematics import (
    end_site_positions,
    forward_kinematics,
    local_transforms,
)
from mocaplab.motion import Motion, Skeleton

REAL_CLIPS = ["cmu/walk_20.bvh", "cmu/jump_05.bvh", "cmu_daz/martial_04.bvh"]


def arm(channels, channel_names=(("Zrotation",), ("Zrotation",))) -> Motion:
    """Upper arm of length 2 and forearm of length 1, both along X."""
    skeleton = Skeleton(
        ("Shoulder", "Elbow"), [-1, 0], [[0, 0, 0], [2, 0, 0]], channel_names, [1], [[1, 0, 0]]
    )
    return Motion(skeleton, 0.1, channels)


def scipy_positions(motion: Motion) -> np.ndarray:
    """Walk down the tree frame by frame with scipy's rotations, the slow and plain way."""
    skeleton = motion.skeleton
    positions = np.empty((motion.n_frames, skeleton.n_joints, 3))
    for t, row in enumerate(motion.channels):
        turns: list[Rotation] = []
        values = iter(row)
        for joint, names in enumerate(skeleton.channel_names):
            here = {name: next(values) for name in names}
            turn = Rotation.identity()
            place = skeleton.offsets[joint].copy()
            for name, value in here.items():
                if name.endswith("rotation"):
                    turn = turn * Rotation.from_euler(name[0], value, degrees=True)
                else:
                    place["XYZ".index(name[0])] = value
            parent = skeleton.parents[joint]
            if parent < 0:
                positions[t, joint] = place
                turns.append(turn)
            else:
                positions[t, joint] = positions[t, parent] + turns[parent].apply(place)
                turns.append(turns[parent] * turn)
    return positions


@pytest.mark.parametrize(
    ("shoulder", "elbow", "elbow_at", "hand_at"),
    [
        (0, 0, (2, 0, 0), (3, 0, 0)),
        (90, 0, (0, 2, 0), (0, 3, 0)),
        (0, 90, (2, 0, 0), (2, 1, 0)),
        (90, 90, (0, 2, 0), (-1, 2, 0)),
        (30, -30, (3**0.5, 1, 0), (3**0.5 + 1, 1, 0)),
        (180, 180, (-2, 0, 0), (-1, 0, 0)),
    ],
)
def test_a_two_bone_arm(shoulder, elbow, elbow_at, hand_at):
    motion = arm([[shoulder, elbow]])
    positions, orientations = forward_kinematics(motion)
    np.testing.assert_allclose(positions[0], [(0, 0, 0), elbow_at], atol=1e-12)
    np.testing.assert_allclose(end_site_positions(motion)[0], [hand_at], atol=1e-12)
    np.testing.assert_allclose(orientations[0, 1, :, 0], np.subtract(hand_at, elbow_at), atol=1e-12)


def test_the_order_of_rotations_is_the_files():
    """ZX turns X into Y; XZ turns it into Y and then Y into Z."""
    for names, expected in [
        (("Zrotation", "Xrotation"), [0, 2, 0]),
        (("Xrotation", "Zrotation"), [0, 0, 2]),
    ]:
        positions, _ = forward_kinematics(arm([[90, 90]], (names, ())))
        np.testing.assert_allclose(positions[0, 1], expected, atol=1e-12)


def test_position_channels_replace_the_offset_and_may_be_partial():
    names = (("Xposition", "Yposition", "Zposition", "Zrotation"), ("Zposition", "Xposition"))
    motion = arm([[10, 20, 30, 90, 7, 5]], names)
    translations, _ = local_transforms(motion)
    assert translations[0].tolist() == [[10, 20, 30], [5, 0, 7]]
    positions, _ = forward_kinematics(motion)
    np.testing.assert_allclose(positions[0, 1], [10, 25, 37], atol=1e-12)


def test_a_root_without_position_channels_stays_at_its_offset(small_motion):
    skeleton = Skeleton(("Root",), [-1], [[1, 2, 3]], (("Xrotation",),), [], np.zeros((0, 3)))
    motion = Motion(skeleton, 0.1, [[40.0], [50.0]])
    assert forward_kinematics(motion)[0][:, 0].tolist() == [[1, 2, 3], [1, 2, 3]]
    assert end_site_positions(motion).shape == (2, 0, 3)


def test_small_motion_is_as_scipy_says(small_motion):
    positions, orientations = forward_kinematics(small_motion)
    np.testing.assert_allclose(positions, scipy_positions(small_motion), atol=1e-11)
    identity = orientations @ np.swapaxes(orientations, -1, -2)
    np.testing.assert_allclose(identity, np.broadcast_to(np.eye(3), identity.shape), atol=1e-12)


def test_bones_keep_their_lengths(small_motion):
    positions, _ = forward_kinematics(small_motion)
    parents = small_motion.skeleton.parents[1:]
    lengths = np.linalg.norm(positions[:, 1:] - positions[:, parents], axis=-1)
    expected = np.linalg.norm(small_motion.skeleton.offsets[1:], axis=-1)
    np.testing.assert_allclose(lengths, np.broadcast_to(expected, lengths.shape))


@pytest.mark.parametrize("name", REAL_CLIPS)
def test_real_clips_are_as_scipy_says(data_dir, name):
    clip = load_bvh(data_dir / name)
    motion = clip.slice_frames(5, 15)
    np.testing.assert_allclose(forward_kinematics(motion)[0], scipy_positions(motion), atol=1e-9)


def check_against_pybvh(motion: Motion, path) -> None:
    pybvh = pytest.importorskip("pybvh")
    theirs = pybvh.read_bvh_file(path, world_up="+y")
    assert tuple(theirs.joint_names) == motion.skeleton.joint_names
    np.testing.assert_allclose(forward_kinematics(motion)[0], theirs.joint_positions(), atol=1e-9)
    is_end = np.ones(len(theirs.nodes), dtype=bool)
    is_end[[theirs.node_index[name] for name in theirs.joint_names]] = False
    np.testing.assert_allclose(
        end_site_positions(motion), theirs.node_positions()[:, is_end], atol=1e-9
    )


@pytest.mark.parametrize("name", REAL_CLIPS)
def test_real_clips_are_as_pybvh_says(data_dir, name):
    check_against_pybvh(load_bvh(data_dir / name), data_dir / name)


def test_ball_joints_are_as_pybvh_says(small_motion, tmp_path):
    """The small motion without its hinge and the blank in a name, which pybvh cannot read."""
    skeleton = small_motion.skeleton
    balls = Skeleton(
        ("Hips", "Spine", "LeftArm", "LeftHand"),
        skeleton.parents[:4],
        np.vstack([np.zeros(3), skeleton.offsets[1:4]]),
        skeleton.channel_names[:4],
        skeleton.end_site_parents[:1],
        skeleton.end_site_offsets[:1],
    )
    motion = Motion(balls, 1 / 60, small_motion.channels[:, :-1])
    save_bvh(motion, tmp_path / "balls.bvh")
    check_against_pybvh(motion, tmp_path / "balls.bvh")
