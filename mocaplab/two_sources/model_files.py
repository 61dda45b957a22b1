"""Model files of the networks of paper B: tensors and JSON, nothing that can be executed."""

from __future__ import annotations

import json
import os
from dataclasses import asdict, dataclass
from functools import partial
from importlib.resources import as_file, files
from typing import Any

from safetensors.torch import save
from torch import nn

from mocaplab.checkpoints import CheckpointError, read_tensors, refuse_damage, with_weights
from mocaplab.files import write_atomically
from mocaplab.two_sources.networks import (
    PredictionConfig,
    PredictionLSTM,
    TwoSourceConfig,
    TwoSourceLSTM,
)
from mocaplab.two_sources.robust import RobustConfig, RobustFusion

FORMAT = "mocaplab-sources-1"

CONFIGS: dict[str, type] = {
    "TwoSourceLSTM": TwoSourceConfig,
    "PredictionLSTM": PredictionConfig,
    "RobustFusion": RobustConfig,
}
"""Each network of paper B by name, and the class of its configuration."""


@dataclass(frozen=True, eq=False)
class SourceModel:
    """A trained network of paper B and all that it takes to use it.

    Parameters
    ----------
    network : a network of :mod:`mocaplab.two_sources.networks` or
        :mod:`mocaplab.two_sources.robust`
    segments : tuple of J str, the joints that it was trained on, in its order
    frame_time : float, seconds, of the clips that it was trained on
    info : dict
        How it was trained: settings, seed, clips, losses.

    Raises
    ------
    ValueError
        If the number of segments is not that of the network.
    """

    network: nn.Module
    segments: tuple[str, ...]
    frame_time: float
    info: dict[str, Any]

    def __post_init__(self) -> None:
        config: Any = self.network.config
        if len(set(self.segments)) != config.n_joints:
            raise ValueError(f"expected {config.n_joints} different segments, got {self.segments}")
        if not 0 < self.frame_time < 10:
            raise ValueError(f"expected a frame time in seconds, got {self.frame_time}")


def build_source_network(config: Any, *, seed: int) -> nn.Module:
    """Make the network that a configuration describes, with fresh weights."""
    if isinstance(config, RobustConfig):
        return RobustFusion(config, seed=seed)
    if isinstance(config, PredictionConfig):
        return PredictionLSTM(config, seed=seed)
    if isinstance(config, TwoSourceConfig):
        return TwoSourceLSTM(config, seed=seed)
    raise TypeError(f"expected a configuration of paper B, got {type(config).__name__}")


def save_source_model(model: SourceModel, path: str | os.PathLike[str]) -> None:
    """Write a model file; an older file of that name is replaced in one step."""
    config: Any = model.network.config
    header = {
        "format": FORMAT,
        "network": type(model.network).__name__,
        "config": asdict(config),
        "segments": model.segments,
        "frame_time": model.frame_time,
        "info": model.info,
    }
    tensors = {k: v.contiguous() for k, v in model.network.state_dict().items()}
    tensors = {f"model.{k}": v for k, v in tensors.items()}
    write_atomically(path, save(tensors, {"mocaplab": json.dumps(header)}))


def load_source_model(path: str | os.PathLike[str]) -> SourceModel:
    """Read a model file. Nothing in it is executed.

    Raises
    ------
    CheckpointError
        If it is not a model file of this kind and version.
    OSError
        If it cannot be read.
    """
    tensors, header = read_tensors(path)
    if header.get("format") != FORMAT:
        raise CheckpointError(f"{path}: expected format {FORMAT}, got {header.get('format')}")
    with refuse_damage(path):
        config = CONFIGS[header["network"]](**header["config"])
        return SourceModel(
            network=with_weights(partial(build_source_network, config, seed=0), tensors),
            segments=tuple(header["segments"]),
            frame_time=float(header["frame_time"]),
            info=header["info"],
        )


SHIPPED = ("fusion", "two_sources", "prediction")
"""The models that come with the package: a RobustFusion, a TwoSourceLSTM, a PredictionLSTM."""


def shipped_source_model(name: str) -> SourceModel:
    """Load a model that comes with the package, trained on CMU clips; ``name`` is in SHIPPED."""
    if name not in SHIPPED:
        raise ValueError(f"the models of the package are {', '.join(SHIPPED)}, got {name!r}")
    with as_file(files("mocaplab") / "data" / f"{name}.safetensors") as path:
        return load_source_model(path)
