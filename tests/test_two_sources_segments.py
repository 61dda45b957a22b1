from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from mocaplab.two_sources.segments import (
    CMU_SEGMENTS,
    SegmentClip,
    all_windows,
    mean_pose,
    motion_to_segments,
    moving_segments,
    resample_segments,
    segment_names,
)


def quaternions_of(rotations, shape):
    return rotations.as_quat()[:, [3, 0, 1, 2]].reshape(*shape, 4)


@pytest.fixture
def turning():
    """Two segments: one turns evenly about z, 3 degrees a frame; the other never."""
    angles = np.radians(3.0 * np.arange(121))
    q = np.zeros((121, 2, 4))
    q[:, 0, 0], q[:, 0, 3] = np.cos(angles / 2), np.sin(angles / 2)
    q[:, 1, 0] = 1
    return SegmentClip(q, 1 / 120, ("Hips", "Arm"), "turning")


def test_cmu_has_22_segments_of_31_joints(walk):
    assert len(CMU_SEGMENTS) == len(set(CMU_SEGMENTS)) == 22
    assert segment_names(walk.skeleton) == CMU_SEGMENTS
    clip = motion_to_segments(walk, action="walk")
    assert clip.quaternions.shape == (walk.n_frames, 22, 4)
    assert clip.action == "walk"


def test_any_other_skeleton_gives_all_joints_that_turn(small_motion):
    clip = motion_to_segments(small_motion)
    assert clip.segments == small_motion.skeleton.joint_names
    assert motion_to_segments(small_motion, ["Leg"]).quaternions.shape == (40, 1, 4)


def test_rotations_are_those_of_scipy(small_motion):
    clip = motion_to_segments(small_motion, ["Left Arm"])
    columns = [small_motion.skeleton.channel_index(f"Left Arm.{axis}rotation") for axis in "YXZ"]
    expected = Rotation.from_euler("YXZ", small_motion.channels[:, columns], degrees=True)
    apart = expected.inv() * Rotation.from_quat(clip.quaternions[:, 0][:, [1, 2, 3, 0]])
    assert apart.magnitude().max() < 1e-12


def test_signs_do_not_jump(turning):
    jumping = turning.quaternions.copy()
    jumping[50:] *= -1
    clip = replace(turning, quaternions=jumping)
    assert np.sum(clip.quaternions[1:] * clip.quaternions[:-1], axis=-1).min() > 0


def test_resampling_agrees_with_scipy():
    rng = np.random.default_rng(0)
    rotations = Rotation.from_rotvec(rng.normal(size=(40, 3)).cumsum(axis=0) * 0.1)
    clip = SegmentClip(quaternions_of(rotations, (40, 1)), 1 / 120, ("a",))
    slower = resample_segments(clip, 25)
    times = np.arange(slower.n_frames) / 25
    assert times[-1] <= 39 / 120 < times[-1] + 1 / 25
    expected = Slerp(np.arange(40) / 120, rotations)(times)
    apart = expected.inv() * Rotation.from_quat(slower.quaternions[:, 0][:, [1, 2, 3, 0]])
    assert apart.magnitude().max() < 1e-7
    assert slower.frame_time == 1 / 25


def test_windows_are_all_runs_of_frames(turning):
    windows = all_windows(turning.quaternions, 60)
    assert windows.shape == (62, 60, 2, 4)
    np.testing.assert_array_equal(windows[7, 3], turning.quaternions[10])
    assert all_windows(turning.quaternions[:59], 60).shape == (0, 60, 2, 4)


def test_what_never_turns_does_not_move(turning):
    assert moving_segments([turning]).tolist() == [True, False]


def test_mean_pose_is_that_of_scipy():
    rng = np.random.default_rng(1)
    rotations = Rotation.from_rotvec([1, 2, 0.5] + 0.3 * rng.normal(size=(50, 3)))
    q = quaternions_of(rotations, (50, 1)) * rng.choice([-1, 1], size=(50, 1, 1))
    mean = mean_pose([SegmentClip(q, 0.01, ("a",))])
    assert (rotations.mean().inv() * Rotation.from_quat(mean[0, [1, 2, 3, 0]])).magnitude() < 1e-9


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"quaternions": np.ones((5, 2, 4))}, "length 1"),
        ({"quaternions": np.full((5, 2, 4), np.nan)}, "NaN or infinity for Hips in frame 0"),
        ({"quaternions": np.zeros((5, 3, 4))}, "expected shape"),
        ({"frame_time": 0.0}, "frame time above 0"),
    ],
)
def test_what_is_no_clip_is_refused(turning, change, message):
    with pytest.raises(ValueError, match=message):
        replace(turning, **change)


def test_wrong_requests_are_refused(small_motion, turning):
    with pytest.raises(ValueError, match="'Tail', found none"):
        motion_to_segments(small_motion, ["Tail"])
    with pytest.raises(ValueError, match="fps above 0"):
        resample_segments(turning, 0)
    with pytest.raises(ValueError, match="at least one clip"):
        mean_pose([])
