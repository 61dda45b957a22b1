"""Does the motion model draw what a person would call a walk, a jog, a run, a jump, a kick?"""

from __future__ import annotations

from collections import Counter
from itertools import chain

import numpy as np
import pytest

from mocaplab.datasets import Dataset
from mocaplab.measures.movement import foot_heights, foot_points
from mocaplab.motion import FloatArray, Motion
from mocaplab.motion_model import CM_PER_UNIT, FRAME_TIME, load_motion_model
from mocaplab.synthesis import ACTIONS, embedded_clips, soft_limit, synthesize


@pytest.fixture(scope="module")
def clips(embedded: Dataset) -> dict[str, list[Motion]]:
    by_action: dict[str, list[Motion]] = {action: [] for action in ACTIONS}
    for motion, action in zip(embedded.clips, embedded.actions, strict=True):
        by_action[action].append(motion)
    return by_action


def lowest_cm(motion: Motion) -> FloatArray:
    return np.asarray(foot_heights(motion).min(axis=1) * CM_PER_UNIT)


def speed_cm_s(motion: Motion) -> float:
    path = motion.channels[:, [0, 2]]
    return float(np.linalg.norm(path[-1] - path[0]) / motion.duration_s * CM_PER_UNIT)


def test_mix_is_the_papers(clips: dict[str, list[Motion]]) -> None:
    every = [(motion, action) for action, motions in clips.items() for motion in motions]
    count = Counter(action for _, action in every)
    assert count == {"walk": 40, "jog": 20, "run": 20, "jump": 10, "kick": 10}
    names = [motion.name for motion, _ in every]
    assert len(set(names)) == 100
    assert {"walk_01", "walk_40", "jog_20", "kick_10"} <= set(names)
    for motion, action in every:
        assert motion.name.startswith(action)
        assert motion.frame_time == FRAME_TIME
        assert 1.25 <= motion.duration_s <= 5.05
        assert np.isfinite(motion.channels).all()


def test_same_seed_same_clips_other_seed_other_clips(clips: dict[str, list[Motion]]) -> None:
    for first, (second, action) in zip(chain(*clips.values()), embedded_clips(), strict=True):
        np.testing.assert_array_equal(first.channels, second.channels, err_msg=action)
    other, _ = embedded_clips(seed=1)[0]
    n = min(other.n_frames, clips["walk"][0].n_frames)
    assert np.abs(other.channels[:n] - clips["walk"][0].channels[:n]).max() > 5.0


@pytest.mark.parametrize("action", ACTIONS)
@pytest.mark.parametrize("duration_s", [0.0, 0.01, 0.02, 0.5, 1.0, 6.0, 20.0])
def test_any_length(action: str, duration_s: float) -> None:
    motion = synthesize(action, duration_s=duration_s, rng=np.random.default_rng(1))
    assert motion.n_frames == round(duration_s / FRAME_TIME) + 1
    assert np.isfinite(motion.channels).all()
    if duration_s >= 6:  # never a dead end: something moves in every half second
        angles = motion.channels[:, load_motion_model().moving]
        assert np.ptp(angles[-60:], axis=0).max() > 0.2
        assert lowest_cm(motion).min() > -3.0


@pytest.mark.parametrize("action", ["jump", "kick"])
def test_short_clip_still_shows_the_event(action: str) -> None:
    motion = synthesize(action, duration_s=0.8, rng=np.random.default_rng(2))
    assert foot_heights(motion).max() * CM_PER_UNIT > 10.0


def test_long_jump_is_repeated() -> None:
    low = lowest_cm(synthesize("jump", duration_s=13.0, rng=np.random.default_rng(3)))
    assert np.sum(np.diff((low > 8.0).astype(int)) == 1) == 3


def test_style_zero_is_the_mean_but_for_heading_and_phase() -> None:
    a, b = (
        synthesize("jump", duration_s=2.0, rng=np.random.default_rng(i), style=0.0) for i in (1, 2)
    )
    moving = load_motion_model().moving.copy()
    moving[:6] = False
    rms = np.sqrt(np.mean((a.channels[:, moving] - b.channels[:, moving]) ** 2))
    assert rms < 3.0  # what is left is the tempo


def test_constant_channels_are_constant_and_the_others_move(
    clips: dict[str, list[Motion]],
) -> None:
    model = load_motion_model()
    still = ~model.moving & model.skeleton.is_rotation
    assert still.sum() >= 21  # as counted in the recordings
    for motion in chain(*clips.values()):
        assert np.ptp(motion.channels[:, still], axis=0).max() == 0.0


def test_angles_stay_in_the_recorded_range(clips: dict[str, list[Motion]]) -> None:
    model = load_motion_model()
    for action, motions in clips.items():
        low, high = model.actions[action].limits[:, model.moving]
        for motion in motions:
            angles = motion.channels[:, model.moving]
            assert (angles >= low - 1e-6).all(), motion.name
            assert (angles <= high + 1e-6).all(), motion.name


