"""What the 3D player shows, prepared for the browser: points, bones, ground and size."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from mocaplab.kinematics import end_site_positions, forward_kinematics
from mocaplab.motion import FloatArray, Motion
from mocaplab.packing import pack_steps

MAX_DISPLAY_FPS = 60


def player_data(
    motions: Sequence[Motion], labels: Sequence[str], height: int, **extra: Any
) -> tuple[dict[str, Any], bytes]:
    """Prepare motions for the browser: what describes them, and the packed positions.

    Parameters
    ----------
    motions, labels, height : see :func:`play`
    **extra : more entries for the description, as player.js knows them
    """
    # The small allowance keeps 60.0006 fps, a rounded frame time, at every frame.
    step = int(np.ceil(motions[0].fps / MAX_DISPLAY_FPS - 1e-3))
    positions = [body_points(motion)[::step] for motion in motions]
    steps, origin, unit = _quantise(positions)
    meta = {
        "frames": max(motion.n_frames for motion in motions),
        "step": step,
        "frame_time": motions[0].frame_time,
        "height": height,
        "strip": True,
        "scale": unit,
        "origin": origin.tolist(),
        **_scene(positions[0]),
        "motions": [
            {
                "label": label,
                "frames": len(values),
                "points": values.shape[1],
                "joints": motion.skeleton.n_joints,
                "names": list(motion.skeleton.joint_names),
                "bones": _bones(motion),
            }
            for motion, label, values in zip(motions, labels, steps, strict=True)
        ],
        **extra,
    }
    return meta, pack_steps(steps)


def body_points(motion: Motion) -> FloatArray:
    """Joints, then End Sites, shape (T, J + E, 3), file length units."""
    return np.concatenate([forward_kinematics(motion)[0], end_site_positions(motion)], axis=1)


def _bones(motion: Motion) -> list[list[int]]:
    """List the pairs of points that a line joins; End Site e is point J + e."""
    n_joints = motion.skeleton.n_joints
    pairs = list(enumerate(motion.skeleton.parents.tolist()))[1:]
    pairs += enumerate(motion.skeleton.end_site_parents.tolist(), start=n_joints)
    return [[parent, child] for child, parent in pairs]


def _scene(positions: FloatArray) -> dict[str, float]:
    """Where the ground is, how large a figure is, and a round width for the grid's cells."""
    lowest, highest = positions[..., 1].min(axis=1), positions[..., 1].max(axis=1)
    reach = np.linalg.norm((positions - positions[:, :1])[..., [0, 2]], axis=-1).max(axis=1)
    # Percentiles: one frame of noise must not sink the floor, nor a jump raise it.
    ground, top = float(np.percentile(lowest, 5)), float(np.percentile(highest, 95))
    size = max(top - ground, 2 * float(np.percentile(reach, 90))) or 1.0
    power = 10.0 ** np.floor(np.log10(size / 4))
    cell = max(factor * power for factor in (1, 2, 5) if factor * power <= size / 4)
    return {"ground": ground, "middle": (ground + top) / 2, "size": size, "cell": float(cell)}


def _quantise(positions: list[FloatArray]) -> tuple[list[np.ndarray], FloatArray, float]:
    """Round positions to 16-bit steps: returns steps (T, P, 3), origin (3,) and unit."""
    points = np.concatenate([values.reshape(-1, 3) for values in positions])
    origin = (points.min(axis=0) + points.max(axis=0)) / 2
    unit = float(np.abs(points - origin).max() / 32767) or 1.0
    return [np.rint((v - origin) / unit).astype(np.int16) for v in positions], origin, unit
