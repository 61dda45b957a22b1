"""What ``mocaplab evaluate --data`` does: compare all methods on holdouts."""

from __future__ import annotations

import argparse
import sys
from difflib import get_close_matches
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from mocaplab.corruption import CORRUPTIONS, corrupt
from mocaplab.datasets import Dataset, load_dataset, load_folder
from mocaplab.files import check_writable, write_atomically
from mocaplab.splits import make_splits, read_clip_list

if TYPE_CHECKING:
    from mocaplab.comparison.job import Job
    from mocaplab.comparison.result import Result


def compare_all(options: argparse.Namespace) -> None:
    """Run every method on every holdout and corruption, and write tables and plots."""
    from mocaplab.comparison.job import make_jobs, usable_measures
    from mocaplab.comparison.job_runner import cluster_workers, local_workers, run_jobs
    from mocaplab.worker_processes import count_cores

    recipes = read_recipes(options.noise)
    methods = read_methods(options.methods or "all")
    folder = Path(options.output or "evaluation").absolute()
    folder.mkdir(parents=True, exist_ok=True)
    check_writable(folder / "results.csv")
    kind = options.split or "paper"
    dataset, subjects = load_clips(options.data)
    splits = make_splits(
        kind, dataset.actions, subjects, seed=options.seed, n_holdouts=options.holdouts or 5
    )
    # What the shortest clip allows, every clip does: better refuse now than after hours.
    shortest = min(dataset.clips, key=lambda clip: clip.n_frames)
    for recipe in recipes:
        corrupt(shortest, recipe, rng=np.random.default_rng(0))
    measures, refused = usable_measures(shortest)
    for name, why in refused.items():
        print(f"{name} is left out: {shortest.name}: {why}")
    jobs = make_jobs(
        splits,
        recipes,
        methods,
        measures,
        seed=options.seed,
        repetitions=options.repeats,
        epochs=options.epochs,
    )
    title = (
        f"{len(dataset)} clips of {dataset.name}, {len(splits)} holdouts ({kind}), every test "
        f"clip corrupted {options.repeats} times, seed {options.seed}"
    )
    print(f"{title}: {len(jobs)} jobs")
    open_workers = (
        partial(cluster_workers, address=options.scheduler)
        if options.scheduler
        else partial(local_workers, processes=options.workers or count_cores())
    )
    results, failed = run_jobs(dataset, jobs, folder, open_workers)
    if failed:
        title += f"; {len(failed)} of {len(jobs)} jobs failed, and what they lack is left out"
    if results:
        _write_report(results, title, folder, options.seed)
    for job, why in failed.items():
        print(f"failed: {job.name}: {why}", file=sys.stderr)
    if failed:
        raise ValueError(
            f"{len(failed)} of {len(jobs)} jobs failed; the whole messages are in "
            f"{folder / 'failed'}, and the same command tries them again"
        )


def load_clips(source: str) -> tuple[Dataset, list[int] | None]:
    """Load the clips and, where a list of them tells, the subject of each.

    Parameters
    ----------
    source : str, a folder of BVH files, or "embedded"
    """
    if source == "embedded":
        return load_dataset("embedded"), None
    dataset = load_folder(source)
    if not (Path(source) / "clips.csv").exists():
        return dataset, None
    names, _, subjects = read_clip_list(source)
    of_clip = dict(zip(names, subjects or [], strict=False))
    known = all(clip.name in of_clip for clip in dataset.clips)
    return dataset, [of_clip[clip.name] for clip in dataset.clips] if known else None


def read_recipes(text: str) -> list[str]:
    """Read recipes joined by commas, or "all".

    "all" is paper A's three amounts of angular noise, 0.5 cm of spatial noise, and every
    other corruption that there is, with its usual amount.

    Raises
    ------
    ValueError
        If a recipe cannot be read.
    """
    from mocaplab.comparison.job import spell_recipe

    if text != "all":
        return list(dict.fromkeys(spell_recipe(recipe) for recipe in text.split(",")))
    paper = ["angular:0.1", "angular:0.5", "angular:0.9", "spatial:0.5"]
    first = [recipe for recipe in paper if recipe.split(":")[0] in CORRUPTIONS]
    rest = [name for name in CORRUPTIONS if name not in ("angular", "spatial")]
    return [*first, *map(spell_recipe, rest)]


def read_methods(text: str) -> list[str]:
    """Read names of methods joined by commas; "all" is all but networks, and the oracle.

    ``ebf@angular:0.5`` is a network that is trained on that noise alone.

    Raises
    ------
    ValueError
        If there is no such method; the message has the nearest names.
    """
    from mocaplab.comparison.job import ORACLE, spell_recipe
    from mocaplab.comparison.methods import METHODS, NETWORK_LABELS, PIPELINES

    networks = [*NETWORK_LABELS, *PIPELINES]
    known = [*METHODS, *networks, ORACLE]
    names: list[str] = []
    for name in [part.strip() for part in text.split(",")]:
        network, at, recipe = name.partition("@")
        if name == "all":
            names += [*METHODS, ORACLE]
        elif at and network in networks:
            names.append(f"{network}@{spell_recipe(recipe)}")
        elif name in known:
            names.append(name)
        else:
            near = ", ".join(get_close_matches(name, known, cutoff=0.0))
            raise ValueError(
                f"no method {name!r}; the nearest names are {near}; all are {', '.join(known)}"
            )
    if text == "all":
        print(f"left out, since they are trained for minutes: {', '.join(networks)}")
    return list(dict.fromkeys(names))


def _write_report(results: dict[Job, Result], title: str, folder: Path, seed: int) -> None:
    """Write results.csv, table.csv, table.md and the plots."""
    from mocaplab.comparison import report
    from mocaplab.comparison.gap_report import draw_gap_plots, gap_tables

    speeds = report.frames_per_second(results)
    estimates = report.estimate(results, seed=seed)
    table = report.estimates_to_markdown(estimates, speeds) + gap_tables(estimates)
    write_atomically(folder / "results.csv", report.results_to_csv(results))
    write_atomically(folder / "table.csv", report.estimates_to_csv(estimates, speeds))
    write_atomically(folder / "table.md", f"# {title}\n\n{report.EXPLANATION}\n\n{table}")
    plots = report.draw_plots(estimates, speeds, folder) + draw_gap_plots(estimates, folder)
    notes = sorted({note for result in results.values() for note in result["notes"]})
    print(f"\n{table}")
    if notes:
        print(f"{len(notes)} notes by the methods are in {folder / 'rows'}; the first: {notes[0]}")
    print(f"wrote results.csv, table.csv, table.md and {len(plots)} plots in {folder}")