def test_smooth_and_lively_like_the_recordings(clips: dict[str, list[Motion]]) -> None:
    model = load_motion_model()
    for action, motions in clips.items():
        recorded = model.actions[action].acceleration[model.moving]
        second = [
            np.diff(motion.channels[:, model.moving], n=2, axis=0) / FRAME_TIME**2
            for motion in motions
        ]
        drawn = np.sqrt(np.mean([np.mean(x**2) for x in second]))
        ratio = drawn / np.sqrt(np.mean(recorded**2))
        peak = max(np.abs(x).max() for x in second)
        print(f"{action}: angular acceleration {ratio:.2f} of recorded, peak {peak:.0f} deg/s^2")
        assert 0.3 < ratio < 1.3, action
        assert peak < 60_000, action  # recorded clips, smoothed at 11 Hz, reach 57,000 and more


def test_lower_foot_is_on_the_floor(clips: dict[str, list[Motion]]) -> None:
    for action, motions in clips.items():
        low = np.concatenate([lowest_cm(motion) for motion in motions])
        touching = low[low < 3.0]
        print(f"{action}: lower foot {np.median(np.abs(touching)):.2f} cm from the floor (median)")
        assert low.min() > -2.5, action
        assert np.median(np.abs(touching)) < 0.6, action


def test_standing_feet_hardly_slide(clips: dict[str, list[Motion]]) -> None:
    for action, motions in clips.items():
        slides = []
        for motion in motions:
            points = foot_points(motion)[:, :, 1:]
            velocity = np.gradient(points[..., [0, 2]], FRAME_TIME, axis=0) * CM_PER_UNIT
            height = points[..., 1]
            lowest = height.min(axis=(1, 2), keepdims=True)
            standing = (height * CM_PER_UNIT < 2.0) & (height < lowest + 0.2)
            slides.append(np.linalg.norm(velocity, axis=-1)[standing])
        slide = float(np.median(np.concatenate(slides)))
        print(f"{action}: a standing foot slides at {slide:.1f} cm/s (median)")
        assert slide < 20.0, action


def test_flight_where_it_belongs(clips: dict[str, list[Motion]]) -> None:
    for motion in clips["walk"]:
        assert lowest_cm(motion).max() < 3.0, motion.name
    for motion in clips["run"]:
        assert lowest_cm(motion).max() > 4.0, motion.name
    for motion in clips["jump"]:
        assert lowest_cm(motion).max() > 12.0, motion.name


def test_speeds_are_in_order(clips: dict[str, list[Motion]]) -> None:
    walk, jog, run = ([speed_cm_s(m) for m in clips[a]] for a in ("walk", "jog", "run"))
    assert min(walk) > 70
    assert max(walk) < min(jog)
    assert np.mean(jog) < np.mean(run)
    assert max(run) < 450


@pytest.mark.parametrize(("action", "lowest", "highest"), [("walk", 0.7, 1.2), ("run", 1.2, 1.7)])
def test_stride_rate(action: str, lowest: float, highest: float) -> None:
    for seed in range(5):
        motion = synthesize(action, duration_s=12.0, rng=np.random.default_rng(seed))
        thigh = motion.channel("LeftUpLeg.Xrotation")
        spectrum = np.abs(np.fft.rfft((thigh - thigh.mean()) * np.hanning(len(thigh))))
        rate = np.fft.rfftfreq(len(thigh), FRAME_TIME)[spectrum.argmax()]
        assert lowest < rate < highest


def test_cycles_are_not_copies() -> None:
    motion = synthesize("walk", duration_s=12.0, rng=np.random.default_rng(0))
    knee = motion.channel("LeftLeg.Xrotation")
    best = min(np.std(knee[lag:] - knee[:-lag]) for lag in range(90, 180))
    assert best > 0.5  # degrees: no shift makes the clip repeat exactly


def test_soft_limit_is_inside_and_leaves_the_middle() -> None:
    limits = np.array([[-10.0], [30.0]])
    values = np.linspace(-100, 100, 2001)[:, None]
    bent = soft_limit(values, limits)
    assert bent.min() >= -10.0
    assert bent.max() <= 30.0
    middle = np.abs(values - 10) < 17.9
    np.testing.assert_array_equal(bent[middle], values[middle])
    assert (np.diff(bent, axis=0) >= 0).all()


def test_wrong_requests_are_refused() -> None:
    rng = np.random.default_rng(0)
    with pytest.raises(ValueError, match="walk, jog, run, jump, kick, got 'dance'"):
        synthesize("dance", duration_s=1.0, rng=rng)
    with pytest.raises(ValueError, match="duration"):
        synthesize("walk", duration_s=-1.0, rng=rng)
    with pytest.raises(ValueError, match="duration"):
        synthesize("walk", duration_s=float("nan"), rng=rng)
    with pytest.raises(ValueError, match="style"):
        synthesize("walk", duration_s=1.0, rng=rng, style=5.0)
