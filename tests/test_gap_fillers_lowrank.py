"""The Kalman smoother of scores, against dense linear algebra; filling is in test_gap_pca."""

import numpy as np
import pytest

from mocaplab.gap_fillers.lowrank import score_acceleration, smooth_scores


def observations(n_frames, k, rng, empty=()):
    """Random information about scores; frames in ``empty`` say nothing."""
    half = rng.normal(size=(n_frames, k, k))
    precision = half @ half.transpose(0, 2, 1)
    vector = rng.normal(size=(n_frames, k))
    precision[list(empty)], vector[list(empty)] = 0.0, 0.0
    return vector, precision


def dense_mean(vector, precision, acceleration, frame_time):
    """All scores of all frames as one Gaussian: the twice integrated Wiener process."""
    n_frames, k = vector.shape
    t = np.arange(n_frames) * frame_time
    early, late = np.minimum.outer(t, t), np.maximum.outer(t, t)
    wiener = early**3 / 3 + early**2 * (late - early) / 2
    prior = np.zeros((n_frames * k, n_frames * k))
    information = np.zeros_like(prior)
    for i in range(k):
        prior[i::k, i::k] = 1 + acceleration[i] * np.multiply.outer(t, t) + acceleration[i] * wiener
    for f in range(n_frames):
        information[f * k : f * k + k, f * k : f * k + k] = precision[f]
    system = np.eye(n_frames * k) + prior @ information
    return np.linalg.solve(system, prior @ vector.ravel()).reshape(n_frames, k)


@pytest.mark.parametrize("empty", [(), (3,), (0, 1, 5, 6, 7), range(1, 12)])
def test_smoother_equals_the_dense_solution(empty):
    rng = np.random.default_rng(0)
    vector, precision = observations(12, 3, rng, empty)
    acceleration = np.array([0.5, 40.0, 3000.0])
    ours = smooth_scores(vector, precision, acceleration, 1 / 30)
    theirs = dense_mean(vector, precision, acceleration, 1 / 30)
    np.testing.assert_allclose(ours, theirs, rtol=1e-5, atol=1e-6)


def test_one_frame_is_a_ridge_regression():
    vector, precision = observations(1, 3, np.random.default_rng(0))
    expected = np.linalg.solve(precision[0] + np.eye(3), vector[0])
    np.testing.assert_allclose(smooth_scores(vector, precision, np.ones(3), 0.01)[0], expected)


def test_frames_that_see_nothing_do_not_change_the_others():
    """So 120 frames per second with every fourth visible are the same as 30."""
    vector, precision = observations(20, 2, np.random.default_rng(1))
    fine_vector, fine_precision = np.zeros((77, 2)), np.zeros((77, 2, 2))
    fine_vector[::4], fine_precision[::4] = vector, precision
    acceleration = np.array([10.0, 500.0])
    coarse = smooth_scores(vector, precision, acceleration, 1 / 30)
    fine = smooth_scores(fine_vector, fine_precision, acceleration, 1 / 120)
    np.testing.assert_allclose(fine[::4], coarse, rtol=1e-6, atol=1e-8)


def test_acceleration_of_a_twice_integrated_white_noise():
    power, dt = 50.0, 1 / 30
    rng = np.random.default_rng(0)
    # Finer by 20, so that sums are nearly integrals.
    white = rng.normal(scale=np.sqrt(power * 20 / dt), size=(400_000, 1))
    scores = (np.cumsum(np.cumsum(white, axis=0), axis=0) * (dt / 20) ** 2)[::20]
    assert score_acceleration(scores, dt)[0] == pytest.approx(power, rel=0.1)


def test_acceleration_does_not_depend_on_the_frame_rate():
    time = np.arange(1200)[:, None] / 120
    scores = np.sin(7 * time)
    at_30 = score_acceleration(scores[::4], 1 / 30)
    np.testing.assert_allclose(score_acceleration(scores, 1 / 120), at_30, rtol=0.02)


@pytest.mark.parametrize("n_frames", [1, 2])
def test_very_short_clips_stand_still(n_frames):
    np.testing.assert_array_equal(score_acceleration(np.ones((n_frames, 2)), 0.01), [0, 0])
