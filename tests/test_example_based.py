"""Example-based denoising against closed forms, and against spikes."""

from __future__ import annotations

import numpy as np
import pytest

from mocaplab import example_based
from mocaplab.corruption import corrupt
from mocaplab.cosine_windows import CosineWindows
from mocaplab.example_based import (
    OUTLIER_STD,
    fit_example_based,
    learn_bases,
    lorentzian_weight,
    robust_projection,
)
from mocaplab.filters import GaussianDenoiser, gaussian_filter
from mocaplab.motion import Corrupted, Motion, moving_channels
from mocaplab.tuning import tune_gaussian


def spoil(motion, recipe="angular:0.5", seed=0):
    return corrupt(motion, recipe, rng=np.random.default_rng(seed))


def rms(motion, clean):
    moving = moving_channels(clean)
    return np.sqrt(np.mean((motion.channels - clean.channels)[:, moving] ** 2))


@pytest.fixture(scope="module")
def walks(embedded):
    return [embedded[f"walk_{i:02d}"].slice_frames(0, 240) for i in range(1, 8)]


@pytest.fixture(scope="module")
def denoiser(walks):
    return fit_example_based([spoil(w, seed=i) for i, w in enumerate(walks[:5])])


def test_bases_are_the_singular_vectors_of_the_windows():
    rows = np.random.default_rng(0).normal(size=(50, 4)) * [5.0, 3.0, 1.0, 0.1]
    bases = learn_bases(rows.T @ rows, energy=0.9)
    _, values, expected = np.linalg.svd(rows, full_matrices=False)
    m = bases.shape[1]
    assert np.sum(values[:m] ** 2) >= 0.9 * np.sum(values**2) > np.sum(values[: m - 1] ** 2)
    np.testing.assert_allclose(np.abs(expected[:m] @ bases), np.eye(m), atol=1e-9)
    assert learn_bases(rows.T @ rows, energy=1.0).shape == (4, 4)


def test_lorentzian_weight_is_the_slope_of_its_loss():
    def loss(r):
        return OUTLIER_STD**2 / 2 * np.log(1 + (r / OUTLIER_STD) ** 2)

    r, step = np.array([0.1, 1.0, 3.0, 20.0]), 1e-5
    slope = (loss(r + step) - loss(r - step)) / (2 * step)
    np.testing.assert_allclose(lorentzian_weight(r), slope / r, rtol=1e-6)
    assert lorentzian_weight(np.array([0.0])) == 1.0


def test_one_window_comes_to_the_least_squares_answer():
    """With one window and no outliers, what lies outside the bases is divided by 1 + s."""
    rng = np.random.default_rng(1)
    one = CosineWindows(13, 0.02)
    assert one.starts.size == 1
    d = 2 * one.basis.shape[1]
    bases = np.linalg.qr(rng.normal(size=(d, 3)))[0]
    y = rng.normal(size=(13, 2))
    huge_noise = np.full(2, 1e6)  # no sample is an outlier
    stiffness = np.array([4.0, 4.0])
    result = robust_projection(y, bases, stiffness, huge_noise, 0.02)
    projected = one.synthesise(one.analyse(y) @ bases @ bases.T)
    np.testing.assert_allclose(result, projected + (y - projected) / 5, atol=1e-6)


def test_a_spike_is_ignored_and_the_rest_kept():
    t = np.arange(200) / 120
    clean = np.stack([10 * np.sin(2 * np.pi * t), 5 * np.cos(2 * np.pi * t)], axis=1)
    windows = CosineWindows(200, 1 / 120)
    rows = windows.analyse(clean)
    bases = learn_bases(rows.T @ rows, 0.9999)
    noisy = clean + 0.2 * np.random.default_rng(2).normal(size=clean.shape)
    noisy[100, 0] += 60.0
    result = robust_projection(noisy, bases, np.full(2, 1.0), np.full(2, 0.2), 1 / 120)
    error = result - clean
    assert abs(error[100, 0]) < 1.0  # of 60
    assert np.sqrt(np.mean(error**2)) < 0.15


