"""Retargeting: what must be exact is exact, and what cannot be done is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from data_tools.asfamc import convert
from mocaplab.bvh import load_bvh
from mocaplab.kinematics import end_site_positions, forward_kinematics
from mocaplab.motion import Motion, Skeleton
from mocaplab.skeletons.retargeting import retarget


def scaled(skeleton: Skeleton, factor: float) -> Skeleton:
    return replace(
        skeleton,
        offsets=skeleton.offsets * factor,
        end_site_offsets=skeleton.end_site_offsets * factor,
    )


def line(names, offsets, channel_names, parents=None) -> Skeleton:
    """A chain of joints, or another tree."""
    parents = np.arange(len(names)) - 1 if parents is None else parents
    return Skeleton(names, parents, offsets, channel_names, [], np.zeros((0, 3)))


BALL = ("Zrotation", "Yrotation", "Xrotation")
ROOT = ("Xposition", "Yposition", "Zposition", *BALL)
LEG = ((0, 0, 0), (0, -4, 0), (0, -4, 0))


def leg_motion(skeleton=None, n_frames=20) -> Motion:
    skeleton = skeleton or line(("hip", "knee", "foot"), LEG, (ROOT, BALL, BALL))
    path = np.cumsum(np.random.default_rng(0).normal(scale=5, size=(n_frames, 12)), axis=0)
    return Motion(skeleton, 0.01, path, name="leg")


def test_the_same_skeleton_gives_the_same_motion(small_motion):
    result = retarget(small_motion, small_motion.skeleton)
    np.testing.assert_allclose(result.channels, small_motion.channels, atol=1e-9)
    assert result.frame_time == small_motion.frame_time


@pytest.mark.parametrize("factor", [0.5, 1.3])
def test_a_body_of_another_size_moves_alike_and_larger(small_motion, walk, factor):
    for motion in (small_motion, walk):
        result = retarget(motion, scaled(motion.skeleton, factor))
        np.testing.assert_allclose(
            forward_kinematics(result)[0], factor * forward_kinematics(motion)[0], atol=1e-9
        )
        np.testing.assert_allclose(
            end_site_positions(result), factor * end_site_positions(motion), atol=1e-9
        )


def test_other_orders_of_channels_give_the_same_positions(walk):
    orders = ["XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX"]
    names = [tuple(f"{a}rotation" for a in orders[j % 6]) for j in range(walk.skeleton.n_joints)]
    names[0] = ("Zrotation", "Xrotation", "Yrotation", "Zposition", "Xposition", "Yposition")
    target = replace(walk.skeleton, channel_names=tuple(names))
    result = retarget(walk, target)
    np.testing.assert_allclose(
        forward_kinematics(result)[0], forward_kinematics(walk)[0], atol=1e-9
    )
    assert np.abs(np.diff(result.channels, axis=0)).max() < 90  # continuous
    back = retarget(result, walk.skeleton)
    np.testing.assert_allclose(back.channels, walk.channels, atol=1e-9)


def test_other_names_in_another_order_of_joints(small_motion):
    """The target lists the leg before the arm, and calls the joints by other names."""
    new = {"Hips": "pelvis", "Leg": "thigh", "Spine": "back", "Left Arm": "arm", "LeftHand": "hand"}
    source = small_motion.skeleton
    places = [source.joint_names.index(name) for name in new]
    target = line(
        tuple(new.values()),
        source.offsets[places],
        tuple(source.channel_names[j] for j in places),
        parents=[-1, 0, 0, 2, 3],
    )
    result = retarget(small_motion, target, new)
    np.testing.assert_allclose(
        forward_kinematics(result)[0], forward_kinematics(small_motion)[0][:, places], atol=1e-9
    )


def test_bones_of_other_proportions_keep_their_orientations():
    motion = leg_motion()
    target = line(("hip", "knee", "foot"), ((0, 0, 0), (0, -6, 0), (0, -3, 0)), (ROOT, BALL, BALL))
    result = retarget(motion, target)
    positions, orientations = forward_kinematics(result)
    before, turns = forward_kinematics(motion)
    np.testing.assert_allclose(orientations, turns, atol=1e-12)
    np.testing.assert_allclose(positions[:, 0], before[:, 0] * 9 / 8, atol=1e-9)
    np.testing.assert_allclose(
        positions[:, 1] - positions[:, 0], (before[:, 1] - before[:, 0]) * 6 / 4, atol=1e-9
    )
    stays = retarget(motion, target, scale=1.0)
    np.testing.assert_allclose(stays.channels[:, :3], motion.channels[:, :3], atol=1e-12)


def test_joints_between_and_below_are_carried_along():
    """The target's shin and toe are in no map: each stays straight with its parent."""
    target = line(
        ("hip", "knee", "shin", "foot", "toe"),
        ((0, 0, 0), (0, -4, 0), (0, -2, 0), (0, -2, 0), (0, 0, 1)),
        (ROOT, BALL, BALL, BALL, ()),
    )
    motion = leg_motion()
    result = retarget(motion, target)
    np.testing.assert_allclose(
        forward_kinematics(result)[0][:, [0, 1, 3]], forward_kinematics(motion)[0], atol=1e-9
    )
    assert not result.channels[:, 9:12].any()


def test_positions_on_every_joint_stay_at_the_offsets():
    full = ("Xposition", "Yposition", "Zposition", *BALL)
    target = line(("hip", "knee", "foot"), LEG, (full, full, full))
    result = retarget(leg_motion(), target)
    np.testing.assert_array_equal(result.channels[:, 6:9], np.broadcast_to(LEG[1], (20, 3)))
    back = retarget(result, leg_motion().skeleton)
    np.testing.assert_allclose(back.channels, leg_motion().channels, atol=1e-9)


