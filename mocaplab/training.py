"""Train a network on clean clips: fresh noise every epoch, checkpoints, resume."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from tqdm.auto import tqdm

from mocaplab.batches import Batch, Windows
from mocaplab.checkpoints import Checkpoint
from mocaplab.corruption import corrupt
from mocaplab.datasets import clip_digest
from mocaplab.filters import tune_gaussian
from mocaplab.layers import seeded
from mocaplab.motion import CONSTANT_STD_DEG, BoolArray, Motion, moving_channels
from mocaplab.networks import EBFConfig, build_network
from mocaplab.normalization import constant_channels, standardize
from mocaplab.parallel import (
    mean_over_processes,
    process_group,
    rank_and_size,
    share_gradients,
    training_device,
)
from mocaplab.training_state import TrainingState


@dataclass(frozen=True)
class TrainConfig:
    """How to train. Paper A, section 3: L2 loss, Adam, 200 epochs."""

    epochs: int = 200  # an epoch sees every frame once on average
    patience: int = 0  # stop after so many epochs without a lower validation loss; 0: never
    batch_size: int = 16  # pieces a step
    n_frames: int = 150  # frames a piece, margins included
    margin: int = 15  # frames at each cut end that the loss leaves out
    learning_rate: float = 3e-3  # at the start; falls along a cosine to 0
    gradient_norm: float = 1.0  # longer gradients are cut to this length
    k_low: float = 0.0  # the amount of noise of each piece is drawn
    k_high: float = 1.0  # between these two, so that any noise can be met later
    speed_low: float = 0.6  # each piece is played slower or faster, by a factor
    speed_high: float = 1.7  # between these two, so that new speeds can be met later
    gap_probability: float = 0.0  # that a gap starts, a channel and 1/120 s; for an EBD
    gap_mean_s: float = 0.5  # mean length of these gaps
    gaussian_k: float = 0.5  # the noise for which the Gaussian is tuned
    seed: int = 0  # of first weights, pieces, noise and dropout

    def __post_init__(self) -> None:
        for name in ("epochs", "batch_size", "n_frames", "learning_rate", "gradient_norm"):
            if not getattr(self, name) > 0:
                raise ValueError(f"{name} must be above 0, got {getattr(self, name)}")
        for low, high in ((self.k_low, self.k_high), (self.speed_low, self.speed_high)):
            if not 0 <= low <= high:
                raise ValueError(f"a range must go up from 0 or more, got {low} to {high}")
        if self.patience < 0:
            raise ValueError(f"patience must be 0 epochs or more, got {self.patience}")


def train(
    clips: Sequence[Motion],
    config: TrainConfig,
    network_config: Any = None,
    *,
    validation: Sequence[Motion] = (),
    state_path: str | os.PathLike[str] | None = None,
    progress: bool = True,
    on_epoch: Callable[[TrainingState], None] | None = None,
) -> Checkpoint:
    """Train a network.

    On a machine with a GPU it trains there; under ``torchrun`` with several processes
    (:mod:`mocaplab.parallel`).

    Parameters
    ----------
    clips : list of Motion, clean, continuous, of one skeleton and frame rate
    config : TrainConfig
    network_config : configuration of a network in :mod:`mocaplab.networks`; None for an EBF
    validation : list of Motion
        Further clips on which the loss is measured after each epoch, always with the same
        noise. The weights with the lowest are returned.
    state_path : path or None
        Where to keep the state of training after every epoch. If the file is there,
        training goes on from it, and the result is the same as without interruption.
        Remove it once the model is saved.
    progress : bool
        Show a progress bar with the time left.
    on_epoch : function or None
        Called with the state of training after every epoch, such as
        :class:`mocaplab.live_plot.LossPlot`.

    Returns
    -------
    Checkpoint

    Raises
    ------
    ValueError
        If there is nothing to learn from, or the state is of another training.
    FloatingPointError
        If the loss is not finite any more. The state of the epoch before is kept.
    """
    if not any(moving_channels(clip).any() for clip in clips):
        raise ValueError("no joint moves in any of the clips, so there is nothing to learn")
    columns = clips[0].skeleton.is_cleaned
    network = build_network(network_config or EBFConfig(int(columns.sum())), seed=config.seed)
    fingerprint = {
        **asdict(config),
        "model": asdict(network.config),
        "clips": {clip.name: clip_digest(clip) for clip in clips},
        "validation": {clip.name: clip_digest(clip) for clip in validation},
    }
    with process_group() as (rank, _):
        state = TrainingState(network.to(training_device()), config.learning_rate, config.epochs)
        if state_path is not None and Path(state_path).exists():
            state.load(state_path, fingerprint)
        learn = _Lesson(state, clips, validation, config, columns)
        bar = tqdm(
            range(len(state.losses), config.epochs),
            initial=len(state.losses),
            total=config.epochs,
            desc="training",
            unit="epoch",
            disable=not progress or rank > 0,
        )
        for epoch in bar:
            if config.patience and state.epochs_since_best >= config.patience:
                break
            learn.epoch(epoch)
            bar.set_postfix(loss=f"{state.losses[-1]:.3f}")
            if state_path is not None and rank == 0:
                state.save(state_path, fingerprint)
            if on_epoch is not None and rank == 0:
                on_epoch(state)
    if state.best:
        network.load_state_dict(state.best)

    noise_rng = np.random.default_rng([config.seed, config.epochs])
    noisy = [corrupt(clip, f"angular:{config.gaussian_k}", rng=noise_rng) for clip in clips]
    gaussian_s, gaussian_per_channel_s = tune_gaussian(noisy)
    return Checkpoint(
        model=network.cpu().eval(),
        constant=constant_channels(clips),
        channel_labels=clips[0].skeleton.channel_labels,
        frame_time=clips[0].frame_time,
        gaussian_s=gaussian_s,
        gaussian_per_channel_s=gaussian_per_channel_s,
        info={
            "train": fingerprint,
            "losses": state.losses,
            "validation_losses": state.validation_losses,
        },
    )


class _Lesson:
    """A network in training and the clips that it learns from, epoch by epoch."""

    def __init__(
        self,
        state: TrainingState,
        clips: Sequence[Motion],
        validation: Sequence[Motion],
        config: TrainConfig,
        columns: BoolArray,
    ):
        self.state, self.config, self.columns = state, config, columns
        self.windows = Windows(clips, config.n_frames, config.margin)
        self.validation = (
            Windows(validation, config.n_frames, config.margin) if validation else None
        )
        self.shared = share_gradients(state.network)

    def epoch(self, epoch: int) -> None:
        """Take all steps of an epoch."""
        rng = np.random.default_rng([self.config.seed, epoch])
        self.state.network.train()
        batches = self._batches(self.windows, rng)
        with seeded(int(rng.integers(2**31)) + rank_and_size()[0]):  # dropout
            loss = float(np.mean([self._step(batch) for batch in batches]))
        if not np.isfinite(loss):
            raise FloatingPointError(
                f"the loss is {loss} in epoch {epoch + 1}; try a smaller learning_rate than "
                f"{self.config.learning_rate}"
            )
        self.state.end_epoch(loss, self._validate())

    def _batches(self, windows: Windows, rng: np.random.Generator) -> Iterator[Batch]:
        batches = windows.batches(
            self.config.batch_size,
            (self.config.k_low, self.config.k_high),
            (self.config.speed_low, self.config.speed_high),
            (self.config.gap_probability, self.config.gap_mean_s),
            rng=rng,
        )
        rank, n_processes = rank_and_size()
        return (batch.share(rank, n_processes) for batch in batches)

    def _step(self, batch: Batch) -> float:
        loss = batch_loss(self.shared, batch, self.columns)
        self.state.optimizer.zero_grad()
        loss.backward()  # type: ignore[no-untyped-call]
        torch.nn.utils.clip_grad_norm_(self.state.network.parameters(), self.config.gradient_norm)
        self.state.optimizer.step()
        return mean_over_processes(loss).item()

    def _validate(self) -> float | None:
        """Measure the loss on the validation clips, with the same noise every time."""
        if self.validation is None:
            return None
        self.state.network.eval()
        batches = self._batches(self.validation, np.random.default_rng([self.config.seed]))
        with torch.no_grad():
            losses = [batch_loss(self.shared, batch, self.columns) for batch in batches]
        return mean_over_processes(torch.stack(losses).mean()).item()


def batch_loss(network: torch.nn.Module, batch: Batch, columns: BoolArray) -> torch.Tensor:
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

    def tensor(array: np.ndarray) -> torch.Tensor:
        return torch.from_numpy(np.ascontiguousarray(array, dtype=np.float32)).to(device)

    observed, clean = (
        tensor(standardize(values, batch.mean, batch.std)[..., columns])
        for values in (batch.observed, batch.clean)
    )
    cleaned = network(observed, tensor(batch.root_velocity))
    variance = tensor(batch.std[..., columns] ** 2)  # (B, 1, C)
    spread = variance.mean(dim=-1, keepdim=True).clamp_min(CONSTANT_STD_DEG**2)  # (B, 1, 1)
    error = (cleaned - clean) ** 2 * variance / spread  # (B, T, C)
    weight = tensor(batch.weight[..., None] * batch.counted[..., columns])  # (B, T, C)
    # The mean over all processes, so that together they take the step of one.
    loss: torch.Tensor = (error * weight).sum() / mean_over_processes(weight.sum())
    return loss
