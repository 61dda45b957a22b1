"""Train a network on clean clips: fresh noise every epoch, checkpoints, resume."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
import torch
from tqdm.auto import tqdm

from mocaplab.blend import Blend
from mocaplab.checkpoints import Checkpoint
from mocaplab.corruption import corrupt
from mocaplab.datasets import clip_digest
from mocaplab.layers import seeded
from mocaplab.learning.blend_lesson import BlendLesson
from mocaplab.learning.config import TrainConfig
from mocaplab.learning.lessons import Lesson, WindowLesson
from mocaplab.learning.parallel import (
    mean_over_processes,
    process_group,
    rank_and_size,
    share_gradients,
    training_device,
)
from mocaplab.learning.recipe_lesson import RecipeLesson
from mocaplab.learning.state import TrainingState, cosine_decay
from mocaplab.motion import BoolArray, Motion, moving_channels
from mocaplab.networks import EBFConfig, build_network
from mocaplab.normalization import constant_channels
from mocaplab.skeletons.as_json import skeleton_to_json
from mocaplab.tuning import tune_gaussian


def train(
    clips: Sequence[Motion],
    config: TrainConfig,
    network_shape: Callable[[int], Any] = EBFConfig,
    *,
    recipe: str | None = None,
    validation: Sequence[Motion] = (),
    state_path: str | os.PathLike[str] | None = None,
    progress: bool = True,
    on_epoch: Callable[[TrainingState], None] | None = None,
) -> Checkpoint:
    """Train a network.

    On a machine with a GPU it trains there; under ``torchrun`` with several processes
    (:mod:`mocaplab.learning.parallel`).

    Parameters
    ----------
    clips : list of Motion, clean, continuous, of one skeleton and frame rate
    config : TrainConfig
    network_shape : function
        Takes the number of channels that move in the clips and returns the configuration of a
        network in :mod:`mocaplab.networks`, such as ``EBFConfig`` itself.
    recipe : str or None
        What the clips are corrupted by, see :func:`mocaplab.corruption.parse_recipe`; None
        is angular noise of all amounts between the config's ``k_low`` and ``k_high``.
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
        :class:`mocaplab.learning.live_plot.LossPlot`.

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
    # Channels that never move hold nothing to learn from and nothing to clean.
    constant = constant_channels(clips)
    columns = clips[0].skeleton.is_cleaned & ~constant
    network = build_network(network_shape(int(columns.sum())), seed=config.seed)
    fingerprint = {
        **asdict(config),
        "model": asdict(network.config),
        "clips": {clip.name: clip_digest(clip) for clip in clips},
        "validation": {clip.name: clip_digest(clip) for clip in validation},
    }
    if recipe is not None:
        fingerprint["recipe"] = recipe
    with process_group() as (rank, _):
        state = TrainingState(network.to(training_device()), config.weight_decay)
        if state_path is not None and Path(state_path).exists():
            state.load(state_path, fingerprint)
        trainer = _Trainer(state, clips, validation, config, columns, recipe)
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
            trainer.epoch(epoch)
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
        constant=constant,
        channel_labels=clips[0].skeleton.channel_labels,
        frame_time=clips[0].frame_time,
        gaussian_s=gaussian_s,
        gaussian_per_channel_s=gaussian_per_channel_s,
        info={
            "train": fingerprint,
            "skeleton": skeleton_to_json(clips[0].skeleton),
            "losses": state.losses,
            "validation_losses": state.validation_losses,
        },
    )


class _Trainer:
    """A network in training and the clips that it learns from, epoch by epoch."""

    def __init__(
        self,
        state: TrainingState,
        clips: Sequence[Motion],
        validation: Sequence[Motion],
        config: TrainConfig,
        columns: BoolArray,
        recipe: str | None = None,
    ):
        self.state, self.config = state, config
        network = state.network
        self.shared = share_gradients(network.mixer if isinstance(network, Blend) else network)

        def lesson(clips: Sequence[Motion], measure: bool) -> Lesson:
            if isinstance(network, Blend):
                if recipe is not None:
                    raise ValueError(f"a Blend draws its own noise, and takes no recipe ({recipe})")
                return BlendLesson(clips, config, columns, network, measure=measure)
            if recipe is not None:
                return RecipeLesson(clips, recipe, config, columns)
            return WindowLesson(clips, config, columns)

        self.lesson = lesson(clips, True)
        self.validation = lesson(validation, False) if validation else None

    def epoch(self, epoch: int) -> None:
        """Take all steps of an epoch."""
        rng = np.random.default_rng([self.config.seed, epoch])
        self.state.network.train()
        batches = self.lesson.batches(rng)
        losses = []
        with seeded(int(rng.integers(2**31)) + rank_and_size()[0]):  # dropout
            for i, batch in enumerate(batches):
                done = (epoch + min(i / self.lesson.n_batches, 1)) / self.config.epochs
                losses.append(self.step(batch, self.config.learning_rate * _slow_down(done)))
        loss = float(np.mean(losses))
        if not np.isfinite(loss):
            raise FloatingPointError(
                f"the loss is {loss} in epoch {epoch + 1}; try a smaller learning_rate than "
                f"{self.config.learning_rate}"
            )
        self.state.end_epoch(loss, self._validate())

    def step(self, batch: Any, learning_rate: float) -> float:
        """Take one step of training; return its loss."""
        self.state.set_learning_rate(learning_rate)
        loss = self.lesson.loss(self.shared, batch)
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
        batches = self.validation.batches(np.random.default_rng([self.config.seed]))
        with torch.no_grad():
            losses = [self.validation.loss(self.shared, batch) for batch in batches]
        return mean_over_processes(torch.stack(losses).mean()).item()


WARM_UP = 0.05
"""Share of the training over which the learning rate rises."""


def _slow_down(done: float) -> float:
    """Return the factor of the learning rate when this share of the training is done."""
    return min(1.0, (done + 1e-3) / WARM_UP) * cosine_decay(done)


def time_step(
    clips: Sequence[Motion],
    config: TrainConfig,
    network_shape: Callable[[int], Any] = EBFConfig,
    n_steps: int = 2,
) -> float:
    """Measure how long a training step takes, to know what a longer training will cost.

    Returns
    -------
    float, seconds: the shortest of a few steps, after one to warm up
    """
    columns = clips[0].skeleton.is_cleaned & ~constant_channels(clips)
    network = build_network(network_shape(int(columns.sum())), seed=config.seed)
    trainer = _Trainer(TrainingState(network.to(training_device())), clips, (), config, columns)
    seconds = []
    for i in range(1 + n_steps):
        start = perf_counter()
        trainer.step(next(iter(trainer.lesson.batches(np.random.default_rng(i)))), 1e-4)
        seconds.append(perf_counter() - start)
    return min(seconds[1:])
