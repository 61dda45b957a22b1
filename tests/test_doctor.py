"""Planted defects are found, each in its place and no other; sound clips raise no alarm."""

from __future__ import annotations

from collections import Counter
from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest

from mocaplab.bvh import load_bvh
from mocaplab.corruption import corrupt
from mocaplab.doctor import diagnose
from mocaplab.euler import alternate_euler, rotation_triples
from mocaplab.findings import Finding, summarize
from mocaplab.motion import Motion
from mocaplab.noise.angular import angular_noise


def defects(motion):
    """What was found, constant angles left out."""
    return [finding for finding in diagnose(motion) if finding.kind != "constant"]


def only(motion, kind):
    """The one finding there must be."""
    (finding,) = defects(motion)
    assert finding.kind == kind
    assert finding.message.endswith(".")
    assert finding.message.count("\n") == 0
    return finding


def columns_of(motion, joint):
    """The rotation channels and the Euler order of a joint."""
    index = motion.skeleton.joint_names.index(joint)
    return next((c, order) for j, c, order in rotation_triples(motion.skeleton) if j == index)


def edited(motion, frames, columns, values):
    channels = motion.channels.copy()
    channels[frames, columns] = values
    return motion.with_channels(channels)


def test_no_embedded_clip_raises_an_alarm(embedded):
    kinds = Counter(finding.kind for clip in embedded.clips for finding in diagnose(clip))
    assert set(kinds) <= {"constant", "near gimbal lock"}


def test_full_turns_are_found_in_their_channel(walk):
    column = walk.skeleton.channel_index("LeftLeg.Xrotation")
    channels = walk.channels.copy()
    channels[50:60, column] += 360
    finding = only(walk.with_channels(channels), "full turn")
    assert (finding.where, finding.frames) == ("LeftLeg.Xrotation", ((50, 50), (60, 60)))
    assert finding.message.startswith("LeftLeg.Xrotation: 2 full turns, frames 50, 60: ")
    assert finding.severity == "warning"


def test_full_turns_of_a_hinge_are_found(small_motion):
    channels = small_motion.channels.copy()
    channels[10:, -1] -= 720
    finding = only(small_motion.with_channels(channels), "full turn")
    assert (finding.where, finding.frames) == ("Leg.Xrotation", ((10, 10),))


def test_branch_switches_are_found_and_not_told_as_turns(walk):
    columns, order = columns_of(walk, "LeftArm")
    channels = walk.channels.copy()
    channels[60:80, columns] = alternate_euler(channels[60:80, columns], order)
    finding = only(walk.with_channels(channels), "branch switch")
    assert (finding.where, finding.frames) == ("LeftArm", ((60, 60), (80, 80)))


def test_frames_near_lock_are_found_as_ranges(walk):
    columns, order = columns_of(walk, "Neck")
    assert order[0] != order[1] != order[2] != order[0]
    swing = 84 * np.sin(np.linspace(0, 2 * np.pi, walk.n_frames)) ** 3
    motion = edited(walk, slice(None), columns[1], swing)
    assert not [f for f in defects(motion) if f.kind == "near gimbal lock"]
    motion = edited(walk, slice(None), columns[1], swing / 84 * 88)
    finding = only(motion, "near gimbal lock")
    expected = np.flatnonzero(np.abs(swing / 84 * 88) > 85)
    first, second = finding.frames
    frames = [*range(first[0], first[1] + 1), *range(second[0], second[1] + 1)]
    np.testing.assert_array_equal(frames, expected)
    assert (finding.where, finding.severity) == ("Neck", "note")
    assert f"frames {first[0]} to {first[1]}, {second[0]} to {second[1]}" in finding.message


def test_constant_angles_are_listed(walk):
    before = {f.where for f in diagnose(walk)}
    column = walk.skeleton.channel_index("Head.Yrotation")
    assert "Head.Yrotation" not in before
    still = edited(walk, slice(None), column, 7.0 + 1e-7 * (np.arange(walk.n_frames) % 2))
    assert {f.where for f in diagnose(still)} - before == {"Head.Yrotation"}
    assert not any(f.where.startswith("Hips") for f in diagnose(still))


def test_missing_samples_are_told_first(walk):
    column = walk.skeleton.channel_index("Spine.Zrotation")
    motion = edited(walk, slice(20, 25), column, np.nan)
    finding = only(motion, "missing")
    assert (finding.where, finding.frames) == ("Spine.Zrotation", ((20, 24),))
    assert diagnose(motion)[0] == finding
    never = edited(walk, slice(None), column, np.nan)
    assert only(never, "missing").frames == ((0, walk.n_frames - 1),)


def test_a_wrap_is_found_beside_a_gap(walk):
    column = walk.skeleton.channel_index("Spine.Zrotation")
    channels = walk.channels.copy()
    channels[20:25, column] = np.nan
    channels[25:, column] -= 360
    found = {f.kind: f for f in defects(walk.with_channels(channels))}
    assert set(found) == {"missing", "full turn"}
    assert found["full turn"].where == "Spine.Zrotation"


def test_a_flip_that_no_angles_explain_is_a_jump(walk):
    columns, _ = columns_of(walk, "LeftHand")
    motion = edited(walk, slice(100, 103), columns[0], walk.channels[100:103, columns[0]] + 150)
    found = [f for f in defects(motion) if f.kind == "jump"]
    assert [(f.where, f.frames) for f in found] == [("LeftHand", ((100, 100), (103, 103)))]


