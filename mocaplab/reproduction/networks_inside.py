"""What errors do not show: the shapes of free kernels, the bias that is learnt, filled gaps."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch

from mocaplab.checkpoints import Checkpoint, load_checkpoint
from mocaplab.comparison.job import Job
from mocaplab.comparison.run_job import fit_method
from mocaplab.datasets import Dataset
from mocaplab.gap_fillers.curves import lerp_gaps
from mocaplab.measures.movement import root_angular_velocity
from mocaplab.motion import Corrupted, FloatArray, moving_channels
from mocaplab.noise.draws import draw_test
from mocaplab.normalization import standardize

SIGMAS = np.geomspace(0.1, 30.0, 120)
"""Widths, in frames, among which the Gaussian nearest to a kernel is sought."""


def _inputs(checkpoint: Checkpoint, clip: Corrupted) -> tuple[list[torch.Tensor], FloatArray]:
    """Return what a network sees of a clip whose gaps are closed, and the channels' scale."""
    observed = lerp_gaps(clip.observed)
    columns = checkpoint.columns(observed.skeleton)
    mean, std = observed.channels.mean(axis=0), observed.channels.std(axis=0)
    pose = standardize(observed.channels, mean, std)[:, columns]
    pair = (pose, root_angular_velocity(observed))
    return [torch.from_numpy(x).float()[None] for x in pair], std[columns]


def kernels_of(model: Path, clip: Corrupted) -> FloatArray:
    """Predict the free kernel of every frame, shape (T, 31): weights that add up to 1."""
    checkpoint = load_checkpoint(model)
    inputs, _ = _inputs(checkpoint, clip)
    with torch.no_grad():
        scores, _ = checkpoint.model.predict(*inputs)  # type: ignore[operator]
    kernels: FloatArray = scores[0, :, 0].double().softmax(dim=-1).numpy()
    return kernels


def gaussian_share(kernels: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Measure how Gaussian kernels are.

    Parameters
    ----------
    kernels : array, shape (T, taps), each of sum 1, the present frame in the middle

    Returns
    -------
    overlap : array, shape (T,)
        The common area of a kernel and the Gaussian nearest to it: 1 if it is one.
    sigma : array, shape (T,), that Gaussian's width in frames
    """
    taps = np.arange(kernels.shape[1]) - kernels.shape[1] // 2
    shapes = np.exp(-0.5 * (taps / SIGMAS[:, None]) ** 2)
    shapes /= shapes.sum(axis=1, keepdims=True)
    overlaps = np.minimum(kernels[:, None], shapes).sum(axis=-1)  # (T, widths)
    best = overlaps.argmax(axis=1)
    return overlaps.max(axis=1), SIGMAS[best]


def bias_share(model: Path, clips: Iterable[Corrupted]) -> float:
    """Measure the bias that a network subtracts: its RMS over that of the movement."""
    checkpoint = load_checkpoint(model)
    squares, total = 0.0, 0.0
    for clip in clips:
        inputs, scale = _inputs(checkpoint, clip)
        with torch.no_grad():
            _, bias = checkpoint.model.predict(*inputs)  # type: ignore[operator]
        moves = moving_channels(clip.clean)[checkpoint.columns(clip.clean.skeleton)]
        std = clip.clean.channels[:, checkpoint.columns(clip.clean.skeleton)].std(axis=0)
        squares += float(np.mean((bias[0].numpy() * scale)[:, moves] ** 2))
        total += float(np.mean(std[moves] ** 2))
    return float(np.sqrt(squares / total)) if total else np.nan


@dataclass(frozen=True, eq=False)
class FilledGap:
    """One channel of one clip with a long gap, and what methods made of it."""

    clip: str
    channel: str
    frames: tuple[int, int]  # the first and the last that are hidden
    clean: FloatArray  # (T,), degrees
    filled: dict[str, FloatArray]  # by method, (T,), degrees


def fill_one_gap(
    dataset: Dataset, jobs: Sequence[Job], index: int, models: Path
) -> FilledGap | None:
    """Let several methods clean one clip, and look at the hidden channel that moves most.

    Knees are looked at first, as in the paper; None if nothing that moves is hidden.

    Parameters
    ----------
    dataset : Dataset
    jobs : list of Job, one a method, of one holdout and noise
    index : int, of the clip in the data set
    models : Path, the folder of trained networks
    """
    clip = draw_test(dataset.clips[index], jobs[0].corruption, seed=jobs[0].seed, repetition=0)
    hidden = ~clip.mask & moving_channels(clip.clean)
    if not hidden.any():
        return None
    labels = clip.clean.skeleton.channel_labels
    knee = np.array(["leg" in label.lower() and "up" not in label.lower() for label in labels])
    spread = np.where(hidden.any(axis=0), clip.clean.channels.std(axis=0) * (1 + 9 * knee), -1)
    column = int(np.argmax(spread))
    frames = np.flatnonzero(hidden[:, column])
    filled = {
        job.method: fit_method(dataset, job, models)(clip).channels[:, column] for job in jobs
    }
    ends = int(frames[0]), int(frames[-1])
    return FilledGap(
        dataset.clips[index].name, labels[column], ends, clip.clean.channels[:, column], filled
    )
