"""Compare the networks of paper B with opponents that learn nothing.

python -m data_tools.paper_b "$MOCAPLAB_DATA/cmu" --models FOLDER -o results

``FOLDER`` has the models that ``python -m data_tools.paper_b_models`` makes, ``plain.safetensors``
and so on; the robust network is the one in the package, unless it is there too. What has no file
is left out. Test clips are those that no network saw, the same ones for the same seed.
"""

from __future__ import annotations

import argparse
import csv
import sys
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import numpy as np
import torch
from numpy.typing import ArrayLike

from data_tools.paper_b_models import (
    RECIPES,
    Clips,
    fusion_clips,
    prediction_clips,
    split_clips,
)
from mocaplab.bootstrap import mean_intervals, paired_interval
from mocaplab.cleaning import Cleaner
from mocaplab.datasets import load_folder
from mocaplab.euler import make_continuous
from mocaplab.fusion import rotations_to_channels, shipped_fusion
from mocaplab.fusion_baselines import (
    gated_gaussian_mean,
    gaussian_mean,
    mean_of_sources,
    quaternion_distance,
    steadier_frames,
    steadier_source,
    tune_width,
)
from mocaplab.motion import BoolArray, FloatArray, Motion
from mocaplab.movement import jitter
from mocaplab.poses import motion_to_quaternions
from mocaplab.prediction_baselines import (
    constant_velocity,
    horizon_frames,
    mean_pose_predictor,
    prediction_error_rad,
    zero_velocity,
)
from mocaplab.segments import SegmentClip, all_windows, mean_pose, moving_segments
from mocaplab.source_batches import towards_pure_noise
from mocaplab.source_models import SourceModel, load_source_model
from mocaplab.source_noise import SourceNoise, two_sources
from mocaplab.units import cm_per_unit

Fusion = Callable[[FloatArray, FloatArray], FloatArray]
Row = dict[str, object]

REPEATS = 5
"""Draws of noise for each test clip."""
PURE_SHARES = (0.0, 0.1, 0.2, 0.4, 0.6, 0.8, 1.0)
"""How much of the second source is pure noise, in the failure experiment."""
LEARNED = ("robust", "robust, no poses", "plain", "faithful")
"""The fusions that are ours or the paper's; all others are opponents."""
NOT_ASKED = "gated Gaussian mean"
"""An opponent that is stronger than those that the paper or its readers would name."""


def load_models(folder: Path | None) -> dict[str, SourceModel]:
    """Read the models that are there; the robust one is also in the package."""
    models = {"robust": shipped_fusion()} if not folder or not has(folder, "robust") else {}
    for name in RECIPES:
        if folder and has(folder, name):
            models[name] = load_source_model(folder / f"{name}.safetensors")
    return models


def has(folder: Path, name: str) -> bool:
    """Tell whether a folder has a model of this name."""
    return (folder / f"{name}.safetensors").is_file()


def network_fusion(model: SourceModel, poses: bool = True) -> Fusion:
    """Make a fusion of two arrays, shape (T, J, 4), out of a trained network."""
    network, frame_time = model.network, model.frame_time

    def fuse(a: FloatArray, b: FloatArray) -> FloatArray:
        p, q = (torch.tensor(x, dtype=torch.float32)[None] for x in (a, b))
        with torch.no_grad():
            if poses:
                fused = network(p, q, frame_time)
            else:
                trust, sigma_s, _ = network.judge_sources(p, q)  # type: ignore[operator]
                fused = network.blend(p, q, trust, sigma_s / frame_time)  # type: ignore[operator]
        result: FloatArray = fused[0].double().numpy()
        return result

    return fuse


def fusions(models: dict[str, SourceModel], clips: Clips, seed: int) -> dict[str, Fusion]:
    """Return all fusions by name; widths are tuned on training clips."""
    train = fusion_clips(clips.train)
    frame_time = train[0].frame_time
    rng = np.random.default_rng([seed, 1])
    pairs = [
        (*two_sources(c.quaternions, SourceNoise(), rng=rng), c.quaternions) for c in train[::4]
    ]
    width, gated = (tune_width(pairs, frame_time, gated=gated) for gated in (False, True))
    print(f"Gaussian widths tuned on training clips: {width:g} s; with gate {gated:g} s\n")
    found: dict[str, Fusion] = {
        "source A": lambda a, b: a,
        "source B": lambda a, b: b,
        "mean": mean_of_sources,
        "steadier source": steadier_source,
        "steadier, frame by frame": steadier_frames,
        "Gaussian mean": partial(gaussian_mean, sigma_s=width, frame_time=frame_time),
        NOT_ASKED: partial(gated_gaussian_mean, sigma_s=gated, frame_time=frame_time),
    }
    for name in ("faithful", "plain", "robust"):
        if name in models:
            found[name] = network_fusion(models[name])
    if "robust" in models:
        found["robust, no poses"] = network_fusion(models["robust"], poses=False)
    return found


def with_segments(clean: Motion, quaternions: FloatArray, segments: Sequence[str]) -> Motion:
    """Put rotations of segments into a motion; the other joints stay as they are."""
    skeleton = clean.skeleton
    joints = [skeleton.joint_names.index(name) for name in segments]
    whole = motion_to_quaternions(clean)
    whole[:, joints] = quaternions / np.linalg.norm(quaternions, axis=-1, keepdims=True)
    written = np.isin(skeleton.channel_joint, joints) & skeleton.is_rotation
    channels = np.where(written, rotations_to_channels(whole, skeleton), clean.channels)
    return make_continuous(clean.with_channels(channels))


