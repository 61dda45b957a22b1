"""The networks of paper A: modules only, no training loop and no file.

All that denoise answer a pose with a pose: standardized angles in, standardized angles
out (:func:`mocaplab.normalization.standardize`). Letters in shapes: B clips in a batch,
T frames, C channels, h units each way.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor, nn

from mocaplab.adaptive_filter import adaptive_gaussian, free_filter
from mocaplab.blend import Blend, BlendConfig
from mocaplab.layers import (
    Network,
    bidirectional_lstm,
    check_sizes,
    dense,
    dense_stack,
    seeded,
    start_glorot,
    start_near,
)
from mocaplab.live.mixer import LiveMixer, LiveMixerConfig


@dataclass(frozen=True)
class EBFConfig:
    """The shape of an EBF; the defaults are the paper's."""

    n_channels: int  # C: joint angles in, and filters out
    n_code: int = 64  # width of the code between encoder and LSTM
    n_hidden: int = 126  # LSTM units in each direction
    n_layers: int = 4  # dense layers in the encoder, and as many in the filter part
    dropout: float = 0.5  # on the inputs of the LSTM
    radius: int = 15  # frames that the filter reaches to each side
    first_sigma: float = 4.0  # frames; every width starts near this
    encoder: bool = True  # False is BF, the paper's ablation: the LSTM sees the pose itself
    bias: bool = False  # predict also what to subtract, for noise whose mean is not 0
    kernel: str = "gaussian"  # or "free": 2 * radius + 1 weights, the same for all channels
    paper_init: bool = False  # dense weights uniform in [-0.5, 0.5], LSTM weights Gaussian

    def __post_init__(self) -> None:
        check_sizes(self, "n_channels", "n_code", "n_hidden", "n_layers", "radius")
        if not 0.1 <= self.first_sigma <= 30:
            raise ValueError(f"first_sigma must lie in [0.1, 30], got {self.first_sigma!r}")
        if self.kernel not in ("gaussian", "free"):
            raise ValueError(f"kernel must be 'gaussian' or 'free', got {self.kernel!r}")


class EBF(Network):
    """Encoder, bidirectional LSTM, filter prediction (paper A, section 3).

    It sees a noisy pose and the root's angular velocity and answers with a Gaussian
    width for each channel and frame. It never outputs an angle: the cleaned pose is the
    noisy one, smoothed by :func:`mocaplab.adaptive_filter.adaptive_gaussian`.

    Parameters
    ----------
    config : EBFConfig
    seed : int, of the first weights
    """

    def __init__(self, config: EBFConfig, *, seed: int):
        super().__init__()
        self.config = config
        n_pose = config.n_channels
        n_filter = 2 * config.radius + 1 if config.kernel == "free" else n_pose
        n_out = n_filter + (n_pose if config.bias else 0)
        with seeded(seed):
            if config.encoder:
                self.encoder = dense_stack(n_pose + 3, config.n_code, config.n_layers)
            n_code = config.n_code if config.encoder else n_pose + 3
            self.dropout = nn.Dropout(config.dropout)
            self.lstm = bidirectional_lstm(n_code, config.n_hidden, config.dropout)
            self.head = dense_stack(2 * config.n_hidden, n_out, config.n_layers)
            if config.paper_init:
                _init_as_in_the_paper(self)
            else:
                start_glorot(self)
                start_near(self.head, _first_outputs(config, n_out))

    def predict(self, pose: Tensor, root_velocity: Tensor) -> tuple[Tensor, Tensor | None]:
        """Predict the filters.

        Parameters
        ----------
        pose : tensor, shape (B, T, C), standardized angles
        root_velocity : tensor, shape (B, T, 3), radians per second

        Returns
        -------
        filters : tensor
            Widths in frames, shape (B, T, C), between 0.1 and 30; for free kernels their
            scores, shape (B, T, 1, 2 * radius + 1).
        bias : tensor, shape (B, T, C), or None
        """
        x = torch.cat([pose, root_velocity], dim=-1)  # (B, T, C + 3)
        if self.config.encoder:
            x = torch.tanh(self.encoder(x))  # (B, T, code)
        x, _ = self.lstm(self.dropout(x))  # (B, T, 2h)
        x = self.head(x)  # (B, T, filters [+ C])
        bias = None
        if self.config.bias:
            x, bias = x[..., : -pose.shape[-1]], x[..., -pose.shape[-1] :]
        if self.config.kernel == "free":
            return x[..., None, :], bias
        # Below 0.1 frames or above 30 the filter does not change any more.
        return torch.exp(x.clamp(math.log(0.1), math.log(30.0))), bias

    def forward(self, pose: Tensor, root_velocity: Tensor) -> Tensor:
        """Clean a pose, shape (B, T, C), with the filters that it predicts for it."""
        filters, bias = self.predict(pose, root_velocity)
        if self.config.kernel == "free":
            smooth = free_filter(pose, filters)
        else:
            smooth = adaptive_gaussian(pose, filters, self.config.radius)
        return smooth if bias is None else smooth - bias


