"""The conditional Gaussian against the formula with the covariance itself."""

import numpy as np
import pytest

from mocaplab.gap_fillers.conditional_gaussian import (
    LEAST_VARIANCE,
    N_COSINES,
    PRIOR_S,
    PoseWindows,
    Scaled,
    cosine_coefficients,
    near_gaps,
    window_covariance,
)
from mocaplab.motion import moving_channels
from mocaplab.noise.gaps import hide


@pytest.fixture(scope="module")
def covariance(embedded):
    return window_covariance(embedded.clips[:40:8])


def holed(walk):
    mask = np.ones(walk.channels.shape, dtype=bool)
    moving = np.flatnonzero(moving_channels(walk))
    mask[100:130, moving[30:33]] = False
    mask[115:150, moving[4]] = False
    return hide(walk, mask)


def test_scaled_channels_have_mean_0_and_deviation_1(walk):
    scaled = Scaled.of(walk)
    np.testing.assert_allclose(scaled.values.mean(axis=0), 0, atol=1e-9)
    np.testing.assert_allclose(scaled.values.std(axis=0), 1, atol=0.01)
    np.testing.assert_array_equal(scaled.columns, np.flatnonzero(moving_channels(walk)))
    np.testing.assert_array_equal(scaled.joint, walk.skeleton.channel_joint[scaled.columns])
    again = scaled.values * scaled.std + scaled.mean
    np.testing.assert_allclose(again, walk.channels[:, scaled.columns])


def test_coefficients_are_those_of_the_cosine_transform():
    from scipy.fft import dct

    values = np.random.default_rng(0).normal(size=(100, 2))
    found, middle, radius = cosine_coefficients(values, 1 / 60)
    assert radius == 15
    expected = dct(values[35:66], axis=0, norm="ortho")[:N_COSINES] / np.sqrt(31)
    np.testing.assert_allclose(found[50].T, expected, atol=1e-12)
    constant = cosine_coefficients(np.full((40, 1), 3.0), 1 / 60)[0]
    np.testing.assert_allclose(constant[:, 0] @ middle, 3.0)


def test_near_gaps_are_the_windows_with_a_hidden_sample():
    hidden = np.zeros((30, 2), dtype=bool)
    hidden[10:12, 0] = hidden[29, 1] = True
    found = near_gaps(hidden, 3)
    np.testing.assert_array_equal(np.flatnonzero(found[:, 0]), np.arange(7, 15))
    np.testing.assert_array_equal(np.flatnonzero(found[:, 1]), np.arange(26, 30))


def full_covariance(motion, covariance):
    """Return the covariance whose inverse PoseWindows uses, and the windows, by plain loops."""
    scaled = Scaled.of(motion)
    signals = np.hstack([np.where(np.isnan(scaled.values), 0.0, scaled.values), scaled.root])
    windows, middle, radius = cosine_coefficients(signals, motion.frame_time)
    blind = near_gaps(np.isnan(scaled.values), radius)
    who = [*scaled.columns, *range(len(covariance) - 3, len(covariance))]
    n, k = len(who), N_COSINES
    prior = np.zeros((n * k, n * k))
    for i, a in enumerate(who):
        for j, b in enumerate(who):
            prior[i * k : i * k + k, j * k : j * k + k] = covariance[a, :, b, :]
    noise = np.repeat([*scaled.noise**2, 0, 0, 0], k) / (2 * radius + 1)
    prior += np.diag(noise + LEAST_VARIANCE)
    flat = windows.reshape(len(windows), -1)
    own = flat[~blind.any(axis=1)]
    weight = PRIOR_S / motion.frame_time
    return (weight * prior + own.T @ own) / (weight + len(own)), flat, blind, middle


def test_guess_is_the_conditional_mean_and_variance(walk, covariance):
    motion = holed(walk)
    values, variance = PoseWindows(Scaled.of(motion), motion.frame_time, covariance).guess()
    full, flat, blind, middle = full_covariance(motion, covariance)
    frame = 118
    assert blind[frame].sum() == 4
    hidden = np.append(np.repeat(blind[frame], N_COSINES), np.zeros(3 * N_COSINES, dtype=bool))
    across = full[np.ix_(hidden, ~hidden)] @ np.linalg.inv(full[np.ix_(~hidden, ~hidden)])
    mean = (across @ flat[frame, ~hidden]).reshape(4, N_COSINES) @ middle
    np.testing.assert_allclose(values[frame, blind[frame]], mean, rtol=1e-5, atol=1e-6)
    left = full[np.ix_(hidden, hidden)] - across @ full[np.ix_(~hidden, hidden)]
    left = np.einsum("akal,k,l->a", left.reshape((4, N_COSINES) * 2), middle, middle)
    np.testing.assert_allclose(variance[frame, blind[frame]], left, rtol=1e-5)
    assert not values[~blind].any()


def test_what_is_hidden_has_no_influence(walk, covariance):
    motion = holed(walk)
    windows = PoseWindows(Scaled.of(motion), motion.frame_time, covariance)
    before, _ = windows.guess()
    unseen = np.repeat(windows.blind, windows.k, axis=1)
    windows.flat[:, : unseen.shape[1]][unseen] = 1e3
    np.testing.assert_array_equal(windows.guess()[0], before)


def test_leaving_a_joint_out_is_hiding_it(walk, covariance):
    scaled = Scaled.of(walk)
    windows = PoseWindows(scaled, walk.frame_time, covariance)
    values, variance = windows.leave_out(scaled.joint)
    joint = scaled.joint[10]
    windows.blind[:] = scaled.joint == joint
    guessed, of_guess = windows.guess()
    np.testing.assert_allclose(values[:, scaled.joint == joint], guessed[:, scaled.joint == joint])
    np.testing.assert_allclose(variance[scaled.joint == joint], of_guess[0, scaled.joint == joint])


def test_other_joints_tell_most_of_a_walk(embedded, covariance):
    clip = embedded["walk_20"]
    scaled = Scaled.of(clip)
    values, _ = PoseWindows(scaled, clip.frame_time, covariance).leave_out(scaled.joint)
    assert np.mean((values - scaled.values) ** 2) < 0.5


def test_nothing_moves(walk):
    still = walk.with_channels(np.tile(walk.channels[:1], (60, 1)))
    with pytest.raises(ValueError, match="something moves"):
        window_covariance([still])
