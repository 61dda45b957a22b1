"""What each command of the command line does; cli.py reads the options.

torch is imported only by the commands that need it, so that the others answer at once.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from tqdm.auto import tqdm

from mocaplab.bvh import load_bvh, save_bvh
from mocaplab.corruption import corrupt as corrupt_clip
from mocaplab.datasets import Dataset, clip_digest, load_folder, split_holdout
from mocaplab.doctor import diagnose
from mocaplab.euler import align_to, make_continuous
from mocaplab.evaluation import (
    Untouched,
    compare_methods,
    format_table,
    table_by_action,
)
from mocaplab.files import check_writable
from mocaplab.filters import Denoiser, GaussianDenoiser
from mocaplab.findings import summarize
from mocaplab.measures import rms_all_deg, rms_moving_deg
from mocaplab.motion import Motion, moving_channels
from mocaplab.movement import jitter
from mocaplab.noise import angular_noise

if TYPE_CHECKING:
    from mocaplab.cleaning import Cleaner


def clean(options: argparse.Namespace) -> None:
    """Clean a file and say what was changed."""
    from mocaplab.cleaning import Cleaner, report_changes

    check_writable(options.output)
    noisy = load_bvh(options.file)
    cleaner = Cleaner(options.model)
    cleaned = cleaner.clean(noisy)
    cleaned = _round_changes(noisy, cleaned)
    save_bvh(cleaned, options.output)
    print(report_changes(noisy, cleaned))
    print(f"wrote     {options.output}")


def corrupt(options: argparse.Namespace) -> None:
    """Add angular noise to a file."""
    motion = load_bvh(options.file)
    noisy = angular_noise(motion, options.noise, rng=np.random.default_rng(options.seed))
    noisy = _round_changes(motion, noisy)
    save_bvh(noisy, options.output)
    moving = moving_channels(motion)
    error = rms_moving_deg(noisy, motion)
    print(f"noise     {error:.2f} degrees RMS on the {moving.sum()} channels that move")
    print(f"jitter    {jitter(motion):,.0f} -> {jitter(noisy):,.0f} units/s^3")
    print(f"wrote     {options.output}")


def _round_changes(before: Motion, after: Motion) -> Motion:
    """Round the samples that were changed to a millionth of a degree; it keeps files small."""
    same = after.channels == before.channels
    return after.with_channels(np.where(same, before.channels, after.channels.round(6)))


def train(options: argparse.Namespace) -> None:
    """Train a model, then test it on the clips held out."""
    from mocaplab.checkpoints import save_checkpoint
    from mocaplab.cleaning import Cleaner
    from mocaplab.training import TrainConfig
    from mocaplab.training import train as train_model

    check_writable(options.output)
    dataset = load_folder(options.folder)
    test = None
    training = dataset
    if options.holdout:
        training, test = split_holdout(dataset, options.holdout, seed=options.seed)
    frames = sum(clip.n_frames for clip in training.clips)
    print(f"training on {len(training)} clips ({frames} frames) of {options.folder}")
    config = TrainConfig(epochs=options.epochs, seed=options.seed)
    state_path = Path(f"{options.output}.part")
    if state_path.exists():
        print(f"going on from {state_path}")
    checkpoint = train_model(training.clips, config, state_path=state_path)
    save_checkpoint(checkpoint, options.output)
    state_path.unlink()
    print(f"wrote {options.output}")
    if test is not None:
        print(f"test on the {len(test)} clips held out, noise 0.5:\n")
        _print_scores(test, Cleaner(checkpoint), noise=0.5, seed=options.seed, repeats=5)


def evaluate(options: argparse.Namespace) -> None:
    """Score methods on clean clips, or files against a reference."""
    if options.reference:
        _compare_files(options.reference, options.paths)
        return
    from mocaplab.cleaning import Cleaner

    cleaner = Cleaner(options.model)
    if len(options.paths) == 1 and Path(options.paths[0]).is_dir():
        dataset = load_folder(options.paths[0])
    else:
        clips = tuple(make_continuous(load_bvh(path)) for path in options.paths)
        dataset = Dataset("files", clips, tuple(clip.name.rsplit("_", 1)[0] for clip in clips))
    if not options.all_clips:
        known = set(cleaner.checkpoint.trained_on.values())
        new = [i for i, clip in enumerate(dataset.clips) if clip_digest(clip) not in known]
        if len(new) < len(dataset):
            print(f"{len(dataset) - len(new)} clips that the model was trained on are left out")
        if not new:
            raise ValueError("no clip is left; --all-clips scores the training clips too")
        dataset = dataset.select(new, dataset.name)
    _print_scores(dataset, cleaner, noise=options.noise, seed=options.seed, repeats=options.repeats)


def _print_scores(
    dataset: Dataset, cleaner: Cleaner, *, noise: float, seed: int, repeats: int
) -> None:
    """Print the table of errors by action, for both kinds of RMS."""
    checkpoint = cleaner.checkpoint
    for clip in dataset.clips:
        checkpoint.require(clip.skeleton, clip.frame_time, clip.name)
    tuned_ms = 1000 * checkpoint.gaussian_s
    methods: dict[str, Denoiser] = {
        "noisy": Untouched(),
        "Gaussian 58 ms": GaussianDenoiser(0.058),
        f"Gaussian tuned ({tuned_ms:.0f} ms)": GaussianDenoiser(checkpoint.gaussian_s),
        "Gaussian tuned per channel": GaussianDenoiser(checkpoint.gaussian_per_channel_s),
        "EBF": cleaner,
    }
    scores = []
    for repeat in tqdm(range(repeats), desc="scoring", unit="draw", leave=False):
        corrupted = [
            corrupt_clip(clip, f"angular:{noise}", rng=np.random.default_rng([seed, repeat, i]))
            for i, clip in enumerate(dataset.clips)
        ]
        scores += compare_methods(corrupted, methods, corruption=f"{noise} noise", seed=repeat)
    actions = dict(zip((c.name for c in dataset.clips), dataset.actions, strict=True))
    print(f"{len(dataset)} clips, {noise} noise drawn {repeats} times, seed {seed}")
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


def info(options: argparse.Namespace) -> None:
    """Describe a file."""
    motion = load_bvh(options.file)
    skeleton = motion.skeleton
    moving = moving_channels(motion)
    still = int((skeleton.is_cleaned & ~moving).sum())
    print(f"name      {motion.name}")
    print(f"frames    {motion.n_frames} at {motion.fps:.4g} per second, {motion.duration_s:.2f} s")
    print(f"joints    {skeleton.n_joints}, and {len(skeleton.end_site_parents)} end sites")
    print(f"channels  {skeleton.n_channels}: {moving.sum()} joint angles that move, {still} still")
    print(f"jitter    {jitter(motion):,.0f} units/s^3 (mean joint jerk)")
    print("findings")
    for line in summarize(diagnose(motion)) or ["nothing to mention"]:
        print(f"  {line}")
    print("skeleton")
    depth = [0] * skeleton.n_joints
    for joint, parent in enumerate(skeleton.parents.tolist()):
        depth[joint] = depth[parent] + 1 if parent >= 0 else 1
        channels = " ".join(skeleton.channel_names[joint])
        print(f"{'  ' * depth[joint]}{skeleton.joint_names[joint]}  [{channels}]")