def _first_outputs(config: EBFConfig, n_out: int) -> Tensor:
    """Return outputs that make every filter a Gaussian of width first_sigma."""
    if config.kernel == "gaussian":
        filters = torch.full((config.n_channels,), math.log(config.first_sigma))
    else:
        taps = torch.arange(-config.radius, config.radius + 1)
        filters = -0.5 * (taps / config.first_sigma) ** 2
    return torch.cat([filters, torch.zeros(n_out - len(filters))])


def _init_as_in_the_paper(model: EBF) -> None:
    """Dense weights uniform in [-0.5, 0.5]; LSTM weights Gaussian, of a width it does not give."""
    for layer in model.modules():
        if isinstance(layer, nn.Linear):
            nn.init.uniform_(layer.weight, -0.5, 0.5)
            nn.init.uniform_(layer.bias, -0.5, 0.5)
    for values in model.lstm.parameters():
        nn.init.normal_(values, std=0.1)


@dataclass(frozen=True)
class NNConfig:
    """The shape of NN; the paper gives the number of layers and no widths."""

    n_channels: int  # C
    n_hidden: int = 256  # units in each layer but the last
    n_layers: int = 6  # dense layers
    radius: int = 15  # frames that it sees, and filters, to each side
    first_sigma: float = 4.0  # frames

    def __post_init__(self) -> None:
        check_sizes(self, "n_channels", "n_hidden", "n_layers", "radius")


class NN(Network):
    """Six dense layers over the whole window at once: no recurrence (paper A, section 4.1).

    We read "a vector of values for 126 joint channels" as filter widths, since only what
    stands before the filter is compared there.

    Parameters
    ----------
    config : NNConfig
    seed : int, of the first weights
    """

    def __init__(self, config: NNConfig, *, seed: int):
        super().__init__()
        self.config = config
        n_in = (config.n_channels + 3) * (2 * config.radius + 1)  # 129 x 31 = 3999
        widths = [n_in, *[config.n_hidden] * (config.n_layers - 1), config.n_channels]
        with seeded(seed):
            self.layers = dense(widths)
            start_glorot(self)
            first = torch.full((config.n_channels,), math.log(config.first_sigma))
            start_near(self.layers, first)

    def predict(self, pose: Tensor, root_velocity: Tensor) -> tuple[Tensor, None]:
        """Predict widths in frames, shape (B, T, C), and no bias; see :meth:`EBF.predict`."""
        x = torch.cat([pose, root_velocity], dim=-1)  # (B, T, C + 3)
        radius = self.config.radius
        x = nn.functional.pad(x, (0, 0, radius, radius))  # zeros beyond the ends
        x = x.unfold(1, 2 * radius + 1, 1).flatten(2)  # (B, T, (C + 3) * window)
        log_sigma = self.layers(x)  # (B, T, C)
        return torch.exp(log_sigma.clamp(math.log(0.1), math.log(30.0))), None

    def forward(self, pose: Tensor, root_velocity: Tensor) -> Tensor:
        """Clean a pose, shape (B, T, C)."""
        sigma, _ = self.predict(pose, root_velocity)
        return adaptive_gaussian(pose, sigma, self.config.radius)


