"""What each command of the command line does; cli.py reads the options.

torch is imported only by the commands that need it, so that the others answer at once.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from mocaplab.bvh import load_bvh, round_changes, save_bvh
from mocaplab.commands.evaluate import print_scores
from mocaplab.corruption import corrupt as corrupt_clip
from mocaplab.corruption import snr_db
from mocaplab.datasets import load_folder, split_holdout
from mocaplab.doctor import diagnose
from mocaplab.euler import motion_continuity
from mocaplab.files import check_writable
from mocaplab.findings import summarize
from mocaplab.measures.by_name import rms_moving_deg
from mocaplab.measures.movement import jitter
from mocaplab.motion import moving_channels
from mocaplab.noise.faults import hold_gaps
from mocaplab.noise.gaps import hidden_share, save_gaps


def fuse(options: argparse.Namespace) -> None:
    """Fuse two recordings of one movement, and say how."""
    from mocaplab.fusion import Fuser

    check_writable(options.output)
    first, second = load_bvh(options.first), load_bvh(options.second)
    fused, report = Fuser(options.model).fuse(first, second, options.offset)
    save_bvh(fused.with_channels(fused.channels.round(6)), options.output)
    print(report)
    print(f"wrote     {options.output}")


def corrupt(options: argparse.Namespace) -> None:
    """Spoil a file, and say how much and where."""
    gaps_file = Path(options.output).with_suffix(".gaps.csv")
    check_writable(options.output)
    check_writable(gaps_file)
    motion = load_bvh(options.file)
    corrupted = corrupt_clip(motion, options.noise, rng=np.random.default_rng(options.seed))
    clean, hidden = corrupted.clean, hidden_share(corrupted.observed)
    held = hold_gaps(corrupted.observed)  # a BVH file cannot say that a number is missing
    sign, offset = motion_continuity(motion)
    in_files_branch = sign * (held.channels - offset)
    channels = np.where(held.channels == clean.channels, motion.channels, in_files_branch)
    save_bvh(round_changes(motion, motion.with_channels(channels)), options.output)
    error, moving = rms_moving_deg(held, clean), moving_channels(clean).sum()
    print(f"noise     {error:.2f} degrees RMS on the {moving} channels that move")
    print(f"SNR       {snr_db(corrupted):.1f} dB, over the samples that are not hidden")
    print(f"hidden    {hidden:.2%} of the joint angles")
    print(f"jitter    {jitter(clean):,.0f} -> {jitter(held):,.0f} units/s^3")
    print(f"wrote     {options.output}")
    if hidden or gaps_file.exists():  # an older list would be wrong
        save_gaps(corrupted.mask, motion.skeleton, gaps_file)
        print(f"wrote     {gaps_file}, which lists the gaps: the BVH file has older values there")


def train(options: argparse.Namespace) -> None:
    """Train a model, then test it on the clips held out."""
    from mocaplab.checkpoints import save_checkpoint
    from mocaplab.cleaning import Cleaner
    from mocaplab.comparison.network_methods import SHAPES, enough_epochs, training_recipe
    from mocaplab.training import train as train_model

    check_writable(options.output)
    dataset = load_folder(options.folder)
    test = None
    training = dataset
    if options.holdout:
        training, test = split_holdout(dataset, options.holdout, seed=options.seed)
    frames = sum(clip.n_frames for clip in training.clips)
    print(f"training on {len(training)} clips ({frames} frames) of {options.folder}")
    epochs = options.epochs or enough_epochs(options.network, frames)
    config = training_recipe(options.network, epochs, options.seed)
    shape = SHAPES[options.network]
    state_path = Path(f"{options.output}.part")
    if state_path.exists():
        print(f"going on from {state_path}")
    checkpoint = train_model(training.clips, config, shape, state_path=state_path)
    save_checkpoint(checkpoint, options.output)
    state_path.unlink()
    print(f"wrote {options.output}")
    if test is not None:
        print(f"test on the {len(test)} clips held out, noise 0.5:\n")
        print_scores(test, [Cleaner(checkpoint)], noise="angular:0.5", seed=options.seed, repeats=5)


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
