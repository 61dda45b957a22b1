"""The Kalman smoother against a direct solution of the same model."""

import numpy as np
import pytest

from mocaplab.corruption import corrupt
from mocaplab.cosine_windows import estimate_noise_std
from mocaplab.filters import Untouched
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


def test_long_gaps_are_no_worse_than_straight_lines(walk):
    clip = corrupt(walk, "angular:0.1", rng=np.random.default_rng(0))
    column = walk.skeleton.channel_index("LeftLeg.Xrotation")
    holed = clip.observed.channels.copy()
    holed[200:320, column] = np.nan  # a second
    mask = ~np.isnan(holed)
    observed = clip.observed.with_channels(holed)
    hidden = clip.clean.channels[~mask]

    def error(cleaned):
        return np.sqrt(np.mean((cleaned.channels[~mask] - hidden) ** 2))

    over_lines = error(KalmanSmoother(1e9).denoise(observed, mask))
    assert over_lines < 1.02 * error(Untouched().denoise(observed, mask))
    variance = estimate_noise_std(holed[:, [column]], mask[:, [column]]) ** 2
    bridged = kalman_smooth(holed[:, [column]], 1e9, variance, DT)[200:320, 0]
    assert np.sqrt(np.mean((bridged - hidden) ** 2)) > 1.5 * over_lines


def test_what_was_filled_says_nothing_about_the_noise(walk):
    clip = corrupt(walk, "angular:0.5", rng=np.random.default_rng(0))
    mask = np.ones(walk.channels.shape, dtype=bool)
    mask[100:200] = False
    values = clip.observed.channels.copy()
    values[100:200] = values[99]
    plain = KalmanSmoother(1e7).smooth(values, mask, DT)
    told = kalman_smooth(values, 1e7, np.maximum(estimate_noise_std(values, mask), 1e-3) ** 2, DT)
    np.testing.assert_array_equal(plain, told)
    assert np.abs(plain - KalmanSmoother(1e7).smooth(values, np.ones_like(mask), DT)).max() > 0.1


def test_the_largest_density_of_the_grid_smooths_nothing():
    values = np.random.default_rng(0).normal(size=(300, 2)) * [1.0, 5.0]
    change = np.sqrt(np.mean((smooth(JERK_GRID[-1], values) - values) ** 2, axis=0))
    assert (change < [0.02, 0.1]).all()  # 2 percent


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
