"""Save and load fitted gap fillers: arrays and JSON, nothing that can be executed.

A file is a safetensors file. Its header holds one JSON text with all that is no array. The
covariance is symmetric, so only half of it is kept, in single precision.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from importlib.resources import as_file, files
from pathlib import Path
from typing import Any

import numpy as np
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save

from mocaplab.files import FormatError, write_atomically
from mocaplab.gap_fillers.conditional_gaussian import N_COSINES, ROOT
from mocaplab.gap_fillers.gaussian import GaussianFiller
from mocaplab.gap_fillers.kriging import WIDTHS_S, Smoothness

FORMAT = "mocaplab-gaps-1"


def shipped_filler() -> GaussianFiller:
    """Load the gap filler that comes with the package, fitted to CMU clips of 31 joints."""
    with as_file(files("mocaplab") / "data" / "gaps.safetensors") as path:
        return load_filler(path)


def save_filler(filler: GaussianFiller, path: str | os.PathLike[str]) -> None:
    """Write a gap filler to a file; an older file of that name is replaced in one step."""
    size = len(filler.covariance) * N_COSINES
    half = filler.covariance.reshape(size, size)[np.tril_indices(size)]
    header = {
        "format": FORMAT,
        "channel_labels": filler.channel_labels,
        "caution": filler.caution,
        "trained_on": filler.trained_on,
    }
    arrays: dict[str, np.ndarray] = {
        "covariance": half.astype(np.float32),
        "of_errors": filler.of_errors.shares,
        "of_angles": filler.of_angles.shares,
    }
    write_atomically(path, save(arrays, {"mocaplab": json.dumps(header)}))


def load_filler(path: str | os.PathLike[str]) -> GaussianFiller:
    """Read a gap filler. Nothing in the file is executed.

    Raises
    ------
    FormatError
        If it is another kind of file, or damaged.
    OSError
        If it cannot be read.
    """
    if not Path(path).is_file():
        raise FileNotFoundError(f"{path}: no such file")
    try:
        with safe_open(str(path), framework="np") as file:
            header = json.loads((file.metadata() or {})["mocaplab"])
            arrays = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
        return _filler(header, arrays)
    except (SafetensorError, KeyError, TypeError, ValueError, RecursionError) as error:
        raise FormatError(path, None, "a gap filler of mocaplab", str(error)) from error


def _filler(header: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> GaussianFiller:
    if header["format"] != FORMAT:
        raise ValueError(f"format {header['format']!r}")
    labels = tuple(str(label) for label in header["channel_labels"])
    n = len(labels) + ROOT
    size = n * N_COSINES
    shapes = {"covariance": (size * (size + 1) // 2,), "of_errors": WIDTHS_S.shape}
    for name, shape in {**shapes, "of_angles": WIDTHS_S.shape}.items():
        if arrays[name].shape != shape or not np.isfinite(arrays[name]).all():
            raise ValueError(f"{name} is not {shape} numbers")
    caution = float(header["caution"])
    if not 0 < caution < np.inf:
        raise ValueError(f"caution {caution}")
    covariance = np.zeros((size, size))
    covariance[np.tril_indices(size)] = arrays["covariance"]
    covariance += np.tril(covariance, -1).T
    return GaussianFiller(
        channel_labels=labels,
        covariance=covariance.reshape(n, N_COSINES, n, N_COSINES),
        of_errors=Smoothness(arrays["of_errors"].astype(np.float64)),
        of_angles=Smoothness(arrays["of_angles"].astype(np.float64)),
        caution=caution,
        trained_on=dict(header["trained_on"]),
    )
