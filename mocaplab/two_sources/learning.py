"""The loop in which the networks of paper B learn: batches, steps, validation, resume."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn
from tqdm.auto import tqdm

from mocaplab.learning.parallel import (
    mean_over_processes,
    process_group,
    rank_and_size,
    share_gradients,
    training_device,
)
from mocaplab.learning.state import TrainingState, cosine_decay

Draw = Callable[[np.random.Generator], Any]
Loss = Callable[[nn.Module, Any], Tensor]


@dataclass(frozen=True)
class SourceTrainConfig:
    """How to train a network of paper B; see section "Implementation Details"."""

    epochs: int = 30
    steps: int = 100  # batches in an epoch
    batch_size: int = 64  # windows in a batch
    n_frames: int = 60  # frames in a window
    n_future: int = 10  # of these, frames to predict; for a PredictionLSTM
    learning_rate: float = 1e-3  # at the start; falls along a cosine to 0
    gradient_norm: float = 0.1  # longer gradients are cut to this length
    invariant: bool = True  # q and -q are the same; False is the paper's Eq. 1
    kinematics_weight: float = 0.0  # of the forward-kinematics loss, a file length unit
    varied: bool = False  # sources that differ in quality, from clean to pure noise
    strides: tuple[int, ...] = (1,)  # keep every so many-th frame, to learn other frame rates
    seed: int = 0  # of windows and noise

    def __post_init__(self) -> None:
        for name in ("epochs", "steps", "batch_size", "n_frames", "learning_rate", "gradient_norm"):
            if not getattr(self, name) > 0:
                raise ValueError(f"{name} must be above 0, got {getattr(self, name)}")
        if not 0 < self.n_future < self.n_frames:
            raise ValueError(f"n_future must lie between 1 and n_frames - 1, got {self.n_future}")
        if not self.strides or min(self.strides) < 1:
            raise ValueError(f"strides must be whole numbers above 0, got {self.strides}")


def learn(
    network: nn.Module,
    draw: Draw,
    draw_validation: Draw | None,
    loss: Loss,
    config: SourceTrainConfig,
    fingerprint: dict[str, Any],
    state_path: str | os.PathLike[str] | None,
    progress: bool,
) -> TrainingState:
    """Take all steps; the weights that did best on the validation clips stay in the network.

    Parameters
    ----------
    network : Module
    draw : function of a random generator, makes a batch
    draw_validation : the same from validation clips, or None
    loss : function of the network and a batch
    config : SourceTrainConfig
    fingerprint : dict that tells this training from any other
    state_path, progress : see :func:`mocaplab.two_sources.training.train_fusion`
    """
    with process_group() as (rank, _):
        state = TrainingState(network.to(training_device()))
        if state_path is not None and Path(state_path).exists():
            state.load(state_path, fingerprint)
        shared = share_gradients(network)
        done = len(state.losses)
        bar = tqdm(
            range(done, config.epochs),
            initial=done,
            total=config.epochs,
            desc="training",
            unit="epoch",
            disable=not progress or rank > 0,
        )
        for epoch in bar:
            # Every process draws windows and noise of its own.
            rng = np.random.default_rng([config.seed, epoch, rank_and_size()[0]])
            network.train()
            state.set_learning_rate(config.learning_rate * cosine_decay(epoch / config.epochs))
            steps = (_step(state, shared, loss, draw(rng), config) for _ in range(config.steps))
            mean = float(np.mean(list(steps)))
            if not np.isfinite(mean):
                raise FloatingPointError(
                    f"the loss is {mean} in epoch {epoch + 1}; try a smaller learning_rate than "
                    f"{config.learning_rate}"
                )
            state.end_epoch(mean, _validate(network, draw_validation, loss, config))
            last = (state.validation_losses or state.losses)[-1]
            bar.set_postfix(loss=f"{last:.3f}")
            if state_path is not None and rank == 0:
                state.save(state_path, fingerprint)
    if state.best:
        network.load_state_dict(state.best)
    network.cpu().eval()
    return state


def _step(
    state: TrainingState, shared: nn.Module, loss: Loss, batch: Any, config: SourceTrainConfig
) -> float:
    error = loss(shared, batch)
    state.optimizer.zero_grad()
    error.backward()  # type: ignore[no-untyped-call]
    nn.utils.clip_grad_norm_(state.network.parameters(), config.gradient_norm)
    state.optimizer.step()
    return mean_over_processes(error).item()


def _validate(
    network: nn.Module, draw: Draw | None, loss: Loss, config: SourceTrainConfig
) -> float | None:
    """Measure the loss on a tenth as many batches, the same ones every time."""
    if draw is None:
        return None
    rng = np.random.default_rng([config.seed, 2**32 - 1])
    network.eval()
    with torch.no_grad():
        losses = [loss(network, draw(rng)) for _ in range(max(4, config.steps // 10))]
    return mean_over_processes(torch.stack(losses).mean()).item()
