"""Kriging against closed forms and against conditioning a joint normal distribution."""

import numpy as np
import pytest

from mocaplab.gap_fillers.kriging import (
    WIDTHS_S,
    Smoothness,
    krige,
    matern,
    relative_increments,
    runs,
    variances,
)

SMOOTH = Smoothness(np.array([0.0, 0.1, 0.5, 0.4, 0.0]))
FRAME_S = 1 / 120


def draw(n, sets, rng, smoothness=SMOOTH):
    lag = np.arange(n) * FRAME_S
    covariance = smoothness.correlation(lag[:, None] - lag)
    return np.linalg.cholesky(covariance + 1e-10 * np.eye(n)) @ rng.normal(size=(n, sets))


def test_matern_is_the_one_of_the_textbook():
    from scipy.special import gamma, kv

    lag = np.array([0.004, 0.03, 0.11, 0.7])
    z = np.sqrt(5) * lag[:, None] / WIDTHS_S
    with np.errstate(under="ignore"):
        expected = 2 ** (1 - 2.5) / gamma(2.5) * z**2.5 * kv(2.5, z)
    np.testing.assert_allclose(matern(lag), expected, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(matern(np.zeros(1)), 1.0)


def test_estimate_is_the_conditional_mean_of_a_joint_normal():
    times, wanted = np.array([0.0, 0.05, 0.3]), np.array([0.1, 0.2])
    values, noise = np.array([1.0, -0.5, 0.7]), 0.3
    size, wanted_size = np.array([1.0, 1.2, 0.8]), np.array([1.1, 0.9])
    found, variance = krige(values, times, wanted, SMOOTH, noise, (size, wanted_size))
    both, sizes = np.append(times, wanted), np.append(size, wanted_size)
    joint = SMOOTH.correlation(both[:, None] - both) * np.outer(sizes, sizes)
    joint[:3, :3] += noise**2 * np.eye(3)
    inverse = np.linalg.inv(joint[:3, :3])
    np.testing.assert_allclose(found, joint[3:, :3] @ inverse @ values, rtol=1e-4)
    left = np.diag(joint[3:, 3:] - joint[3:, :3] @ inverse @ joint[:3, 3:])
    surprise = (10 + values @ inverse @ values) / 13
    np.testing.assert_allclose(variance, left * surprise, rtol=1e-4)


def test_without_noise_the_curve_goes_through_the_samples():
    rng = np.random.default_rng(0)
    signal = draw(80, 1, rng)[:, 0]
    time = np.arange(80) * FRAME_S
    seen = np.r_[0:30, 50:80]
    ones = np.ones(len(seen)), np.ones(80)
    found, variance = krige(signal[seen], time[seen], time, SMOOTH, 0.0, ones)
    np.testing.assert_allclose(found[seen], signal[seen], atol=0.01)
    steps = np.abs(np.diff(found))
    assert steps[29:51].max() < 2 * np.abs(np.diff(signal)).max()
    assert variance[40] > 10 * variance[31]


def test_without_any_sample_nothing_is_known():
    size = np.array([0.5, 2.0])
    none = np.zeros(0)
    found, variance = krige(none, none, np.array([0.0, 0.1]), SMOOTH, 0.1, (none, size))
    assert not found.any()
    np.testing.assert_array_equal(variance, size**2)


@pytest.mark.parametrize("noise", [0.0, 0.3])
def test_errors_are_as_large_as_the_variance_says(noise):
    rng = np.random.default_rng(1)
    signals = draw(90, 300, rng)
    time, seen, gap = np.arange(90) * FRAME_S, np.r_[0:30, 60:90], np.r_[30:60]
    ratios = []
    for signal in signals.T:
        observed = signal[seen] + noise * rng.normal(size=60)
        ones = np.ones(60), np.ones(30)
        found, variance = krige(observed, time[seen], time[gap], SMOOTH, noise, ones)
        ratios.append((found - signal[gap]) / np.sqrt(variance))
    assert 0.9 < np.std(ratios) < 1.1


def test_smoothness_is_found_again():
    signals = draw(3000, 30, np.random.default_rng(2))
    noise = np.zeros(30)
    found = Smoothness.fit(*relative_increments(signals, noise, FRAME_S))
    lag = np.array([1, 4, 16, 50]) * FRAME_S
    np.testing.assert_allclose(1 - found.correlation(lag), 1 - SMOOTH.correlation(lag), rtol=0.15)


def test_noise_is_taken_off_increments_and_variances():
    rng = np.random.default_rng(3)
    signals = draw(3000, 30, rng)
    noisy = signals + 0.2 * rng.normal(size=signals.shape)
    noise = np.full(30, 0.2)
    clear, _ = relative_increments(signals, 0 * noise, FRAME_S)
    found, _ = relative_increments(noisy, noise, FRAME_S)
    np.testing.assert_allclose(found[3:], clear[3:], rtol=0.25)
    np.testing.assert_allclose(variances(noisy, noise), variances(signals, 0 * noise), rtol=0.05)


def test_nothing_can_be_measured_on_noise_or_one_frame():
    noise = np.ones(3)
    values = np.random.default_rng(4).normal(size=(200, 3))
    for signals in (values, values[:1]):
        increments, lags_s = relative_increments(signals, noise, FRAME_S)
        assert len(increments) == len(lags_s) == 0


def test_runs():
    hidden = np.array([1, 1, 0, 1, 0, 0, 1], dtype=bool)
    assert list(runs(hidden)) == [(0, 2), (3, 4), (6, 7)]
    assert list(runs(~np.ones(3, dtype=bool))) == []
