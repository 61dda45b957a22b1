"""Choosing parameters on training clips."""

from dataclasses import dataclass

import numpy as np
import pytest

from mocaplab.corruption import corrupt
from mocaplab.filters import GaussianDenoiser, Smoother
from mocaplab.measures.by_name import rms_all_deg
from mocaplab.motion import Corrupted, moving_channels
from mocaplab.tuning import (
    SIGMA_GRID_S,
    PerChannel,
    best_for_all,
    best_for_each,
    error_table,
    lowest_fps,
    mean_rms,
    oracle_gaussian,
    squared_errors,
    tune,
    tune_gaussian,
    tune_per_channel,
)


@dataclass(frozen=True)
class Shift(Smoother):
    """Adds a constant, so that errors can be counted by hand."""

    by: float

    def smooth(self, values, mask, frame_time):
        return values + self.by


@pytest.fixture
def shifted(small_motion):
    """A clip observed 1 degree too low, the last channel 2; channel 7 does not move."""
    clean = small_motion.channels.copy()
    clean[:, 7] = 5.0
    offset = np.full(clean.shape[1], -1.0)
    offset[-1] = -2.0
    motion = small_motion.with_channels(clean)
    mask = np.ones(clean.shape, dtype=bool)
    return Corrupted(motion, motion.with_channels(clean + offset), mask)


def test_errors_are_means_over_frames_of_moving_channels(shifted):
    errors = error_table([Shift(0.0), Shift(1.0), Shift(2.0)], [shifted, shifted])
    moves = moving_channels(shifted.clean)
    assert not moves[:6].any()  # the root
    assert not moves[7]
    expected = np.zeros(errors.shape)
    expected[:, :, moves] = np.array([[1.0], [0.0], [1.0]])
    expected[:, :, -1] = np.array([4.0, 1.0, 0.0])
    np.testing.assert_allclose(errors, expected, atol=1e-9)


# Three clips, two candidates, two channels. The third clip is violent: candidate 0 is better
# there, and worse in both others. RMS of the clips: 4, 4, 14 (mean 7.33) with candidate 0 and
# 2, 2, 15 (mean 6.33) with candidate 1; the sums of squares are 228 and 233.
BY_HAND = np.array([[[8, 8], [2, 2]], [[8, 8], [2, 2]], [[98, 98], [112.5, 112.5]]], dtype=float)


def test_one_violent_clip_does_not_decide():
    assert np.argmin(BY_HAND.sum(axis=(0, 2))) == 0
    assert best_for_all(BY_HAND) == 1


def test_one_violent_clip_does_not_decide_a_channel_either():
    # With candidate 1 the RMS are 2, 2 and 15. In each channel 8/2 + 8/2 + 98/15 = 14.5 for
    # candidate 0, 2/2 + 2/2 + 112.5/15 = 9.5 for candidate 1; unweighted, 114 and 116.5.
    np.testing.assert_array_equal(best_for_each(BY_HAND), [1, 1])
    # The violent clip has its say where the others do not care: 98/15 < 112.5/15.
    errors = BY_HAND.copy()
    errors[:2, :, 1] = 2
    np.testing.assert_array_equal(best_for_each(errors), [1, 0])


def test_a_channel_that_never_moves_and_a_clip_without_error():
    errors = np.concatenate([BY_HAND, np.zeros((3, 2, 1))], axis=2)
    np.testing.assert_array_equal(best_for_each(errors), [1, 1, 1])
    perfect = np.concatenate([BY_HAND, np.array([[[3, 3], [0, 0]]])])
    np.testing.assert_array_equal(best_for_each(perfect), [1, 1])


def test_one_for_each_is_never_worse_than_one_for_all():
    rng = np.random.default_rng(0)
    for _ in range(50):
        errors = rng.gamma(0.3, size=(6, 5, 4)) * rng.gamma(0.3, size=(6, 1, 1))
        single = np.sqrt(errors[:, best_for_all(errors)].sum(axis=1)).mean()
        each = errors[:, best_for_each(errors), range(4)]
        assert np.sqrt(each.sum(axis=1)).mean() <= single + 1e-12


