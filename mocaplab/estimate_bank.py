"""Nine estimates of the same clean pose, and what each says of the others.

The observed pose itself, seven Gaussians from narrow to wide, and a linear estimate from all
channels in a window around the frame. Which one is best differs from angle to angle and from
moment to moment; :class:`mocaplab.blend.Blend` learns to choose.

Letters in shapes: B clips, T frames, C channels, M estimates, F clues, K cosines.
"""

from __future__ import annotations

import math

import torch
from torch import Tensor

SIGMAS = (1.5, 2.5, 4.0, 6.0, 9.0, 14.0, 22.0)
"""Widths of the Gaussians, frames."""
N_ESTIMATES = len(SIGMAS) + 2
MIDDLE = 3
"""Number of the estimate by the Gaussian of 4 frames, with which the linear one is compared."""
N_CLUES = 2 * (len(SIGMAS) - 1) + 5
LEAST_NOISE = 1e-3
"""So little noise is taken for none, in deviations of the clip."""
LARGEST = 100.0
"""A squared clue counts no more than this; single bad samples would drown the rest."""


def noise_std(pose: Tensor) -> Tensor:
    """Estimate the noise of each channel from third differences.

    In them a smooth movement almost vanishes, while white noise has 20 times its variance.
    Single jumps are cut: what is above 2.5 times the typical size counts as 2.5 times.

    Parameters
    ----------
    pose : tensor, shape (B, T, C)

    Returns
    -------
    tensor, shape (B, C), unit of the pose, at least ``LEAST_NOISE``; 1 for still channels
    """
    if pose.shape[1] < 4:  # too short to tell
        return pose.new_full((pose.shape[0], pose.shape[2]), LEAST_NOISE)
    steps = pose.diff(n=3, dim=1).abs() / math.sqrt(20)
    typical = steps.median(dim=1, keepdim=True).values / 0.6745  # 0.6745: of a normal variable
    power = torch.minimum(steps, 2.5 * typical).square().mean(dim=1) / 0.9771  # the same, cut
    still = (pose == 0).all(dim=1)
    return power.sqrt().clamp_min(LEAST_NOISE).masked_fill(still, 1.0)


def gaussians(x: Tensor, sigmas: tuple[float, ...] = SIGMAS) -> Tensor:
    """Smooth x with several widths at once; beyond its ends it goes on as its mirror image.

    Parameters
    ----------
    x : tensor, shape (B, T, C)
    sigmas : M widths, frames

    Returns
    -------
    tensor, shape (M, B, T, C)
    """
    n_frames = x.shape[1]
    # Twice as fast with time as the last axis.
    line = x.transpose(1, 2)  # (B, C, T)
    spectrum = torch.fft.rfft(torch.cat([line, line.flip(-1)], dim=-1))
    omega = torch.arange(n_frames + 1, dtype=x.dtype) * (math.pi / n_frames)  # rad a frame
    response = torch.exp(-0.5 * (torch.tensor(sigmas, dtype=x.dtype)[:, None] * omega) ** 2)
    smooth: Tensor = torch.fft.irfft(spectrum * response[:, None, None], 2 * n_frames)
    return smooth[..., :n_frames].transpose(2, 3)


def cosine_windows(pose: Tensor, radius: int, n_cosines: int) -> Tensor:
    """Describe the window around every frame by a few cosine coefficients a channel.

    Parameters
    ----------
    pose : tensor, shape (B, T, C)
    radius : int, frames to each side
    n_cosines : int, K

    Returns
    -------
    tensor, shape (B, T, C * K)
    """
    indices = torch.arange(-radius, pose.shape[1] + radius)
    period = 2 * pose.shape[1]  # mirrored as often as it takes for a short clip
    indices = indices % period
    indices = torch.where(indices >= pose.shape[1], period - 1 - indices, indices)
    windows = pose[:, indices].unfold(1, 2 * radius + 1, 1)  # (B, T, C, window)
    return (windows @ _cosines(radius, n_cosines).to(pose)).flatten(2)


def _cosines(radius: int, n_cosines: int) -> Tensor:
    """Return the first cosines of the orthonormal DCT, shape (window, K)."""
    n = 2 * radius + 1
    phase = torch.arange(n, dtype=torch.float64)[:, None] + 0.5
    basis = torch.cos(math.pi / n * phase * torch.arange(n_cosines))
    normal: Tensor = basis / basis.square().sum(dim=0).sqrt()
    return normal


