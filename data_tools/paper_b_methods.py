"""The methods that are compared for paper B, by name: ours, the paper's and their opponents."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import numpy as np
import torch
from numpy.typing import ArrayLike

from data_tools.paper_b_models import RECIPES, Clips, fusion_clips
from mocaplab.cleaning import Cleaner
from mocaplab.euler import make_continuous
from mocaplab.motion import FloatArray, Motion
from mocaplab.poses import motion_to_quaternions
from mocaplab.rotation_channels import rotations_to_channels
from mocaplab.two_sources.baselines import (
    gated_gaussian_mean,
    gaussian_mean,
    mean_of_sources,
    steadier_frames,
    steadier_source,
    tune_width,
)
from mocaplab.two_sources.model_files import SourceModel, load_source_model, shipped_source_model
from mocaplab.two_sources.noise import SourceNoise, two_sources
from mocaplab.two_sources.prediction_baselines import (
    constant_velocity,
    mean_pose_predictor,
    zero_velocity,
)
from mocaplab.two_sources.segments import SegmentClip, mean_pose

Fusion = Callable[[FloatArray, FloatArray], FloatArray]

LEARNED = ("robust", "robust, no poses", "plain", "faithful")
"""The fusions that are ours or the paper's; all others are opponents."""
NOT_ASKED = "gated Gaussian mean"
"""An opponent that is stronger than those that the paper or its readers would name."""


IN_THE_PACKAGE = {"robust": "fusion", "plain": "two_sources", "prediction": "prediction"}
"""Models that come with the package, by their names here and there."""


def load_models(folder: Path | None) -> dict[str, SourceModel]:
    """Read the models that are in the folder; for others, those that come with the package."""
    models = {name: shipped_source_model(there) for name, there in IN_THE_PACKAGE.items()}
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
