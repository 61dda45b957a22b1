"""Plan, run, draw, judge: what ``mocaplab reproduce`` does."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from pathlib import Path

from mocaplab.comparison.job import Job
from mocaplab.comparison.job_runner import OpenWorkers, run_jobs
from mocaplab.comparison.methods import PIPELINES, part_network
from mocaplab.datasets import Dataset, clip_digest
from mocaplab.reproduction.claims import Claim, Evidence
from mocaplab.reproduction.costs import estimate_s, measure_steps, sources_s
from mocaplab.reproduction.figures import FIGURES
from mocaplab.reproduction.needs import make_groups, make_jobs
from mocaplab.reproduction.plan import (
    FULL,
    LADDER,
    Plan,
    at_level,
    dataset_digest,
    most_holdouts,
)
from mocaplab.reproduction.report import Part, write_figure, write_report
from mocaplab.reproduction.scores import Scores
from mocaplab.splits import make_splits

Subjects = Sequence[int] | None


def jobs_of(plan: Plan, figures: Sequence[str], dataset: Dataset, subjects: Subjects) -> list[Job]:
    """List the jobs that some figures need under a plan."""
    needs = [need for name in figures for need in FIGURES[name].needs]
    return make_jobs(needs, dataset, make_groups(dataset, subjects, plan), plan)


def count_given(models: Path, dataset: Dataset, seed: int, holdouts: int) -> int:
    """Count the first holdouts for which a folder has fully trained networks.

    They are the files that ``mocaplab evaluate --data`` keeps in its folder models.

    Raises
    ------
    ValueError
        If there is none, or one was trained on other clips than the holdout's.
    """
    from mocaplab.checkpoints import load_checkpoint

    splits = make_splits("paper", dataset.actions, seed=seed, n_holdouts=holdouts)
    for n, (holdout, split) in enumerate(splits.items()):
        paths = [models / f"{name}-{holdout}.safetensors" for name in FULL]
        if not all(path.is_file() for path in paths):
            if n == 0:
                raise ValueError(
                    f"{models}: expected {paths[0].name} and {paths[1].name}, as mocaplab evaluate "
                    f"--data FOLDER --methods {','.join(FULL)} makes them"
                )
            return n
        clips = {clip_digest(dataset.clips[i]) for i in split.train}
        for path in paths:
            if set(load_checkpoint(path).trained_on.values()) != clips:
                raise ValueError(
                    f"{path} was trained on other clips than those outside {holdout} with seed "
                    f"{seed}"
                )
    return len(splits)


def wanted_plan(
    figures: Sequence[str], dataset: Dataset, budget_min: float, seed: int, full: int
) -> Plan:
    """Put down what is asked for, on the lowest level."""
    plan = Plan(
        **vars(LADDER[0]),
        figures=tuple(figures),
        data=dataset.name,
        digest=dataset_digest(dataset),
        budget_min=budget_min,
        seed=seed,
        possible_holdouts=most_holdouts(dataset, seed),
        full=full,
    )
    return at_level(plan, LADDER[0])


def make_plan(
    figures: Sequence[str],
    dataset: Dataset,
    subjects: Subjects,
    *,
    budget_min: float,
    seed: int,
    workers: int,
    full: int = 0,
) -> Plan:
    """Choose the highest level of the ladder that the budget is enough for.

    Raises
    ------
    ValueError
        If it is not enough for the lowest; the message has the budget that is.
    """
    first = wanted_plan(figures, dataset, budget_min, seed, full)
    networks = {part_network(job.method) for job in jobs_of(first, figures, dataset, subjects)}
    steps = measure_steps(dataset, sorted({parts[0] for parts in networks if parts}))
    chosen: Plan | None = None
    for level in LADDER:
        candidate = at_level(first, level)
        seconds = estimate_s(
            jobs_of(candidate, figures, dataset, subjects), dataset, candidate, steps, workers
        )
        seconds += sources_s(level, steps) * any(FIGURES[name].sources for name in figures)
        if seconds <= 60 * budget_min:
            chosen = candidate
        elif chosen is None:
            least = int(seconds / 60 + 1)
            raise ValueError(
                f"a budget of {budget_min:g} minutes is too small for {len(figures)} figures on "
                f"{workers} processes; the smallest that works is about --budget {least}"
            )
        else:
            break
    return chosen or first


def reproduce(
    dataset: Dataset,
    subjects: Subjects,
    plan: Plan,
    figures: Sequence[str],
    folder: Path,
    open_workers: OpenWorkers,
    given: Path | None = None,
) -> tuple[list[Claim], dict[Job, str]]:
    """Run what is not done yet, and write figures, claims and the report.

    Parameters
    ----------
    dataset : Dataset
    subjects : list of int, who moves in each clip, or None
    plan : Plan
    figures : list of str, names in ``FIGURES``
    folder : Path, the output folder
    open_workers : see :func:`mocaplab.comparison.job_runner.run_jobs`
    given : folder of fully trained networks, or None

    Returns
    -------
    claims, and the jobs that failed with the reason
    """
    if given is not None:
        _copy_networks(given, folder / "models", plan.full)
    groups = make_groups(dataset, subjects, plan)
    jobs = jobs_of(plan, figures, dataset, subjects)
    # Each network is trained by one job first; two at a time would both train it.
    first = {
        job.network_name: job
        for job in jobs
        if part_network(job.method) and job.method not in PIPELINES
    }
    if first:
        run_jobs(dataset, list(first.values()), folder, open_workers)
    results, failed = run_jobs(dataset, jobs, folder, open_workers)
    evidence = Evidence(plan, dataset, groups, Scores(results, plan), folder)
    claims: list[Claim] = []
    parts: list[Part] = []
    for name in figures:
        figure = FIGURES[name]
        tested = not figure.needs or any(
            evidence.scores.tested(need.methods, need.recipes, need.group) for need in figure.needs
        )
        drawing = figure.draw(evidence) if tested else None
        if drawing is None:
            nothing = "Nothing could be tested on these clips."
            parts.append(Part(figure.title, figure.asks, None, nothing))
            continue
        judged = [claim for claim in figure.claims(evidence) if claim.clips]
        claims += judged
        parts.append(write_figure(figure, *drawing, judged, plan, folder))
    write_report(claims, parts, plan, folder)
    return claims, failed


def _copy_networks(given: Path, models: Path, holdouts: int) -> None:
    """Take trained networks over, those alone that are not there yet."""
    models.mkdir(parents=True, exist_ok=True)
    for number in range(1, holdouts + 1):
        for name in FULL:
            file = f"{name}-holdout_{number}.safetensors"
            if not (models / file).exists() and given.resolve() != models.resolve():
                shutil.copyfile(given / file, models / file)