@pytest.mark.parametrize("names", [("Xrotation",), ("Zrotation", "Xrotation")])
def test_hinges_take_what_they_can_hold_and_refuse_the_rest(names):
    hinged = line(("hip", "knee", "foot"), LEG, (ROOT, names, ()))
    columns = 6 + len(names)
    values = leg_motion().channels[:, :columns] * 2  # beyond 90 degrees
    motion = Motion(hinged, 0.01, values, name="hinged")
    result = retarget(motion, scaled(hinged, 2.0))
    np.testing.assert_allclose(
        forward_kinematics(result)[0], 2 * forward_kinematics(motion)[0], atol=1e-9
    )
    with pytest.raises(ValueError, match=r"'knee' has .rotation.*cannot turn as the motion asks"):
        retarget(leg_motion(), line(("hip", "knee", "foot"), LEG, (ROOT, names, BALL)))
    fixed = line(("hip", "knee", "foot"), LEG, (ROOT, BALL, ()))
    with pytest.raises(ValueError, match="'foot' has no channels: it cannot turn"):
        retarget(leg_motion(), fixed)


def test_movement_that_goes_nowhere_must_be_let_go():
    short = line(("hip", "knee"), LEG[:2], (ROOT, BALL))
    with pytest.raises(ValueError, match=r"mapped to nothing: foot \(\d+ degrees\); map each"):
        retarget(leg_motion(), short)
    result = retarget(leg_motion(), short, {"hip": "hip", "knee": "knee", "foot": None})
    np.testing.assert_allclose(
        forward_kinematics(result)[0], forward_kinematics(leg_motion())[0][:, :2], atol=1e-9
    )
    still = leg_motion().channels.copy()
    still[:, 9:] = 0.5  # half a degree is no movement
    assert retarget(leg_motion().with_channels(still), short).n_frames == 20


@pytest.mark.parametrize(
    ("joint_map", "message"),
    [
        ({"hip": "hip", "kne": "knee"}, "the motion has no joint 'kne'; the nearest names are kne"),
        ({"hip": "pelvis"}, "the target has no joint 'pelvis'; the nearest names are"),
        ({"hip": "hip", "knee": "foot", "foot": "foot"}, "follow one joint, got 'knee' and 'foot'"),
        ({"knee": "knee", "foot": "foot"}, "the target's root 'hip' must follow a joint"),
        ({}, "the target's root 'hip' must follow a joint"),
    ],
)
def test_maps_that_make_no_sense(joint_map, message):
    with pytest.raises(ValueError, match=message):
        retarget(leg_motion(), leg_motion().skeleton, joint_map)


def test_rest_poses_must_agree():
    bent = line(("hip", "knee", "foot"), ((0, 0, 0), (0, -4, 0), (0, -4, 4)), (ROOT, BALL, BALL))
    message = "from 'knee' to 'foot' the target points 45 degrees away.*expected at most 15"
    with pytest.raises(ValueError, match=message):
        retarget(leg_motion(), bent)
    assert retarget(leg_motion(), bent, rest_tolerance_deg=50).n_frames == 20


def test_paths_need_channels_legs_and_numbers():
    motion = leg_motion()
    flat = line(("hip", "knee", "foot"), LEG, (("Xposition", "Zposition", *BALL), BALL, BALL))
    with pytest.raises(ValueError, match="moves along Y, but the target's root 'hip' has no Ypos"):
        retarget(motion, flat)
    with pytest.raises(ValueError, match="expected a leg"):
        retarget(motion, motion.skeleton, {"hip": "hip", "knee": None, "foot": None})
    with pytest.raises(ValueError, match="expected a scale above 0, got -1"):
        retarget(motion, motion.skeleton, scale=-1)
    channels = motion.channels.copy()
    channels[3, 7] = np.nan
    with pytest.raises(ValueError, match=r"knee.Yrotation is NaN in frame 3; fill the gaps"):
        retarget(motion.with_channels(channels), motion.skeleton)


def test_between_the_two_skeletons_of_subject_02(data_dir):
    """From CMU's own 31 joints to the public conversion's, which rests in the same pose.

    The target lacks the thorax bone: its legs must come out right, its neck lower.
    """
    folder = data_dir / "cmu_asfamc"
    motion = convert(folder / "02.asf", folder / "02_01.amc")
    target = load_bvh(data_dir / "cmu" / "walk_20.bvh").skeleton
    names = {"root": "Hips", "lowerback": "LowerBack", "upperback": "Spine", "thorax": "Spine1"}
    names |= {"lowerneck": "Neck", "upperneck": "Neck1", "head": "Head"}
    for letter, side in (("l", "Left"), ("r", "Right")):
        pairs = {"femur": "UpLeg", "tibia": "Leg", "foot": "Foot", "toes": "ToeBase"}
        pairs |= {"clavicle": "Shoulder", "humerus": "Arm", "radius": "ForeArm", "wrist": "Hand"}
        pairs |= {"hand": "FingerBase", "fingers": "HandIndex1"}
        names |= {letter + a: side + b for a, b in pairs.items()}
        names |= {letter + "thumb": side[0] + "Thumb"}
    result = retarget(motion, target, names)
    ours, theirs = forward_kinematics(motion)[0], forward_kinematics(result)[0]

    def apart(a, b):
        there = theirs[:, target.joint_names.index(b)]
        return np.linalg.norm(ours[:, motion.skeleton.joint_names.index(a)] - there, axis=1).max()

    assert max(apart("l" + a, "Left" + b) for a, b in list(pairs.items())[:4]) < 1e-3
    assert 2.0 < apart("lowerneck", "Neck") < 2.1
