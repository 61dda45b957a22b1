"""Train the networks of paper B: fusion of two sources, and prediction.

As in the paper: Adam with 0.001, gradients cut to length 0.1, batches of 64 windows of 60 frames,
noise drawn anew for every window. Ours: the learning rate falls along a cosine, and an epoch is a
fixed number of batches, because all windows of a clip are nearly the same.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from mocaplab.learning.state import TrainingState
from mocaplab.motion import Skeleton
from mocaplab.two_sources.batches import ClipWindows, paper_pair, varied_pair
from mocaplab.two_sources.learning import Draw, SourceTrainConfig, learn
from mocaplab.two_sources.losses import invariant_l1_loss, kinematics_loss, l1_loss
from mocaplab.two_sources.networks import PredictionLSTM
from mocaplab.two_sources.noise import SourceNoise
from mocaplab.two_sources.segments import SegmentClip


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
    return learn(network, *draws, loss, config, fingerprint, state_path, progress)


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
    return learn(network, *draws, loss, config, fingerprint, state_path, progress)


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
