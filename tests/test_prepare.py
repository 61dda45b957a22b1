"""On the way in: the T-pose goes, an impossible frame time is corrected, nothing else."""

import csv
from dataclasses import replace

import numpy as np
import pytest

from data_tools.prepare import FALL_G, fall_g, has_tpose_frame, prepare, strides_per_s
from mocaplab.bvh import load_bvh


def with_tpose(motion):
    """Put a frame without any rotation in front, at the place of the first frame."""
    rest = np.where(motion.skeleton.is_rotation, 0.0, motion.channels[0])
    return motion.with_channels(np.concatenate([rest[None], motion.channels]))


@pytest.mark.parametrize("name", ["walk_01", "jog_01", "run_01", "jump_01", "kick_01"])
def test_a_tpose_goes_and_the_rest_stays(embedded, name):
    clip = embedded[name]
    prepared = prepare(with_tpose(clip), name.split("_")[0])
    assert prepared.notes == ("took away the T-pose in front",)
    np.testing.assert_array_equal(prepared.motion.channels, clip.channels)


def test_a_clip_without_a_tpose_stays(embedded):
    for clip, action in zip(embedded.clips, embedded.actions, strict=True):
        prepared = prepare(clip, action)
        assert prepared.motion is clip, prepared.notes
        assert prepared.is_usual


def test_a_full_turn_is_no_step(embedded):
    clip = embedded["walk_01"]
    channels = clip.channels.copy()
    channels[0, clip.skeleton.is_rotation] += 360.0
    assert not has_tpose_frame(clip.with_channels(channels))


def test_a_tpose_that_the_actor_holds_stays(embedded):
    clip = with_tpose(with_tpose(embedded["walk_01"]))
    assert not has_tpose_frame(clip)  # two frames: it is part of the recording


def test_very_short_clips_are_left_alone(embedded):
    clip = embedded["walk_01"].slice_frames(0, 3)
    assert prepare(clip, "walk").motion is clip
    assert strides_per_s(clip) is None
    assert fall_g(clip) is None


def test_a_skeleton_without_ankles_or_height_is_left_alone(small_motion):
    assert strides_per_s(small_motion) is None
    prepared = prepare(small_motion, "walk")
    assert prepared.motion is small_motion
    assert not prepared.is_usual


@pytest.mark.parametrize("name", ["run_01", "jog_02", "jump_01"])
def test_a_header_that_lies_is_corrected(embedded, name):
    clip, action = embedded[name], name.split("_")[0]
    fast = replace(clip, channels=clip.channels[::2])  # a take at 60 fps that says 120
    slow = replace(clip, frame_time=1 / 60)
    assert prepare(fast, action).motion.fps == pytest.approx(60)
    assert prepare(slow, action).motion.fps == pytest.approx(120)
    (note,) = prepare(fast, action).notes
    assert note.startswith("set 60 fps: at the header's 120")


def test_a_walk_at_double_speed_is_corrected(embedded):
    clip = embedded["walk_01"]
    fast = prepare(replace(clip, channels=clip.channels[::2]), "walk")
    assert fast.motion.fps == pytest.approx(60)
    assert not fast.is_usual


def test_an_honest_header_of_60_fps_is_believed(embedded):
    for name in ("walk_01", "run_01", "jump_01"):
        clip = replace(embedded[name], channels=embedded[name].channels[::2], frame_time=1 / 60)
        assert prepare(clip, name.split("_")[0]).motion is clip


def test_a_strange_rate_is_told(embedded):
    clip = replace(embedded["walk_01"], frame_time=1 / 50)
    prepared = prepare(clip, "walk")
    assert prepared.notes == ("50 fps is not a rate at which CMU recorded",)
    assert prepared.motion is clip


def test_the_fall_of_a_stone_is_one_g(embedded):
    clip = embedded["jump_01"]
    t = clip.time_s
    channels = np.zeros_like(clip.channels)
    channels[:, 1] = -0.5 * 9.81 / 0.0254 * 0.45 * t**2
    assert fall_g(clip.with_channels(channels)) == pytest.approx(1.0)


def test_real_clips_are_told_right_from_wrong(data_dir):
    with open(data_dir / "cmu" / "clips.csv", newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["action"] != "basketball"]
    found = 0
    for row in rows:
        clip, action = load_bvh(data_dir / "cmu" / f"{row['clip']}.bvh"), row["action"]
        assert prepare(clip, action).notes == (), row["clip"]
        honest = replace(clip, channels=clip.channels[::2], frame_time=1 / 60)
        assert prepare(honest, action).notes == (), row["clip"]
        assert has_tpose_frame(with_tpose(clip)), row["clip"]
        lie = replace(clip, channels=clip.channels[::2])
        found += prepare(lie, action).motion.fps == 60
        if action in FALL_G:
            assert prepare(lie, action).motion.fps == 60, row["clip"]
            slow = replace(clip, frame_time=1 / 60)
            assert prepare(slow, action).motion.fps == 120, row["clip"]
    assert found >= 70
