"""The networks as methods to compare: trained on one holdout's clips, and kept in files."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from mocaplab.blend import BlendConfig
from mocaplab.checkpoints import Checkpoint, load_checkpoint, save_checkpoint
from mocaplab.cleaning import Cleaner
from mocaplab.comparison.methods import part_network
from mocaplab.corruption import parse_recipe
from mocaplab.datasets import clip_digest
from mocaplab.filters import Denoiser, GapFiller
from mocaplab.gap_fillers.network import NetworkFiller, with_gap_errors
from mocaplab.learning.config import BLEND_TRAINING, EBD_TRAINING, EBF_TRAINING, TrainConfig
from mocaplab.motion import Motion
from mocaplab.networks import EBDConfig, EBFConfig, NNConfig
from mocaplab.training import train

SHAPES: dict[str, Callable[[int], Any]] = {
    "ebf": EBFConfig,
    "ebf_bias": lambda n: EBFConfig(n, bias=True),
    "ebf_free": lambda n: EBFConfig(n, kernel="free"),
    "bf": lambda n: EBFConfig(n, encoder=False),
    "nn": NNConfig,
    "ebd_denoiser": EBDConfig,
    "blend": BlendConfig,
    "ebd": EBDConfig,
}
"""For the name of a method, a function from the number of channels to a network's shape."""

RECIPES = {
    "ebf": EBF_TRAINING,
    "ebf_bias": EBF_TRAINING,
    "ebf_free": EBF_TRAINING,
    "bf": EBF_TRAINING,
    "nn": EBF_TRAINING,
    "blend": BLEND_TRAINING,
    "ebd": EBD_TRAINING,
}
"""How networks are trained. BF and NN are trained as EBF is, so that nothing but the part that they
lack makes the difference. The denoising EBD keeps to TrainConfig: a higher rate, and no jumps."""

LEAST_FRAMES_SEEN = 200_000
"""Frames times epochs below which a training is too short."""


def training_recipe(name: str, epochs: int | None, seed: int = 0) -> TrainConfig:
    """Return how a network of this name is trained; without epochs, for its usual number."""
    config = RECIPES.get(name, TrainConfig())
    return replace(config, seed=seed, epochs=epochs or config.epochs)


def enough_epochs(name: str, n_frames: int) -> int:
    """Return a network's usual number of epochs, or more if there are few frames to see.

    An epoch over one short clip is a step or two, and no network learns anything in forty.
    """
    return max(training_recipe(name, None).epochs, math.ceil(LEAST_FRAMES_SEEN / n_frames))


def training_noise(config: TrainConfig, recipe: str) -> tuple[TrainConfig, str | None]:
    """Set what noise a network is trained on, in place of angular noise of all amounts.

    Returns
    -------
    TrainConfig, and the recipe if it is more than an amount of angular noise
    """
    steps = [(step.name, amount) for step, amount in parse_recipe(recipe)]
    if len(steps) == 1 and steps[0][0] == "angular":
        return replace(config, k_low=steps[0][1], k_high=steps[0][1]), None
    return config, recipe


def train_method(
    name: str, clips: Sequence[Motion], epochs: int | None, model: Path | None, state: Path | None
) -> Denoiser:
    """Train a network on clean clips, or load it if that was done before.

    Parameters
    ----------
    name : str, a name in ``SHAPES``, or ``"NAME@RECIPE"`` to train on one recipe alone
    clips : list of Motion, clean; the noise is drawn here
    epochs : int, or None for the network's usual number
    model : file to keep the network in, or None
    state : file for the state of training, from which it goes on after a stop, or None

    Raises
    ------
    CheckpointError
        If the file holds no network.
    ValueError
        If it holds another one, or one of other clips or settings.
    """
    network, recipe = part_network(name) or (name, None)
    shape = SHAPES[network]
    config = training_recipe(network, epochs)
    if recipe is not None:
        config, recipe = training_noise(config, recipe)
    if model is not None and model.exists():
        checkpoint = load_checkpoint(model)
        other = _differences(checkpoint, clips, config, shape, recipe)
        if other:
            raise ValueError(f"{model} was trained with other {', '.join(other)}; take it away")
        return _denoiser(checkpoint)
    checkpoint = train(clips, config, shape, recipe=recipe, state_path=state, progress=False)
    if network == "ebd":
        rng = np.random.default_rng(config.seed)
        checkpoint = with_gap_errors(checkpoint, clips, rng=rng)
    if model is not None:
        save_checkpoint(checkpoint, model)
    if state is not None:
        state.unlink(missing_ok=True)
    return _denoiser(checkpoint)


def _differences(
    checkpoint: Checkpoint,
    clips: Sequence[Motion],
    config: TrainConfig,
    shape: Callable[[int], Any],
    recipe: str | None,
) -> list[str]:
    """Name what a network was trained with that is not as asked for."""
    # What a file does not tell had not been invented when it was made: it is as by default.
    settings = asdict(TrainConfig()) | {"recipe": None} | checkpoint.info["train"]
    wanted = asdict(config) | {"recipe": recipe}
    other = [name for name, value in wanted.items() if settings[name] != value]
    if checkpoint.model.config != shape(checkpoint.model.config.n_channels):
        other.insert(0, "layers")
    if set(checkpoint.trained_on.values()) != {clip_digest(clip) for clip in clips}:
        other.insert(0, "clips")
    return other


def _denoiser(checkpoint: Checkpoint) -> Denoiser:
    """Use a network for what it was trained for: to clean, or to fill gaps."""
    if "gap_errors" in checkpoint.info:
        return GapFiller(NetworkFiller(checkpoint))
    return Cleaner(checkpoint)
