"""The network that mixes the estimates of a stream; it works on one frame at a time.

It is what a :class:`mocaplab.blend.Blend` has after its LSTM: one small network that is the same
for all channels, with a few numbers of their own. The past comes in through its clues, which are
averaged over time, so it needs no memory.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor, nn

from mocaplab.layers import Network, check_sizes, seeded

LIMIT = 4.0
"""How far a sample may be moved, in deviations of the noise."""


@dataclass(frozen=True)
class LiveMixerConfig:
    """The shape of a LiveMixer."""

    n_channels: int  # C
    n_estimates: int  # M
    n_clues: int  # F
    n_head: int = 32  # units in each of the two layers
    radius: int = 15  # frames before the one to clean that the linear estimate sees
    n_cosines: int = 8  # cosine coefficients a channel and window, for the linear estimate

    def __post_init__(self) -> None:
        names = ("n_channels", "n_estimates", "n_clues", "n_head", "radius", "n_cosines")
        check_sizes(self, *names)


class LiveMixer(Network):
    """Weights for estimates, from clues; :class:`mocaplab.live.blend.LiveBlend` uses it.

    Parameters
    ----------
    config : LiveMixerConfig
    seed : int, of the first weights
    """

    covariance: Tensor  # (C * K, C * K), of clean windows; not learned by descent but measured

    def __init__(self, config: LiveMixerConfig, *, seed: int):
        super().__init__()
        self.config = config
        n_channels, n_head, n_windows = (
            config.n_channels,
            config.n_head,
            config.n_channels * config.n_cosines,
        )
        self.register_buffer("covariance", torch.zeros(n_windows, n_windows))
        with seeded(seed):
            self.first = nn.Linear(config.n_clues, n_head)
            self.second = nn.Linear(n_head, n_head)
            self.scores = nn.Linear(n_head, config.n_estimates)
            nn.init.normal_(self.scores.weight, std=0.01)
        self.channel_first = nn.Parameter(torch.zeros(n_channels, n_head))
        self.channel_scores = nn.Parameter(torch.zeros(n_channels, config.n_estimates))
        with torch.no_grad():  # at first mostly the last estimate, from all channels
            self.scores.bias.fill_(-1.0)
            self.scores.bias[-1] = 1.0

    def mix(self, estimates: Tensor, clues: Tensor, noise: Tensor) -> Tensor:
        """Mix the estimates of each frame and channel.

        Parameters
        ----------
        estimates : tensor, shape (..., C, M), as differences from the observed frame
        clues : tensor, shape (..., C, F)
        noise : tensor, shape (..., C)

        Returns
        -------
        tensor, shape (..., C): what to add to the observed frame, at most ``LIMIT`` times the
        noise, so that clean input stays clean
        """
        x = torch.tanh(self.first(clues) + self.channel_first)  # (..., C, head)
        x = torch.tanh(self.second(x))
        weights = (self.scores(x) + self.channel_scores).softmax(dim=-1)  # (..., C, M)
        mixed: Tensor = (weights * estimates).sum(dim=-1)
        return mixed.clamp(-LIMIT * noise, LIMIT * noise)

    def forward(self, pose: Tensor, root_velocity: Tensor) -> Tensor:
        """Refuse whole clips."""
        raise ValueError(
            "this network cleans streams: Stream(skeleton, frame_time, LiveBlend(model))"
        )
