"""What ``mocaplab corrupt`` does."""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from mocaplab.bvh import load_bvh, round_changes, save_bvh
from mocaplab.commands.option_types import add_output, add_seed
from mocaplab.corruption import corrupt, corruption_table, snr_db
from mocaplab.euler import motion_continuity
from mocaplab.files import check_writable
from mocaplab.measures.by_name import rms_moving_deg
from mocaplab.measures.movement import jitter
from mocaplab.motion import moving_channels
from mocaplab.noise.faults import hold_gaps
from mocaplab.noise.gaps import hidden_share, save_gaps

SUMMARY = "add noise or gaps to a clean BVH file, to have something to clean"
DETAILS = (
    "A RECIPE is NAME:AMOUNT, or several joined by +, such as angular:0.5+gaps:0.001.\n"
    "Without an amount it has the one below; a number alone is angular noise.\n\n"
    f"{corruption_table()}\n\n"
    "Where a sample is hidden, the file holds the value before it, and OUT.gaps.csv\n"
    "lists the gaps.\n\n"
    "examples:\n  mocaplab corrupt walk.bvh --noise 0.5 --seed 1 -o noisy.bvh\n"
    "  mocaplab corrupt walk.bvh --noise angular:0.1+joint_gaps -o holed.bvh"
)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what can be set."""
    parser.add_argument("file", metavar="IN.bvh", help="a clean file")
    add_output(parser, "OUT.bvh", "the noisy file")
    parser.add_argument(
        "--noise",
        default="angular:0.5",
        metavar="RECIPE",
        help="what is done to the file (default: %(default)s, which is 6 dB)",
    )
    add_seed(parser)


def run(options: argparse.Namespace) -> None:
    """Spoil a file, and say how much and where."""
    gaps_file = Path(options.output).with_suffix(".gaps.csv")
    check_writable(options.output)
    check_writable(gaps_file)
    motion = load_bvh(options.file)
    corrupted = corrupt(motion, options.noise, rng=np.random.default_rng(options.seed))
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
