"""The Wiener filter against closed forms and dense solves."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.fft import dct

from mocaplab import wiener
from mocaplab.corruption import corrupt
from mocaplab.cosine_windows import CosineWindows, estimate_noise_std
from mocaplab.filters import GaussianDenoiser, gaussian_filter
from mocaplab.motion import Corrupted, Motion, moving_channels
from mocaplab.tuning import tune_gaussian
from mocaplab.wiener import (
    WienerDenoiser,
    fit_wiener,
    scale_mixture_estimate,
    wiener_estimate,
)


def spoil(motion, recipe="angular:0.5", seed=0):
    return corrupt(motion, recipe, rng=np.random.default_rng(seed))


@pytest.fixture(scope="module")
def walks(embedded):
    return [embedded[f"walk_{i:02d}"].slice_frames(0, 240) for i in range(1, 8)]


@pytest.fixture(scope="module")
def denoiser(walks):
    return fit_wiener([spoil(w, seed=i) for i, w in enumerate(walks[:4])])


def rms(motion, clean):
    moving = moving_channels(clean)
    return np.sqrt(np.mean((motion.channels - clean.channels)[:, moving] ** 2))


def test_one_number_has_the_textbook_gain():
    estimate, error = wiener_estimate([[10.0]], [[4.0]], [1.0])
    assert estimate == pytest.approx(np.array([[8.0]]))  # 4 / (4 + 1) of what was seen
    assert error == pytest.approx(np.array([[0.8]]))  # 4 * 1 / (4 + 1)


def test_equals_conditioning_a_joint_gaussian():
    rng = np.random.default_rng(1)
    root = rng.normal(size=(6, 6))
    signal, noise = root @ root.T, rng.uniform(0.1, 2.0, 6)
    y = rng.normal(size=(5, 6))
    # E[x | y] = x'P x with the precision matrix: an independent formula.
    precision = np.linalg.inv(signal) + np.diag(1 / noise)
    expected = np.linalg.solve(precision, (y / noise).T).T
    estimate, error = wiener_estimate(y, signal, noise)
    np.testing.assert_allclose(estimate, expected, atol=1e-9)
    np.testing.assert_allclose(error, np.linalg.inv(precision), atol=1e-9)
    np.testing.assert_allclose(
        scale_mixture_estimate(y, signal, noise, scales=(1.0,)), expected, atol=1e-9
    )


def test_scale_mixture_weighs_by_bayes_rule():
    y, scales = 3.0, np.array([0.1, 1.0, 10.0])
    density = np.exp(-0.5 * y**2 / (scales * 2 + 1)) / np.sqrt(scales * 2 + 1)
    expected = np.sum(density / density.sum() * scales * 2 / (scales * 2 + 1)) * y
    estimate = scale_mixture_estimate([[y]], [[2.0]], [1.0], scales)
    assert estimate[0, 0] == pytest.approx(expected)


def test_known_covariance_beats_the_best_gaussian_filter():
    rng = np.random.default_rng(2)
    t = np.arange(200)
    time_cov = np.exp(-0.5 * ((t[:, None] - t) / 12.0) ** 2)
    joint_cov = np.array([[1.0, 0.9], [0.9, 1.0]])  # two channels that move together
    signal = np.kron(joint_cov, time_cov)
    x = np.linalg.cholesky(signal + 1e-9 * np.eye(400)) @ rng.normal(size=(400, 30))
    y = x + 0.8 * rng.normal(size=x.shape)
    estimate, error = wiener_estimate(y.T, signal, np.full(400, 0.64))
    mine = np.mean((estimate.T - x) ** 2)
    smooth = [
        np.mean((gaussian_filter(y[:200], s, 1.0) - x[:200]) ** 2) for s in (2.0, 4.0, 6.0, 9.0)
    ]
    assert mine < 0.8 * min(smooth)
    assert mine == pytest.approx(np.trace(error) / 400, rel=0.1)  # as good as it says


def test_noise_is_measured_whatever_the_movement():
    rng = np.random.default_rng(3)
    t = np.arange(2000) / 120
    values = np.stack([30 * np.sin(2 * np.pi * t), np.zeros(2000)], axis=1)
    noisy = values + rng.normal(size=values.shape) * [0.5, 2.0]
    noisy[::200] += 40.0  # spikes
    np.testing.assert_allclose(estimate_noise_std(noisy), [0.5, 2.0], rtol=0.15)
    seen = np.ones(noisy.shape, bool)
    seen[500:1700] = False
    noisy[~seen] = 0.0
    np.testing.assert_allclose(estimate_noise_std(noisy, seen), [0.5, 2.0], rtol=0.15)
    assert not estimate_noise_std(noisy[:3]).any()
    assert not estimate_noise_std(noisy, np.zeros(noisy.shape, bool)).any()


def test_window_coefficients_are_a_cosine_transform_and_lose_no_smooth_signal():
    windows = CosineWindows(100, 1 / 120)
    assert windows.length == 32
    values = np.random.default_rng(4).normal(size=(100, 3))
    first = windows.analyse(values)[0].reshape(3, -1)
    expected = dct(values[:32], axis=0, norm="ortho")[: windows.basis.shape[1]].T / np.sqrt(32)
    np.testing.assert_allclose(first, expected, atol=1e-12)
    line = np.linspace(0, 1, 100)[:, None] * [1.0, -2.0, 0.5] + 3.0
    np.testing.assert_allclose(windows.synthesise(windows.analyse(line)), line, atol=0.02)


def test_unfamiliar_walks_come_out_cleaner_than_from_the_tuned_gaussian(walks, denoiser):
    training = [spoil(w, seed=i) for i, w in enumerate(walks[:4])]
    tuned = GaussianDenoiser(tune_gaussian(training)[1])
    for seed, clean in enumerate(walks[5:7], start=50):
        clip = spoil(clean, seed=seed)
        error = rms(denoiser.denoise(clip.observed, clip.mask), clean)
        assert error < rms(tuned.denoise(clip.observed, clip.mask), clean)


def test_root_and_still_channels_are_returned_exactly(walks, denoiser):
    clip = spoil(walks[5])
    cleaned = denoiser.denoise(clip.observed, clip.mask)
    still = ~moving_channels(clip.observed)
    assert still.any()
    np.testing.assert_array_equal(cleaned.channels[:, still], clip.observed.channels[:, still])


def test_channel_that_was_still_in_training_is_cleaned_too(walks, denoiser):
    still = np.flatnonzero(~moving_channels(walks[0]) & walks[0].skeleton.is_cleaned)[0]
    channels = walks[5].channels.copy()
    channels[:, still] = 20 * np.sin(2 * np.pi * walks[5].time_s)
    clip = spoil(walks[5].with_channels(channels))
    cleaned = denoiser.denoise(clip.observed, clip.mask)
    error = (cleaned.channels - clip.clean.channels)[:, still].std()
    assert error < 0.5 * (clip.observed.channels - clip.clean.channels)[:, still].std()


def test_30_and_120_frames_per_second_agree(walks, denoiser):
    fast = walks[5].with_channels(gaussian_filter(walks[5].channels, 0.03, walks[5].frame_time))
    assert fast.fps == pytest.approx(120, rel=1e-4)
    slow = Motion(fast.skeleton, 4 * fast.frame_time, fast.channels[::4])
    from_fast = denoiser.denoise(fast, np.ones(fast.channels.shape, bool)).channels[::4]
    from_slow = denoiser.denoise(slow, np.ones(slow.channels.shape, bool))
    assert rms(from_slow, slow.with_channels(from_fast)) < 0.3


@pytest.mark.parametrize("frames", [1, 3, 4, 10, 31])
def test_clips_shorter_than_a_window(walks, denoiser, frames):
    clip = spoil(walks[5].slice_frames(40, 40 + frames))
    cleaned = denoiser.denoise(clip.observed, clip.mask)
    assert np.isfinite(cleaned.channels).all()
    if frames < 4:
        np.testing.assert_array_equal(cleaned.channels, clip.observed.channels)


def test_gaps_are_filled_and_clean_motion_stays(walks, denoiser):
    clip = spoil(walks[5], "angular:0.5+gaps:0.002")
    assert np.isfinite(denoiser.denoise(clip.observed, clip.mask).channels).all()
    all_seen = np.ones(walks[5].channels.shape, bool)
    assert rms(denoiser.denoise(walks[5], all_seen), walks[5]) < 0.5


def test_refuses_another_skeleton_and_empty_training(denoiser, small_motion):
    with pytest.raises(ValueError, match=r"joints and .* channels of the training clips"):
        denoiser.denoise(small_motion, np.ones(small_motion.channels.shape, bool))
    with pytest.raises(ValueError, match="at least one training clip"):
        fit_wiener([])
    still = small_motion.with_channels(np.zeros_like(small_motion.channels))
    clips = [Corrupted(still, still, np.ones(still.channels.shape, bool))]
    with pytest.raises(ValueError, match="something moves"):
        fit_wiener(clips)


def test_shrinkage_is_chosen_on_training_clips_only(walks, monkeypatch):
    seen = []

    def record(denoiser, clips):
        seen.extend(clip.clean.name for clip in clips)
        return len(seen)

    monkeypatch.setattr(wiener, "mean_rms", record)
    clips = [spoil(w.slice_frames(0, 60)) for w in walks]
    assert isinstance(fit_wiener(clips), WienerDenoiser)
    assert set(seen) == {walks[2].name}  # clips 2, 7, 12 ... test; the others train