def test_tuning_finds_the_width_with_the_smallest_reported_error(walk, embedded):
    # A long walk with little noise and a short kick with much of it.
    clips = [
        corrupt(motion, f"angular:{k}", rng=np.random.default_rng(0))
        for motion, k in ((walk, 0.1), (embedded["kick_02"].slice_frames(0, 200), 0.9))
    ]

    def reported(sigma_s):
        smooth = GaussianDenoiser(sigma_s)
        return np.mean([rms_all_deg(smooth.denoise(c.observed, c.mask), c.clean) for c in clips])

    single, per_channel = tune_gaussian(clips)
    errors = [reported(sigma_s) for sigma_s in SIGMA_GRID_S]
    assert single == SIGMA_GRID_S[np.argmin(errors)]
    squares = sum(
        squared_errors([GaussianDenoiser(s) for s in SIGMA_GRID_S], c).sum(axis=1)
        * c.clean.n_frames
        for c in clips
    )
    assert single != SIGMA_GRID_S[np.argmin(squares)]
    assert reported(per_channel) < min(errors)
    with pytest.raises(ValueError, match="at least one"):
        tune_gaussian([])


def test_clean_clips_are_left_alone(walk):
    mask = np.ones(walk.channels.shape, dtype=bool)
    single, per_channel = tune_gaussian([Corrupted(walk, walk, mask)])
    assert single == 0
    assert not per_channel.any()


def test_tuning_does_not_look_at_the_root(walk):
    trembling = walk.channels.copy()
    trembling[::2, :3] += 100.0  # which any smoothing would make worse
    clips = [
        corrupt(motion, "angular:0.5", rng=np.random.default_rng(0))
        for motion in (walk, walk.with_channels(trembling))
    ]
    assert tune_gaussian(clips[1:])[0] == tune_gaussian(clips[:1])[0]


def test_no_gaussian_beats_the_one_that_sees_the_truth(walk):
    clip = corrupt(walk, "angular:0.5", rng=np.random.default_rng(0))
    moves = moving_channels(walk)
    bound = np.mean((oracle_gaussian(clip).channels - clip.clean.channels) ** 2, axis=0)
    candidates = [GaussianDenoiser(sigma) for sigma in SIGMA_GRID_S]
    best = squared_errors(candidates, clip).min(axis=0)
    # Not exactly: the common window reaches further than 4 sigma of the narrow filters.
    np.testing.assert_allclose(bound[moves], best[moves], rtol=1e-3)


def test_mean_rms_is_the_reported_error_up_to_a_factor(walk, embedded):
    clips = [
        corrupt(motion, "angular:0.5", rng=np.random.default_rng(0))
        for motion in (walk, embedded["run_01"])
    ]
    smooth = GaussianDenoiser(0.03)
    by_measure = [rms_all_deg(smooth.denoise(c.observed, c.mask), c.clean) for c in clips]
    share = np.mean(walk.skeleton.is_cleaned)
    np.testing.assert_allclose(mean_rms(smooth, clips), np.mean(by_measure) * np.sqrt(share))


def test_the_best_for_all_and_the_best_for_each(shifted):
    candidates = [Shift(0.0), Shift(1.0), Shift(2.0)]
    assert tune(candidates, [shifted]) == Shift(1.0)
    per_channel = tune_per_channel(candidates, [shifted])
    assert per_channel.choice[-1] == 2
    assert set(per_channel.choice[:-1]) == {1}  # still channels: the best for all
    cleaned = per_channel.denoise(shifted.observed, shifted.mask).channels
    moves = moving_channels(shifted.clean)
    truth = shifted.clean.channels
    np.testing.assert_allclose(cleaned[:, moves], truth[:, moves], atol=1e-9)


def test_agrees_with_the_tuning_of_gaussians(walk, embedded):
    clips = [
        corrupt(motion, "angular:0.5", rng=np.random.default_rng(i))
        for i, motion in enumerate((walk, embedded["run_01"]))
    ]
    single, per_channel = tune_gaussian(clips)
    candidates = [GaussianDenoiser(sigma) for sigma in SIGMA_GRID_S]
    assert tune(candidates, clips).sigma_s == single
    choice = np.array(tune_per_channel(candidates, clips).choice)
    moves = moving_channels(clips[0].clean) & moving_channels(clips[1].clean)
    np.testing.assert_array_equal(SIGMA_GRID_S[choice][moves], per_channel[moves])


def test_nothing_to_tune_with_is_refused(shifted, walk):
    with pytest.raises(ValueError, match="at least one training clip"):
        tune([Shift(0.0)], [])
    with pytest.raises(ValueError, match="at least one candidate"):
        tune([], [shifted])
    other = corrupt(walk, "angular:0.5", rng=np.random.default_rng(0))
    with pytest.raises(ValueError, match="need the same channels"):
        tune([Shift(0.0)], [shifted, other])
    assert lowest_fps([shifted, other]) == pytest.approx(60)


def test_another_number_of_channels_is_refused(walk):
    smoother = PerChannel((Shift(0.0),), (0, 0))
    with pytest.raises(ValueError, match="tuned for 2 channels, got 96"):
        smoother.denoise(walk, np.ones(walk.channels.shape, dtype=bool))
