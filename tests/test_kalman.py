"""The Kalman smoother against a direct solution of the same model."""

import numpy as np
import pytest

from mocaplab.corruption import corrupt
from mocaplab.kalman import (
    JERK_GRID,
    START_VARIANCE,
    KalmanSmoother,
    fit_kalman,
    kalman_smooth,
)
from mocaplab.motion import moving_channels

DT = 1 / 120


def smooth(jerk_density, values, frame_time=DT):
    values = np.asarray(values, dtype=float)
    mask = np.ones(values.shape, dtype=bool)
    return KalmanSmoother(jerk_density).smooth(values, mask, frame_time)


def least_squares(values, jerk_density, variance, dt):
    """Solve for all states of one channel at once, in seconds and degrees."""
    n = len(values)
    seen = np.flatnonzero(~np.isnan(values))
    step = np.array([[1, dt, dt**2 / 2], [0, 1, dt], [0, 0, 1]])
    # The integral of (s^2/2, s, 1)(s^2/2, s, 1)' ds from 0 to dt, by a quadrature that is
    # exact for polynomials.
    nodes, weights = np.polynomial.legendre.leggauss(4)
    s = dt * (nodes + 1) / 2
    v = np.array([s**2 / 2, s, np.ones_like(s)])
    jerk = jerk_density * (v * weights * dt / 2) @ v.T
    start = START_VARIANCE * variance * np.diag([1, dt**-2, dt**-4])
    whiten_start, whiten = (np.linalg.inv(np.linalg.cholesky(m)) for m in (start, jerk))
    rows = np.zeros((3 * n + len(seen), n, 3))
    right = np.zeros(len(rows))
    rows[:3, 0] = whiten_start
    right[:3] = whiten_start @ [values[seen[0]], 0, 0]
    for t in range(1, n):
        rows[3 * t : 3 * t + 3, t - 1] = -whiten @ step
        rows[3 * t : 3 * t + 3, t] = whiten
    rows[3 * n + np.arange(len(seen)), seen, 0] = variance**-0.5
    right[3 * n :] = values[seen] * variance**-0.5
    states, *_ = np.linalg.lstsq(rows.reshape(len(rows), -1), right, rcond=None)
    return states.reshape(n, 3)[:, 0]


def test_equals_least_squares_over_all_frames_with_gaps():
    rng = np.random.default_rng(0)
    time_s = np.arange(50) * DT
    values = np.stack([20 * np.sin(9 * time_s), 5 * np.cos(20 * time_s)], axis=1)
    variance, density = np.array([1.0, 0.25]), np.array([3e6, 2e8])
    values += rng.normal(size=values.shape) * np.sqrt(variance)
    values[20:30, 0] = np.nan
    values[:2, 1] = np.nan
    values[-3:, 1] = np.nan
    ours = kalman_smooth(values, density, variance, DT)
    for c in range(2):
        direct = least_squares(values[:, c], density[c], variance[c], DT)
        np.testing.assert_allclose(ours[:, c], direct, atol=1e-8)


def test_bridges_a_gap_with_the_movement_around_it():
    time_s = np.arange(120)[:, None] * DT
    clean = 30 * np.sin(2 * np.pi * time_s)
    values = clean.copy()
    values[50:70] = np.nan  # a sixth of a second over the turning point
    bridged = kalman_smooth(values, 1e6, np.array([1e-4]), DT)
    np.testing.assert_allclose(bridged, clean, atol=0.5)
    line = np.interp(60, [49, 70], clean[[49, 70], 0])
    assert abs(bridged[60, 0] - clean[60, 0]) < 0.1 * abs(line - clean[60, 0])


def test_what_was_filled_in_a_gap_does_not_matter(walk):
    clip = corrupt(walk, "angular:0.5+gaps:0.005", rng=np.random.default_rng(0))
    filled = np.where(clip.mask, clip.observed.channels, 0.0)
    other = np.where(clip.mask, clip.observed.channels, 99.0)
    smoother = KalmanSmoother(1e7)
    np.testing.assert_array_equal(
        smoother.smooth(filled, clip.mask, DT), smoother.smooth(other, clip.mask, DT)
    )


