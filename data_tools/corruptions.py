"""The corruptions of the benchmark by name, and the files that hold them."""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import Any

import numpy as np

from mocaplab.corruption import CORRUPTIONS
from mocaplab.motion import Corrupted

MANIFEST = "manifest.json"

AMOUNTS = {"angular": ("noise", (0.1, 0.5, 0.9)), "spatial": ("spatial", (0.1, 0.5, 1.0, 3.0))}
"""What paper A tests in several amounts: the benchmark's name for it, and the amounts."""

RECIPES: dict[str, str] = {
    **{
        f"{name}_{amount:g}": f"{kind}:{amount:g}"
        for kind, (name, amounts) in AMOUNTS.items()
        if kind in CORRUPTIONS
        for amount in amounts
    },
    **{
        name: f"{name}:{corruption.amount:g}"
        for name, corruption in CORRUPTIONS.items()
        if name not in AMOUNTS
    },
    "noise_0.5_gaps": "angular:0.5+gaps:0.001",
    "noise_0.5_long_gaps": "angular:0.5+long_gaps:1",
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


def read_manifest(folder: Path) -> dict[str, Any]:
    """Read the manifest of a benchmark.

    Raises
    ------
    ValueError
        If it is not one.
    """
    path = folder / MANIFEST
    try:
        manifest = json.loads(path.read_text(encoding="utf-8"))
    except ValueError:
        manifest = None
    files = manifest.get("files") if isinstance(manifest, dict) else None
    if not (
        isinstance(files, dict)
        and isinstance(manifest.get("clips"), dict)
        and all(isinstance(f, dict) and isinstance(f.get("sha256"), str) for f in files.values())
        and all(isinstance(c, dict) and "digest" in c for c in manifest["clips"].values())
    ):
        raise ValueError(f"{path}: expected the manifest of a benchmark, got something else")
    found: dict[str, Any] = manifest
    return found
