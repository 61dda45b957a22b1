"""Several processes that train one network together, started by ``torchrun``.

    torchrun --nproc-per-node 2 -m mocaplab train FOLDER -o MODEL

Each process takes its share of the pieces of every step, and all take the same step: the
mean of their gradients. Without torchrun there is one process and nothing here does anything.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager

import torch
import torch.distributed as dist
from torch import Tensor, nn
from torch.nn.parallel import DistributedDataParallel


@contextmanager
def process_group() -> Iterator[tuple[int, int]]:
    """Join the other processes, if there are any, inside a with-block.

    Yields
    ------
    rank, n_processes : int; (0, 1) without torchrun
    """
    if "WORLD_SIZE" not in os.environ or dist.is_initialized():
        yield rank_and_size()
        return
    dist.init_process_group("nccl" if torch.cuda.is_available() else "gloo")
    try:
        yield rank_and_size()
    finally:
        dist.destroy_process_group()


def rank_and_size() -> tuple[int, int]:
    """Return the number of this process, and how many there are."""
    return (dist.get_rank(), dist.get_world_size()) if dist.is_initialized() else (0, 1)


def training_device() -> torch.device:
    """Return the GPU of this process where there is one, else the CPU."""
    if torch.cuda.is_available():
        return torch.device("cuda", int(os.environ.get("LOCAL_RANK", "0")))
    return torch.device("cpu")


def share_gradients(network: nn.Module) -> nn.Module:
    """Wrap a network so that backward takes the mean of the gradients of all processes."""
    return DistributedDataParallel(network) if dist.is_initialized() else network


def mean_over_processes(value: Tensor) -> Tensor:
    """Return the mean of a number over all processes; no gradient flows through it."""
    value = value.detach().clone()
    if dist.is_initialized():
        dist.all_reduce(value)
        value /= dist.get_world_size()
    return value
