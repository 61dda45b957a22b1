"""One job of a comparison: fit a method for one holdout, clean its clips, score them.

The rows of a job depend on the clips, the seed, the recipe, the method and the versions
of the libraries, and on nothing else. All of that is its fingerprint.
"""

from __future__ import annotations

import hashlib
import json
import re
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from mocaplab import __version__
from mocaplab.comparison.methods import METHODS, PIPELINES, part_network
from mocaplab.corruption import parse_recipe
from mocaplab.datasets import Dataset, clip_digest
from mocaplab.evaluation import score_clip
from mocaplab.files import write_atomically
from mocaplab.filters import Denoiser
from mocaplab.measures.by_name import MEASURES
from mocaplab.motion import Corrupted, Motion
from mocaplab.noise.draws import draw_test, draw_training
from mocaplab.splits import Split
from mocaplab.tuning import oracle_gaussian

ORACLE = "oracle"
"""The row of :func:`mocaplab.tuning.oracle_gaussian`, which sees the clean signal."""

Result = dict[str, Any]
"""What a job returns: fingerprint, fit_s (seconds), notes (what the method warned of), and
rows, one a clip and repetition."""


@dataclass(frozen=True)
class Job:
    """One method, one corruption, one holdout.

    Parameters
    ----------
    holdout : str, the split's name
    split : Split
    corruption : str, a recipe, see :func:`mocaplab.corruption.parse_recipe`
    method : str, a name in ``METHODS``, a network (``part_network``), or ``ORACLE``
    measures : tuple of str, names in ``MEASURES``
    seed : int
    repetitions : int, times that fresh noise is drawn for every test clip
    epochs : int, for which networks are trained, or None for their usual number
    detail : bool
        Rows have also the RMS of every frame and of every joint, over all angles, as lists
        by_frame_deg and by_joint_deg.
    """

    holdout: str
    split: Split
    corruption: str
    method: str
    measures: tuple[str, ...]
    seed: int
    repetitions: int
    epochs: int | None = None
    detail: bool = False

    @property
    def name(self) -> str:
        """A name that can be a file's."""
        return _file_name(f"{self.corruption}-{self.network_name}")

    @property
    def network_name(self) -> str:
        """The name without the corruption, which a trained network does not depend on."""
        usual = self.epochs is None or part_network(self.method) is None
        epochs = "" if usual else f"-{self.epochs}"
        return _file_name(f"{self.method}-{self.holdout}{epochs}")


def _file_name(text: str) -> str:
    return re.sub(r"[^\w.+-]", "_", text)


def make_jobs(
    splits: Mapping[str, Split],
    recipes: Sequence[str],
    methods: Sequence[str],
    measures: Sequence[str],
    *,
    seed: int,
    repetitions: int,
    epochs: int | None = None,
) -> list[Job]:
    """List all jobs, those of one corruption together, so that its noise is drawn once."""
    return [
        Job(holdout, split, recipe, method, tuple(measures), seed, repetitions, epochs)
        for recipe in recipes
        for holdout, split in splits.items()
        for method in methods
    ]


def spell_recipe(recipe: str) -> str:
    """Spell a recipe with all its amounts, one spelling for each: ``"0.5"`` is ``"angular:0.5"``.

    Raises
    ------
    ValueError
        If the recipe cannot be read.
    """
    spelled = [f"{step.name}:{amount:g}" for step, amount in parse_recipe(recipe)]
    return "+".join(step.replace("e+", "e") for step in spelled)  # a plus joins steps


def usable_measures(clip: Motion) -> tuple[list[str], dict[str, str]]:
    """Try every measure on a clip: some need feet, or a skeleton of a person's size.

    Returns
    -------
    names : list of str
    refused : dict from the other names to why
    """
    corrupted = Corrupted(clip, clip, np.ones(clip.channels.shape, dtype=bool))
    names, refused = [], {}
    for name, measure in MEASURES.items():
        try:
            measure.score(clip, corrupted)
            names.append(name)
        except ValueError as error:
            refused[name] = str(error)
    return names, refused


def versions() -> dict[str, str]:
    """Tell the versions of the libraries that numbers may depend on."""
    return {"mocaplab": __version__} | {name: version(name) for name in ("numpy", "scipy", "torch")}


def fingerprint(dataset: Dataset, job: Job) -> dict[str, Any]:
    """Tell all that the rows of a job depend on."""
    found = {
        "versions": versions(),
        "corruption": job.corruption,
        "method": job.method,
        "measures": list(job.measures),
        "seed": job.seed,
        "repetitions": job.repetitions,
        "epochs": job.epochs if part_network(job.method) else None,
        "training clips": _digest(dataset, job.split.train),
        "test clips": _digest(dataset, job.split.test),
    }
    return found | ({"detail": True} if job.detail else {})


def _digest(dataset: Dataset, indices: Sequence[int]) -> str:
    """Make one digest of some clips: their samples, names, actions, bones and frame times."""
    digest = hashlib.sha256()
    for i in indices:
        clip = dataset.clips[i]
        names = [clip.name, dataset.actions[i], *clip.skeleton.channel_labels]
        digest.update(json.dumps([names, clip.frame_time, clip_digest(clip)]).encode())
        digest.update(clip.skeleton.offsets.tobytes())
    return digest.hexdigest()[:16]


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


def save_result(path: Path, result: Result) -> None:
    """Write what a job returned; nobody ever sees half of the file."""
    write_atomically(path, json.dumps(result, indent=0) + "\n")


def load_result(path: Path, expected: Mapping[str, Any]) -> Result | None:
    """Read what the same job returned earlier.

    Parameters
    ----------
    path : file that :func:`save_result` wrote
    expected : the job's fingerprint

    Returns
    -------
    dict, or None if there is no such file

    Raises
    ------
    ValueError
        If the file is of another job, or cannot be read.
    """
    try:
        result: Result = json.loads(path.read_text(encoding="utf-8"))
        found = result["fingerprint"]
        rows = result["rows"]
        differ = [
            f"{key} ({found[key]}, now {now})" for key, now in expected.items() if found[key] != now
        ]
        whole = all(set(expected["measures"]) <= set(row) for row in rows) and len(rows) > 0
    except FileNotFoundError:
        return None
    except (ValueError, KeyError, TypeError):
        raise ValueError(
            f"{path}: expected the rows of a comparison, got something else; "
            "remove the file, and it is made anew"
        ) from None
    if differ:
        raise ValueError(
            f"{path} was made with other settings: {', '.join(differ)}; choose "
            "another output folder, or take this one away"
        )
    if not whole:
        raise ValueError(f"{path}: rows lack measures; remove the file, and it is made anew")
    return result
