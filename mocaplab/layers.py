"""Pieces that all networks are built from."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
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


class Network(nn.Module):
    """What all networks have in common: a pose in, a pose out."""

    config: Any  # the frozen dataclass that describes it

    def forward(self, pose: Tensor, root_velocity: Tensor) -> Tensor:
        """Clean a pose.

        Parameters
        ----------
        pose : tensor, shape (B, T, C), standardized angles
        root_velocity : tensor, shape (B, T, 3), radians per second

        Returns
        -------
        tensor, shape (B, T, C), standardized angles
        """
        raise NotImplementedError


def dense_stack(n_in: int, n_out: int, n_layers: int) -> nn.Sequential:
    """Dense layers with tanh between them, whose widths go evenly from n_in to n_out."""
    return dense([round(n_in + (n_out - n_in) * i / n_layers) for i in range(n_layers + 1)])


def dense(widths: list[int]) -> nn.Sequential:
    """Dense layers of these widths with tanh between them, none after the last."""
    layers: list[nn.Module] = []
    for a, b in pairwise(widths):
        layers += [nn.Linear(a, b), nn.Tanh()]
    return nn.Sequential(*layers[:-1])


def bidirectional_lstm(n_in: int, n_hidden: int, dropout: float) -> nn.LSTM:
    """Two layers of n_hidden units in each direction."""
    return nn.LSTM(
        n_in, n_hidden, num_layers=2, bidirectional=True, batch_first=True, dropout=dropout
    )


def start_glorot(network: nn.Module) -> None:
    """Choose first weights with which signals keep their size from layer to layer.

    Glorot's in dense layers and for what enters an LSTM, orthogonal ones for what it carries
    from frame to frame. With torch's own, about half of a signal is left behind a dense layer and
    a tenth behind the LSTM (notebook 04, section 9): for many epochs a network learns constants.
    """
    for layer in network.modules():
        if isinstance(layer, nn.Linear):
            nn.init.xavier_uniform_(layer.weight)
            nn.init.zeros_(layer.bias)
        elif isinstance(layer, nn.LSTM):
            for name, values in layer.named_parameters():
                for i, gate in enumerate(values.detach().chunk(4)):  # input, forget, cell, output
                    if name.startswith("bias"):  # the forget gates start open
                        nn.init.constant_(gate, float(i == 1 and "_ih" in name))
                    elif "_hh" in name:
                        nn.init.orthogonal_(gate)
                    else:
                        nn.init.xavier_uniform_(gate)


def start_near(layers: nn.Sequential, outputs: Tensor) -> None:
    """Set the last layer so that its outputs start near these, whatever comes in.

    With the paper's own start, exp gives widths from 0 to 1000.
    """
    *_, weight, bias = layers.parameters()
    nn.init.normal_(weight, std=0.01)
    with torch.no_grad():
        bias.copy_(outputs)


def check_sizes(config: Any, *names: str) -> None:
    """Refuse a configuration in which one of these fields is no size, or dropout no share."""
    for name in names:
        value = getattr(config, name)
        if type(value) is not int or not 1 <= value <= 100_000:
            raise ValueError(f"{name} must be a whole number above 0, got {value!r}")
    dropout = getattr(config, "dropout", 0.0)
    if not 0 <= dropout < 1:
        raise ValueError(f"dropout must be at least 0 and below 1, got {dropout!r}")
