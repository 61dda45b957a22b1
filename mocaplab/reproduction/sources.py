"""Paper B's figures 4 and 5: a network that makes one motion of two noisy sources."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import torch

from mocaplab.datasets import Dataset
from mocaplab.motion import FloatArray
from mocaplab.reproduction.costs import SOURCE_STEPS
from mocaplab.reproduction.plan import Plan
from mocaplab.splits import Split
from mocaplab.two_sources.baselines import (
    gated_gaussian_mean,
    mean_of_sources,
    quaternion_distance,
    tune_width,
)
from mocaplab.two_sources.learning import SourceTrainConfig
from mocaplab.two_sources.model_files import SourceModel, load_source_model, save_source_model
from mocaplab.two_sources.networks import TwoSourceConfig, TwoSourceLSTM
from mocaplab.two_sources.noise import SourceNoise, two_sources
from mocaplab.two_sources.segments import SegmentClip, motion_to_segments
from mocaplab.two_sources.training import train_fusion

NETWORK, GATED = "network", "gated Gaussian mean"
Row = dict[str, Any]


def source_rows(dataset: Dataset, split: Split, plan: Plan, models: Path) -> list[Row]:
    """Train paper B's network on a holdout's clips, and measure what it makes of two sources.

    Beside it are the two sources, their mean, and a Gaussian tuned on the training clips that
    leaves out lost samples.

    Returns
    -------
    list of rows: clip, action, repetition, and the L1 quaternion distance of every method,
    summed over segments, mean over frames
    """
    train, test = (
        [motion_to_segments(dataset.clips[i], action=dataset.actions[i]) for i in part]
        for part in (split.train, split.test)
    )
    fuse = _network(train, plan, models)
    frame_time = train[0].frame_time
    rng = np.random.default_rng([plan.seed, 1])
    pairs = [
        (*two_sources(c.quaternions, SourceNoise(), rng=rng), c.quaternions) for c in train[::4]
    ]
    width = tune_width(pairs, frame_time, gated=True)
    gated = partial(gated_gaussian_mean, sigma_s=width, frame_time=frame_time)
    methods = {
        "input A": lambda a, b: a,
        "input B": lambda a, b: b,
        "mean": mean_of_sources,
        GATED: gated,
        NETWORK: fuse,
    }
    rows = []
    for number, clip in enumerate(test):
        rng = np.random.default_rng([plan.seed, 2, number])
        for repetition in range(plan.repetitions):
            a, b = two_sources(clip.quaternions, SourceNoise(), rng=rng)
            errors = {
                name: float(quaternion_distance(method(a, b), clip.quaternions).sum(-1).mean())
                for name, method in methods.items()
            }
            rows.append(
                {"clip": clip.name, "action": clip.action, "repetition": repetition} | errors
            )
    return rows


def _network(train: list[SegmentClip], plan: Plan, models: Path) -> Any:
    """Train the network, or load it if that was done before."""
    path = models / "two_sources-holdout_1.safetensors"
    if path.exists():
        model = load_source_model(path)
    else:
        n = len(train[0].segments)
        network = TwoSourceLSTM(TwoSourceConfig(n, plan.width), seed=plan.seed)
        config = SourceTrainConfig(epochs=plan.epochs, steps=SOURCE_STEPS, seed=plan.seed)
        state = path.with_suffix(".part")
        train_fusion(network, train, config, state_path=state, progress=False)
        model = SourceModel(network.cpu().eval(), train[0].segments, train[0].frame_time, {})
        save_source_model(model, path)
        state.unlink(missing_ok=True)

    def fuse(a: FloatArray, b: FloatArray) -> FloatArray:
        p, q = (torch.tensor(x, dtype=torch.float32)[None] for x in (a, b))
        with torch.no_grad():
            fused: FloatArray = model.network(p, q, model.frame_time)[0].double().numpy()
        return fused

    return fuse
