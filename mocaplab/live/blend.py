"""LiveBlend: a stream cleaned by mixing eleven estimates, the live sibling of Blend.

Nothing in it is standardized by what only the whole clip knows: its estimates are linear filters
that end at the look-ahead, and its clues compare them in units of the noise so far. One network
serves for every look-ahead from 0 to 15 frames.
"""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from mocaplab.checkpoints import Checkpoint, load_checkpoint, shipped_checkpoint
from mocaplab.live.bank import N_PAST, Estimates, RunningBank, linear_gains
from mocaplab.live.filters import LOOK_AHEAD_S, Running, whole_frames, window_mean
from mocaplab.live.mixer import LIMIT, LiveMixer
from mocaplab.live.statistics import RunningScale
from mocaplab.motion import CONSTANT_STD_DEG, FloatArray, Skeleton


class LiveBlend:
    """Clean a stream by mixing estimates.

    Parameters
    ----------
    model : Checkpoint of a LiveMixer, path of its file, or "stream", the one in the package
    look_ahead_s : float, seconds, rounded to whole frames; no more than 15 frames

    Raises
    ------
    ValueError
        If the model is another network.
    """

    def __init__(
        self,
        model: Checkpoint | str | os.PathLike[str] = "stream",
        look_ahead_s: float = LOOK_AHEAD_S,
    ):
        if model == "stream":
            model = shipped_checkpoint("stream")
        self.checkpoint = model if isinstance(model, Checkpoint) else load_checkpoint(model)
        self.look_ahead_s = look_ahead_s
        self._gains: dict[int, FloatArray] = {}
        if not isinstance(self.checkpoint.model, LiveMixer):
            name = type(self.checkpoint.model).__name__
            raise ValueError(f"LiveBlend needs a network made for streams, LiveMixer, got {name}")

    def start(self, skeleton: Skeleton, frame_time: float) -> Running:
        """See :class:`mocaplab.live.filters.LiveFilter`."""
        self.checkpoint.require(skeleton, frame_time, "stream")
        network: Any = self.checkpoint.model
        config = network.config
        look_ahead = whole_frames(self.look_ahead_s, frame_time)
        if look_ahead > config.radius:
            raise ValueError(
                f"this model was made for {config.radius * frame_time:.3g} s ahead at most, got "
                f"look_ahead_s = {self.look_ahead_s}"
            )
        if look_ahead not in self._gains:  # takes a fifth of a second
            self._gains[look_ahead] = linear_gains(
                network.covariance.double().numpy(),
                look_ahead,
                config.radius,
                config.n_cosines,
            )
        bank = RunningBank(self._gains[look_ahead], look_ahead, config.radius)
        return _RunningBlend(self.checkpoint, skeleton, frame_time, bank)


class _RunningBlend:
    """See :class:`mocaplab.live.filters.Running`."""

    n_past = N_PAST

    def __init__(
        self, checkpoint: Checkpoint, skeleton: Skeleton, frame_time: float, bank: RunningBank
    ):
        network: Any = checkpoint.model
        self.bank, self.look_ahead = bank, bank.look_ahead
        self.columns = checkpoint.columns(skeleton)
        self.unknown = skeleton.is_cleaned & ~self.columns  # channels still in training
        self.sigma = checkpoint.gaussian_s / frame_time
        self.scale = RunningScale(int(self.unknown.sum()))
        self.mix = NumpyMixer(network)

    def observe(self, frame: FloatArray) -> None:
        self.bank.observe(frame[self.columns])
        self.scale.add(frame[self.unknown])

    def clean(self, window: FloatArray, middle: int) -> FloatArray:
        cleaned: FloatArray = window[middle].copy()
        known = self.bank.estimate(window[:, self.columns], middle)
        moves = self.bank.scale.std >= CONSTANT_STD_DEG
        cleaned[self.columns] += np.where(moves, self.mix(known), 0.0)
        sigma = np.where(self.scale.std >= CONSTANT_STD_DEG, self.sigma, 0.0)
        cleaned[self.unknown] = window_mean(window[:, self.unknown], middle, sigma)
        return cleaned


class NumpyMixer:
    """A :class:`mocaplab.live.mixer.LiveMixer` in numpy: faster for a single frame.

    Parameters
    ----------
    network : LiveMixer
    """

    def __init__(self, network: LiveMixer):
        arrays = {name: x.detach().double().numpy() for name, x in network.named_parameters()}
        self.weights = [arrays[f"{n}.weight"].T.copy() for n in ("first", "second", "scores")]
        self.first_bias = arrays["first.bias"] + arrays["channel_first"]
        self.second_bias = arrays["second.bias"]
        self.scores_bias = arrays["scores.bias"] + arrays["channel_scores"]

    def __call__(self, known: Estimates) -> FloatArray:
        """Return what to add to the observed frame, shape (C,)."""
        first, second, last = self.weights
        x = np.tanh(known.clues @ first + self.first_bias)
        scores = np.tanh(x @ second + self.second_bias) @ last + self.scores_bias
        weights = np.exp(scores - scores.max(axis=1, keepdims=True))
        weights /= weights.sum(axis=1, keepdims=True)
        change = (weights * (known.estimates - known.estimates[:, :1])).sum(axis=1)
        limit = LIMIT * known.noise
        result: FloatArray = np.clip(change, -limit, limit)
        return result
