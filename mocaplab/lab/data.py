"""A scene of the lab, prepared for the browser."""

from __future__ import annotations

from typing import Any

import numpy as np

from mocaplab.corruption import CORRUPTIONS
from mocaplab.datasets import Dataset
from mocaplab.lab.gaussian import LOOK_AHEADS_S, WIDTHS_S
from mocaplab.lab.model import MAX_GAP_S, NOISES, Scene, max_amount

SCALE = 1e-4
"""Degrees, and milliseconds, in one step of what the browser gets; also in lab.js."""


def scene_signals(scene: Scene) -> list[np.ndarray]:
    """List clean, observed, EBF, Blend (degrees) and widths (ms) as whole steps, (T, N) each."""
    motions = (scene.corrupted.clean, scene.filled, scene.cleaned["EBF"], scene.cleaned["Blend"])
    arrays = [motion.channels[:, scene.channels] for motion in motions]
    arrays.append(1000 * scene.sigma_s[:, scene.channels])
    return [np.rint(array / SCALE).astype(np.int32) for array in arrays]


def describe_scene(scene: Scene, dataset: Dataset) -> dict[str, Any]:
    """Describe a scene for lab.js: names, grids, gaps and the errors over all angles."""
    clean, skeleton = scene.corrupted.clean, scene.filled.skeleton
    of_joint = skeleton.channel_joint[scene.channels]
    joints, position = np.unique(of_joint, return_inverse=True)
    errors = scene.errors_deg(scene.tuned_sigma_s)
    cuts = [None if s is None else round(s / clean.frame_time) for s in LOOK_AHEADS_S]
    return {
        "settings": vars(scene.settings),
        "choices": {
            "clips": [clip.name for clip in dataset.clips],
            "noises": [
                {
                    "name": name,
                    "unit": CORRUPTIONS[name].unit,
                    "summary": CORRUPTIONS[name].summary,
                    "max": max_amount(name),
                }
                for name in NOISES
            ],
            "max_gap_s": MAX_GAP_S,
        },
        "frame_time": clean.frame_time,
        "frames": clean.n_frames,
        "joints": [skeleton.joint_names[j] for j in joints],
        "channels": [
            [j, skeleton.channel_kind[c], skeleton.channel_labels[c]]
            for c, j in zip(scene.channels.tolist(), position.tolist(), strict=True)
        ],
        "gaps": _gaps(scene),
        "widths_ms": [1000 * s for s in WIDTHS_S.tolist()],
        "look_aheads_s": list(LOOK_AHEADS_S),
        "look_aheads_ms": [None if s is None else 1000 * s for s in LOOK_AHEADS_S],
        "look_ahead_frames": cuts,
        "gaussian_rms": scene.gaussian_rms.round(5).tolist(),
        "tuned": scene.tuned.tolist(),
        "rms": {name: round(errors[name], 5) for name in ("observed", "EBF", "Blend")},
        "moving_factor": float(np.sqrt(skeleton.is_cleaned.sum() / len(scene.channels))),
    }


def _gaps(scene: Scene) -> list[list[int]]:
    """List the gaps as (place of the channel, first frame, frame after the last)."""
    hidden = ~scene.corrupted.mask[:, scene.channels]
    edges = np.diff(hidden.astype(np.int8), axis=0, prepend=0, append=0)
    starts, stops = np.argwhere(edges.T == 1), np.argwhere(edges.T == -1)
    return [[int(c), int(a), int(b)] for (c, a), (_, b) in zip(starts, stops, strict=True)]
