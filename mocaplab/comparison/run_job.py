"""Run one job of a comparison: fit its method for one holdout, clean its clips, score them."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from mocaplab.comparison.job import ORACLE, Job
from mocaplab.comparison.methods import METHODS, PIPELINES, part_network
from mocaplab.comparison.result import Result, fingerprint
from mocaplab.datasets import Dataset
from mocaplab.evaluation import score_clip
from mocaplab.filters import Denoiser
from mocaplab.motion import Corrupted, Motion
from mocaplab.noise.draws import draw_test, draw_training
from mocaplab.tuning import oracle_gaussian


def run_job(dataset: Dataset, job: Job, models: Path | None = None) -> Result:
    """Fit, clean and score.

    Parameters
    ----------
    dataset : Dataset
    job : Job
    models : folder for trained networks, or None to keep none

    Raises
    ------
    ValueError
        If the method leaves samples empty, or the job itself makes no sense.
    """
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        start = perf_counter()
        clean = fit_method(dataset, job, models)
        fit_s = perf_counter() - start
        rows = [
            _row(dataset, job, i, repetition, clean)
            for i in job.split.test
            for repetition in range(job.repetitions)
        ]
    return {
        "fingerprint": fingerprint(dataset, job),
        "fit_s": fit_s,
        "notes": sorted({str(warning.message) for warning in caught}),
        "rows": rows,
    }


def _row(
    dataset: Dataset, job: Job, index: int, repetition: int, clean: Callable[[Corrupted], Motion]
) -> dict[str, Any]:
    """Clean one clip and score it."""
    clip = draw_test(dataset.clips[index], job.corruption, seed=job.seed, repetition=repetition)
    start = perf_counter()
    cleaned = clean(clip)
    seconds = perf_counter() - start
    _check_finite(cleaned)
    row = {"clip": clip.clean.name, "action": dataset.actions[index], "repetition": repetition}
    row |= {"frames": cleaned.n_frames, "seconds": seconds}
    row |= score_clip(cleaned, clip, job.measures)
    return row | (_detail(cleaned, clip.clean) if job.detail else {})


def _detail(cleaned: Motion, clean: Motion) -> dict[str, list[float]]:
    """Part the error over all angles by frame and by joint; the root's angles are left out."""
    skeleton = clean.skeleton
    square = (cleaned.channels - clean.channels)[:, skeleton.is_cleaned] ** 2
    joints = skeleton.channel_joint[skeleton.is_cleaned]
    by_joint = [
        float(np.sqrt(square[:, joints == joint].mean())) if (joints == joint).any() else 0.0
        for joint in range(skeleton.n_joints)
    ]
    by_frame = np.sqrt(square.mean(axis=1))
    return {"by_frame_deg": by_frame.round(4).tolist(), "by_joint_deg": by_joint}


def fit_method(dataset: Dataset, job: Job, models: Path | None) -> Callable[[Corrupted], Motion]:
    """Fit a job's method on its training clips, corrupted by the same recipe.

    Returns
    -------
    function that cleans a corrupted clip
    """
    if job.method == ORACLE:
        return oracle_gaussian
    if job.method in PIPELINES:
        return _fit_pipeline(dataset, job, models)
    denoiser: Denoiser
    if part_network(job.method):
        from mocaplab.comparison.network_methods import train_method

        clean = [dataset.clips[i] for i in job.split.train]
        denoiser = train_method(job.method, clean, job.epochs, *_model_files(job, models))
    else:
        clips = [
            draw_training(dataset.clips[i], job.corruption, seed=job.seed) for i in job.split.train
        ]
        denoiser = METHODS[job.method].fit(clips)
    return lambda clip: denoiser.denoise(clip.observed, clip.mask)


def _fit_pipeline(dataset: Dataset, job: Job, models: Path | None) -> Callable[[Corrupted], Motion]:
    """Fit both methods of a pipeline; the second cleans what the first has filled."""
    fill, clean = (
        fit_method(dataset, replace(job, method=part), models) for part in PIPELINES[job.method]
    )

    def run(clip: Corrupted) -> Motion:
        return clean(Corrupted(clip.clean, fill(clip), np.ones_like(clip.mask)))

    return run


def _model_files(job: Job, models: Path | None) -> tuple[Path | None, Path | None]:
    """Name the files for a trained network and for the state of its training.

    All corruptions share the network. Two jobs may train it at the same time, each with a
    state of its own; they get the same, and the second file replaces the first.
    """
    if models is None or not models.is_dir():  # a machine of a cluster, without our disk
        return None, None
    return models / f"{job.network_name}.safetensors", models / f"{job.name}.part"


def _check_finite(cleaned: Motion) -> None:
    empty = np.argwhere(np.isnan(cleaned.channels))
    if empty.size:
        frame, channel = empty[0]
        raise ValueError(
            f"the method left {len(empty)} samples of {cleaned.name!r} empty, the first in "
            f"{cleaned.skeleton.channel_labels[channel]} in frame {frame}"
        )
