"""EBF, the network of paper A, on a live stream.

Offline, a clip is standardized with its own mean and deviation, and both directions of the LSTM
see all of it. A stream has neither, so three things differ:

- a frame is standardized with the mean and deviation of all frames up to it;
- the backward passes begin ``look_ahead`` frames ahead (:mod:`mocaplab.live.lstm`);
- the filter reaches no further ahead than that.

So a stream is worse in its first second, and with a short look-ahead.
"""

from __future__ import annotations

import math
import os
from typing import Any

import numpy as np
from torch import nn

from mocaplab.checkpoints import Checkpoint, load_checkpoint, shipped_checkpoint
from mocaplab.live.angles import RootVelocity
from mocaplab.live.filters import LOOK_AHEAD_S, Running, whole_frames, window_mean
from mocaplab.live.lstm import Float32Array, LiveLSTM
from mocaplab.live.statistics import RunningScale
from mocaplab.motion import CONSTANT_STD_DEG, FloatArray, Skeleton
from mocaplab.networks import EBF
from mocaplab.normalization import standardize


class LiveEBF:
    """Clean a stream with an EBF.

    Parameters
    ----------
    model : Checkpoint of an EBF, path of its file, or "ebf", the one in the package
    look_ahead_s : float, seconds
        Rounded to whole frames; no more than the filter reaches (15 frames, 125 ms at 120
        frames per second).

    Raises
    ------
    ValueError
        If the model is another network.
    """

    def __init__(
        self, model: Checkpoint | str | os.PathLike[str] = "ebf", look_ahead_s: float = LOOK_AHEAD_S
    ):
        if isinstance(model, Checkpoint):
            self.checkpoint = model
        else:
            self.checkpoint = (
                shipped_checkpoint("ebf") if model == "ebf" else load_checkpoint(model)
            )
        self.look_ahead_s = look_ahead_s
        network = self.checkpoint.model
        if not isinstance(network, EBF) or network.config.kernel != "gaussian":
            raise ValueError(
                f"a stream needs an EBF with Gaussian filters, got {type(network).__name__}; "
                f"train one with: mocaplab train FOLDER -o model.safetensors --network ebf"
            )

    def start(self, skeleton: Skeleton, frame_time: float) -> Running:
        """See :class:`mocaplab.live.filters.LiveFilter`."""
        self.checkpoint.require(skeleton, frame_time, "stream")
        radius = self.checkpoint.model.config.radius
        look_ahead = whole_frames(self.look_ahead_s, frame_time)
        if look_ahead > radius:
            raise ValueError(
                f"the filter of this model reaches {radius * frame_time:.3g} s ahead, so "
                f"look_ahead_s must not be more, got {self.look_ahead_s}"
            )
        return _RunningEBF(self.checkpoint, skeleton, frame_time, look_ahead)


class _RunningEBF:
    """See :class:`mocaplab.live.filters.Running`."""

    def __init__(
        self, checkpoint: Checkpoint, skeleton: Skeleton, frame_time: float, look_ahead: int
    ):
        model: Any = checkpoint.model
        self.look_ahead, self.n_past = look_ahead, model.config.radius
        self.cleaned = skeleton.is_cleaned
        self.columns = checkpoint.columns(skeleton)
        self.unknown_sigma = checkpoint.gaussian_s / frame_time  # channels still in training
        self.has_bias = model.config.bias
        self.encoder = _dense_layers(model.encoder) if model.config.encoder else None
        self.head = _dense_layers(model.head)
        self.lstm = LiveLSTM(model.lstm, look_ahead)
        self.velocity = RootVelocity(skeleton, frame_time)
        self.scale = RunningScale(skeleton.n_channels)

    def observe(self, frame: FloatArray) -> None:
        self.scale.add(frame)
        pose = standardize(frame, self.scale.mean, self.scale.std)[self.columns]
        x = np.concatenate([pose, self.velocity.push(frame)]).astype(np.float32)
        if self.encoder is not None:
            x = np.tanh(_run_dense(self.encoder, x))
        self.lstm.observe(x)

    def clean(self, window: FloatArray, middle: int) -> FloatArray:
        std, n_seen = self.scale.std, int(self.columns.sum())
        outputs = _run_dense(self.head, self.lstm.oldest())
        sigma = np.full(len(std), self.unknown_sigma)
        sigma[self.columns] = np.exp(np.clip(outputs[:n_seen], math.log(0.1), math.log(30.0)))
        sigma[~self.cleaned | (std < CONSTANT_STD_DEG)] = 0.0
        smooth = window_mean(window, middle, sigma)
        if self.has_bias:
            smooth[self.columns] -= outputs[n_seen:] * std[self.columns]
        return smooth


def _dense_layers(layers: nn.Sequential) -> list[tuple[Float32Array, Float32Array]]:
    """Return weight (n_in, n_out) and bias of each dense layer."""
    return [
        (layer.weight.detach().numpy().T.copy(), layer.bias.detach().numpy())
        for layer in layers
        if isinstance(layer, nn.Linear)
    ]


def _run_dense(layers: list[tuple[Float32Array, Float32Array]], x: Float32Array) -> Float32Array:
    """Run dense layers with tanh between them, as :func:`mocaplab.layers.dense` makes them."""
    *first, (weight, bias) = layers
    for inner_weight, inner_bias in first:
        x = np.tanh(x @ inner_weight + inner_bias)
    result: Float32Array = x @ weight + bias
    return result
