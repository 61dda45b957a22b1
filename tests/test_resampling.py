"""Resampling against closed forms, scipy's Slerp and exact fractions."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation, Slerp

from mocaplab.bvh import load_bvh
from mocaplab.euler import make_continuous, rotation_triples
from mocaplab.kinematics import forward_kinematics
from mocaplab.motion import Motion, Skeleton
from mocaplab.resampling import nominal_fps, resample, sample_times

ORDERS = ["XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX"]


def one_joint(channels, order="ZYX", fps=120.0) -> Motion:
    names = tuple(f"{axis}rotation" for axis in order)
    skeleton = Skeleton(("Root",), [-1], np.zeros((1, 3)), (names,), [], np.zeros((0, 3)))
    return Motion(skeleton, 1 / fps, channels)


def matrices(motion: Motion) -> np.ndarray:
    order = "".join(kind[0] for kind in motion.skeleton.channel_kind)
    return Rotation.from_euler(order, motion.channels, degrees=True).as_matrix()


@pytest.mark.parametrize("frame_time", [1 / 120, 0.0083333, 0.00833333, 0.008333])
def test_121_frames_at_120_fps_become_31_at_30(small_motion, frame_time):
    """Headers round 1/120; one second is one second all the same."""
    channels = np.random.default_rng(0).normal(size=(121, 16))
    motion = Motion(small_motion.skeleton, frame_time, channels)
    down = resample(motion, 30)
    assert down.n_frames == 31
    assert down.fps == pytest.approx(30, rel=1e-12)
    np.testing.assert_array_equal(down.channels, channels[::4])
    assert resample(motion, 60).n_frames == 61
    assert resample(motion, 240).n_frames == 241
    assert resample(motion.slice_frames(0, 120), 30).n_frames == 30
    assert resample(motion.slice_frames(0, 1), 30).n_frames == 1


@pytest.mark.parametrize(
    ("fps", "nominal"),
    [
        (1 / 0.0083333, 120),
        (1 / 0.0333333, 30),
        (1 / 0.0333667, 30000 / 1001),
        (1 / 0.0416667, 24),
        (1 / 0.016683, 60000 / 1001),
        (12.5, 12.5),
        (0.3, 0.3),
    ],
)
def test_rounded_rates_are_told(fps, nominal):
    assert nominal_fps(fps) == pytest.approx(nominal, rel=1e-12)


@settings(max_examples=300, deadline=None)
@given(
    st.integers(1, 200),
    st.fractions(5, 250, max_denominator=60),
    st.fractions(5, 250, max_denominator=60),
)
def test_frames_are_counted_as_fractions_count_them(n_frames, source, target):
    """Frame k belongs to the result if k / target is not after (n - 1) / source."""
    times = sample_times(n_frames, float(source), float(target))
    exact = [k * source / target for k in range(len(times) + 1)]
    assert exact[-2] <= n_frames - 1 < exact[-1]
    np.testing.assert_allclose(times, np.array(exact[:-1], dtype=float), atol=2e-6)
    meets = np.array([moment.denominator == 1 for moment in exact[:-1]])
    assert np.all(times[meets] == np.round(times[meets]))


@settings(max_examples=60, deadline=None)
@given(
    st.integers(1, 60),
    st.floats(5, 300),
    st.floats(5, 300),
)
def test_any_rate_gives_the_same_span_of_time(n_frames, source, target):
    motion = one_joint(np.zeros((n_frames, 3)), fps=source)
    result = resample(motion, target)
    assert result.fps == pytest.approx(target, rel=3e-6)
    slack = 1e-4 * (motion.duration_s + motion.frame_time)  # of rates that count as rounded
    assert result.duration_s <= motion.duration_s + slack
    assert result.duration_s > motion.duration_s - result.frame_time - slack


@pytest.mark.parametrize("fps", [30, 50, 120, 144, 29.97])
def test_an_even_turn_stays_even(fps):
    """A tilted axis, 200 degrees a second: at time t the joint has turned by 200 t."""
    axis = np.array([2.0, -1.0, 2.0]) / 3

    def turned(time_s):
        return Rotation.from_rotvec(np.radians(200 * time_s)[:, None] * axis)

    motion = one_joint(turned(np.arange(100) / 60).as_euler("ZYX", degrees=True), fps=60)
    result = resample(motion, fps)
    np.testing.assert_allclose(matrices(result), turned(result.time_s).as_matrix(), atol=1e-9)


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("fps", [11.0, 24, 47.3, 240])
def test_three_rotations_are_as_scipys_slerp_says(order, fps):
    path = np.cumsum(np.random.default_rng(1).normal(scale=20, size=(40, 3)), axis=0)
    motion = one_joint(path, order, fps=30)
    result = resample(motion, fps)
    source = Rotation.from_euler(order, path, degrees=True)
    expected = Slerp(motion.time_s, source)(np.minimum(result.time_s, motion.time_s[-1]))
    np.testing.assert_allclose(matrices(result), expected.as_matrix(), atol=1e-9)


def test_positions_and_hinges_change_linearly(small_motion):
    result = resample(small_motion, 97)
    triples = {c for _, columns, _ in rotation_triples(small_motion.skeleton) for c in columns}
    others = [c for c in range(16) if c not in triples]
    assert others == [0, 1, 2, 15]
    for c in others:
        expected = np.interp(result.time_s, small_motion.time_s, small_motion.channels[:, c])
        np.testing.assert_allclose(result.channels[:, c], expected, atol=1e-9)


def test_hinges_take_the_shorter_way_across_180_degrees():
    """Halves: a new frame follows the turns of the nearer of its neighbours."""
    motion = one_joint([[170.0], [-170.0], [-150.0]], "X", fps=1)
    angles = resample(motion, 4).channels[:, 0]
    np.testing.assert_allclose(
        angles, [170, 175, 180, -175, -170, -165, -160, -155, -150], atol=1e-12
    )


def test_angles_stay_near_the_sources(small_motion):
    """Going up, no angle may jump further than the source does."""
    largest = np.abs(np.diff(small_motion.channels, axis=0)).max(axis=0)
    up = resample(small_motion, 333)
    assert np.all(np.abs(np.diff(up.channels, axis=0)).max(axis=0) <= largest)


def test_full_turns_and_branch_switches_stay_where_they_are():
    smooth = np.linspace([0, -40, 10], [50, 60, 40], 31)
    jumpy = smooth.copy()
    jumpy[10:20] += [360, 0, -360]
    jumpy[20:] = jumpy[20:] * [1, -1, 1] + [180, 180, -180]
    up = resample(one_joint(jumpy, fps=30), 120)
    np.testing.assert_array_equal(up.channels[::4], jumpy)
    plain = resample(one_joint(smooth, fps=30), 120)
    np.testing.assert_allclose(matrices(up), matrices(plain), atol=1e-9)
    np.testing.assert_allclose(make_continuous(up).channels, plain.channels, atol=1e-9)
    assert np.sum(np.abs(np.diff(up.channels, axis=0)).max(axis=1) > 90) == 2


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("middle", [90.0, -90.0])
def test_a_joint_at_gimbal_lock_does_not_jump(order, middle):
    """First and third angle both change there; a rotation tells only their sum."""
    angles = np.stack([30 + np.arange(9.0), np.full(9, middle), -70 + 2 * np.arange(9.0)], axis=1)
    up = resample(one_joint(angles, order, fps=30), 120)
    expected = np.linspace(angles[0], angles[-1], 33)
    np.testing.assert_allclose(up.channels, expected, atol=1e-5)


def test_up_and_down_again_gives_the_same_numbers(small_motion):
    up = resample(small_motion, 240)
    np.testing.assert_array_equal(up.channels[::4], small_motion.channels)
    np.testing.assert_array_equal(resample(up, 60).channels, small_motion.channels)
    same = resample(small_motion, small_motion.fps)
    np.testing.assert_array_equal(same.channels, small_motion.channels)


def test_samples_next_to_missing_ones_are_missing(small_motion):
    channels = small_motion.channels.copy()
    channels[10, 15] = channels[20, 3] = np.nan  # a hinge; one rotation of the root
    up = resample(small_motion.with_channels(channels), 120)
    missing = np.isnan(up.channels)
    assert np.flatnonzero(missing[:, 15]).tolist() == [19, 20, 21]
    assert np.flatnonzero(missing[:, 3]).tolist() == [39, 40, 41]
    for other in (4, 5):  # in frame 40 they were observed
        assert np.flatnonzero(missing[:, other]).tolist() == [39, 41]
    assert missing.sum() == 3 + 3 + 2 * 2


@pytest.mark.parametrize("fps", [0, -30, np.nan, np.inf])
def test_rates_must_be_above_zero(small_motion, fps):
    with pytest.raises(ValueError, match="motion 'small': expected fps above 0"):
        resample(small_motion, fps)


@pytest.mark.parametrize("name", ["cmu/walk_20.bvh", "cmu/kick_02.bvh", "cmu_daz/martial_04.bvh"])
def test_real_clips_keep_their_path(data_dir, name):
    """Every fourth frame is exact; back at 120 fps a joint is off by little."""
    motion = load_bvh(data_dir / name)
    n_frames = min(477, motion.n_frames - 11) // 4 * 4 + 1
    motion = motion.slice_frames(10, 10 + n_frames)  # some come out of a T-pose
    down = resample(motion, 30)
    assert down.n_frames == n_frames // 4 + 1
    np.testing.assert_array_equal(down.channels, motion.channels[::4])
    back = resample(down, 120)
    np.testing.assert_array_equal(back.channels[::4], motion.channels[::4])
    positions = forward_kinematics(motion)[0]
    apart = np.linalg.norm(forward_kinematics(back)[0] - positions, axis=-1)
    height = np.ptp(positions[0], axis=0).max()
    print(f"{name}: off by at most {100 * apart.max() / height:.2f} % of the body's height")
    assert apart.max() < 0.05 * height
