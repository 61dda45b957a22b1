"""Choosing parameters on training clips."""

from dataclasses import dataclass

import numpy as np
import pytest

from mocaplab.corruption import corrupt
from mocaplab.filters import SIGMA_GRID_S, GaussianDenoiser, Smoother, tune_gaussian
from mocaplab.motion import Corrupted, moving_channels
from mocaplab.tuning import PerChannel, lowest_fps, total_errors, tune, tune_per_channel


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


def test_errors_add_up_over_clips_and_moving_channels(shifted):
    errors = total_errors([Shift(0.0), Shift(1.0), Shift(2.0)], [shifted, shifted])
    moves = moving_channels(shifted.clean)
    assert not moves[:6].any()  # the root
    assert not moves[7]
    expected = np.zeros(errors.shape)
    expected[:, moves] = 2 * 40 * np.array([[1.0], [0.0], [1.0]])
    expected[:, -1] = 2 * 40 * np.array([4.0, 1.0, 0.0])
    np.testing.assert_allclose(errors, expected, atol=1e-9)


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
