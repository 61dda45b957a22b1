"""How long things take here: steps of training are measured, the rest is scaled from them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from mocaplab.comparison.job import Job
from mocaplab.comparison.methods import PIPELINES, part_network
from mocaplab.datasets import Dataset
from mocaplab.reproduction.plan import Level, Plan

REFERENCE_STEP_S = 0.6
"""An EBF's training step on the machine on which the seconds below were taken."""
FIT_S = {
    "gaussian_tuned": 0.33,
    "gaussian_tuned_channel": 0.33,
    "wiener": 0.45,
    "example_based": 1.4,
}
"""Seconds to fit to 1000 training frames; others take next to none."""
CLEAN_S = {"wiener": 0.55, "example_based": 0.3}
CLEAN_NETWORK_S, CLEAN_OTHER_S = 0.5, 0.05
"""Seconds to clean 1000 frames and score them."""
SPATIAL_S = 1.6
"""Seconds to draw spatial noise for 1000 frames; all other noise takes next to none."""
START_S = 15.0
"""Seconds until worker processes have loaded torch and the clips."""
MARGIN = 1.3
"""What we do not know of is taken to cost this much more."""
SOURCE_STEPS = 20
"""Training steps of paper B's network for each epoch of the others."""
LIKE_EBF = ("ebf", "ebf_bias", "ebf_free", "bf")


def measure_steps(dataset: Dataset, networks: Iterable[str]) -> dict[str, float]:
    """Measure a training step of each kind of network, in seconds, on a few clips.

    Variants of EBF take as long as EBF itself.
    """
    from mocaplab.comparison.network_methods import SHAPES, training_recipe
    from mocaplab.training import time_step

    clips = sorted(dataset.clips, key=lambda clip: clip.n_frames)[: min(3, len(dataset))]
    kinds = dict.fromkeys("ebf" if name in LIKE_EBF else name for name in (*networks, "ebf"))
    return {
        kind: time_step(clips, training_recipe(kind, 1), SHAPES[kind])
        for kind in kinds
        if kind in SHAPES
    }


def estimate_s(
    jobs: Iterable[Job], dataset: Dataset, plan: Plan, steps: Mapping[str, float], workers: int
) -> float:
    """Estimate the seconds that the jobs of a plan take together on so many workers."""
    speed = steps["ebf"] / REFERENCE_STEP_S
    total, trained = 0.0, set()
    for job in jobs:
        train, test = (
            sum(dataset.clips[i].n_frames for i in part)
            for part in (job.split.train, job.split.test)
        )
        test *= job.repetitions
        parts = part_network(job.method)
        if parts is None:
            total += speed * (FIT_S.get(job.method, 0.0) * train / 1000)
            total += speed * (CLEAN_S.get(job.method, CLEAN_OTHER_S) * test / 1000)
        else:
            total += speed * CLEAN_NETWORK_S * test / 1000
            given = job.epochs is None and plan.is_full(job.method)
            if job.network_name not in trained and not given and job.method not in PIPELINES:
                trained.add(job.network_name)
                total += training_s(*parts, train, job.epochs, steps)
        if "spatial" in job.corruption:
            fits = parts is None and job.method in FIT_S
            total += speed * SPATIAL_S * (test + (train if fits else 0)) / 1000
    return START_S + MARGIN * total / workers


def training_s(
    network: str, recipe: str | None, frames: int, epochs: int | None, steps: Mapping[str, float]
) -> float:
    """Estimate the seconds to train a network on so many frames."""
    from mocaplab.comparison.network_methods import training_recipe

    config = training_recipe(network, epochs)
    counted = (config.n_frames - 2 * config.margin) * config.batch_size
    kind = "ebf" if network in LIKE_EBF else network
    speed = steps["ebf"] / REFERENCE_STEP_S
    drawn = 3 * SPATIAL_S * frames / 1000 if recipe and "spatial" in recipe else 0.0
    tuning = FIT_S["gaussian_tuned"] * frames / 1000
    n_steps = config.epochs * max(1, round(frames / counted))
    return n_steps * steps.get(kind, steps["ebf"]) + speed * (drawn + tuning)


def sources_s(level: Level, steps: Mapping[str, float]) -> float:
    """Estimate the seconds to train paper B's network: wide LSTM layers cost their square."""
    share = 0.3 + 0.7 * (level.width / 128) ** 2
    return level.epochs * SOURCE_STEPS * share * steps["ebf"]
