"""Savitzky-Golay, Butterworth, median + Gaussian and One-Euro."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d
from scipy.signal import butter, lfilter, sosfreqz

from mocaplab.corruption import corrupt
from mocaplab.motion import moving_channels
from mocaplab.smoothers import (
    Butterworth,
    MedianGaussian,
    OneEuro,
    SavitzkyGolay,
    fit_butterworth,
    fit_median_gaussian,
    fit_one_euro,
    fit_savgol,
    odd_frames,
)

FRAME_TIME = 1 / 120
SMOOTHERS = [
    SavitzkyGolay(0.3, 3),
    Butterworth(6.0),
    MedianGaussian(0.1, 0.03),
    OneEuro(5.0, 0.05),
]


def smooth(smoother, values, frame_time=FRAME_TIME):
    values = np.asarray(values, dtype=float)
    return smoother.smooth(values, np.ones(values.shape, dtype=bool), frame_time)


def noise(n_frames=300, n_channels=2):
    return np.random.default_rng(0).normal(size=(n_frames, n_channels))


def test_savitzky_golay_is_the_polynomial_fitted_around_each_frame():
    values = noise(60, 1)
    window = 25
    ours = smooth(SavitzkyGolay(window * FRAME_TIME, 3), values)[:, 0]
    frames = np.arange(60)
    for t in (30, 41):
        around = frames[t - 12 : t + 13]
        fitted = np.polynomial.Polynomial.fit(around, values[around, 0], 3)
        np.testing.assert_allclose(ours[t], fitted(t), atol=1e-10)
    last = np.polynomial.Polynomial.fit(frames[-window:], values[-window:, 0], 3)
    np.testing.assert_allclose(ours[-12:], last(frames[-12:]), atol=1e-10)


def test_savitzky_golay_fits_a_short_clip_as_a_whole():
    values = noise(9, 1)
    fitted = np.polynomial.Polynomial.fit(np.arange(9), values[:, 0], 3)(np.arange(9))
    np.testing.assert_allclose(smooth(SavitzkyGolay(0.5, 3), values)[:, 0], fitted, atol=1e-10)


def test_butterworth_has_its_cutoff_where_it_says_and_fourth_order_slope():
    impulse = np.zeros((4801, 1))
    impulse[2400] = 1.0
    response = np.abs(np.fft.rfft(smooth(Butterworth(6.0), impulse)[:, 0]))
    frequency = np.fft.rfftfreq(4801, FRAME_TIME)
    at = np.interp([0.0, 6.0, 12.0], frequency, response)
    np.testing.assert_allclose(at[:2], [1.0, np.sqrt(0.5)], atol=1e-3)
    # Two passes of a second-order section whose cutoff scipy is told directly.
    warped = np.tan(np.pi * 6 / 120) / 0.802
    section = butter(2, np.arctan(warped) / np.pi * 120, fs=120, output="sos")
    theirs = np.abs(sosfreqz(section, [12.0], fs=120)[1]) ** 2
    np.testing.assert_allclose(at[2], theirs, rtol=5e-3)


def test_butterworth_does_not_delay():
    time_s = np.arange(600)[:, None] * FRAME_TIME
    slow = np.sin(2 * np.pi * time_s)
    smoothed = smooth(Butterworth(6.0), slow)
    np.testing.assert_allclose(smoothed[100:-100], slow[100:-100], atol=1e-3)


def test_median_forgets_a_spike_that_a_gaussian_spreads():
    values = np.zeros((100, 1))
    values[50] = 1000.0
    np.testing.assert_array_equal(smooth(MedianGaussian(0.025, 0.03), values), 0.0)


def test_median_and_gaussian_agree_with_scipy_and_a_sort():
    values = noise(50, 1)[:, 0]
    padded = np.pad(values, 2, mode="symmetric")
    medians = [np.sort(padded[t : t + 5])[2] for t in range(50)]
    ours = smooth(MedianGaussian(5 * FRAME_TIME, 3 * FRAME_TIME), values[:, None])
    theirs = gaussian_filter1d(medians, 3, mode="reflect", radius=12)
    np.testing.assert_allclose(ours[:, 0], theirs, atol=1e-12)


def test_one_euro_without_beta_is_exponential_smoothing():
    values = noise()
    share = 1 / (1 + 120 / (2 * np.pi * 4))
    first = (1 - share) * values[:1]  # so that the filter starts at rest at the first sample
    theirs, _ = lfilter([share], [1, share - 1], values, axis=0, zi=first)
    np.testing.assert_allclose(smooth(OneEuro(4.0), values), theirs, atol=1e-12)


def test_one_euro_by_hand():
    """Three samples 0, 6, 6 at 10 frames per second, cutoff 1 Hz, beta 0.5."""
    share = 1 / (1 + 10 / (2 * np.pi))  # of 1 Hz at 10 fps: 0.385870
    speed_1 = share * 60.0  # 23.1522 degrees per second
    share_1 = 1 / (1 + 10 / (2 * np.pi * (1 + 0.5 * speed_1)))  # 12.5761 Hz: 0.887656
    speed_2 = speed_1 + share * (0.0 - speed_1)  # 14.2185
    share_2 = 1 / (1 + 10 / (2 * np.pi * (1 + 0.5 * speed_2)))  # 8.10923 Hz: 0.835934
    expected = [0.0, 6 * share_1, 6 * share_1 + share_2 * (6 - 6 * share_1)]
    ours = smooth(OneEuro(1.0, 0.5), [[0.0], [6.0], [6.0]], 0.1)[:, 0]
    np.testing.assert_allclose(ours, expected, rtol=1e-12)
    np.testing.assert_allclose(ours, [0.0, 5.32593, 5.88941], atol=1e-4)


def test_one_euro_is_causal():
    values = noise()
    changed = values.copy()
    changed[200:] += 5.0
    before, after = (smooth(OneEuro(3.0, 0.1), v)[:200] for v in (values, changed))
    np.testing.assert_array_equal(before, after)


@pytest.mark.parametrize("smoother", SMOOTHERS, ids=lambda s: type(s).__name__)
def test_30_and_120_fps_agree(smoother):
    time_s = np.arange(961)[:, None] / 120
    fine = 20 * np.sin(2 * np.pi * 0.8 * time_s) + 5 * np.sin(2 * np.pi * 2.1 * time_s)
    at_120 = smooth(smoother, fine)[::4]
    at_30 = smooth(smoother, fine[::4], 1 / 30)
    difference = np.sqrt(np.mean((at_120 - at_30)[15:-15] ** 2))
    change = np.sqrt(np.mean((at_120 - fine[::4])[15:-15] ** 2))
    assert difference < 0.35
    assert difference < 0.5 * change or change < 0.1


@pytest.mark.parametrize("smoother", SMOOTHERS, ids=lambda s: type(s).__name__)
def test_a_constant_stays(smoother):
    np.testing.assert_allclose(smooth(smoother, np.full((50, 2), 7.0)), 7.0, atol=1e-9)


@pytest.mark.parametrize("n_frames", [1, 2, 3, 10])
@pytest.mark.parametrize("smoother", SMOOTHERS, ids=lambda s: type(s).__name__)
def test_short_clips_are_smoothed_too(smoother, n_frames):
    values = noise(n_frames)
    smoothed = smooth(smoother, values)
    assert smoothed.shape == values.shape
    assert np.abs(smoothed).max() <= 3 * np.abs(values).max()
    if n_frames == 1:
        np.testing.assert_allclose(smoothed, values)


@pytest.mark.parametrize("smoother", SMOOTHERS, ids=lambda s: type(s).__name__)
def test_denoisers_lessen_noise_and_leave_root_and_still_channels(smoother, walk):
    clip = corrupt(walk, "angular:0.5+gaps:0.001", rng=np.random.default_rng(0))
    moves = moving_channels(walk)
    cleaned = smoother.denoise(clip.observed, clip.mask).channels
    before = np.nanmean((clip.observed.channels - clip.clean.channels)[:, moves] ** 2)
    assert np.mean((cleaned - clip.clean.channels)[:, moves] ** 2) < 0.75 * before
    np.testing.assert_array_equal(cleaned[:, ~moves], walk.channels[:, ~moves])


def test_windows_are_odd_and_nearest():
    assert [odd_frames(n / 120, 1 / 120) for n in (0.5, 1, 2.9, 3, 4.1, 7)] == [1, 1, 3, 3, 5, 7]


@pytest.mark.parametrize("fit", [fit_butterworth, fit_median_gaussian, fit_one_euro, fit_savgol])
def test_fitting_tries_only_what_the_frame_rate_allows(fit, small_motion):
    slow = type(small_motion)(small_motion.skeleton, 1 / 10, small_motion.channels, "slow")
    clip = corrupt(slow, "angular:0.5", rng=np.random.default_rng(0))
    for per_channel in (False, True):
        fitted = fit([clip], per_channel=per_channel)
        assert np.isfinite(fitted.denoise(clip.observed, clip.mask).channels).all()
    with pytest.raises(ValueError, match="at least one training clip"):
        fit([])


@pytest.mark.parametrize("number", [0.0, -1.0, np.nan, np.inf])
def test_nonsense_is_refused(number):
    with pytest.raises(ValueError, match="window_s must be a positive"):
        SavitzkyGolay(number, 3)
    with pytest.raises(ValueError, match="cutoff_hz must be a positive"):
        Butterworth(number)
    with pytest.raises(ValueError, match="window_s must be a positive"):
        MedianGaussian(number, 0.1)
    with pytest.raises(ValueError, match="min_cutoff_hz must be a positive"):
        OneEuro(number)
    if number != 0:
        with pytest.raises(ValueError, match="sigma_s must be 0 or more"):
            MedianGaussian(0.1, number)
        with pytest.raises(ValueError, match="beta must be 0 or more"):
            OneEuro(1.0, number)


def test_what_the_frame_rate_forbids_is_refused():
    with pytest.raises(ValueError, match="order must be 0 or more"):
        SavitzkyGolay(0.1, -1)
    with pytest.raises(ValueError, match=r"more than 3 frames, got 0.1 s = 3 at 30 fps"):
        smooth(SavitzkyGolay(0.1, 3), noise(), 1 / 30)
    with pytest.raises(ValueError, match=r"Nyquist frequency, 15 Hz at 30 fps, got 15.0 Hz"):
        smooth(Butterworth(15.0), noise(), 1 / 30)
    with pytest.raises(ValueError, match=r"3 frames or more, got 0.025 s = 1 at 30 fps"):
        smooth(MedianGaussian(0.025, 0.1), noise(), 1 / 30)
