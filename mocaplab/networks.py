"""The networks: modules only, no training loop and no file.

Letters in shapes: B clips in a batch, T frames, C channels, h units each way.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import torch
from torch import Tensor, nn


@contextmanager
def seeded(seed: int) -> Iterator[None]:
    """Make torch's randomness repeatable inside a with-block, and only there."""
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        yield


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
        total, weight = x.clone(), torch.ones_like(x)
        spread, spread_weight = torch.zeros_like(x), torch.zeros_like(x)
        for d, w in _weights(sigma, min(radius, x.shape[1] - 1)):
            for here, there in _shifts(d):
                wx = w[:, here] * x[:, there]
                total[:, here] += wx
                weight[:, here] += w[:, here]
                spread[:, here] += d * d * wx
                spread_weight[:, here] += d * d * w[:, here]
        y = total / weight
        ctx.save_for_backward(sigma, weight, (spread - y * spread_weight) / (weight * sigma**3))
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
            for d, w in _weights(sigma, min(ctx.radius, grad.shape[1] - 1)):
                for here, there in _shifts(d):
                    grad_x[:, there] += w[:, here] * share[:, here]
        return grad_x, grad * slope, None


def _weights(sigma: Tensor, radius: int) -> Iterator[tuple[int, Tensor]]:
    """Yield each distance from 1 to radius with its weight, shape (B, T, C)."""
    q = torch.exp(-0.5 / sigma**2)
    factor, w = q.clone(), torch.ones_like(q)
    for d in range(1, radius + 1):
        w *= factor  # factor is q^(2d - 1)
        factor *= q * q
        yield d, w


def _shifts(d: int) -> tuple[tuple[slice, slice], tuple[slice, slice]]:
    """Pair the frames that have a neighbour d frames away with that neighbour."""
    early, late = slice(None, -d), slice(d, None)
    return (early, late), (late, early)


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
    result: Tensor = AdaptiveGaussian.apply(x, sigma, radius)  # type: ignore[no-untyped-call]
    return result


@dataclass(frozen=True)
class EBFConfig:
    """The shape of an EBF; the defaults are the paper's."""

    n_channels: int  # C: joint angles in, and widths out
    n_code: int = 64  # width of the code between encoder and LSTM
    n_hidden: int = 126  # LSTM units in each direction
    n_layers: int = 4  # dense layers in the encoder, and as many in the filter part
    dropout: float = 0.5  # on the inputs of the LSTM
    radius: int = 15  # frames that the filter reaches to each side
    first_sigma: float = 4.0  # frames; every width starts near this

    def __post_init__(self) -> None:
        for name in ("n_channels", "n_code", "n_hidden", "n_layers", "radius"):
            value = getattr(self, name)
            if type(value) is not int or not 1 <= value <= 100_000:
                raise ValueError(f"{name} must be a whole number above 0, got {value!r}")
        if not 0 <= self.dropout < 1:
            raise ValueError(f"dropout must be at least 0 and below 1, got {self.dropout!r}")
        if not 0.1 <= self.first_sigma <= 30:
            raise ValueError(f"first_sigma must lie in [0.1, 30], got {self.first_sigma!r}")


class EBF(nn.Module):
    """Encoder, bidirectional LSTM, filter prediction (paper A, section 3).

    It sees a noisy pose and the root's angular velocity and answers with a Gaussian
    width for each channel and frame. It never outputs an angle: the cleaned motion is
    the noisy motion, smoothed by :func:`adaptive_gaussian` with these widths.

    Parameters
    ----------
    config : EBFConfig
    seed : int, of the first weights
    """

    def __init__(self, config: EBFConfig, *, seed: int):
        super().__init__()
        self.config = config
        with seeded(seed):
            n_in = config.n_channels + 3
            self.encoder = dense_stack(n_in, config.n_code, config.n_layers)
            self.dropout = nn.Dropout(config.dropout)
            self.lstm = nn.LSTM(
                config.n_code,
                config.n_hidden,
                num_layers=2,
                bidirectional=True,
                batch_first=True,
                dropout=config.dropout,
            )
            self.head = dense_stack(2 * config.n_hidden, config.n_channels, config.n_layers)
            # Small last weights and this bias: all widths start near first_sigma. With the
            # paper's own start (uniform in [-0.5, 0.5]) exp gives widths from 0 to 1000.
            *_, weight, bias = self.head.parameters()
            nn.init.normal_(weight, std=0.01)
            nn.init.constant_(bias, math.log(config.first_sigma))

    def forward(self, pose: Tensor, root_velocity: Tensor) -> Tensor:
        """Predict the filter widths.

        Parameters
        ----------
        pose : tensor, shape (B, T, C), normalized angles
        root_velocity : tensor, shape (B, T, 3), radians per second

        Returns
        -------
        tensor, shape (B, T, C), frames, between 0.1 and 30
        """
        x = torch.cat([pose, root_velocity], dim=-1)  # (B, T, C + 3)
        x = torch.tanh(self.encoder(x))  # (B, T, code)
        x, _ = self.lstm(self.dropout(x))  # (B, T, 2h)
        log_sigma = self.head(x)  # (B, T, C)
        # Below 0.1 frames or above 30 the filter does not change any more.
        return torch.exp(log_sigma.clamp(math.log(0.1), math.log(30.0)))


def dense_stack(n_in: int, n_out: int, n_layers: int) -> nn.Sequential:
    """Dense layers with tanh between them, whose widths go evenly from n_in to n_out."""
    widths = [round(n_in + (n_out - n_in) * i / n_layers) for i in range(n_layers + 1)]
    layers: list[nn.Module] = []
    for a, b in pairwise(widths):
        layers += [nn.Linear(a, b), nn.Tanh()]
    return nn.Sequential(*layers[:-1])
