"""What ``mocaplab evaluate`` does: score a model, compare files, or compare all methods."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from difflib import get_close_matches
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from tqdm.auto import tqdm

from mocaplab.bvh import load_bvh
from mocaplab.corruption import CORRUPTIONS, corrupt
from mocaplab.datasets import Dataset, clip_digest, load_dataset, load_folder
from mocaplab.euler import align_to, make_continuous
from mocaplab.evaluation import compare_methods, format_table, table_by_action
from mocaplab.files import check_writable, write_atomically
from mocaplab.filters import Denoiser, GaussianDenoiser, Untouched
from mocaplab.measures.by_name import rms_all_deg, rms_moving_deg
from mocaplab.measures.movement import jitter
from mocaplab.noise.draws import draw_test
from mocaplab.splits import make_splits, read_clip_list

if TYPE_CHECKING:
    from mocaplab.cleaning import Cleaner
    from mocaplab.comparison.job import Job, Result

OF_COMPARISON = ("methods", "split", "holdouts", "epochs", "output", "workers", "scheduler")
"""Options that go with --data alone; they are None where they are not given."""

OF_MODEL = ("model", "all_clips")
"""Options that do not go with --data."""


def evaluate(options: argparse.Namespace) -> None:
    """Score a model on clean clips, files against a reference, or all methods on holdouts."""
    wrong = [
        name for name in (OF_MODEL if options.data else OF_COMPARISON) if getattr(options, name)
    ]
    if wrong:
        flags = ", ".join("--" + name.replace("_", "-") for name in wrong)
        raise ValueError(
            f"{flags} {'do' if len(wrong) > 1 else 'does'} not go "
            f"with{'' if options.data else 'out'} --data"
        )
    if options.data:
        if options.paths or options.reference:
            raise ValueError("--data compares methods on a folder of clips; give no files with it")
        _compare_all(options)
    elif not options.paths:
        raise ValueError("say which clips: BVH files, a folder of them, or --data FOLDER")
    elif options.reference:
        _compare_files(options.reference, options.paths)
    else:
        _score_model(options)


def _compare_all(options: argparse.Namespace) -> None:
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
    """Read names of methods joined by commas, or "all": all but networks, and the oracle.

    Raises
    ------
    ValueError
        If there is no such method; the message has the nearest names.
    """
    from mocaplab.comparison.job import ORACLE
    from mocaplab.comparison.methods import METHODS, NETWORK_LABELS, PIPELINES

    networks = [*NETWORK_LABELS, *PIPELINES]
    if text == "all":
        print(f"left out, since they are trained for minutes: {', '.join(networks)}")
        return [*METHODS, ORACLE]
    names = [name.strip() for name in text.split(",")]
    known = [*METHODS, *networks, ORACLE]
    for name in names:
        if name not in known:
            near = ", ".join(get_close_matches(name, known, cutoff=0.0))
            raise ValueError(
                f"no method {name!r}; the nearest names are {near}; all are {', '.join(known)}"
            )
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


def _score_model(options: argparse.Namespace) -> None:
    """Score a model, or those of the package, on clips that they were not trained on."""
    from mocaplab.checkpoints import SHIPPED
    from mocaplab.cleaning import Cleaner

    cleaners = [Cleaner(model) for model in ([options.model] if options.model else SHIPPED)]
    if len(options.paths) == 1 and Path(options.paths[0]).is_dir():
        dataset = load_folder(options.paths[0])
    else:
        clips = tuple(make_continuous(load_bvh(path)) for path in options.paths)
        dataset = Dataset("files", clips, tuple(clip.name.rsplit("_", 1)[0] for clip in clips))
    if not options.all_clips:
        known = {clip for c in cleaners for clip in c.checkpoint.trained_on.values()}
        new = [i for i, clip in enumerate(dataset.clips) if clip_digest(clip) not in known]
        if len(new) < len(dataset):
            print(f"{len(dataset) - len(new)} clips that the model was trained on are left out")
        if not new:
            raise ValueError("no clip is left; --all-clips scores the training clips too")
        dataset = dataset.select(new, dataset.name)
    print_scores(dataset, cleaners, noise=options.noise, seed=options.seed, repeats=options.repeats)


def print_scores(
    dataset: Dataset, cleaners: Sequence[Cleaner], *, noise: str, seed: int, repeats: int
) -> None:
    """Print the table of errors by action, for both kinds of RMS.

    The noise is drawn as in a comparison of all methods (:mod:`mocaplab.noise.draws`).
    The Gaussians are those tuned on the training clips of the first model.
    """
    from mocaplab.comparison.job import spell_recipe

    for cleaner in cleaners:
        for clip in dataset.clips:
            cleaner.checkpoint.require(clip.skeleton, clip.frame_time, clip.name)
    checkpoint = cleaners[0].checkpoint
    tuned_ms = 1000 * checkpoint.gaussian_s
    methods: dict[str, Denoiser] = {
        "noisy": Untouched(),
        "Gaussian 58 ms": GaussianDenoiser(0.058),
        f"Gaussian tuned ({tuned_ms:.0f} ms)": GaussianDenoiser(checkpoint.gaussian_s),
        "Gaussian tuned per channel": GaussianDenoiser(checkpoint.gaussian_per_channel_s),
    }
    methods |= {type(cleaner.checkpoint.model).__name__: cleaner for cleaner in cleaners}
    scores = []
    noise = spell_recipe(noise)  # one spelling, one draw
    for repeat in tqdm(range(repeats), desc="scoring", unit="draw", leave=False):
        corrupted = [draw_test(clip, noise, seed=seed, repetition=repeat) for clip in dataset.clips]
        scores += compare_methods(corrupted, methods, corruption=noise, seed=repeat)
    actions = dict(zip((c.name for c in dataset.clips), dataset.actions, strict=True))
    print(f"{len(dataset)} clips, {noise} drawn {repeats} times, seed {seed}")
    print("Gaussians were tuned on the training clips of the model.")
    for metric, title in (
        ("rms_all_deg", "RMS over all joint angles, degrees"),
        ("rms_moving_deg", "RMS over the angles that move, degrees"),
    ):
        print(f"\n{title}")
        print(format_table(table_by_action(scores, metric, actions)))


def _compare_files(reference: str, paths: list[str]) -> None:
    clean_motion = make_continuous(load_bvh(reference))
    rows = [["file", "RMS all, deg", "RMS moving, deg", "jitter, units/s^3"]]
    rows.append([Path(reference).name, "0", "0", f"{jitter(clean_motion):,.0f}"])
    for path in paths:
        motion = load_bvh(path)
        if not motion.skeleton.same_as(clean_motion.skeleton):
            raise ValueError(f"{path} has other joints or channels than {reference}")
        if motion.n_frames != clean_motion.n_frames:
            raise ValueError(
                f"{path} has {motion.n_frames} frames, {reference} has {clean_motion.n_frames}"
            )
        motion = align_to(motion, clean_motion)
        rows.append(
            [
                Path(path).name,
                f"{rms_all_deg(motion, clean_motion):.3f}",
                f"{rms_moving_deg(motion, clean_motion):.3f}",
                f"{jitter(motion):,.0f}",
            ]
        )
    print(format_table(rows))
