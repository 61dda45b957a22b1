"""Compare the networks of paper B with opponents that learn nothing.

python -m data_tools.paper_b "$MOCAPLAB_DATA/cmu" --models FOLDER -o results

``FOLDER`` has the models that ``python -m data_tools.paper_b_models`` makes, ``plain.safetensors``
and so on. Without it, or for what it lacks, the networks in the package are taken; the others are
left out. Test clips are those that no network saw, the same ones for the same seed.
"""

from __future__ import annotations

import argparse
import csv
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import torch

from data_tools.paper_b_methods import (
    LEARNED,
    NOT_ASKED,
    Fusion,
    fusions,
    load_models,
)
from data_tools.paper_b_models import Clips, fusion_clips, split_clips
from data_tools.paper_b_scores import (
    PURE_SHARES,
    Row,
    compare_fusions,
    compare_predictions,
    failure,
)
from mocaplab.comparison.bootstrap import mean_intervals, paired_interval
from mocaplab.datasets import load_folder
from mocaplab.two_sources.noise import SourceNoise, two_sources
from mocaplab.two_sources.segments import moving_segments

PARTS = ("fusion", "failure", "prediction", "cost")
"""The experiments, in order."""


def print_fusions(rows: Sequence[Row], seed: int) -> None:
    """Print the table of all clips, the means with intervals, and the gain over opponents."""
    names = list(dict.fromkeys(str(row["method"]) for row in rows))
    clips = list(dict.fromkeys(str(row["clip"]) for row in rows))
    for column in ("all", "moving"):
        table = np.array([[_cell(rows, name, clip, column) for clip in clips] for name in names])
        intervals = mean_intervals(table, rng=np.random.default_rng([seed, 3]))
        print(f"L1 quaternion distance, segments: {column}; mean with 95 % interval; test clips")
        print(f"{'':26}{'mean':>7} {'95 %':>15}  {'  '.join(f'{c[-13:]:>13}' for c in clips)}")
        for name, values, interval in zip(names, table, intervals, strict=True):
            ends = f"{interval.low:.3f}-{interval.high:.3f}"
            cells = "  ".join(f"{v:13.3f}" for v in values)
            print(f"{name:26}{interval.value:7.3f} {ends:>15}  {cells}")
        rivals = [n for n in names if n not in (*LEARNED, NOT_ASKED)]
        best = min(rivals, key=lambda name: table[names.index(name)].mean())
        for ours in (name for name in LEARNED if name in names):
            for rival in (best, NOT_ASKED):
                ratio = paired_interval(
                    table[names.index(ours)],
                    table[names.index(rival)],
                    how="ratio",
                    rng=np.random.default_rng([seed, 4]),
                )
                low, high = (100 * (end - 1) for end in (ratio.low, ratio.high))
                print(
                    f"{ours} against {rival}: {100 * (ratio.value - 1):+.0f} % "
                    f"({low:+.0f} to {high:+.0f})"
                )
        print()


def _cell(rows: Sequence[Row], method: str, clip: str, column: str) -> float:
    (value,) = [r[column] for r in rows if r["method"] == method and r["clip"] == clip]
    return float(str(value))


def print_failure(rows: Sequence[Row]) -> None:
    """Print error and jitter of every fusion for every share of pure noise."""
    names = list(dict.fromkeys(str(row["method"]) for row in rows))
    for column, title, form in (
        ("l1", "L1 distance to the clean motion", ".3f"),
        ("jitter_cm_s3", "jitter (mean joint jerk), 1000 cm/s^3", ".1f"),
    ):
        scale = 1000 if column == "jitter_cm_s3" else 1
        print(f"Source A is clean, B goes to pure noise. {title}; mean over test clips")
        print(f"{'':26}{''.join(f'{share:9.0%}' for share in PURE_SHARES)}")
        for name in names:
            means = [
                np.mean([float(str(r[column])) for r in rows if (r["method"], r["share"]) == key])
                for key in ((name, share) for share in PURE_SHARES)
            ]
            print(f"{name:26}{''.join(f'{m / scale:9{form}}' for m in means)}")
        print()


def print_predictions(rows: Sequence[Row]) -> None:
    """Print the error of every prediction for every action, mean over clips."""
    names = list(dict.fromkeys(str(row["method"]) for row in rows))
    columns = [key for key in rows[0] if key.endswith(" ms")]
    for action in (*sorted({str(row["action"]) for row in rows}), None):
        chosen = [row for row in rows if action in (None, row["action"])]
        n_clips = len({str(row["clip"]) for row in chosen})
        print(f"Euler error (Eq. 2), radians, {action or 'all actions'}: {n_clips} clips")
        print(f"{'':22}{''.join(f'{c:>9}' for c in columns)}")
        for name in names:
            of_method = [row for row in chosen if row["method"] == name]
            means = [np.mean([float(str(row[c])) for row in of_method]) for c in columns]
            print(f"{name:22}{''.join(f'{m:9.3f}' for m in means)}")
        print()


def print_cost(found: dict[str, Fusion], clips: Clips) -> None:
    """Print how long every fusion takes for a frame of the longest test clip."""
    clip = max(fusion_clips(clips.test), key=lambda c: c.n_frames)
    a, b = two_sources(clip.quaternions, SourceNoise(), rng=np.random.default_rng(0))
    print(f"milliseconds a frame, one thread, {clip.n_frames} frames; best of 3")
    torch.set_num_threads(1)
    for name, fuse in found.items():
        times = []
        for _ in range(3):
            began = time.perf_counter()
            fuse(a, b)
            times.append(time.perf_counter() - began)
        print(f"{name:26}{1000 * min(times) / clip.n_frames:9.3f}")


def _write(rows: Sequence[Row], path: Path) -> None:
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, fieldnames=list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)


def main(arguments: Sequence[str] | None = None) -> int:
    """Print all tables and write their rows as CSV files."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", help="folder of clean .bvh files")
    parser.add_argument("--models", type=Path, help="folder of trained models")
    parser.add_argument("-o", "--output", type=Path, default=Path("paper_b"))
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", nargs="+", choices=PARTS, default=PARTS, help="some parts")
    options = parser.parse_args(arguments)
    try:
        clips = split_clips(load_folder(options.folder), options.seed)
        models = load_models(options.models)
        options.output.mkdir(parents=True, exist_ok=True)
    except (ValueError, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    if set(options.only) & {"fusion", "failure", "cost"}:
        found = fusions(models, clips, options.seed)
    if "fusion" in options.only:
        moving = moving_segments(fusion_clips(clips.train))
        rows = compare_fusions(found, clips, moving, options.seed)
        print_fusions(rows, options.seed)
        _write(rows, options.output / "fusion.csv")
    if "failure" in options.only:
        rows = failure(found, clips, options.seed)
        print_failure(rows)
        _write(rows, options.output / "failure.csv")
    if "prediction" in options.only:
        rows = compare_predictions(models, clips)
        print_predictions(rows)
        _write(rows, options.output / "prediction.csv")
    if "cost" in options.only:
        print_cost(found, clips)
    return 0


if __name__ == "__main__":
    sys.exit(main())
