"""What ``mocaplab fuse`` does."""

from __future__ import annotations

import argparse

from mocaplab.bvh import load_bvh, save_bvh
from mocaplab.commands.option_types import add_output
from mocaplab.files import check_writable

SUMMARY = "fuse two recordings of one movement into a better one"
DETAILS = (
    "Both files must have the same joints, channels and frame rate. They may have begun\n"
    "up to a second apart: the offset is found and printed. The result has the frames\n"
    "that both have, and the root's path of A.\n\n"
    "example:\n  mocaplab fuse one.bvh two.bvh -o fused.bvh"
)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what can be set."""
    parser.add_argument("first", metavar="A.bvh", help="a recording")
    parser.add_argument("second", metavar="B.bvh", help="another recording of the same movement")
    add_output(parser, "OUT.bvh", "the fused file")
    parser.add_argument(
        "--offset",
        type=float,
        metavar="SECONDS",
        help="how much later B shows the same moment (default: found by cross-correlation)",
    )
    parser.add_argument(
        "--model", metavar="MODEL", help="a fusion model (default: the shipped one)"
    )


def run(options: argparse.Namespace) -> None:
    """Fuse two recordings of one movement, and say how."""
    from mocaplab.fusion import Fuser

    check_writable(options.output)
    first, second = load_bvh(options.first), load_bvh(options.second)
    fused, report = Fuser(options.model).fuse(first, second, options.offset)
    save_bvh(fused.with_channels(fused.channels.round(6)), options.output)
    print(report)
    print(f"wrote     {options.output}")
