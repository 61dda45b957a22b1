"""The Gaussian that tunes itself on the noisy clip."""

import numpy as np
import pytest

from mocaplab.filters import GaussianDenoiser, gaussian_filter
from mocaplab.motion import Corrupted
from mocaplab.noise.angular import angular_noise
from mocaplab.stein import SelfTunedGaussian, estimated_risk, own_weight
from mocaplab.tuning import oracle_gaussian, tune_gaussian

DT = 1 / 120


def rms(motion, clean):
    return np.sqrt(np.mean((motion.channels - clean.channels) ** 2))


@pytest.mark.parametrize("sigma_s", [0.0, 0.004, 0.02, 0.1])
def test_the_estimate_is_the_true_error_on_average(sigma_s):
    """Stein's theorem, with noise of known variance."""
    time = np.arange(600) * DT
    draws = 4000
    clean = np.stack([30 * np.sin(2 * np.pi * f * time) for f in (0.5, 1, 3)], axis=1)
    clean = np.repeat(clean, draws, axis=1)
    noisy = clean + np.random.default_rng(0).normal(scale=4.0, size=clean.shape)
    smoothed = gaussian_filter(noisy, sigma_s, DT)
    mask, variance = np.ones(clean.shape, dtype=bool), np.full(3 * draws, 16.0)
    risk = estimated_risk(noisy, smoothed, mask, variance, own_weight(sigma_s, DT, len(time)))
    error = np.mean((smoothed - clean) ** 2, axis=0)
    estimated, true = (x.reshape(3, draws).mean(axis=1) for x in (risk, error))
    np.testing.assert_allclose(estimated, true, rtol=0.03)


@pytest.mark.parametrize("n_frames", [50, 1000])
@pytest.mark.parametrize("sigma_s", [0.0, 0.004, 0.05])
def test_the_own_weight_is_the_mean_diagonal_of_the_filter(sigma_s, n_frames):
    matrix = gaussian_filter(np.eye(n_frames), sigma_s, DT)
    assert own_weight(sigma_s, DT, n_frames) == pytest.approx(np.diag(matrix).mean(), rel=1e-9)


def test_it_comes_near_what_knows_the_truth(embedded):
    """It needs no training, and is ahead of one width that was tuned on these very clips."""
    pairs = []
    for i, clip in enumerate(embedded.clips[:6]):
        noisy = angular_noise(clip, 0.5, rng=np.random.default_rng(i))
        pairs.append(Corrupted(clip, noisy, np.ones(clip.channels.shape, dtype=bool)))
    one_width = GaussianDenoiser(tune_gaussian(pairs)[0])
    ours, oracle, tuned = (
        np.mean([rms(method(pair), pair.clean) for pair in pairs])
        for method in (
            lambda pair: SelfTunedGaussian().denoise(pair.observed, pair.mask),
            oracle_gaussian,
            lambda pair: one_width.denoise(pair.observed, pair.mask),
        )
    )
    assert oracle <= ours < 1.06 * oracle
    assert ours < tuned


def test_a_clean_clip_stays_nearly_as_it_is(walk):
    cleaned = SelfTunedGaussian().denoise(walk, np.ones(walk.channels.shape, dtype=bool))
    assert rms(cleaned, walk) < 0.1


def test_samples_in_gaps_have_no_say(walk):
    noisy = angular_noise(walk, 0.5, rng=np.random.default_rng(0))
    mask = np.ones(noisy.channels.shape, dtype=bool)
    mask[100:220] = False
    values, wild = noisy.channels.copy(), noisy.channels.copy()
    wild[~mask] = 0.0
    risks = [
        estimated_risk(x, np.zeros_like(x), mask, np.ones(x.shape[1]), 0.5) for x in (values, wild)
    ]
    np.testing.assert_array_equal(*risks)
    nothing = estimated_risk(values, values, np.zeros_like(mask), np.ones(values.shape[1]), 1.0)
    np.testing.assert_array_equal(nothing, 1.0)


@pytest.mark.parametrize("frames", [1, 2, 5])
def test_very_short_clips(walk, frames):
    short = walk.slice_frames(0, frames)
    cleaned = SelfTunedGaussian().denoise(short, np.ones(short.channels.shape, dtype=bool))
    np.testing.assert_allclose(cleaned.channels, short.channels, atol=5)