def test_a_gap_at_an_end_holds_the_nearest_smoothed_value():
    values = np.random.default_rng(0).normal(size=(200, 2)).cumsum(axis=0)
    mask = np.ones(values.shape, dtype=bool)
    mask[:30, 0] = mask[-120:, 0] = mask[:, 1] = False
    held = KalmanSmoother(1e7).smooth(values, mask, DT)
    np.testing.assert_array_equal(held[:30, 0], held[30, 0])
    np.testing.assert_array_equal(held[-120:, 0], held[79, 0])
    np.testing.assert_array_equal(held[:, 1], values[:, 1])  # never observed: as it was filled


def test_a_noisier_clip_is_smoothed_more():
    rng = np.random.default_rng(0)
    clean = 40 * np.sin(2 * np.pi * np.arange(600)[:, None] * DT)
    for std in (0.1, 1.0, 5.0):
        noise = std * rng.normal(size=clean.shape)
        told = kalman_smooth(clean + noise, 1e7, np.array([std**2]), DT)
        estimated = smooth(1e7, clean + noise)
        errors = [np.sqrt(np.mean((x - clean) ** 2)) for x in (told, estimated)]
        np.testing.assert_allclose(errors[1], errors[0], rtol=0.1)


@pytest.mark.parametrize("n_frames", [1, 2, 3])
def test_without_four_samples_in_a_row_the_noise_is_taken_as_least(n_frames):
    values = np.random.default_rng(0).normal(size=(n_frames, 2))
    np.testing.assert_allclose(smooth(1e7, values), values, atol=1e-3)


def test_30_and_120_fps_agree():
    rng = np.random.default_rng(0)
    time_s = np.arange(961)[:, None] / 120
    clean = 20 * np.sin(2 * np.pi * 0.8 * time_s) + 5 * np.sin(2 * np.pi * 2.1 * time_s)
    variance = np.array([1.0])
    # The same information: four times the frames, each with four times the variance.
    fine = clean + 2 * rng.normal(size=clean.shape)
    coarse = clean[::4] + rng.normal(size=clean[::4].shape)
    at_120 = kalman_smooth(fine, 1e7, 4 * variance, 1 / 120)[::4]
    at_30 = kalman_smooth(coarse, 1e7, variance, 1 / 30)
    errors = [np.sqrt(np.mean((x - clean[::4]) ** 2)) for x in (at_120, at_30)]
    np.testing.assert_allclose(errors[0], errors[1], rtol=0.15)
    noiseless = [kalman_smooth(clean, 1e7, 4 * variance, 1 / 120)[::4]]
    noiseless += [kalman_smooth(clean[::4], 1e7, variance, 1 / 30)]
    np.testing.assert_allclose(noiseless[0][8:-8], noiseless[1][8:-8], atol=0.02)


def test_a_parabola_with_noise_comes_out_when_there_is_no_jerk():
    frames = np.arange(100)
    values = 0.01 * frames**2 - frames + np.random.default_rng(0).normal(size=100)
    fitted = np.polynomial.Polynomial.fit(frames, values, 2)(frames)
    ours = kalman_smooth(values[:, None], 1e-6, np.array([1.0]), DT)[:, 0]
    np.testing.assert_allclose(ours, fitted, atol=1e-2)


def test_tuning_finds_the_best_of_the_grid_and_leaves_root_and_still_channels(walk):
    walk = walk.slice_frames(0, 100)
    clip = corrupt(walk, "angular:0.5+gaps:0.001", rng=np.random.default_rng(0))
    moves = moving_channels(walk)

    def error(density):
        cleaned = KalmanSmoother(density).denoise(clip.observed, clip.mask).channels
        np.testing.assert_array_equal(cleaned[:, ~moves], walk.channels[:, ~moves])
        return np.sum((cleaned - clip.clean.channels) ** 2)

    single, per_channel = fit_kalman([clip]), fit_kalman([clip], per_channel=True)
    at = int(np.flatnonzero(single.jerk_density == JERK_GRID)[0])
    errors = [error(JERK_GRID[i]) for i in (at - 1, at, at + 1)]
    assert errors[1] == min(errors)
    assert error(per_channel.jerk_density) <= errors[1] + 1e-9


@pytest.mark.parametrize("density", [0.0, -1.0, np.nan, np.inf, [1.0, 0.0]])
def test_nonsense_is_refused(density):
    with pytest.raises(ValueError, match="must be positive numbers"):
        KalmanSmoother(density)


def test_another_number_of_channels_is_refused():
    with pytest.raises(ValueError, match="tuned for 2 channels, got 3"):
        smooth([1e6, 1e7], np.zeros((9, 3)))