def with_spikes(motion, seed):
    """A tenth of a deviation of noise, and one sample in 100 far off in each moving channel."""
    rng = np.random.default_rng(seed)
    clip = corrupt(motion, "angular:0.1", rng=rng)
    height = 3 * motion.channels.std(axis=0) * moving_channels(motion)
    hit = rng.choice([-1.0, 0.0, 1.0], p=[0.005, 0.99, 0.005], size=motion.channels.shape)
    observed = clip.observed.with_channels(clip.observed.channels + hit * height)
    return Corrupted(clip.clean, observed, clip.mask)


def test_spikes_hurt_it_less_than_a_tuned_gaussian(walks, denoiser):
    training = [with_spikes(w, seed) for seed, w in enumerate(walks[:5])]
    tuned = GaussianDenoiser(tune_gaussian(training)[1])
    clip = with_spikes(walks[6], 50)
    error = rms(denoiser.denoise(clip.observed, clip.mask), clip.clean)
    assert error < 0.9 * rms(tuned.denoise(clip.observed, clip.mask), clip.clean)


def test_noise_on_an_unfamiliar_walk(walks, denoiser):
    clip = spoil(walks[6], seed=51)
    error = rms(denoiser.denoise(clip.observed, clip.mask), clip.clean)
    assert error < rms(GaussianDenoiser(0.058).denoise(clip.observed, clip.mask), clip.clean)


def test_root_and_still_channels_are_returned_exactly(walks, denoiser):
    clip = spoil(walks[6])
    cleaned = denoiser.denoise(clip.observed, clip.mask)
    still = ~moving_channels(clip.observed)
    np.testing.assert_array_equal(cleaned.channels[:, still], clip.observed.channels[:, still])


def test_gaps_are_filled(walks, denoiser):
    clip = spoil(walks[6], "angular:0.5+gaps:0.002")
    assert np.isfinite(denoiser.denoise(clip.observed, clip.mask).channels).all()


def test_channel_without_examples_is_left_alone(walks, denoiser):
    still = np.flatnonzero(~moving_channels(walks[0]) & walks[0].skeleton.is_cleaned)[0]
    channels = walks[6].channels.copy()
    channels[:, still] = 20 * np.sin(2 * np.pi * walks[6].time_s)
    clip = spoil(walks[6].with_channels(channels))
    cleaned = denoiser.denoise(clip.observed, clip.mask)
    np.testing.assert_allclose(
        cleaned.channels[:, still], clip.observed.channels[:, still], atol=1e-9
    )


def test_pieces_of_a_long_clip_join_without_a_seam(walks, denoiser, monkeypatch):
    clip = spoil(walks[6])
    whole = denoiser.denoise(clip.observed, clip.mask)
    monkeypatch.setattr(example_based, "PIECE_FRAMES", 100)
    pieces = denoiser.denoise(clip.observed, clip.mask)
    assert rms(pieces, whole) < 0.05


def test_30_and_120_frames_per_second_agree(walks, denoiser):
    fast = walks[6].with_channels(gaussian_filter(walks[6].channels, 0.03, walks[6].frame_time))
    assert fast.fps == pytest.approx(120, rel=1e-4)
    slow = Motion(fast.skeleton, 4 * fast.frame_time, fast.channels[::4])
    from_fast = denoiser.denoise(fast, np.ones(fast.channels.shape, bool)).channels[::4]
    from_slow = denoiser.denoise(slow, np.ones(slow.channels.shape, bool))
    assert rms(from_slow, slow.with_channels(from_fast)) < 0.5


@pytest.mark.parametrize("frames", [1, 3, 4, 10, 31])
def test_clips_shorter_than_a_window(walks, denoiser, frames):
    clip = spoil(walks[6].slice_frames(40, 40 + frames))
    cleaned = denoiser.denoise(clip.observed, clip.mask)
    assert np.isfinite(cleaned.channels).all()
    if frames < 4:
        np.testing.assert_array_equal(cleaned.channels, clip.observed.channels)


def test_refuses_another_skeleton_and_empty_training(denoiser, small_motion):
    with pytest.raises(ValueError, match="channels of the training clips"):
        denoiser.denoise(small_motion, np.ones(small_motion.channels.shape, bool))
    with pytest.raises(ValueError, match="at least one training clip"):
        fit_example_based([])
    still = small_motion.with_channels(np.zeros_like(small_motion.channels))
    clips = [Corrupted(still, still, np.ones(still.channels.shape, bool))]
    with pytest.raises(ValueError, match="something moves"):
        fit_example_based(clips)
