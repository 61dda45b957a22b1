"""The estimates that Blend mixes, against scipy and closed forms."""

import numpy as np
import pytest
import torch
from scipy.fft import dct
from scipy.ndimage import gaussian_filter1d

from mocaplab.estimate_bank import (
    LEAST_NOISE,
    N_CLUES,
    N_ESTIMATES,
    SIGMAS,
    cosine_windows,
    estimates_and_clues,
    gaussians,
    linear_estimate,
    noise_std,
)


def draw(*shape, seed=0):
    return torch.from_numpy(np.random.default_rng(seed).normal(size=shape))


@pytest.mark.parametrize("n_frames", [60, 201])
def test_gaussians_equal_those_of_scipy(n_frames):
    x = draw(2, n_frames, 3)
    smooth = gaussians(x, (2.5, 6.0))
    for found, sigma in zip(smooth, (2.5, 6.0), strict=True):
        # The same response only for widths well above a frame, where both are sampled well.
        expected = gaussian_filter1d(x.numpy(), sigma, axis=1, mode="reflect", truncate=8)
        np.testing.assert_allclose(found, expected, atol=1e-6)


def test_noise_is_found_under_movement():
    t = torch.arange(2000) / 120
    movement = torch.sin(2 * torch.pi * t)[None, :, None] * torch.tensor([1.0, 3.0])
    noise = draw(1, 2000, 2) * torch.tensor([0.2, 0.05])
    found = noise_std(movement + noise)
    torch.testing.assert_close(found, torch.tensor([[0.2, 0.05]]).double(), rtol=0.06, atol=0)


def test_a_few_spikes_do_not_change_the_noise_much():
    noise = draw(1, 2000, 1)
    spiked = noise.clone()
    spiked[0, ::200] += 30.0
    assert noise_std(spiked) < 1.15 * noise_std(noise)


def test_still_and_short_channels_have_a_noise_too():
    assert torch.equal(noise_std(torch.zeros(1, 50, 2)), torch.ones(1, 2))
    assert noise_std(draw(1, 3, 2)).tolist() == [[LEAST_NOISE, LEAST_NOISE]]
    smooth = torch.linspace(0, 1, 50)[None, :, None]
    assert noise_std(smooth) == LEAST_NOISE


@pytest.mark.parametrize("n_frames", [1, 5, 80])
def test_windows_equal_those_of_scipy(n_frames):
    pose = draw(1, n_frames, 2)
    found = cosine_windows(pose, radius=15, n_cosines=8)[0].reshape(n_frames, 2, 8)
    padded = np.pad(pose[0].numpy(), ((15, 15), (0, 0)), mode="symmetric")
    for t in range(n_frames):
        expected = dct(padded[t : t + 31], axis=0, norm="ortho")[:8].T
        np.testing.assert_allclose(found[t], expected, atol=1e-12)


def test_the_linear_estimate_is_the_conditional_mean():
    """For Gaussian signals it is: solved here sample by sample from the joint covariance."""
    rng = np.random.default_rng(0)
    mixing = rng.normal(size=(2 * 8, 2 * 8))
    covariance = mixing @ mixing.T
    noise = np.array([0.7, 2.0])
    pose = draw(1, 40, 2, seed=1)
    found = linear_estimate(
        pose, torch.from_numpy(noise)[None], torch.from_numpy(covariance), radius=15
    )
    windows = cosine_windows(pose, 15, 8)[0].numpy()
    observed = covariance + np.diag(np.repeat(noise**2, 8))
    best = windows @ np.linalg.inv(observed) @ covariance  # all coefficients of each window
    middle = np.cos(np.pi / 31 * 15.5 * np.arange(8))
    middle[0] /= np.sqrt(2)
    middle *= np.sqrt(2 / 31)
    np.testing.assert_allclose(found[0], best.reshape(40, 2, 8) @ middle, atol=1e-9)


def test_steps_of_pure_noise_are_near_one():
    noise = draw(1, 4000, 2)
    covariance = torch.eye(16).double()
    estimates, clues = estimates_and_clues(noise, torch.ones(1, 2).double(), covariance, 15)
    assert estimates.shape == (1, 4000, 2, N_ESTIMATES)
    assert clues.shape == (1, 4000, 2, N_CLUES)
    steps = torch.sinh(clues[..., : len(SIGMAS) - 1])
    sizes = steps.square().mean(dim=(0, 1, 2)).sqrt()
    torch.testing.assert_close(sizes, torch.ones_like(sizes), rtol=0.2, atol=0)


def test_the_first_estimate_is_the_pose_itself():
    pose = draw(1, 50, 2)
    estimates, _ = estimates_and_clues(pose, noise_std(pose), torch.eye(16).double(), 15)
    assert torch.equal(estimates[..., 0], pose)
    torch.testing.assert_close(estimates[..., 1:8], gaussians(pose).permute(1, 2, 3, 0))
