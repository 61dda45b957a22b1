"""Train the networks of paper B on a folder of clean clips.

python -m data_tools.paper_b_models "$MOCAPLAB_DATA/cmu" -o mocaplab/data/fusion.safetensors

makes the fusion network that ships with the package, always the same on the same machine. With
``--network`` it makes one of the others, which the comparison (:mod:`data_tools.paper_b`) needs.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from torch import nn

from mocaplab.datasets import Dataset, load_folder, split_holdout
from mocaplab.files import check_writable
from mocaplab.two_sources.learning import SourceTrainConfig
from mocaplab.two_sources.model_files import SourceModel, save_source_model
from mocaplab.two_sources.networks import (
    PredictionConfig,
    PredictionLSTM,
    TwoSourceConfig,
    TwoSourceLSTM,
)
from mocaplab.two_sources.robust import RobustConfig, RobustFusion
from mocaplab.two_sources.segments import (
    SegmentClip,
    mean_pose,
    motion_to_segments,
    resample_segments,
    segment_names,
)
from mocaplab.two_sources.training import train_fusion, train_prediction

PREDICTION_FPS = 25.0
SHARE = 0.05
"""Of the clips of every action, for testing and again for validation; at least one clip."""

RECIPES: dict[str, dict[str, Any]] = {
    # For sources of all qualities and frame rates. Our own, so not bound to the paper's settings.
    "robust": {
        "epochs": 12,
        "steps": 40,
        "batch_size": 16,
        "learning_rate": 3e-3,
        "gradient_norm": 1.0,
        "varied": True,
        "strides": (1, 2, 4),
    },
    # Paper B's training, with fewer steps.
    "plain": {"epochs": 10, "steps": 60},
    "faithful": {"epochs": 10, "steps": 60, "invariant": False},
    "prediction": {"epochs": 10, "steps": 60},
    "faithful_prediction": {"epochs": 10, "steps": 60, "invariant": False},
}
"""How each network is trained. What is not said here is as in paper B."""


@dataclass(frozen=True)
class Clips:
    """The three parts of the clips (paper B: 90, 5 and 5 %), split by motion."""

    train: Dataset
    validation: Dataset
    test: Dataset


def split_clips(dataset: Dataset, seed: int = 0) -> Clips:
    """Split clips as in paper B, with every action in every part that has clips enough."""
    rest, test = split_holdout(dataset, SHARE, seed=seed)
    train, validation = split_holdout(rest, SHARE, seed=seed + 1)
    return Clips(train, validation, test)


def fusion_clips(dataset: Dataset) -> list[SegmentClip]:
    """Return the clips of a data set as quaternions of the chosen segments."""
    pairs = zip(dataset.clips, dataset.actions, strict=True)
    return [motion_to_segments(clip, action=action) for clip, action in pairs]


def prediction_clips(dataset: Dataset) -> list[SegmentClip]:
    """Return the clips at 25 frames per second, without the root.

    As is usual in prediction, which way somebody faces is not predicted.
    """
    names = segment_names(dataset.skeleton)[1:]
    pairs = zip(dataset.clips, dataset.actions, strict=True)
    clips = [motion_to_segments(clip, names, action) for clip, action in pairs]
    return [resample_segments(clip, PREDICTION_FPS) for clip in clips]


def train_model(
    name: str,
    clips: Clips,
    *,
    seed: int = 0,
    state_path: Path | None = None,
    progress: bool = True,
    n_hidden: int = 128,
    **changes: Any,
) -> SourceModel:
    """Train one of ``RECIPES``.

    Parameters
    ----------
    name : a name of ``RECIPES``
    clips : Clips
    seed : int, of first weights, windows and noise
    state_path, progress : see :func:`mocaplab.two_sources.training.train_fusion`
    n_hidden : int, LSTM units; 1000 in the paper. The robust network has its own sizes.
    changes : fields of SourceTrainConfig to set otherwise
    """
    config = SourceTrainConfig(**{**RECIPES[name], **changes, "seed": seed})
    predicts = name.endswith("prediction")
    prepare = prediction_clips if predicts else fusion_clips
    train, validation = prepare(clips.train), prepare(clips.validation)
    n, faithful = len(train[0].segments), name.startswith("faithful")
    options: dict[str, Any] = {"state_path": state_path, "progress": progress}
    network: nn.Module
    if predicts:
        # Clips of fewer than 60 frames teach nothing here, and are left out as in the paper.
        long = [clip for clip in validation if clip.n_frames >= config.n_frames]
        predictor = PredictionLSTM(PredictionConfig(n, n_hidden, faithful=faithful), seed=seed)
        state = train_prediction(predictor, train, config, validation=long, **options)
        network = predictor
    else:
        if name == "robust":
            network = RobustFusion(RobustConfig(n), seed=seed)
            poses = np.concatenate([clip.quaternions for clip in train])
            network.learn_poses(mean_pose(train), poses)
        else:
            network = TwoSourceLSTM(TwoSourceConfig(n, n_hidden, faithful=faithful), seed=seed)
        state = train_fusion(network, train, config, validation=validation, **options)
    info = {
        "recipe": name,
        "train": {**RECIPES[name], **changes, "seed": seed, "clips": [c.name for c in train]},
        "losses": state.losses,
        "validation_losses": state.validation_losses,
    }
    return SourceModel(network, train[0].segments, train[0].frame_time, info)


def main(arguments: Sequence[str] | None = None) -> int:
    """Train a network and write its file."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", help="folder of clean .bvh files")
    parser.add_argument("-o", "--output", required=True, type=Path, help="the model file")
    parser.add_argument("--network", choices=RECIPES, default="robust")
    parser.add_argument("--width", type=int, default=128, help="LSTM units; 1000 in the paper")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args(arguments)
    try:
        check_writable(options.output)
        clips = split_clips(load_folder(options.folder), options.seed)
        state_path = Path(f"{options.output}.part")
        began = time.perf_counter()
        model = train_model(
            options.network,
            clips,
            seed=options.seed,
            state_path=state_path,
            n_hidden=options.width,
        )
    except (ValueError, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    save_source_model(model, options.output)
    state_path.unlink()
    lowest = np.min(model.info["validation_losses"] or model.info["losses"])
    print(f"trained {(time.perf_counter() - began) / 60:.1f} minutes, loss {lowest:.3f}")
    print(f"wrote {options.output}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
