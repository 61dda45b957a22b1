"""Train an EBF on clean clips: fresh noise every epoch, checkpoints, resume."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from safetensors.torch import save
from tqdm.auto import tqdm

from mocaplab.batches import Batch, Windows
from mocaplab.checkpoints import (
    Checkpoint,
    CheckpointError,
    read_tensors,
    refuse_damage,
    tensors_under,
)
from mocaplab.corruption import corrupt
from mocaplab.datasets import clip_digest
from mocaplab.files import write_atomically
from mocaplab.filters import tune_gaussian
from mocaplab.motion import CONSTANT_STD_DEG, BoolArray, Motion, moving_channels
from mocaplab.networks import EBF, EBFConfig, adaptive_gaussian, seeded
from mocaplab.normalization import constant_channels, standardize


@dataclass(frozen=True)
class TrainConfig:
    """How to train. Paper A, section 3: L2 loss, Adam, 200 epochs."""

    epochs: int = 200  # an epoch sees every frame once on average
    batch_size: int = 16  # pieces a step
    n_frames: int = 150  # frames a piece, margins included
    margin: int = 15  # frames at each cut end that the loss leaves out
    learning_rate: float = 3e-3  # at the start; falls along a cosine to 0
    gradient_norm: float = 1.0  # longer gradients are cut to this length
    k_low: float = 0.0  # the amount of noise of each piece is drawn
    k_high: float = 1.0  # between these two, so that any noise can be met later
    speed_low: float = 0.6  # each piece is played slower or faster, by a factor
    speed_high: float = 1.7  # between these two, so that new speeds can be met later
    gaussian_k: float = 0.5  # the noise for which the Gaussian is tuned
    seed: int = 0  # of first weights, pieces, noise and dropout

    def __post_init__(self) -> None:
        for name in ("epochs", "batch_size", "n_frames", "learning_rate", "gradient_norm"):
            if not getattr(self, name) > 0:
                raise ValueError(f"{name} must be above 0, got {getattr(self, name)}")
        for low, high in ((self.k_low, self.k_high), (self.speed_low, self.speed_high)):
            if not 0 <= low <= high:
                raise ValueError(f"a range must go up from 0 or more, got {low} to {high}")


def train(
    clips: Sequence[Motion],
    config: TrainConfig,
    *,
    state_path: str | os.PathLike[str] | None = None,
    progress: bool = True,
) -> Checkpoint:
    """Train an EBF.

    Parameters
    ----------
    clips : list of Motion, clean, continuous, of one skeleton and frame rate
    config : TrainConfig
    state_path : path or None
        Where to keep the state of training after every epoch. If the file is there,
        training goes on from it, and the result is the same as without interruption.
        Remove it once the model is saved.
    progress : bool
        Show a progress bar with the time left.

    Returns
    -------
    Checkpoint

    Raises
    ------
    ValueError
        If there is nothing to learn from, or the state is of another training.
    FloatingPointError
        If the loss is not finite any more.
    """
    columns = clips[0].skeleton.is_cleaned
    if not any(moving_channels(clip).any() for clip in clips):
        raise ValueError("no joint moves in any of the clips, so there is nothing to learn")
    constant = constant_channels(clips)
    windows = Windows(clips, config.n_frames, config.margin)
    trainer = _Trainer(EBF(EBFConfig(int(columns.sum())), seed=config.seed), constant, columns)
    optimizer = torch.optim.Adam(trainer.model.parameters(), lr=config.learning_rate)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, config.epochs)

    losses: list[float] = []
    fingerprint = {
        **asdict(config),
        "model": asdict(trainer.model.config),
        "clips": {clip.name: clip_digest(clip) for clip in clips},
    }
    if state_path is not None and Path(state_path).exists():
        losses = _load_state(state_path, trainer.model, optimizer, schedule, fingerprint)
    bar = tqdm(
        range(len(losses), config.epochs),
        initial=len(losses),
        total=config.epochs,
        desc="training",
        unit="epoch",
        disable=not progress,
    )
    for epoch in bar:
        rng = np.random.default_rng([config.seed, epoch])
        batches = windows.batches(
            config.batch_size,
            (config.k_low, config.k_high),
            (config.speed_low, config.speed_high),
            rng=rng,
        )
        trainer.model.train()
        with seeded(int(rng.integers(2**31))):  # dropout
            step_losses = [trainer.step(batch, optimizer, config) for batch in batches]
        schedule.step()
        losses.append(float(np.mean(step_losses)))
        if not np.isfinite(losses[-1]):
            raise FloatingPointError(
                f"the loss is {losses[-1]} after {epoch + 1} epochs; try a smaller learning_rate "
                f"than {config.learning_rate}"
            )
        bar.set_postfix(loss=f"{losses[-1]:.3f}")
        if state_path is not None:
            _save_state(state_path, trainer.model, optimizer, schedule, fingerprint, losses)

    noise_rng = np.random.default_rng([config.seed, config.epochs])
    noisy = [corrupt(clip, f"angular:{config.gaussian_k}", rng=noise_rng) for clip in clips]
    gaussian_s, gaussian_per_channel_s = tune_gaussian(noisy)
    return Checkpoint(
        model=trainer.model.eval(),
        constant=constant,
        channel_labels=clips[0].skeleton.channel_labels,
        frame_time=clips[0].frame_time,
        gaussian_s=gaussian_s,
        gaussian_per_channel_s=gaussian_per_channel_s,
        info={"train": fingerprint, "losses": losses},
    )


class _Trainer:
    """A model and how to take one step with it."""

    def __init__(self, model: EBF, constant: BoolArray, columns: BoolArray):
        self.model, self.columns = model, columns
        # Channels that never move need no filter: they are left out of the work.
        self.moving = torch.from_numpy(~constant[columns])

    def step(self, batch: Batch, optimizer: torch.optim.Optimizer, config: TrainConfig) -> float:
        """Take one step and return the loss before it."""
        pose = standardize(batch.observed, batch.mean, batch.std)[..., self.columns]
        sigma = self.model(_float32(pose), _float32(batch.root_velocity))
        clean = _float32((batch.clean - batch.mean)[..., self.columns])
        noisy = _float32((batch.observed - batch.mean)[..., self.columns])
        smooth = adaptive_gaussian(
            noisy[..., self.moving], sigma[..., self.moving], self.model.config.radius
        )
        error = (smooth - clean[..., self.moving]) ** 2  # (B, T, moving C), degrees squared
        # Divided by the spread of the observed clip; otherwise the few clips with the widest
        # movements would decide everything.
        spread = _float32(batch.std[..., self.columns] ** 2).mean(dim=-1)  # (B, 1)
        spread = spread.clamp_min(CONSTANT_STD_DEG**2)  # a clip that does not move at all
        weight = _float32(batch.weight)  # (B, T)
        loss = (error.mean(dim=-1) / spread * weight).sum() / weight.sum()
        optimizer.zero_grad()
        loss.backward()  # type: ignore[no-untyped-call]
        torch.nn.utils.clip_grad_norm_(self.model.parameters(), config.gradient_norm)
        optimizer.step()
        return loss.item()


def _float32(array: np.ndarray) -> torch.Tensor:
    return torch.from_numpy(np.ascontiguousarray(array, dtype=np.float32))


def _save_state(
    path: str | os.PathLike[str],
    model: EBF,
    optimizer: torch.optim.Optimizer,
    schedule: torch.optim.lr_scheduler.LRScheduler,
    fingerprint: dict[str, Any],
    losses: list[float],
) -> None:
    """Write all that it takes to go on after an interruption."""
    tensors = {f"model.{name}": value for name, value in model.state_dict().items()}
    for index, values in optimizer.state_dict()["state"].items():
        tensors |= {f"adam.{index}.{name}": value for name, value in values.items()}
    header = {"train": fingerprint, "losses": losses, "schedule": schedule.state_dict()}
    write_atomically(path, save(tensors, {"mocaplab": json.dumps(header)}))


def _load_state(
    path: str | os.PathLike[str],
    model: EBF,
    optimizer: torch.optim.Optimizer,
    schedule: torch.optim.lr_scheduler.LRScheduler,
    fingerprint: dict[str, Any],
) -> list[float]:
    """Put everything back as it was and return the losses so far."""
    tensors, header = read_tensors(path)
    if header.get("train") != fingerprint:
        raise CheckpointError(
            f"{path} is not the state of this training (other settings or clips); "
            f"remove it to start anew"
        )
    with refuse_damage(path):
        return _put_back(tensors, header, model, optimizer, schedule)


def _put_back(
    tensors: dict[str, torch.Tensor],
    header: dict[str, Any],
    model: EBF,
    optimizer: torch.optim.Optimizer,
    schedule: torch.optim.lr_scheduler.LRScheduler,
) -> list[float]:
    model.load_state_dict(tensors_under(tensors, "model."))
    state = optimizer.state_dict()
    for name, value in tensors_under(tensors, "adam.").items():
        index, key = name.split(".")
        state["state"].setdefault(int(index), {})[key] = value
    schedule.load_state_dict(header["schedule"])
    state["param_groups"][0]["lr"] = schedule.get_last_lr()[0]
    optimizer.load_state_dict(state)
    losses: list[float] = header["losses"]
    return losses
