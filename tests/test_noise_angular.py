"""Noise on joint angles."""

import numpy as np
import pytest
from scipy.stats import kstest

from mocaplab.motion import Motion, moving_channels
from mocaplab.noise.angular import (
    angular_noise,
    biased_noise,
    movement_std,
    uniform_noise,
    wavering_noise,
)


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


def added(noisy, walk):
    """What a noise added, in deviations of each channel that moves."""
    moving = moving_channels(walk)
    return (noisy.channels - walk.channels)[:, moving] / walk.channels.std(axis=0)[moving]


def test_uniform_noise_is_uniform(walk):
    noise = added(uniform_noise(walk, 0.5, rng=np.random.default_rng(0)), walk)
    edge = 0.5 * np.sqrt(3)
    assert kstest(noise.ravel(), "uniform", args=(-edge, 2 * edge)).pvalue > 0.01
    assert np.abs(noise).max() <= edge
    assert noise.std() == pytest.approx(0.5, rel=0.01)


def test_the_bias_is_half_a_deviation_in_every_channel(walk):
    noise = added(biased_noise(walk, 0.0, rng=np.random.default_rng(0)), walk)
    np.testing.assert_allclose(noise, 0.5)
    noise = added(biased_noise(walk, 0.3, bias_std=-1.0, rng=np.random.default_rng(0)), walk)
    assert noise.mean() == pytest.approx(-1, abs=0.01)
    assert noise.std() == pytest.approx(0.3, rel=0.02)


@pytest.mark.parametrize("step", [1, 4])  # 120 and 30 frames per second
def test_the_wavering_bias_is_a_sine_of_the_given_period(walk, step):
    motion = Motion(walk.skeleton, step * walk.frame_time, walk.channels[::step])
    noisy = wavering_noise(
        motion, 0.0, amplitude_std=0.7, period_s=0.8, rng=np.random.default_rng(0)
    )
    phase = np.random.default_rng(0)
    phase.normal(size=motion.channels.shape)  # the noise around the bias comes first
    sine = 0.7 * np.sin(2 * np.pi * (motion.time_s / 0.8 + phase.random()))
    noise = added(noisy, motion)
    np.testing.assert_allclose(noise, np.repeat(sine[:, None], noise.shape[1], axis=1), atol=1e-9)


def test_no_noise_touches_root_and_still_channels(walk):
    still = ~moving_channels(walk)
    for noise in (uniform_noise, biased_noise, wavering_noise):
        noisy = noise(walk, 0.5, rng=np.random.default_rng(0))
        np.testing.assert_array_equal(noisy.channels[:, still], walk.channels[:, still])


def test_the_deviation_leaves_gaps_out(walk):
    channels = walk.channels.copy()
    column = walk.skeleton.channel_index("LeftLeg.Xrotation")
    channels[20:90, column] = np.nan
    std = movement_std(walk.with_channels(channels))
    assert std[column] == pytest.approx(np.nanstd(channels[:, column]))
    np.testing.assert_allclose(std, walk.channels.std(axis=0) * moving_channels(walk), rtol=0.5)
    channels[:, column] = np.nan
    assert movement_std(walk.with_channels(channels))[column] == 0


@pytest.mark.parametrize(
    ("noise", "arguments", "message"),
    [
        (angular_noise, {"k": -0.1}, r"noise amount k must lie in \[0, 100\], got -0.1"),
        (angular_noise, {"k": np.nan}, "noise amount k"),
        (uniform_noise, {"k": 101}, "noise amount k"),
        (biased_noise, {"k": 0.5, "bias_std": np.nan}, "size of the bias"),
        (wavering_noise, {"k": 0.5, "amplitude_std": -1}, "amplitude of the bias"),
        (wavering_noise, {"k": 0.5, "period_s": 0}, "period must be over 0 seconds, got 0"),
    ],
)
def test_nonsense_is_refused(walk, noise, arguments, message):
    with pytest.raises(ValueError, match=message):
        noise(walk, **arguments, rng=np.random.default_rng(0))