def ebf_on_mean(clean: Motion, clip: SegmentClip, cleaner: Cleaner) -> Fusion:
    """Clean the mean of the two sources with the EBF of paper A."""

    def fuse(a: FloatArray, b: FloatArray) -> FloatArray:
        noisy = with_segments(clean, mean_of_sources(a, b), clip.segments)
        joints = [clean.skeleton.joint_names.index(name) for name in clip.segments]
        return motion_to_quaternions(cleaner.clean(noisy))[:, joints]

    return fuse


def compare_fusions(
    found: dict[str, Fusion], clips: Clips, moving: BoolArray, seed: int
) -> list[Row]:
    """Measure the L1 distance of every fusion on every test clip, mean over draws of noise."""
    cleaner, rows = Cleaner(), []
    for index, (motion, clip) in enumerate(
        zip(clips.test.clips, fusion_clips(clips.test), strict=True)
    ):
        methods = {**found, "EBF on the mean": ebf_on_mean(motion, clip, cleaner)}
        rng = np.random.default_rng([seed, 2, index])
        draws = [two_sources(clip.quaternions, SourceNoise(), rng=rng) for _ in range(REPEATS)]
        for name, fuse in methods.items():
            errors = [quaternion_distance(fuse(*pair), clip.quaternions) for pair in draws]
            each = np.mean([error.mean(axis=0) for error in errors], axis=0)  # (J,)
            row: Row = {"clip": clip.name, "action": clip.action, "method": name}
            rows.append({**row, "all": each.sum(), "moving": each[moving].sum()})
    return rows


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


def failure(found: dict[str, Fusion], clips: Clips, seed: int) -> list[Row]:
    """Fuse a clean source with one that goes from clean to pure noise."""
    rows: list[Row] = []
    for index, (motion, clip) in enumerate(
        zip(clips.test.clips, fusion_clips(clips.test), strict=True)
    ):
        scale = cm_per_unit(motion.skeleton)
        clean = clip.quaternions
        for share in PURE_SHARES:
            rng = np.random.default_rng([seed, 5, index, round(100 * share)])
            noisy = towards_pure_noise(clean, share, rng=rng)
            for name, fuse in found.items():
                fused = fuse(clean, noisy)
                moved = with_segments(motion, fused, clip.segments)
                row: Row = {"clip": clip.name, "share": share, "method": name}
                error = quaternion_distance(fused, clean).sum(axis=-1).mean()
                rows.append({**row, "l1": error, "jitter_cm_s3": jitter(moved) * scale})
    return rows


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


def predictors(
    models: dict[str, SourceModel], train: Sequence[SegmentClip]
) -> dict[str, Callable[[ArrayLike, int], FloatArray]]:
    """Return the predictions by name."""
    found = {
        "zero velocity": zero_velocity,
        "constant velocity": constant_velocity,
        "mean pose": mean_pose_predictor(mean_pose(train)),
    }
    for name in ("faithful_prediction", "prediction"):
        if name in models:
            found[name] = partial(_predict, models[name])
    return found


def _predict(model: SourceModel, past: ArrayLike, n_future: int) -> FloatArray:
    with torch.no_grad():
        said = model.network(torch.tensor(past, dtype=torch.float32), n_future)
    q: FloatArray = said.double().numpy()
    unit: FloatArray = q / np.linalg.norm(q, axis=-1, keepdims=True)
    return unit


def compare_predictions(models: dict[str, SourceModel], clips: Clips) -> list[Row]:
    """Measure predictions on all windows of the test and validation clips that are long enough."""
    n_past, n_future, rows = 50, 10, []
    test = prediction_clips(clips.test)
    frames = horizon_frames(1 / test[0].frame_time)
    for name, predict in predictors(models, prediction_clips(clips.train)).items():
        for clip in test:
            windows = all_windows(clip.quaternions, n_past + n_future)
            if not len(windows):
                continue
            past, future = windows[:, :n_past].copy(), windows[:, n_past:]
            error = prediction_error_rad(predict(past, n_future), future, "ZYX")  # (N, 10)
            row: Row = {"clip": clip.name, "action": clip.action, "method": name}
            row["windows"] = len(windows)
            rows.append({**row, **{f"{ms} ms": error[:, f].mean() for ms, f in frames.items()}})
    return rows


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
    options = parser.parse_args(arguments)
    try:
        clips = split_clips(load_folder(options.folder), options.seed)
        models = load_models(options.models)
        options.output.mkdir(parents=True, exist_ok=True)
    except (ValueError, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    found = fusions(models, clips, options.seed)
    moving = moving_segments(fusion_clips(clips.train))
    rows = compare_fusions(found, clips, moving, options.seed)
    print_fusions(rows, options.seed)
    _write(rows, options.output / "fusion.csv")
    rows = failure(found, clips, options.seed)
    print_failure(rows)
    _write(rows, options.output / "failure.csv")
    rows = compare_predictions(models, clips)
    print_predictions(rows)
    _write(rows, options.output / "prediction.csv")
    print_cost(found, clips)
    return 0


if __name__ == "__main__":
    sys.exit(main())
