"""Train the networks of paper B: fusion of two sources, and prediction.

As in the paper: Adam with 0.001, gradients cut to length 0.1, batches of 64 windows of 60 frames,
noise drawn anew for every window. Ours: the learning rate falls along a cosine, and an epoch is a
fixed number of batches, because all windows of a clip are nearly the same.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn
from tqdm.auto import tqdm

from mocaplab.motion import Skeleton
from mocaplab.parallel import (
    mean_over_processes,
    process_group,
    rank_and_size,
    share_gradients,
    training_device,
)
from mocaplab.quaternion_losses import invariant_l1_loss, kinematics_loss, l1_loss
from mocaplab.segments import SegmentClip
from mocaplab.source_batches import ClipWindows, paper_pair, varied_pair
from mocaplab.source_networks import PredictionLSTM
from mocaplab.source_noise import SourceNoise
from mocaplab.training_state import TrainingState

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


def train_fusion(
    network: nn.Module,
    clips: Sequence[SegmentClip],
    config: SourceTrainConfig,
    *,
    validation: Sequence[SegmentClip] = (),
    skeleton: Skeleton | None = None,
    state_path: str | os.PathLike[str] | None = None,
    progress: bool = True,
) -> TrainingState:
    """Train a TwoSourceLSTM or a RobustFusion on clean clips.

    Parameters
    ----------
    network : takes two sources and a frame time
    clips, validation : lists of SegmentClip, clean, of one frame rate
        The weights with the lowest loss on the validation clips are kept.
    config : SourceTrainConfig
    skeleton : Skeleton, needed for the forward-kinematics loss
    state_path : path or None
        Where to keep the state after every epoch; if the file is there, training goes on from
        it. Remove it once the model is saved.
    progress : bool, show a progress bar

    Returns
    -------
    TrainingState, with the losses of every epoch; the network itself has the weights

    Raises
    ------
    ValueError
        If no clip is long enough, or the state is of another training.
    FloatingPointError
        If the loss is not finite any more.
    """
    spoil, noise = varied_pair if config.varied else paper_pair, SourceNoise()
    distance = _distance(config, clips[0].segments, skeleton)

    def drawer(from_clips: Sequence[SegmentClip]) -> Draw:
        rates = [ClipWindows(from_clips, config.n_frames, stride) for stride in config.strides]

        def draw(rng: np.random.Generator) -> Any:
            windows = rates[rng.integers(len(rates))]
            clean = windows.draw(config.batch_size, rng=rng)
            return spoil(clean, windows.frame_time, noise, rng=rng)

        return draw

    def loss(model: nn.Module, batch: Any) -> Tensor:
        a, b, clean = _tensors(model, batch.a, batch.b, batch.clean)
        return distance(model(a, b, batch.frame_time), clean)

    draws = drawer(clips), drawer(validation) if validation else None
    fingerprint = _fingerprint(network, config, clips, validation)
    return _learn(network, *draws, loss, config, fingerprint, state_path, progress)


def train_prediction(
    network: PredictionLSTM,
    clips: Sequence[SegmentClip],
    config: SourceTrainConfig,
    *,
    validation: Sequence[SegmentClip] = (),
    skeleton: Skeleton | None = None,
    state_path: str | os.PathLike[str] | None = None,
    progress: bool = True,
) -> TrainingState:
    """Train a PredictionLSTM, with teacher forcing in half of all batches.

    Parameters and errors are those of :func:`train_fusion`. On validation clips the network is
    always fed its own frames, as it will be in use.
    """
    distance = _distance(config, clips[0].segments, skeleton)
    n_past = config.n_frames - config.n_future

    def drawer(from_clips: Sequence[SegmentClip]) -> Draw:
        windows = ClipWindows(from_clips, config.n_frames)

        def draw(rng: np.random.Generator) -> Any:
            return windows.draw(config.batch_size, rng=rng), rng.random() < 0.5

        return draw

    def loss(model: nn.Module, batch: Any) -> Tensor:
        (window,) = _tensors(model, batch[0])
        past, future = window[:, :n_past], window[:, n_past:]
        teacher = future if batch[1] and model.training else None
        return distance(model(past, config.n_future, teacher), future)

    draws = drawer(clips), drawer(validation) if validation else None
    fingerprint = _fingerprint(network, config, clips, validation)
    return _learn(network, *draws, loss, config, fingerprint, state_path, progress)


def _learn(
    network: nn.Module,
    draw: Draw,
    draw_validation: Draw | None,
    loss: Loss,
    config: SourceTrainConfig,
    fingerprint: dict[str, Any],
    state_path: str | os.PathLike[str] | None,
    progress: bool,
) -> TrainingState:
    """Take all steps; the weights that did best on the validation clips stay in the network."""
    with process_group() as (rank, _):
        state = TrainingState(network.to(training_device()), config.learning_rate, config.epochs)
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


def _tensors(model: nn.Module, *arrays: np.ndarray) -> list[Tensor]:
    device = next(model.parameters()).device
    return [torch.from_numpy(np.asarray(x, dtype=np.float32)).to(device) for x in arrays]


def _distance(
    config: SourceTrainConfig, segments: Sequence[str], skeleton: Skeleton | None
) -> Callable[[Tensor, Tensor], Tensor]:
    """Choose the loss: paper B's or the one that does not tell q from -q, and positions."""
    l1 = invariant_l1_loss if config.invariant else l1_loss
    if not config.kinematics_weight:
        return l1
    if skeleton is None:
        raise ValueError("the forward-kinematics loss needs a skeleton, got None")
    joints = [skeleton.joint_names.index(name) for name in segments]
    weight = config.kinematics_weight
    return lambda q, truth: l1(q, truth) + weight * kinematics_loss(q, truth, skeleton, joints)


def _fingerprint(
    network: nn.Module,
    config: SourceTrainConfig,
    clips: Sequence[SegmentClip],
    validation: Sequence[SegmentClip],
) -> dict[str, Any]:
    """Describe a training, to refuse going on with another one, and for the model's file."""

    def digests(some: Sequence[SegmentClip]) -> dict[str, str]:
        return {c.name: hashlib.sha256(c.quaternions.tobytes()).hexdigest()[:12] for c in some}

    shape: Any = network.config
    return {
        **asdict(config),
        "strides": list(config.strides),
        "network": type(network).__name__,
        "model": asdict(shape),
        "clips": digests(clips),
        "validation": digests(validation),
    }
