"""The corruptions of the benchmark by name, and the files that hold them."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np

from mocaplab.motion import Corrupted

RECIPES: dict[str, str] = {
    "noise_0.1": "angular:0.1",
    "noise_0.5": "angular:0.5",
    "noise_0.9": "angular:0.9",
    "gaps": "gaps:0.001",
    "noise_0.5_gaps": "angular:0.5+gaps:0.001",
}
"""All corruptions of the benchmark: a name, which is a folder's, and its recipe."""


def corrupted_to_bytes(corrupted: Corrupted, dtype: str) -> bytes:
    """Write what was observed, and where, as the bytes of an .npz file.

    They are not compressed: noise hardly shrinks, and other versions of the library that
    compresses give other bytes.
    """
    buffer = io.BytesIO()
    np.savez(buffer, observed=corrupted.observed.channels.astype(dtype), mask=corrupted.mask)
    return buffer.getvalue()


def read_file(path: Path) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    """Read one file of the benchmark.

    Returns
    -------
    observed : array, shape (T, C), degrees and file units, NaN in gaps
    mask : array, shape (T, C), bool, True = observed
    """
    with np.load(path, allow_pickle=False) as arrays:
        return arrays["observed"], arrays["mask"]
