"""mocaplab: learn how motion capture is cleaned, and clean BVH files.

The names below are loaded when first used: importing the package takes neither
torch nor matplotlib with it.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

__version__ = "0.1.0"

_HOME = {
    "Skeleton": "motion",
    "Motion": "motion",
    "Corrupted": "motion",
    "BVHError": "bvh",
    "load_bvh": "bvh",
    "save_bvh": "bvh",
    "forward_kinematics": "kinematics",
    "load_dataset": "datasets",
    "Cleaner": "cleaning",
}

__all__ = ["__version__", *_HOME]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'mocaplab' has no attribute {name!r}")
    return getattr(import_module(f"mocaplab.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