@dataclass(frozen=True)
class EBDConfig:
    """The shape of an EBD, the gap filler; the defaults are the paper's."""

    n_channels: int  # C
    n_code: int = 64  # width of the code between encoder and LSTM
    n_hidden: int = 32  # LSTM units in each direction
    n_layers: int = 4  # dense layers in the encoder, and as many in the decoder
    dropout: float = 0.5  # on the inputs of the LSTM
    stride: int = 4  # the LSTM steps over this many frames at once

    def __post_init__(self) -> None:
        check_sizes(self, "n_channels", "n_code", "n_hidden", "n_layers", "stride")


class EBD(Network):
    """Encoder, bidirectional LSTM, decoder: recovers the pose itself (paper A, section 3).

    The LSTM steps over 4 frames at once, so that 15 steps reach 60 frames. A sequence is
    therefore read as four interleaved ones, each with every fourth frame.

    Parameters
    ----------
    config : EBDConfig
    seed : int, of the first weights
    """

    def __init__(self, config: EBDConfig, *, seed: int):
        super().__init__()
        self.config = config
        with seeded(seed):
            self.encoder = dense_stack(config.n_channels + 3, config.n_code, config.n_layers)
            self.dropout = nn.Dropout(config.dropout)
            self.lstm = bidirectional_lstm(config.n_code, config.n_hidden, config.dropout)
            self.decoder = dense_stack(2 * config.n_hidden, config.n_channels, config.n_layers)

    def forward(self, pose: Tensor, root_velocity: Tensor) -> Tensor:
        """Recover a pose, shape (B, T, C), whose gaps were closed by straight lines."""
        x = torch.cat([pose, root_velocity], dim=-1)  # (B, T, C + 3)
        x = torch.tanh(self.encoder(x))  # (B, T, code)
        x, _ = self.lstm(_interleave(self.dropout(x), self.config.stride))
        x = _join(x, len(pose), pose.shape[1])  # (B, T, 2h)
        result: Tensor = self.decoder(x)  # (B, T, C)
        return result


def _interleave(x: Tensor, stride: int) -> Tensor:
    """Turn (B, T, n) into (B * stride, T / stride, n): one sequence for each remainder.

    T is made a multiple of the stride by repeating the last frame.
    """
    n_clips, n_frames, n = x.shape
    missing = -n_frames % stride
    x = torch.cat([x, x[:, -1:].expand(-1, missing, -1)], dim=1)
    x = x.reshape(n_clips, -1, stride, n).transpose(1, 2)  # (B, stride, T / stride, n)
    return x.reshape(n_clips * stride, -1, n)


def _join(x: Tensor, n_clips: int, n_frames: int) -> Tensor:
    """Undo :func:`_interleave`."""
    x = x.reshape(n_clips, -1, *x.shape[1:]).transpose(1, 2)  # (B, T / stride, stride, n)
    return x.flatten(1, 2)[:, :n_frames]


NETWORKS: dict[str, tuple[type, type]] = {
    "EBF": (EBF, EBFConfig),
    "NN": (NN, NNConfig),
    "EBD": (EBD, EBDConfig),
    "Blend": (Blend, BlendConfig),
    "LiveMixer": (LiveMixer, LiveMixerConfig),  # for streams
}
"""Each network by name: its class and the class of its configuration."""


def build_network(config: Any, *, seed: int) -> Network:
    """Make the network that a configuration describes, with fresh weights."""
    for network, config_type in NETWORKS.values():
        if type(config) is config_type:
            built: Network = network(config, seed=seed)
            return built
    raise TypeError(f"expected the configuration of a network, got {type(config).__name__}")
