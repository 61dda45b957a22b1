"""Count the jumps of Euler angles in BVH files, before and after they are made continuous.

A jump is a step of over 90 degrees from one frame to the next in some channel of a joint.
Three numbers are printed for each file with jumps: how many steps of a joint jump as the
file has it, how many after :func:`mocaplab.euler.make_continuous`, and how many of these
some other choice of triple and full turns would have removed, tried one by one. The last
must be 0, and positions must stay: then what is left is in the data, not in the angles.

    python -m data_tools.count_jumps FOLDER
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import astuple, dataclass
from itertools import product
from pathlib import Path

import numpy as np

from mocaplab.bvh import load_bvh
from mocaplab.euler import (
    JUMP_DEG,
    alternate_euler,
    channels_of_order,
    make_continuous,
    wrap_degrees,
)
from mocaplab.kinematics import forward_kinematics
from mocaplab.motion import FloatArray, Motion


@dataclass(frozen=True)
class Jumps:
    """The steps of joints, from frame to frame, that jump."""

    before: int  # as the file has it
    after: int  # once continuous
    removable: int  # of those after, the ones that other angles for the same pose remove
    shift: float  # the largest change of any joint's position, file length units


def count_jumps(motion: Motion) -> Jumps:
    """Count the jumps of a motion before and after it is made continuous."""
    continuous = make_continuous(motion)
    before = after = removable = 0
    for order, (_, columns) in channels_of_order(motion.skeleton).items():
        steps = np.diff(motion.channels[:, columns], axis=0)
        before += int((_largest(steps) > JUMP_DEG).sum())
        angles = continuous.channels[:, columns]
        left = _largest(np.diff(angles, axis=0)) > JUMP_DEG
        after += int(left.sum())
        smallest = smallest_step(angles[:-1][left], angles[1:][left], order)
        removable += int((smallest <= JUMP_DEG).sum())
    positions = (forward_kinematics(m)[0] for m in (motion, continuous))
    shift = float(np.abs(np.subtract(*positions)).max())
    return Jumps(before, after, removable, shift)


def smallest_step(start: FloatArray, end: FloatArray, order: str) -> FloatArray:
    """Try every way to write the second of two poses, and return the smallest step.

    How the first pose is written does not matter: changing its triple mirrors and shifts
    all ways to write the second alike.

    Parameters
    ----------
    start, end : array, shape (N, n), degrees, one angle a letter of the order

    Returns
    -------
    array, shape (N,), degrees: the largest change of an angle, of the best way
    """
    triples = [end, alternate_euler(end, order)] if len(order) == 3 else [end]
    best = np.full(len(start), np.inf)
    for triple in triples:
        step = wrap_degrees(triple - start)
        for turns in product((-360.0, 0.0, 360.0), repeat=len(order)):
            best = np.minimum(best, _largest(step + np.array(turns)))
    return best


def _largest(steps: FloatArray) -> FloatArray:
    return np.asarray(np.abs(steps).max(axis=-1))


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the counts of every BVH file in a folder and below; 1 if any could be better."""
    parser = argparse.ArgumentParser(
        prog="python -m data_tools.count_jumps", description=(__doc__ or "").splitlines()[0]
    )
    parser.add_argument("folder", type=Path, help="a folder of BVH files; folders below count too")
    folder = parser.parse_args(arguments).folder
    if not folder.is_dir():
        parser.error(f"{folder} is not a folder")
    paths = sorted(path for path in folder.rglob("*.bvh") if path.is_file())
    try:
        rows = [(path, count_jumps(load_bvh(path))) for path in paths]
    except (ValueError, OSError) as error:
        parser.error(str(error))
    print(f"{'file':32}{'before':>8}{'after':>8}{'removable':>11}  position change")
    for path, jumps in rows:
        if jumps.before:
            _print_row(str(path.relative_to(folder)), jumps)
    counts = [astuple(jumps) for _, jumps in rows]
    before, after, removable, _ = np.sum(counts, axis=0, dtype=int) if rows else (0, 0, 0, 0)
    shift = max((jumps.shift for _, jumps in rows), default=0.0)
    _print_row(f"all {len(rows)} files", Jumps(before, after, removable, shift))
    return int(removable > 0)


def _print_row(name: str, jumps: Jumps) -> None:
    counts = f"{jumps.before:8}{jumps.after:8}{jumps.removable:11}"
    print(f"{name:32}{counts}  {jumps.shift:.1e}")


if __name__ == "__main__":
    sys.exit(main())
