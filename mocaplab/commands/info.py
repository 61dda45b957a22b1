"""What ``mocaplab info`` does."""

from __future__ import annotations

import argparse

from mocaplab.bvh import load_bvh
from mocaplab.doctor import diagnose
from mocaplab.findings import summarize
from mocaplab.measures.movement import jitter
from mocaplab.motion import moving_channels

SUMMARY = "tell what is in a BVH file"
DETAILS = "example:\n  mocaplab info walk.bvh"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what can be set."""
    parser.add_argument("file", metavar="FILE.bvh")


def run(options: argparse.Namespace) -> None:
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