def with_first(motion, pose):
    """Put a pose in front of a motion."""
    return motion.with_channels(np.concatenate([[pose], motion.channels]))


@pytest.mark.parametrize("name", ["walk_01", "run_03", "kick_02"])
def test_a_rest_pose_in_front_is_found(embedded, name):
    motion = embedded[name]
    zero = np.where(motion.skeleton.is_rotation, 0.0, motion.channels[0])
    finding = only(with_first(motion, zero), "rest pose")
    assert (finding.where, finding.frames) == ("", ((0, 0),))
    arms_out = motion.channels[0].copy()
    for side, angle in (("Left", 75), ("Right", -75)):
        arms_out[columns_of(motion, f"{side}Arm")[0]] += [angle, 0, 0]
    assert only(with_first(motion, arms_out), "rest pose").message.startswith("Frame 0 is a rest")


def test_a_first_pose_that_comes_again_is_no_rest_pose(walk):
    columns, _ = columns_of(walk, "LeftArm")
    raised = walk.channels.copy()
    raised[[0, *range(100, 140)], columns[0]] += 60
    assert "rest pose" not in {f.kind for f in defects(walk.with_channels(raised))}


@pytest.mark.parametrize("name", ["run_01", "run_03", "run_10"])
def test_thirty_frames_said_to_be_120_are_doubted(embedded, name):
    motion = embedded[name]
    thirty = motion.with_channels(motion.channels[::4])
    finding = only(thirty, "frame time")
    assert finding.message.startswith("At 120 frames per second, joints turn ")
    assert "check the frame time" in finding.message
    assert not defects(replace(thirty, frame_time=1 / 30))
    assert not defects(replace(motion, frame_time=1 / 30))  # slow motion is possible


def test_a_root_too_fast_for_people_is_doubted(walk):
    channels = walk.channels.copy()
    channels[:, 2] *= 8
    assert only(walk.with_channels(channels), "frame time").frames == ()


@pytest.mark.parametrize("k", [0.1, 0.5, 0.9])
def test_noise_is_not_taken_for_a_wrong_frame_time_or_a_rest_pose(walk, k):
    noisy = angular_noise(walk, k, rng=np.random.default_rng(0))
    assert not {f.kind for f in defects(noisy)} & {"frame time", "rest pose", "jump"}
    holed = corrupt(walk, f"angular:{k}", rng=np.random.default_rng(1)).observed
    assert not {f.kind for f in defects(holed)} & {"frame time", "rest pose", "jump"}


@pytest.mark.parametrize("n_frames", [1, 2, 3])
def test_the_shortest_motions_are_looked_at_too(walk, n_frames):
    assert not defects(walk.slice_frames(0, n_frames))
    gap = np.full((n_frames, walk.skeleton.n_channels), np.nan)
    assert {f.kind for f in diagnose(walk.with_channels(gap))} == {"missing"}


def test_findings_cannot_be_changed_and_summaries_are_short(walk):
    findings = diagnose(walk)
    assert all(isinstance(finding, Finding) for finding in findings)
    with pytest.raises(FrozenInstanceError):
        findings[0].where = "elsewhere"
    (line,) = summarize(findings)
    assert line.startswith(f"{len(findings)} constant angles in ")
    assert f" and {len(findings) - 3} more: " in line
    assert summarize([]) == []


def test_a_summary_names_the_worst_first():
    turns = [
        Finding("full turn", where, tuple((t, t) for t in range(n)), "warning", "")
        for where, n in (("a", 1), ("b", 5), ("c", 2), ("d", 3))
    ]
    still = Finding("constant", "e", (), "note", "")
    first, second = summarize([*turns, still], most=2)
    assert first.startswith("11 full turns in b, d and 2 more: ")
    assert second.startswith("1 constant angle in e: ")


def test_a_rest_pose_that_is_blended_into_the_movement(walk):
    zero = np.where(walk.skeleton.is_rotation, 0.0, walk.channels[0])
    arms = [c for side in ("Left", "Right") for c in columns_of(walk, f"{side}Arm")[0]]
    zero[arms] = [90, 0, 0, -90, 0, 0]
    blend = np.linspace(zero, walk.channels[0], 4)[1:-1]
    finding = only(with_first(walk.with_channels([*blend, *walk.channels]), zero), "rest pose")
    assert finding.frames == ((0, 2),)
    assert finding.message.startswith("Frames 0 to 2 are a rest pose")


@pytest.mark.parametrize("name", ["salsa_10", "martial_04"])
def test_real_files_with_a_rest_pose(data_dir, name):
    motion = load_bvh(data_dir / "cmu_daz" / f"{name}.bvh")
    (finding,) = (f for f in diagnose(motion) if f.kind == "rest pose")
    ((first, last),) = finding.frames
    assert (first, last) == (0, 3)  # both are blended over four frames
    rest = motion.slice_frames(last + 1, motion.n_frames)
    assert "rest pose" not in {f.kind for f in diagnose(rest)}


def test_real_clips_have_no_rest_pose_and_a_frame_time_that_can_be(data_dir):
    paths = sorted((data_dir / "cmu").glob("*.bvh"))
    assert len(paths) > 70
    for path in paths:
        motion: Motion = load_bvh(path)
        assert not {f.kind for f in diagnose(motion)} & {"rest pose", "frame time", "missing"}
