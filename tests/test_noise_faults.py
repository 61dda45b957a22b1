"""Faults of real captures."""

import numpy as np
import pytest

from mocaplab.kinematics import forward_kinematics
from mocaplab.motion import Motion, Skeleton, moving_channels
from mocaplab.noise.angular import movement_std
from mocaplab.noise.faults import (
    drift,
    dropped_frames,
    frozen_frames,
    quantise,
    spikes,
    swaps,
)

FAULTS = (spikes, frozen_frames, dropped_frames, swaps, drift, quantise)


@pytest.fixture
def long_walk(walk):
    """The walk over and over, for ten seconds or a bit more."""
    return walk.with_channels(np.tile(walk.channels, (1200 // walk.n_frames + 1, 1)))


def at_30_fps(motion):
    return Motion(motion.skeleton, 4 * motion.frame_time, motion.channels[::4])


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_repeat_and_leave_the_root_alone(walk, fault):
    amount = 0.01 if fault is spikes else 5.0
    a, b, c = (fault(walk, amount, rng=np.random.default_rng(s)).channels for s in (1, 1, 2))
    np.testing.assert_array_equal(a, b)
    assert fault is quantise or not np.array_equal(a, c, equal_nan=True)
    root = walk.skeleton.channel_joint == 0
    np.testing.assert_array_equal(a[:, root], walk.channels[:, root])
    assert not np.array_equal(a, walk.channels, equal_nan=True)


@pytest.mark.parametrize("fault", FAULTS)
def test_none_of_it_is_no_change(walk, fault):
    same = fault(walk, 0.0, rng=np.random.default_rng(0))
    np.testing.assert_array_equal(same.channels, walk.channels)


@pytest.mark.parametrize("fault", FAULTS)
@pytest.mark.parametrize("amount", [-1.0, np.nan, np.inf])
def test_nonsense_is_refused(walk, fault, amount):
    with pytest.raises(ValueError, match="must lie in"):
        fault(walk, amount, rng=np.random.default_rng(0))


@pytest.mark.parametrize("change", [lambda m: m, at_30_fps], ids=["120 fps", "30 fps"])
def test_spikes_are_three_deviations_high(long_walk, change):
    motion = change(long_walk)
    moving = moving_channels(motion)
    spiky = spikes(motion, 0.01, rng=np.random.default_rng(0))
    added = (spiky.channels - motion.channels)[:, moving]
    height = np.abs(added) / movement_std(motion)[moving]
    assert set(np.round(height[height > 0], 9)) == {3.0}
    assert np.mean(height > 0) == pytest.approx(0.01, rel=0.2)
    assert (added > 0).sum() == pytest.approx((added < 0).sum(), rel=0.3)


@pytest.mark.parametrize("fault", [frozen_frames, dropped_frames, swaps])
def test_as_many_frames_are_spoilt_at_30_frames_per_second(walk, fault):
    def share(motion):
        spoilt = fault(motion, 1.0, rng=np.random.default_rng(0)).channels != motion.channels
        return spoilt.any(axis=1).mean()

    # Five minutes of movement that never repeats, so that holding or mirroring always shows.
    time_s = np.arange(300 * 120)[:, None] / 120
    phase = np.arange(walk.skeleton.n_channels) ** 2
    fine = Motion(walk.skeleton, 1 / 120, 20 * np.sin(time_s * np.sqrt(2) + phase) + time_s)
    theory = 1 - np.exp(-0.05)  # 300 times, each for 0.05 s, some at the same time
    assert share(fine) == pytest.approx(theory, rel=0.2)
    assert share(at_30_fps(fine)) == pytest.approx(theory, rel=0.2)


def test_a_frozen_frame_is_the_last_one_before(walk):
    frozen = frozen_frames(walk, 3.0, rng=np.random.default_rng(0)).channels
    held = np.flatnonzero((frozen != walk.channels).any(axis=1))
    assert 0 < held.size < walk.n_frames
    cleaned = walk.skeleton.is_cleaned
    np.testing.assert_array_equal(frozen[held][:, cleaned], frozen[held - 1][:, cleaned])


def test_dropped_frames_are_whole_and_inside(walk):
    hidden = np.isnan(dropped_frames(walk, 3.0, rng=np.random.default_rng(0)).channels)
    cleaned = walk.skeleton.is_cleaned
    assert (hidden[:, cleaned].all(axis=1) == hidden.any(axis=1)).all()
    assert hidden.any()
    assert not hidden[[0, -1]].any()


def test_swapped_limbs_are_each_others_mirror_image():
    limbs = Skeleton(
        joint_names=("Hips", "LeftLeg", "LeftFoot", "RightLeg", "RightFoot"),
        parents=np.array([-1, 0, 1, 0, 3]),
        offsets=np.array([[0, 0, 0], [9, -5, 1], [2, -40, 0], [-9, -5, 1], [-2, -40, 0]]),
        channel_names=(
            ("Xposition", "Yposition", "Zposition"),
            ("Zrotation", "Yrotation", "Xrotation"),
            ("Xrotation", "Zrotation", "Yrotation"),
            ("Zrotation", "Yrotation", "Xrotation"),
            ("Xrotation", "Zrotation", "Yrotation"),
        ),
        end_site_parents=np.array([], dtype=int),
        end_site_offsets=np.zeros((0, 3)),
    )
    channels = 30 * np.random.default_rng(0).normal(size=(200, 15))
    channels[:, :3] = 0
    motion = Motion(limbs, 1 / 60, channels)
    swapped = swaps(motion, 5.0, rng=np.random.default_rng(0))
    hit = (swapped.channels != motion.channels).any(axis=1)
    assert 0.05 < hit.mean() < 0.6
    # By the definition of a mirror: the other side's positions with another x.
    before, after = (forward_kinematics(m)[0][hit] for m in (motion, swapped))
    np.testing.assert_allclose(after, before[:, [0, 3, 4, 1, 2]] * [-1, 1, 1], atol=1e-9)


def test_no_pairs_are_refused(small_motion):
    with pytest.raises(ValueError, match=r"LeftLeg and RightLeg .* got Hips, Spine, Left Arm"):
        swaps(small_motion, 1.0, rng=np.random.default_rng(0))


def test_drift_grows_with_the_root_of_time(walk):
    still = walk.with_channels(walk.channels * np.linspace(1, 1.001, walk.n_frames)[:, None])
    for motion in (still, at_30_fps(still)):
        moving = moving_channels(motion)
        draws = [
            (drift(motion, 2.0, rng=np.random.default_rng(s)).channels - motion.channels)[:, moving]
            for s in range(40)
        ]
        at_1_s = round(1 / motion.frame_time)
        assert np.std([d[at_1_s] for d in draws]) == pytest.approx(2.0, rel=0.06)
        assert np.std([d[at_1_s // 4] for d in draws]) == pytest.approx(1.0, rel=0.06)
        assert not np.any([d[0] for d in draws])


def test_rounding(walk):
    rounded = quantise(walk, 0.5, rng=np.random.default_rng(0)).channels
    moving = moving_channels(walk)
    assert np.array_equal(2 * rounded[:, moving], np.round(2 * rounded[:, moving]))
    assert np.abs(rounded - walk.channels).max() <= 0.25
    np.testing.assert_array_equal(rounded[:, ~moving], walk.channels[:, ~moving])


def test_a_swap_adds_no_full_turn_and_moves_no_still_channel(walk):
    channels = walk.channels.copy()
    channels[:, walk.skeleton.channel_index("LeftArm.Zrotation")] += 360
    motion = walk.with_channels(channels)
    moved = np.abs(swaps(motion, 5.0, rng=np.random.default_rng(0)).channels - motion.channels)
    assert 5 < moved.max() < 180
    assert not moved[:, ~moving_channels(walk)].any()
