"""The corruptions of the benchmark by name, and the files that hold them."""

from __future__ import annotations

import hashlib
import io
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from mocaplab.corruption import corrupt
from mocaplab.motion import Corrupted, Motion

GAPS = {"gap_probability": 0.001, "gap_frames": 15.0}


@dataclass(frozen=True)
class Corruption:
    """One way to spoil a clip.

    Parameters
    ----------
    function : called as ``function(motion, **parameters, rng=rng)``, returns a Corrupted
    parameters : dict, as the manifest lists them
    """

    function: Callable[..., Corrupted]
    parameters: Mapping[str, float | str] = field(default_factory=dict)

    def __call__(self, motion: Motion, *, rng: np.random.Generator) -> Corrupted:
        """Spoil a clip."""
        return self.function(motion, **self.parameters, rng=rng)


CORRUPTIONS: dict[str, Corruption] = {
    "noise_0.1": Corruption(corrupt, {"k": 0.1}),
    "noise_0.5": Corruption(corrupt, {"k": 0.5}),
    "noise_0.9": Corruption(corrupt, {"k": 0.9}),
    "gaps": Corruption(corrupt, {"k": 0.0, **GAPS}),
    "noise_0.5_gaps": Corruption(corrupt, {"k": 0.5, **GAPS}),
}
"""All corruptions of the benchmark by name; a new one is one line."""


def draw_seed(seed: int, digest: str, corruption: str, repetition: int) -> list[int]:
    """Make the numbers that seed one file's random generator."""
    name = hashlib.sha256(f"{digest}/{corruption}".encode()).digest()
    return [seed, repetition, int.from_bytes(name[:8], "big")]


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