def linear_estimate(pose: Tensor, noise: Tensor, covariance: Tensor, radius: int) -> Tensor:
    """Estimate each pose from all channels in its window: C_xy (C_x + C_n)^-1 y.

    The linear estimate with the smallest mean square error; :mod:`mocaplab.wiener` explains
    it, and goes further.

    Parameters
    ----------
    pose : tensor, shape (B, T, C)
    noise : tensor, shape (B, C), see :func:`noise_std`
    covariance : tensor, shape (C * K, C * K), of the coefficients of clean windows
    radius : int, frames that a window reaches to each side

    Returns
    -------
    tensor, shape (B, T, C)
    """
    n_channels = pose.shape[-1]
    n_cosines = len(covariance) // n_channels
    middle = _cosines(radius, n_cosines)[radius].to(covariance)  # (K,)
    pick = torch.kron(torch.eye(n_channels).to(covariance), middle[:, None])  # (C * K, C)
    windows = cosine_windows(pose, radius, n_cosines)
    noise_variance = torch.diag_embed((noise**2).repeat_interleave(n_cosines, dim=1))
    gain = torch.linalg.solve(covariance + noise_variance.to(covariance), covariance @ pick)
    estimate: Tensor = windows @ gain.to(pose)
    return estimate


def estimates_and_clues(
    pose: Tensor, noise: Tensor, covariance: Tensor, radius: int
) -> tuple[Tensor, Tensor]:
    """Estimate the clean pose in nine ways, and compare them.

    A clue says by how much two neighbouring estimates differ, in units of what noise alone
    would make of it: near 1 where there is only noise, far above where the wider filter cuts
    into the movement. There is one of the frame itself and one averaged around it.

    Parameters
    ----------
    pose : tensor, shape (B, T, C), standardized angles
    noise, covariance, radius : see :func:`linear_estimate`

    Returns
    -------
    estimates : tensor, shape (B, T, C, M)
    clues : tensor, shape (B, T, C, F)
    """
    smooth = gaussians(pose)
    linear = linear_estimate(pose, noise, covariance, radius)
    unit = noise[:, None]
    ladder = torch.cat([pose[None], smooth])
    expected = torch.tensor(_NOISE_OF_STEPS, dtype=pose.dtype)[:, None, None, None]
    steps = (ladder[:-1] - ladder[1:]) / unit / expected  # (7, B, T, C)
    middle, smooth_linear = ladder[MIDDLE], gaussians(linear, (SIGMAS[MIDDLE - 1],))[0]
    apart = torch.stack([middle - smooth_linear, linear - middle]) / unit / _NOISE_OF_MIDDLE
    # Each averaged over the width of the wider of its two filters.
    around = [
        gaussians(step.square().clamp_max(LARGEST), (width,))[0]
        for step, width in zip(steps[1:], (*SIGMAS[2:], SIGMAS[-1]), strict=True)
    ]
    around += [gaussians(x.square().clamp_max(LARGEST), (9.0,))[0] for x in apart]
    clues = [
        *torch.asinh(steps[1:]),
        *torch.asinh(apart),
        *[x.clamp_min(0.05).log() for x in around],
        unit.log().expand_as(pose),
    ]
    return torch.stack([*ladder, linear], dim=-1), torch.stack(clues, dim=-1)


def _white_noise_std(narrow: float, wide: float | None) -> float:
    """Return the deviation that white noise of deviation 1 has after a filter.

    The filter is a Gaussian, or the difference of two.
    """
    omega = torch.linspace(0, math.pi, 2001, dtype=torch.float64)
    response = torch.exp(-0.5 * (omega * narrow) ** 2)
    if wide is not None:
        response = response - torch.exp(-0.5 * (omega * wide) ** 2)
    return math.sqrt(float(response.square().mean()))


_NOISE_OF_STEPS = [_white_noise_std(a, b) for a, b in zip((0.0, *SIGMAS[:-1]), SIGMAS, strict=True)]
_NOISE_OF_MIDDLE = _white_noise_std(SIGMAS[MIDDLE - 1], None)
