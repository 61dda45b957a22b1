"""Interpolation, the Gaussian and its tuning."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from mocaplab.corruption import corrupt
from mocaplab.filters import (
    GaussianDenoiser,
    Untouched,
    gaussian_filter,
)
from mocaplab.motion import moving_channels

FRAME_TIME = 1 / 120


@pytest.mark.parametrize("sigma_frames", [0.5, 3.8, 15.0, 60.0])
def test_gaussian_equals_scipy(sigma_frames):
    values = np.random.default_rng(0).normal(size=(50, 3)).cumsum(axis=0)
    radius = int(np.ceil(4 * sigma_frames))
    ours = gaussian_filter(values, sigma_frames * FRAME_TIME, FRAME_TIME)
    theirs = gaussian_filter1d(values, sigma_frames, axis=0, mode="reflect", radius=radius)
    np.testing.assert_allclose(ours, theirs, atol=1e-12)


def test_gaussian_takes_one_width_a_channel():
    values = np.random.default_rng(0).normal(size=(80, 2))
    both = gaussian_filter(values, [0.02, 0.1], FRAME_TIME)
    for column, sigma in enumerate([0.02, 0.1]):
        alone = gaussian_filter(values[:, [column]], sigma, FRAME_TIME)
        # The common window reaches further than 4 sigma of the narrow filter.
        np.testing.assert_allclose(both[:, column], alone[:, 0], atol=1e-3)


def test_gaussian_of_width_0_changes_nothing_and_a_constant_stays():
    values = np.random.default_rng(0).normal(size=(20, 2))
    np.testing.assert_array_equal(gaussian_filter(values, 0.0, FRAME_TIME), values)
    np.testing.assert_allclose(gaussian_filter(np.full((20, 1), 7.0), 0.1, FRAME_TIME), 7.0)


def test_width_in_seconds_does_not_depend_on_the_frame_rate():
    fine = np.sin(np.arange(481) / 120 * 9)[:, None]
    a = gaussian_filter(fine, 0.05, 1 / 120)[::4]
    b = gaussian_filter(fine[::4], 0.05, 1 / 30)
    np.testing.assert_allclose(a[20:-20], b[20:-20], atol=2e-4)


@pytest.mark.parametrize("sigma", [-0.1, np.nan, np.inf])
def test_gaussian_refuses_nonsense(sigma):
    with pytest.raises(ValueError, match="sigma must be 0 or more"):
        gaussian_filter(np.zeros((5, 1)), sigma, FRAME_TIME)


def test_denoiser_smooths_across_a_wrap_and_keeps_the_files_convention(walk):
    column = walk.skeleton.channel_index("LeftArm.Zrotation")
    wrapped = walk.channels.copy()
    wrapped[50:, column] -= 360
    mask = np.ones(wrapped.shape, dtype=bool)
    denoiser = GaussianDenoiser(0.05)
    plain = denoiser.denoise(walk, mask).channels
    jumpy = denoiser.denoise(walk.with_channels(wrapped), mask).channels
    np.testing.assert_allclose(jumpy[:50], plain[:50], atol=1e-9)
    np.testing.assert_allclose(jumpy[50:, column], plain[50:, column] - 360, atol=1e-9)


def test_denoiser_returns_root_and_still_channels_exactly(walk):
    cleaned = GaussianDenoiser(0.05).denoise(walk, np.ones(walk.channels.shape, dtype=bool))
    still = ~moving_channels(walk)
    np.testing.assert_array_equal(cleaned.channels[:, still], walk.channels[:, still])


def test_untouched_only_fills_gaps(walk):
    clip = corrupt(walk, "angular:0.5+gaps:0.005", rng=np.random.default_rng(0))
    same = Untouched().denoise(clip.observed, clip.mask).channels
    np.testing.assert_array_equal(same[clip.mask], clip.observed.channels[clip.mask])
    frame, column = np.argwhere(~clip.mask)[0]
    seen = np.flatnonzero(clip.mask[:, column])
    line = np.interp(frame, seen, clip.observed.channels[seen, column])
    np.testing.assert_allclose(same[frame, column], line)
