"""Skeleton, Motion and Corrupted: what they refuse, and that nobody can change them."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from mocaplab.motion import Corrupted, Motion, Skeleton

GOOD = {
    "joint_names": ("Hips", "Leg"),
    "parents": [-1, 0],
    "offsets": [[0, 0, 0], [0, -1, 0]],
    "channel_names": (("Yposition", "Zrotation"), ("Xrotation",)),
    "end_site_parents": [1],
    "end_site_offsets": [[0, -1, 0]],
}


def two_joints(**changes: object) -> Skeleton:
    return Skeleton(**{**GOOD, **changes})


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"joint_names": ()}, "at least one joint"),
        ({"joint_names": ("Hips", "Hips")}, "unique, got 'Hips' more than once"),
        ({"parents": [-1]}, r"2 joints need parents of shape \(2,\)"),
        ({"parents": [0, 0]}, "joint 0 must be the root"),
        ({"parents": [-1, 1]}, "parents precede children"),
        ({"parents": [-1, -1]}, "parents precede children"),
        ({"offsets": [[0, 0], [0, 1]]}, r"offsets of shape \(2, 3\).*got .*\(2, 2\)"),
        ({"offsets": [[0, 0, 0], [0, np.nan, 0]]}, "finite"),
        ({"end_site_offsets": [[0, np.inf, 0]]}, "finite"),
        ({"end_site_offsets": [0, 1, 0]}, r"1 end sites need .*got .*\(3,\)"),
        ({"end_site_parents": [[1]]}, r"1 end sites need parents of shape \(1,\)"),
        ({"end_site_parents": [2]}, "end_site_parents must lie between 0 and 1"),
        ({"end_site_parents": [-1]}, "end_site_parents must lie between 0 and 1"),
        ({"channel_names": (("Xrotation",),)}, "must list 2 joints, got 1"),
        ({"channel_names": (("xrotation",), ())}, "'Hips' has unknown or repeated"),
        ({"channel_names": ((), ("Xrotation", "Xrotation"))}, "'Leg' has unknown or repeated"),
        ({"channel_names": ((), ())}, "at least one channel"),
    ],
)
def test_skeleton_refuses(changes, message):
    with pytest.raises(ValueError, match=message):
        two_joints(**changes)


def test_skeleton_describes_its_channels():
    skeleton = two_joints()
    assert (skeleton.n_joints, skeleton.n_channels) == (2, 3)
    assert skeleton.channel_labels == ("Hips.Yposition", "Hips.Zrotation", "Leg.Xrotation")
    assert skeleton.channel_joint.tolist() == [0, 0, 1]
    assert skeleton.is_rotation.tolist() == [False, True, True]
    assert skeleton.is_cleaned.tolist() == [False, False, True]  # not the root's heading
    assert skeleton.channel_index("Leg.Xrotation") == 2


def test_skeleton_may_have_no_end_sites():
    skeleton = two_joints(end_site_parents=[], end_site_offsets=np.zeros((0, 3)))
    assert skeleton.end_site_parents.shape == (0,)


def test_a_mistyped_channel_is_answered_with_the_nearest_names():
    with pytest.raises(ValueError, match=r"no channel 'Leg.Xrotaton'.*Leg\.Xrotation"):
        two_joints().channel_index("Leg.Xrotaton")


def test_lists_are_as_good_as_tuples():
    from_lists = two_joints(joint_names=["Hips", "Leg"], channel_names=[["Yposition"], []])
    assert from_lists.joint_names == ("Hips", "Leg")
    assert from_lists.channel_names == (("Yposition",), ())


def test_same_as_looks_at_joints_and_channels_not_at_bone_lengths():
    assert two_joints().same_as(two_joints(offsets=np.ones((2, 3))))
    assert not two_joints().same_as(two_joints(joint_names=("Hips", "Arm")))
    assert not two_joints().same_as(two_joints(channel_names=(("Zrotation", "Yposition"), ())))


@pytest.mark.parametrize(
    "name",
    [
        "parents",
        "offsets",
        "end_site_parents",
        "end_site_offsets",
        "channel_joint",
        "is_rotation",
        "is_cleaned",
    ],
)
def test_skeleton_arrays_are_read_only(name):
    with pytest.raises(ValueError, match="read-only"):
        getattr(two_joints(), name)[0] = 0


def test_motion_copies_what_it_is_given_and_locks_it():
    values = np.zeros((4, 3))
    motion = Motion(two_joints(), 0.01, values)
    values[0, 0] = 7.0
    assert motion.channels[0, 0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        motion.channels[0, 0] = 1.0
    with pytest.raises(dataclasses.FrozenInstanceError):
        motion.frame_time = 1.0


@pytest.mark.parametrize(
    ("frame_time", "channels", "message"),
    [
        (0.01, np.zeros((4, 2)), r"'walk': channels must be \(T, 3\) with T > 0, got \(4, 2\)"),
        (0.01, np.zeros((0, 3)), r"got \(0, 3\)"),
        (0.01, np.zeros(3), r"got \(3,\)"),
        (0.0, np.zeros((4, 3)), "frame time must be positive, got 0.0"),
        (-0.1, np.zeros((4, 3)), "frame time must be positive"),
        (np.nan, np.zeros((4, 3)), "frame time must be positive"),
        (np.inf, np.zeros((4, 3)), "frame time must be positive"),
        (0.01, [[0, 0, 0], [0, 0, -np.inf]], "Leg.Xrotation is infinite in frame 1"),
    ],
)
def test_motion_refuses(frame_time, channels, message):
    with pytest.raises(ValueError, match=message):
        Motion(two_joints(), frame_time, channels, name="walk")


def test_motion_keeps_time():
    motion = Motion(two_joints(), np.float64(0.25), np.zeros((5, 3)))
    assert (motion.n_frames, motion.fps, motion.duration_s) == (5, 4.0, 1.0)
    assert motion.time_s.tolist() == [0, 0.25, 0.5, 0.75, 1]
    assert type(motion.frame_time) is float  # so that its repr is a plain number


def test_motion_gives_parts_of_itself():
    motion = Motion(two_joints(), 0.01, np.arange(12.0).reshape(4, 3), name="walk")
    assert motion.channel("Leg.Xrotation").tolist() == [2, 5, 8, 11]
    assert motion.slice_frames(1, 3).channels.tolist() == [[3, 4, 5], [6, 7, 8]]
    changed = motion.with_channels(np.ones((2, 3)))
    assert (changed.name, changed.n_frames, motion.n_frames) == ("walk", 2, 4)
    with pytest.raises(ValueError, match="T > 0"):
        motion.slice_frames(3, 3)


def test_motion_may_hold_nan():
    assert np.isnan(Motion(two_joints(), 0.01, [[0, np.nan, 0]]).channels[0, 1])


def test_corrupted_checks_that_mask_and_nan_agree():
    clean = Motion(two_joints(), 0.01, np.zeros((2, 3)))
    holed = clean.with_channels([[0, 0, 0], [0, 0, np.nan]])
    mask = ~np.isnan(holed.channels)
    corrupted = Corrupted(clean, holed, mask)
    with pytest.raises(ValueError, match="read-only"):
        corrupted.mask[0, 0] = False
    with pytest.raises(ValueError, match=r"disagree at frame 1, channel Leg\.Xrotation"):
        Corrupted(clean, holed, np.ones((2, 3), dtype=bool))
    with pytest.raises(ValueError, match=r"disagree at frame 0, channel Hips\.Yposition"):
        Corrupted(clean, holed, np.zeros((2, 3), dtype=bool))
    with pytest.raises(ValueError, match="one shape"):
        Corrupted(clean, holed.slice_frames(0, 1), mask)
