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
from mocaplab.layers import Network, seeded
from mocaplab.motion import CONSTANT_STD_DEG, BoolArray, Motion, moving_channels
from mocaplab.networks import EBFConfig, build_network
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
    model_config: Any = None,
    *,
    state_path: str | os.PathLike[str] | None = None,
    progress: bool = True,
) -> Checkpoint:
    """Train a network, by default an EBF.

    Parameters
    ----------
    clips : list of Motion, clean, continuous, of one skeleton and frame rate
    config : TrainConfig
    model_config : configuration of a network in :mod:`mocaplab.networks`, or None for an EBF
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
    model = build_network(model_config or EBFConfig(int(columns.sum())), seed=config.seed)
    optimizer = torch.optim.Adam(model.parameters(), lr=config.learning_rate)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, config.epochs)

    def step(batch: Batch) -> float:
        loss = batch_loss(model, batch, columns)
        optimizer.zero_grad()
        loss.backward()  # type: ignore[no-untyped-call]
        torch.nn.utils.clip_grad_norm_(model.parameters(), config.gradient_norm)
        optimizer.step()
        return loss.item()

    losses: list[float] = []
    fingerprint = {
        **asdict(config),
        "model": asdict(model.config),
        "clips": {clip.name: clip_digest(clip) for clip in clips},
    }
    if state_path is not None and Path(state_path).exists():
        losses = _load_state(state_path, model, optimizer, schedule, fingerprint)
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
        model.train()
        with seeded(int(rng.integers(2**31))):  # dropout
            step_losses = [step(batch) for batch in batches]
        schedule.step()
        losses.append(float(np.mean(step_losses)))
        if not np.isfinite(losses[-1]):
            raise FloatingPointError(
                f"the loss is {losses[-1]} after {epoch + 1} epochs; try a smaller learning_rate "
                f"than {config.learning_rate}"
            )
        bar.set_postfix(loss=f"{losses[-1]:.3f}")
        if state_path is not None:
            _save_state(state_path, model, optimizer, schedule, fingerprint, losses)

    noise_rng = np.random.default_rng([config.seed, config.epochs])
    noisy = [corrupt(clip, f"angular:{config.gaussian_k}", rng=noise_rng) for clip in clips]
    gaussian_s, gaussian_per_channel_s = tune_gaussian(noisy)
    return Checkpoint(
        model=model.eval(),
        constant=constant,
        channel_labels=clips[0].skeleton.channel_labels,
        frame_time=clips[0].frame_time,
        gaussian_s=gaussian_s,
        gaussian_per_channel_s=gaussian_per_channel_s,
        info={"train": fingerprint, "losses": losses},
    )


def batch_loss(model: Network, batch: Batch, columns: BoolArray) -> torch.Tensor:
    """Mean squared error between what a network makes of a batch and the clean poses.

    Each piece is divided by the spread of the clip that it is from; otherwise the few clips
    with the widest movements would decide everything.

    Parameters
    ----------
    model : network, pose to pose
    batch : Batch
    columns : array, shape (C,), bool: the channels that the network sees

    Returns
    -------
    tensor, one number: the share of a clip's movement that is left as error
    """
    observed, clean = (
        _float32(standardize(values, batch.mean, batch.std)[..., columns])
        for values in (batch.observed, batch.clean)
    )
    cleaned = model(observed, _float32(batch.root_velocity))
    variance = _float32(batch.std[..., columns] ** 2)  # (B, 1, C)
    error = ((cleaned - clean) ** 2 * variance).mean(dim=-1)  # (B, T), degrees squared
    spread = variance.mean(dim=-1).clamp_min(CONSTANT_STD_DEG**2)  # a clip may not move at all
    weight = _float32(batch.weight)  # (B, T)
    loss: torch.Tensor = (error / spread * weight).sum() / weight.sum()
    return loss


def _float32(array: np.ndarray) -> torch.Tensor:
    return torch.from_numpy(np.ascontiguousarray(array, dtype=np.float32))


def _save_state(
    path: str | os.PathLike[str],
    model: Network,
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
    model: Network,
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
    model: Network,
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
