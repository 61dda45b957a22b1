"""Noise on joint angles."""

import numpy as np
import pytest

from mocaplab.motion import moving_channels
from mocaplab.noise import angular_noise


def test_noise_has_the_deviation_that_was_asked_for(walk):
    noisy = angular_noise(walk, 0.5, rng=np.random.default_rng(0))
    added = (noisy.channels - walk.channels)[:, moving_channels(walk)]
    asked = 0.5 * walk.channels.std(axis=0)[moving_channels(walk)]
    # The mean of many estimates of ratio 1, each with a relative error of 1 / sqrt(2 T).
    tolerance = 5 / np.sqrt(2 * added.size)
    assert np.mean(added.std(axis=0) / asked) == pytest.approx(1, abs=tolerance)
    assert np.abs(added.mean(axis=0) / asked).max() < 5 / np.sqrt(walk.n_frames)


def test_noise_leaves_the_root_and_still_channels_alone(walk):
    noisy = angular_noise(walk, 0.9, rng=np.random.default_rng(0))
    still = ~moving_channels(walk)
    assert still[:6].all()
    np.testing.assert_array_equal(noisy.channels[:, still], walk.channels[:, still])


def test_a_wrap_in_the_file_does_not_change_the_noise(walk):
    column = walk.skeleton.channel_index("LeftArm.Zrotation")
    wrapped = walk.channels.copy()
    wrapped[50:, column] += 360
    plain, jumpy = (
        angular_noise(motion, 0.5, rng=np.random.default_rng(3)).channels - motion.channels
        for motion in (walk, walk.with_channels(wrapped))
    )
    np.testing.assert_allclose(jumpy, plain, atol=1e-9)


def test_same_seed_same_noise(walk):
    a, b, c = (angular_noise(walk, 0.5, rng=np.random.default_rng(s)).channels for s in (1, 1, 2))
    np.testing.assert_array_equal(a, b)
    assert not np.array_equal(a, c)


def test_no_noise_is_no_change(walk):
    noisy = angular_noise(walk, 0.0, rng=np.random.default_rng(0))
    np.testing.assert_array_equal(noisy.channels, walk.channels)
