"""What a network is shown while it learns: batches, and the loss on a batch.

EBF and its variants learn from pieces of clips (:mod:`mocaplab.learning.batches`); for Blend see
:mod:`mocaplab.learning.blend_lesson`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, Protocol

import numpy as np
import torch
from torch import Tensor

from mocaplab.learning.batches import Batch, Windows
from mocaplab.learning.config import TrainConfig
from mocaplab.learning.parallel import mean_over_processes, rank_and_size
from mocaplab.motion import CONSTANT_STD_DEG, BoolArray, Motion
from mocaplab.normalization import standardize


class Lesson(Protocol):
    """Clips to learn from."""

    n_batches: int  # in an epoch, about

    def batches(self, rng: np.random.Generator) -> Iterator[Any]:
        """Yield the batches of one epoch, of each the part that this process works on."""
        ...

    def loss(self, network: torch.nn.Module, batch: Any) -> Tensor:
        """Return one number: how far the network is from the clean poses."""
        ...


class WindowLesson:
    """Pieces of clips, as :class:`mocaplab.learning.batches.Windows` draws them."""

    def __init__(self, clips: Sequence[Motion], config: TrainConfig, columns: BoolArray):
        self.config, self.columns = config, columns
        self.windows = Windows(clips, config.n_frames, config.margin)
        self.n_batches = self.windows.n_batches(config.batch_size)

    def batches(self, rng: np.random.Generator) -> Iterator[Batch]:
        """See :class:`Lesson`."""
        config = self.config
        batches = self.windows.batches(
            config.batch_size,
            (config.k_low, config.k_high),
            (config.speed_low, config.speed_high),
            (config.gap_probability, config.gap_mean_s),
            config.jump_rate,
            rng=rng,
        )
        rank, n_processes = rank_and_size()
        return (batch.share(rank, n_processes) for batch in batches)

    def loss(self, network: torch.nn.Module, batch: Batch) -> Tensor:
        """See :class:`Lesson`."""
        return batch_loss(network, batch, self.columns)


def batch_loss(network: torch.nn.Module, batch: Batch, columns: BoolArray) -> Tensor:
    """Mean squared error between what a network makes of a batch and the clean poses.

    Each piece is divided by the spread of the clip that it is from; otherwise the few clips
    with the widest movements would decide everything. For batches with gaps, only what is
    inside them counts.

    Parameters
    ----------
    network : pose to pose
    batch : Batch
    columns : array, shape (C,), bool: the channels that the network sees

    Returns
    -------
    tensor, one number: the share of a clip's movement that is left as error
    """
    device = next(network.parameters()).device

    def tensor(array: np.ndarray) -> Tensor:
        return torch.from_numpy(np.ascontiguousarray(array, dtype=np.float32)).to(device)

    mean, std = batch.mean[..., columns], batch.std[..., columns]  # (B, 1, C)
    observed, clean = (
        tensor(standardize(values[..., columns], mean, std))
        for values in (batch.observed, batch.clean)
    )
    cleaned = network(observed, tensor(batch.root_velocity))
    variance = tensor(std**2)  # (B, 1, C)
    spread = variance.mean(dim=-1, keepdim=True).clamp_min(CONSTANT_STD_DEG**2)  # (B, 1, 1)
    error = (cleaned - clean) ** 2 * variance / spread  # (B, T, C)
    counted = torch.from_numpy(batch.counted[..., columns]).to(device)
    weight = tensor(batch.weight)[..., None] * counted  # (B, T, C)
    # The mean over all processes, so that together they take the step of one.
    loss: Tensor = (error * weight).sum() / mean_over_processes(weight.sum())
    return loss
