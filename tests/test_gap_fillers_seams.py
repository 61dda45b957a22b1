"""How a prediction is made to meet the ends of a gap."""

import numpy as np
import pytest

from mocaplab.gap_fillers.seams import (
    DRIFT,
    FADE_S,
    LASTING,
    LONGEST_S,
    end_weight,
    meet_ends,
    near_gaps,
    seam_lengths,
)

FRAME_TIME = 1 / 120


def kriged(times_s, misses, wanted_s):
    """Gaussian process regression with the covariance exp(-distance), solved as it is written."""

    def covariance(a, b):
        return np.exp(-np.abs(a[:, None] - b) / FADE_S)

    return covariance(wanted_s, times_s) @ np.linalg.solve(covariance(times_s, times_s), misses)


@pytest.mark.parametrize("n_hidden", [1, 5, 60, 2000])
def test_shift_is_a_gaussian_process_and_a_line(n_hidden):
    rng = np.random.default_rng(n_hidden)
    predicted = rng.normal(size=(n_hidden + 40, 1))
    values = predicted + rng.normal(size=predicted.shape)
    gap = slice(20, 20 + n_hidden)
    values[gap] = np.nan
    filled = meet_ends(values, predicted, np.array([1]), FRAME_TIME)
    ends = np.array([19, 20 + n_hidden])
    missed = (values - predicted)[ends, 0]
    frames = np.arange(20, 20 + n_hidden)
    fading = kriged(ends * FRAME_TIME, missed, frames * FRAME_TIME)
    expected = (1 - LASTING) * fading + LASTING * np.interp(frames, ends, missed)
    assert np.allclose(filled[gap, 0] - predicted[gap, 0], expected)
    assert (filled[:20] == values[:20]).all()


def test_gap_at_the_end_of_a_clip_fades_from_its_one_end():
    values = np.full((100, 2), 3.0)
    values[:40, 0] = values[60:, 1] = np.nan
    filled = meet_ends(values, np.zeros((100, 2)), np.array([1, 1]), FRAME_TIME)
    fade = np.exp(-np.arange(1, 41) * FRAME_TIME / FADE_S)
    expected = 3.0 * ((1 - LASTING) * fade + LASTING)
    assert np.allclose(filled[:40, 0][::-1], expected)
    assert np.allclose(filled[60:, 1], expected)


def test_weights_of_two_ends():
    short = end_weight(np.array([0.001]), np.array([0.003]))
    assert np.allclose(short, 0.75, atol=1e-4)  # a straight line
    assert end_weight(np.array([1e4]), np.array([1e4])) == LASTING / 2
    assert end_weight(np.array([np.inf]), np.array([0.1])) == 0.0


def test_miss_is_the_mean_over_what_is_seen():
    values = np.full((30, 1), np.nan)
    values[[5, 7, 8, 9], 0] = [9.0, 1.0, 2.0, 6.0]
    values[15:] = 0.0
    filled = meet_ends(values, np.zeros((30, 1)), np.array([4]), FRAME_TIME)
    weight = end_weight(np.array([FRAME_TIME]), np.array([5 * FRAME_TIME]))
    assert np.allclose(filled[10, 0], 3.0 * weight)  # frame 6 is hidden, frame 5 too far


def test_seams_are_as_long_as_noise_needs():
    rng = np.random.default_rng(0)
    time_s = np.arange(4000) * FRAME_TIME
    clean = np.sin(2 * np.pi * time_s / 3)[:, None] * 10.0
    assert seam_lengths(clean, FRAME_TIME).tolist() == [1]
    assert seam_lengths(np.zeros((50, 1)), FRAME_TIME).tolist() == [1]
    noise = 3.0
    noisy = clean + noise * rng.normal(size=clean.shape)
    step = DRIFT * noisy.std() * np.sqrt(FRAME_TIME)
    lengths = np.arange(1, 40)
    best = lengths[np.argmin(noise**2 / lengths + step**2 * lengths / 3)]
    assert abs(seam_lengths(noisy, FRAME_TIME)[0] - best) <= 1
    mostly_noise = 1e-3 * clean + noise * rng.normal(size=clean.shape)
    assert seam_lengths(mostly_noise, FRAME_TIME).tolist() == [round(LONGEST_S / FRAME_TIME)]


def test_near_gaps():
    hidden = np.zeros((9, 2), dtype=bool)
    hidden[4] = True
    near = near_gaps(hidden, np.array([1, 3]))
    assert np.flatnonzero(near[:, 0]).tolist() == [3, 4, 5]
    assert np.flatnonzero(near[:, 1]).tolist() == [1, 2, 3, 4, 5, 6, 7]


def test_mean_over_a_seam_beats_its_last_sample():
    """With noise, and a prediction that is off by the same everywhere."""
    rng = np.random.default_rng(1)
    clean = np.cumsum(rng.normal(size=(400, 50)), axis=0)
    noisy = clean + 5.0 * rng.normal(size=clean.shape)
    hidden = np.zeros(clean.shape, dtype=bool)
    hidden[200:215] = True
    values = np.where(hidden, np.nan, noisy)
    errors = [
        np.sqrt(np.mean((meet_ends(values, clean - 4.0, m, FRAME_TIME) - clean)[hidden] ** 2))
        for m in (np.ones(50, dtype=int), seam_lengths(values, FRAME_TIME))
    ]
    assert errors[1] < 0.7 * errors[0]
