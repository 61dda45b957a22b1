"""Save and load trained models: tensors and JSON, nothing that can be executed.

A model file is a safetensors file. Its header holds one JSON text with all that is
not a tensor.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import asdict, dataclass
from functools import partial
from importlib.resources import as_file, files
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save

from mocaplab.files import write_atomically
from mocaplab.layers import Network
from mocaplab.motion import BoolArray, FloatArray, Skeleton
from mocaplab.networks import NETWORKS, build_network

FORMAT = "mocaplab-network-1"
SHIPPED = ("ebf", "blend")
"""The models that come with the package, trained on CMU clips of 31 joints."""

AnyNetwork = TypeVar("AnyNetwork", bound=torch.nn.Module)


class CheckpointError(ValueError):
    """A model file that cannot be used; the message says why."""


@dataclass(frozen=True, eq=False)
class Checkpoint:
    """A trained network and all that it takes to use it.

    Parameters
    ----------
    model : a network of :mod:`mocaplab.networks`
    constant : array, shape (C,), bool
        Channels that never moved in training; the network knows nothing of them.
    channel_labels : tuple of C str
        The channels of the whole file, such as ``"LeftLeg.Xrotation"``.
    frame_time : float, seconds
    gaussian_s : float, seconds
        The single Gaussian width tuned on the training clips, the honest opponent.
    gaussian_per_channel_s : array, shape (C,), seconds
    info : dict
        How it was trained: settings, seed, clips, losses.

    Raises
    ------
    ValueError
        If shapes, types or values do not fit together.
    """

    model: Network
    constant: BoolArray
    channel_labels: tuple[str, ...]
    frame_time: float
    gaussian_s: float
    gaussian_per_channel_s: FloatArray
    info: dict[str, Any]

    def __post_init__(self) -> None:
        n = len(self.channel_labels)
        if len(set(self.channel_labels)) != n or not all(
            isinstance(label, str) for label in self.channel_labels
        ):
            raise ValueError("channel labels must be different texts")
        if self.constant.shape != (n,) or self.constant.dtype != np.bool_:
            raise ValueError(f"constant must be {n} times true or false")
        widths = self.gaussian_per_channel_s
        if widths.shape != (n,) or not (np.isfinite(widths) & (widths >= 0)).all():
            raise ValueError(f"gaussian_per_channel_s must be {n} numbers of 0 or more")
        if not 0 < self.frame_time < np.inf:
            raise ValueError(f"frame_time must be above 0, got {self.frame_time}")
        if not 0 <= self.gaussian_s < np.inf:
            raise ValueError(f"gaussian_s must be 0 or more, got {self.gaussian_s}")
        if not all(torch.isfinite(value).all() for value in self.model.parameters()):
            raise ValueError("a weight is not finite")
        if not isinstance(self.trained_on, dict):
            raise ValueError("the list of training clips is not one")

    @property
    def trained_on(self) -> dict[str, str]:
        """The clips that the model has seen: name -> digest."""
        clips: dict[str, str] = self.info["train"]["clips"]
        return clips

    def columns(self, skeleton: Skeleton) -> BoolArray:
        """Tell which channels of a skeleton the network sees, shape (C,)."""
        return skeleton.is_cleaned & ~self.constant

    def require(self, skeleton: Skeleton, frame_time: float, name: str) -> None:
        """Refuse a motion that this model was not trained for.

        Raises
        ------
        ValueError
            If channels or frame rate differ; the message says how to train a model.
        """
        if skeleton.channel_labels != self.channel_labels:
            ours, theirs = set(self.channel_labels), set(skeleton.channel_labels)
            unknown = sorted({label.split(".")[0] for label in theirs - ours})
            detail = f"; it does not know {', '.join(unknown[:4])}" if unknown else ""
            raise ValueError(
                f"{name}: the model was trained for another skeleton "
                f"({len(self.channel_labels)} channels; this file has {len(theirs)}){detail}. "
                f"Train one for yours with: mocaplab train FOLDER_OF_CLEAN_BVH -o model.safetensors"
            )
        n_seen = int(self.columns(skeleton).sum())
        if n_seen != self.model.config.n_channels:
            raise CheckpointError(
                f"the model file is damaged: its network sees {self.model.config.n_channels} "
                f"channels, but {n_seen} moved in training"
            )
        if abs(frame_time / self.frame_time - 1) > 0.01:
            raise ValueError(
                f"{name}: the model was trained at {1 / self.frame_time:.4g} frames per second, "
                f"this file has {1 / frame_time:.4g}. Resample it, or train a model on files of "
                f"its rate with: mocaplab train FOLDER_OF_CLEAN_BVH -o model.safetensors"
            )


def save_checkpoint(checkpoint: Checkpoint, path: str | os.PathLike[str]) -> None:
    """Write a model file; an older file of that name is replaced in one step."""
    tensors = {f"model.{k}": v.contiguous() for k, v in checkpoint.model.state_dict().items()}
    tensors["constant"] = torch.from_numpy(checkpoint.constant)
    tensors["gaussian_per_channel_s"] = torch.from_numpy(checkpoint.gaussian_per_channel_s)
    header = {
        "format": FORMAT,
        "network": type(checkpoint.model).__name__,
        "config": asdict(checkpoint.model.config),
        "channel_labels": checkpoint.channel_labels,
        "frame_time": checkpoint.frame_time,
        "gaussian_s": checkpoint.gaussian_s,
        "info": checkpoint.info,
    }
    write_atomically(path, save(tensors, {"mocaplab": json.dumps(header)}))


def load_checkpoint(path: str | os.PathLike[str]) -> Checkpoint:
    """Read a model file. Nothing in it is executed.

    Raises
    ------
    CheckpointError
        If it is not a model file of this version.
    OSError
        If it cannot be read.
    """
    tensors, header = read_tensors(path)
    if header.get("format") != FORMAT:
        raise CheckpointError(f"{path}: expected format {FORMAT}, got {header.get('format')}")
    with refuse_damage(path):
        config = NETWORKS[header["network"]][1](**header["config"])
        return Checkpoint(
            model=with_weights(partial(build_network, config, seed=0), tensors),
            constant=tensors["constant"].numpy(),
            channel_labels=tuple(header["channel_labels"]),
            frame_time=float(header["frame_time"]),
            gaussian_s=float(header["gaussian_s"]),
            gaussian_per_channel_s=np.asarray(tensors["gaussian_per_channel_s"]),
            info=header["info"],
        )


def shipped_file(name: str) -> AbstractContextManager[Path]:
    """Give the path of a model that comes with the package, in a with-block."""
    return as_file(files("mocaplab") / "data" / f"{name}.safetensors")


def shipped_checkpoint(name: str) -> Checkpoint:
    """Load a model that comes with the package; ``name`` is one of ``SHIPPED``."""
    with shipped_file(name) as path:
        return load_checkpoint(path)


def with_weights(
    build: Callable[[], AnyNetwork], tensors: Mapping[str, torch.Tensor]
) -> AnyNetwork:
    """Build a network and give it the weights of a model file, whose names begin with "model.".

    Raises
    ------
    ValueError
        If they are not the weights of this network.
    """
    weights = tensors_under(tensors, "model.")
    with torch.device("meta"):  # takes no memory, whatever sizes the header claims
        expected = build().state_dict()
    if {k: v.shape for k, v in weights.items()} != {k: v.shape for k, v in expected.items()}:
        raise ValueError("the weights do not fit the configuration")
    network = build()
    network.load_state_dict(weights)
    return network.eval()


@contextmanager
def refuse_damage(path: str | os.PathLike[str]) -> Iterator[None]:
    """Turn whatever a damaged file leads to into a CheckpointError that names the file."""
    try:
        yield
    except (KeyError, TypeError, ValueError, ArithmeticError, AttributeError, RuntimeError) as e:
        reason = str(e).splitlines()[0] if str(e) else type(e).__name__
        raise CheckpointError(f"{path}: the file is damaged ({reason})") from e


def read_tensors(path: str | os.PathLike[str]) -> tuple[dict[str, torch.Tensor], dict[str, Any]]:
    """Read the tensors and the JSON header of one of our safetensors files.

    Raises
    ------
    CheckpointError
        If it is another kind of file.
    OSError
        If it cannot be read.
    """
    if not Path(path).is_file():
        raise FileNotFoundError(f"{path}: no such model file")
    try:
        with safe_open(str(path), framework="pt") as file:
            header = json.loads((file.metadata() or {})["mocaplab"])
            if not isinstance(header, dict):
                raise ValueError("its header is not a dictionary")
            return {name: file.get_tensor(name) for name in file.keys()}, header  # noqa: SIM118
    except (SafetensorError, KeyError, ValueError, RecursionError) as error:
        raise CheckpointError(f"{path}: not a model file of mocaplab ({error})") from error


def tensors_under(tensors: Mapping[str, torch.Tensor], prefix: str) -> dict[str, torch.Tensor]:
    """Pick the tensors whose names begin with a prefix, and drop the prefix."""
    return {k[len(prefix) :]: v for k, v in tensors.items() if k.startswith(prefix)}
