"""What ``mocaplab evaluate`` does: score a model, compare files, or compare all methods."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from tqdm.auto import tqdm

from mocaplab.bvh import load_bvh
from mocaplab.commands.compare import compare_all
from mocaplab.commands.option_types import add_model, add_seed, count
from mocaplab.datasets import Dataset, clip_digest, load_folder
from mocaplab.euler import align_to, make_continuous
from mocaplab.evaluation import compare_methods, format_table, table_by_action
from mocaplab.filters import Denoiser, GaussianDenoiser, Untouched
from mocaplab.measures.by_name import rms_all_deg, rms_moving_deg
from mocaplab.measures.movement import jitter
from mocaplab.noise.draws import draw_test
from mocaplab.splits import KINDS

if TYPE_CHECKING:
    from mocaplab.cleaning import Cleaner

OF_COMPARISON = ("methods", "split", "holdouts", "epochs", "output", "workers", "scheduler")
"""Options that go with --data alone; they are None where they are not given."""

OF_MODEL = ("model", "all_clips")
"""Options that do not go with --data."""


SUMMARY = "measure how well cleaning works: one model, or all methods on holdouts"
DETAILS = (
    "With clean clips, noise is added, a model and tuned Gaussian filters clean it, and the\n"
    "table shows the error that is left. With --reference, the given files are compared with\n"
    "a clean one. With --data, every method is fitted on a part of the clips and tested on\n"
    "another, with 95 % intervals from a bootstrap over clips. A comparison that was stopped\n"
    "goes on when the same command is given again.\n\n"
    "examples:\n"
    "  mocaplab evaluate my_clips --noise 0.5\n"
    "  mocaplab evaluate --reference walk.bvh noisy.bvh clean.bvh\n"
    "  mocaplab evaluate --data my_clips --methods all --noise all -o results"
)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what can be set."""
    add = parser.add_argument
    add("paths", nargs="*", metavar="PATH", help="BVH files, or one folder of clean BVH files")
    add("--reference", metavar="CLEAN.bvh", help="compare the files with this clean one")
    add("--repeats", type=count, default=5, help="times that fresh noise is drawn (default: 5)")
    add("--all-clips", action="store_true", help="also score clips the model was trained on")
    add(
        "--noise",
        default="angular:0.5",
        metavar="RECIPES",
        help="recipes of mocaplab corrupt; with --data several with commas between, or all: paper "
        "A's angular:0.1, 0.5 and 0.9, spatial:0.5, and every other corruption with its usual "
        "amount (default: %(default)s)",
    )
    add_seed(parser)
    add_model(parser)
    add = parser.add_argument_group("comparison of methods").add_argument
    add("--data", metavar="FOLDER", help="clean BVH files, or embedded for the made-up clips")
    add(
        "--methods",
        metavar="NAMES",
        help="names with commas between, or all (default): all but those that train a network, "
        "which must be named (as in all,ebf; or ebf@angular:0.5, trained on that noise alone), and "
        "oracle, a bound that sees the clean signal; a wrong name shows the list",
    )
    add(
        "--split",
        choices=KINDS,
        help="paper: holdouts in the paper's mix of actions (default); subject: and nobody is "
        "on both sides; action: leave one action out",
    )
    add("--holdouts", type=count, metavar="N", help="holdouts that share no clip (default: 5)")
    add("-o", "--output", metavar="FOLDER", help="for rows, tables, plots (default: evaluation)")
    add(
        "--epochs",
        type=count,
        metavar="N",
        help="training of networks (default: 200, blend 20, ebd 700)",
    )
    add("--workers", type=count, metavar="N", help="processes (default: one a core)")
    add("--scheduler", metavar="ADDRESS", help="run on a Dask cluster, such as tcp://host:8786")


def run(options: argparse.Namespace) -> None:
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
        compare_all(options)
    elif not options.paths:
        raise ValueError("say which clips: BVH files, a folder of them, or --data FOLDER")
    elif options.reference:
        _compare_files(options.reference, options.paths)
    else:
        _score_model(options)


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
