"""The layer that paper A is built on: smoothing with filters that a network predicts.

Letters in shapes: B clips in a batch, T frames, C channels.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import torch
from torch import Tensor, nn


def adaptive_gaussian(x: Tensor, sigma: Tensor, radius: int = 15) -> Tensor:
    """Smooth x with a Gaussian of its own width for each frame and channel.

    Parameters
    ----------
    x : tensor, shape (B, T, C)
    sigma : tensor, shape (B, T, C), frames, above 0
    radius : int, frames that the window reaches to each side

    Returns
    -------
    tensor, shape (B, T, C); gradients flow to both x and sigma
    """
    # A few clips at a time, so that all that is at work stays in the processor's cache.
    parts = zip(torch.split(x, 4), torch.split(sigma, 4), strict=True)
    smooth = [AdaptiveGaussian.apply(*part, radius) for part in parts]  # type: ignore[no-untyped-call]
    return torch.cat(smooth)


def free_filter(x: Tensor, scores: Tensor) -> Tensor:
    """Smooth each frame with weights of any shape (paper A, section 3 and Figure 3).

    The weights are the softmax of the scores: positive, and their sum is 1. Frames beyond
    the ends of the sequence get no weight.

    Parameters
    ----------
    x : tensor, shape (B, T, C)
    scores : tensor, shape (B, T, C or 1, 2 * radius + 1)
        The last axis goes from ``radius`` frames back to ``radius`` frames ahead. With 1
        in place of C, all channels of a frame share their weights.

    Returns
    -------
    tensor, shape (B, T, C)
    """
    n_frames, radius = x.shape[1], scores.shape[-1] // 2
    taps = torch.arange(-radius, radius + 1, device=x.device)
    there = torch.arange(n_frames, device=x.device)[:, None] + taps  # (T, taps)
    outside = (there < 0) | (there >= n_frames)
    weights = scores.masked_fill(outside[:, None], -torch.inf).softmax(dim=-1)
    padded = nn.functional.pad(x, (0, 0, radius, radius))
    result = torch.zeros_like(x)
    for tap in range(2 * radius + 1):  # one tap at a time: nothing as large as all windows
        result = result + weights[..., tap] * padded[:, tap : tap + n_frames]
    return result


class AdaptiveGaussian(torch.autograd.Function):
    """Smooth each sample with its own Gaussian width (paper A, section 3).

    ``y(t) = sum_d w_d x(t + d) / sum_d w_d`` with ``w_d = exp(-d^2 / 2 sigma(t)^2)``, d
    from -radius to radius. Frames beyond the ends of the sequence are left out of both
    sums.

    Nothing of size (B, T, C, 2 * radius + 1) is ever held. The weights come one from the
    other: with q = exp(-1 / 2 sigma^2), w_d = q^(d^2) = w_(d-1) * q^(2d-1). The forward
    pass also adds up what the derivative needs, so that backward is one product.
    """

    @staticmethod
    def forward(ctx: Any, x: Tensor, sigma: Tensor, radius: int) -> Tensor:
        """Smooth x, shape (B, T, C), with widths sigma in frames, same shape."""
        padded = nn.functional.pad(x, (0, 0, radius, radius))  # zeros beyond the ends
        shifted = padded.unfold(1, 2 * radius + 1, 1).unbind(-1)  # views, nothing is copied
        total, weight = x.clone(), torch.ones_like(x)
        spread, spread_weight = torch.zeros_like(x), torch.zeros_like(x)
        for d, w, count in _weights(sigma, radius):
            both = shifted[radius - d] + shifted[radius + d]
            total.addcmul_(w, both)
            weight.addcmul_(w, count)
            spread.addcmul_(w, both, value=d * d)
            spread_weight.addcmul_(w, count, value=d * d)
        y = total / weight
        slope = (spread - y * spread_weight) / (weight * sigma**3)  # of y by sigma
        ctx.save_for_backward(sigma, weight, slope)
        ctx.radius = radius
        return y

    @staticmethod
    def backward(ctx: Any, *grads: Tensor) -> tuple[Tensor | None, Tensor | None, None]:
        """Return the gradients with respect to x and sigma."""
        (grad,) = grads
        sigma, weight, slope = ctx.saved_tensors
        grad_x = None
        if ctx.needs_input_grad[0]:
            share = grad / weight
            grad_x = share.clone()
            for d, w, _ in _weights(sigma, ctx.radius):
                here = w * share
                grad_x[:, d:] += here[:, :-d]
                grad_x[:, :-d] += here[:, d:]
        return grad_x, grad * slope, None


def _weights(sigma: Tensor, radius: int) -> Iterator[tuple[int, Tensor, Tensor]]:
    """Yield each distance d from 1 to radius, its weights, and how many frames have them.

    Weights have shape (B, T, C). The counts, shape (T, 1), are 2 where both the frame d
    before and the frame d after exist, 1 or 0 near the ends.
    """
    n_frames = sigma.shape[1]
    frame = torch.arange(n_frames, device=sigma.device)[:, None]
    distance = torch.arange(1, min(radius, n_frames - 1) + 1, device=sigma.device)
    before, after = frame >= distance, frame < n_frames - distance  # (T, distances)
    counts = (before.to(sigma) + after.to(sigma))[..., None].unbind(1)
    q = torch.exp(-0.5 / sigma**2).clamp_min_(1e-18)
    factor, w, q_squared = q.clone(), torch.ones_like(q), (q * q).clamp_min_(1e-18)
    for d, count in enumerate(counts, start=1):
        # factor is q^(2d - 1). Weights that do not count any more are kept above 1e-18: the
        # processor needs many times as long for numbers that are almost 0.
        w.mul_(factor).clamp_min_(1e-18)
        factor.mul_(q_squared).clamp_min_(1e-18)
        yield d, w, count
