"""Which noise a clip gets: fixed by the seed and the clip, whatever else is computed.

Every method sees the same noise, and neither the order of the work nor the number of
machines changes it.
"""

from __future__ import annotations

import hashlib

import numpy as np

from mocaplab.corruption import corrupt
from mocaplab.datasets import clip_digest
from mocaplab.motion import Corrupted, Motion

TRAINING = "training"
"""Set before the recipe where a clip is trained on: that noise is never tested on."""

_KEPT: dict[tuple[object, ...], Corrupted] = {}
_KEPT_SAMPLES = 20_000_000  # of the clips in _KEPT together; some 340 MB


def draw_seed(seed: int, digest: str, corruption: str, repetition: int) -> list[int]:
    """Make the numbers that seed the random generator of one draw.

    Parameters
    ----------
    seed : int
    digest : str, see :func:`mocaplab.datasets.clip_digest`
    corruption : str, a name or a recipe
    repetition : int
    """
    name = hashlib.sha256(f"{digest}/{corruption}".encode()).digest()
    return [seed, repetition, int.from_bytes(name[:8], "big")]


def draw_test(clip: Motion, recipe: str, *, seed: int, repetition: int) -> Corrupted:
    """Corrupt a clip to test on; each repetition is another draw."""
    return _draw(clip, recipe, recipe, seed, repetition)


def draw_training(clip: Motion, recipe: str, *, seed: int) -> Corrupted:
    """Corrupt a clip to fit a method on."""
    return _draw(clip, recipe, f"{TRAINING}/{recipe}", seed, 0)


def _draw(clip: Motion, recipe: str, name: str, seed: int, repetition: int) -> Corrupted:
    """Corrupt a clip, or return what was drawn before: some noise is slow to make."""
    entropy = draw_seed(seed, clip_digest(clip), name, repetition)
    key = (clip.name, clip.frame_time, clip.skeleton.offsets.tobytes(), *entropy)
    if key not in _KEPT:
        if sum(kept.mask.size for kept in _KEPT.values()) > _KEPT_SAMPLES:
            _KEPT.clear()
        _KEPT[key] = corrupt(clip, recipe, rng=np.random.default_rng(entropy))
    return _KEPT[key]
