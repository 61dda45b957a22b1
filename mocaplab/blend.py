"""Blend: a network that mixes nine estimates of the clean pose.

It goes beyond paper A in two ways. EBF can only smooth a channel by itself; here one of the
estimates comes from all channels. And EBF has to learn for every channel anew what a filter
that cuts into the movement looks like; here one small network, the same for all channels,
learns it once from clues that mean the same everywhere. An encoder and a bidirectional LSTM
as in EBF tell it what the body is doing.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor, nn

from mocaplab.estimate_bank import (
    MIDDLE,
    N_CLUES,
    N_ESTIMATES,
    estimates_and_clues,
    noise_std,
)
from mocaplab.layers import Network, bidirectional_lstm, check_sizes, seeded

LIMIT = 4.0
"""How far a sample may be moved, in deviations of the noise."""


@dataclass(frozen=True)
class BlendConfig:
    """The shape of a Blend."""

    n_channels: int  # C
    n_code: int = 128  # width of the code between encoder and LSTM
    n_hidden: int = 96  # LSTM units in each direction
    n_context: int = 6  # numbers a channel and frame that the LSTM passes on
    n_head: int = 32  # units in each of the two layers that all channels share
    dropout: float = 0.2  # before and after the LSTM
    radius: int = 15  # frames that the window of the linear estimate reaches to each side
    n_cosines: int = 8  # cosine coefficients a channel and window

    def __post_init__(self) -> None:
        sizes = ("n_channels", "n_code", "n_hidden", "n_context", "n_head", "radius", "n_cosines")
        check_sizes(self, *sizes)


class Mixer(nn.Module):
    """What a Blend learns: weights for its estimates.

    Parameters
    ----------
    config : BlendConfig
    """

    def __init__(self, config: BlendConfig):
        super().__init__()
        n_channels, n_head = config.n_channels, config.n_head
        self.encoder = nn.Linear(3 * n_channels + 4, config.n_code)
        self.dropout = nn.Dropout(config.dropout)
        self.lstm = bidirectional_lstm(config.n_code, config.n_hidden, config.dropout)
        self.context = nn.Linear(2 * config.n_hidden, n_channels * config.n_context)
        self.first = nn.Linear(N_CLUES + config.n_context, n_head)
        self.second = nn.Linear(n_head, n_head)
        self.scores = nn.Linear(n_head, N_ESTIMATES)
        # What is different between channels: few numbers, so that little data is enough.
        self.channel_first = nn.Parameter(torch.zeros(n_channels, n_head))
        self.channel_scores = nn.Parameter(torch.zeros(n_channels, N_ESTIMATES))
        nn.init.normal_(self.context.weight, std=0.01)
        nn.init.normal_(self.scores.weight, std=0.01)
        with torch.no_grad():  # at first mostly the middle Gaussian and the linear estimate
            self.context.bias.zero_()
            self.scores.bias.fill_(-2.0)
            self.scores.bias[[MIDDLE, N_ESTIMATES - 1]] = 1.0

    def weights(
        self, estimates: Tensor, clues: Tensor, noise: Tensor, root_velocity: Tensor
    ) -> Tensor:
        """Return the weight of each estimate, shape (B, T, C, M); see :meth:`forward`."""
        n_clips, n_frames, n_channels, _ = estimates.shape
        narrow, middle, linear = (estimates[..., i] for i in (1, MIDDLE, N_ESTIMATES - 1))
        level = noise.log().mean(dim=1)[:, None, None].expand(-1, n_frames, 1)
        x = torch.cat([linear, narrow, middle, root_velocity, level], dim=-1)  # (B, T, 3C + 4)
        x = torch.tanh(self.encoder(x))  # (B, T, code)
        x, _ = self.lstm(self.dropout(x))  # (B, T, 2h)
        x = self.context(self.dropout(x))  # (B, T, C * context)
        x = x.reshape(n_clips, n_frames, n_channels, -1)
        x = torch.cat([clues, x], dim=-1)  # (B, T, C, F + context)
        x = torch.tanh(self.first(x) + self.channel_first)  # (B, T, C, head)
        x = torch.tanh(self.second(x))
        scores: Tensor = self.scores(x) + self.channel_scores
        return scores.softmax(dim=-1)

    def forward(
        self, estimates: Tensor, clues: Tensor, noise: Tensor, root_velocity: Tensor
    ) -> Tensor:
        """Mix estimates.

        Parameters
        ----------
        estimates, clues : see :func:`mocaplab.estimate_bank.estimates_and_clues`
        noise : tensor, shape (B, C)
        root_velocity : tensor, shape (B, T, 3), radians per second

        Returns
        -------
        tensor, shape (B, T, C)
        """
        weights = self.weights(estimates, clues, noise, root_velocity)
        mixed = (weights * estimates).sum(dim=-1)
        # No sample moves by more than noise can explain, so that clean input stays clean.
        limit = LIMIT * noise[:, None]
        return estimates[..., 0] + (mixed - estimates[..., 0]).clamp(-limit, limit)


class Blend(Network):
    """Nine estimates, mixed with weights for each channel and frame.

    The weights are positive and their sum is 1, so what it answers lies between the estimates.

    Parameters
    ----------
    config : BlendConfig
    seed : int, of the first weights
    """

    covariance: Tensor  # (C * K, C * K), of clean windows; not learned by descent but measured

    def __init__(self, config: BlendConfig, *, seed: int):
        super().__init__()
        self.config = config
        n_windows = config.n_channels * config.n_cosines
        self.register_buffer("covariance", torch.zeros(n_windows, n_windows))
        with seeded(seed):
            self.mixer = Mixer(config)

    def forward(self, pose: Tensor, root_velocity: Tensor, noise: Tensor | None = None) -> Tensor:
        """Clean a pose, shape (B, T, C); whole clips, since the filters reach far.

        Without ``noise``, shape (B, C), as :func:`mocaplab.estimate_bank.noise_std` returns
        it, that is what it is estimated by. A piece of a long clip comes with the clip's.
        """
        noise = noise_std(pose) if noise is None else noise
        estimates, clues = estimates_and_clues(pose, noise, self.covariance, self.config.radius)
        result: Tensor = self.mixer(estimates, clues, noise, root_velocity)
        return result

    def weights(self, pose: Tensor, root_velocity: Tensor, noise: Tensor | None = None) -> Tensor:
        """Return how the nine estimates are mixed, shape (B, T, C, 9); see :meth:`forward`."""
        noise = noise_std(pose) if noise is None else noise
        estimates, clues = estimates_and_clues(pose, noise, self.covariance, self.config.radius)
        return self.mixer.weights(estimates, clues, noise, root_velocity)
