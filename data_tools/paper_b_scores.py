"""What is measured for paper B: rows of numbers, one for each clip and method."""

from __future__ import annotations

import numpy as np

from data_tools.paper_b_methods import Fusion, ebf_on_mean, predictors, with_segments
from data_tools.paper_b_models import Clips, fusion_clips, prediction_clips
from mocaplab.cleaning import Cleaner
from mocaplab.measures.movement import jitter
from mocaplab.motion import BoolArray
from mocaplab.skeletons.units import cm_per_unit
from mocaplab.two_sources.baselines import quaternion_distance
from mocaplab.two_sources.batches import towards_pure_noise
from mocaplab.two_sources.model_files import SourceModel
from mocaplab.two_sources.noise import SourceNoise, two_sources
from mocaplab.two_sources.prediction_baselines import horizon_frames, prediction_error_rad
from mocaplab.two_sources.segments import all_windows

Row = dict[str, object]

REPEATS = 5
"""Draws of noise for each test clip."""
PURE_SHARES = (0.0, 0.1, 0.2, 0.4, 0.6, 0.8, 1.0)
"""How much of the second source is pure noise, in the failure experiment."""


def compare_fusions(
    found: dict[str, Fusion], clips: Clips, moving: BoolArray, seed: int
) -> list[Row]:
    """Measure the L1 distance of every fusion on every test clip, mean over draws of noise."""
    cleaner, rows = Cleaner("ebf"), []
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


def compare_predictions(models: dict[str, SourceModel], clips: Clips) -> list[Row]:
    """Measure predictions on all windows of the test clips that are long enough."""
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
