"""Fit the statistical motion model that ``mocaplab.synthesis`` draws motions from.

``mocaplab/motion_model.py`` explains the model. It is fitted in three steps:

1. read the clips and make them comparable (``model_clips.py``);
2. turn each clip into one array of series coefficients: Fourier over the gait cycle of a
   walk or run (``gait_cycles.py``), cosines over the window of a jump or kick
   (``motion_events.py``);
3. take the mean of these arrays and their principal components across clips, and note the
   recorded range, acceleration and heading (here).
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from safetensors.numpy import save

from data_tools.gait_cycles import fit_cycle, is_plain_gait, travel_direction
from data_tools.model_clips import joint_reach, load_clips
from data_tools.motion_events import (
    event_knots,
    fit_event,
    jump_direction,
    jump_landmarks,
    kick_direction,
    kick_landmarks,
)
from mocaplab.files import write_atomically
from mocaplab.motion import CONSTANT_STD_DEG, BoolArray, FloatArray, Motion
from mocaplab.motion_model import FRAME_TIME, MODEL_FILE

N_COMPONENTS = {"walk": 8, "run": 3, "jump": 2, "kick": 2}

FloatArrays = dict[str, FloatArray]


def principal_components(
    samples: FloatArray, reach: FloatArray, n_components: int
) -> tuple[FloatArrays, FloatArray]:
    """Mean, components and spread of coefficient arrays.

    Parameters
    ----------
    samples : array, shape (N, K, F), a clip each
    reach : array, shape (F - 3,), file length units
        Lever arm of every angle.
    n_components : int

    Returns
    -------
    dict of mean (K, F), components (n_components, K, F), std (n_components,)
    scores : array, shape (N, n_components)
    """
    # Thumbs and fingers spin in some clips, because few markers hold them. Coefficients far
    # from the median are pulled in, by 5 degrees (or units) at least before it counts as far.
    middle = np.median(samples, axis=0)
    far = 5.0 + 4.0 * np.median(np.abs(samples - middle), axis=0)
    samples = np.clip(samples, middle - far, middle + far)
    # Features count by how far they move the body: an angle by its lever arm, the height
    # fully, a velocity for a fifth of a second. All in degrees times units.
    weight = np.concatenate([reach, np.degrees([1.0, 0.2, 0.2])])
    mean = samples.mean(axis=0)
    flat = ((samples - mean) * weight).reshape(len(samples), -1)
    rows = np.linalg.svd(flat, full_matrices=False)[2][:n_components]
    # The sign of a component is arbitrary; its largest entry is made positive.
    rows *= np.sign(np.take_along_axis(rows, np.abs(rows).argmax(axis=1)[:, None], axis=1))
    scores = flat @ rows.T
    components = rows.reshape(-1, *mean.shape) / weight
    return {"mean": mean, "components": components, "std": scores.std(axis=0, ddof=1)}, scores


def recorded_statistics(clips: Sequence[Motion], directions: Sequence[float]) -> FloatArrays:
    """Range and typical acceleration of every channel, and the headings."""
    from scipy.ndimage import gaussian_filter1d

    # Half a percent at each end is left out of the range, and what is above about 11 Hz out
    # of the acceleration: both are capture noise, of thumbs and toes most of all.
    ranges = np.array([np.percentile(clip.channels, [0.5, 99.5], axis=0) for clip in clips])
    smooth = [gaussian_filter1d(clip.channels, 2.0, axis=0) for clip in clips]
    squares = [np.mean((np.diff(x, n=2, axis=0) / FRAME_TIME**2) ** 2, axis=0) for x in smooth]
    return {
        "limits": np.stack([ranges[:, 0].min(axis=0), ranges[:, 1].max(axis=0)]),
        "acceleration": np.sqrt(np.median(squares, axis=0)),
        "heading": np.array([np.mean(directions), np.std(directions)]),
    }


def fit_action(action: str, clips: list[Motion], moving: BoolArray) -> FloatArrays:
    """Fit all statistics of one action: the fields of ``ActionModel``."""
    log_rates = np.zeros(len(clips))  # an event has no rate
    knots_s = np.empty(0)
    if action in ("walk", "run"):
        directions = [travel_direction(clip) for clip in clips]
        fits = [fit_cycle(clip, moving, at) for clip, at in zip(clips, directions, strict=True)]
        samples = [coefficients for coefficients, _ in fits]
        log_rates = np.log([rate for _, rate in fits])
    else:
        find_landmarks = jump_landmarks if action == "jump" else kick_landmarks
        find_direction = jump_direction if action == "jump" else kick_direction
        landmarks = [find_landmarks(clip) for clip in clips]
        directions = [find_direction(*pair) for pair in zip(clips, landmarks, strict=True)]
        knots_s = event_knots(action, landmarks)
        samples = [
            fit_event(clip, moving, direction, frames, knots_s)
            for clip, direction, frames in zip(clips, directions, landmarks, strict=True)
        ]
    reach = joint_reach(clips[0].skeleton)[clips[0].skeleton.channel_joint[moving]]
    arrays, scores = principal_components(np.array(samples), reach, N_COMPONENTS[action])
    # A long stride is a slow one: the rate follows the scores. Scores of different
    # components are uncorrelated, so each has its own straight line.
    slopes = (log_rates - log_rates.mean()) @ scores / (scores**2).sum(axis=0)
    arrays["log_rate"] = np.concatenate([[log_rates.mean()], slopes])
    return arrays | recorded_statistics(clips, directions) | {"knots_s": knots_s}


def fit_model(folder: Path) -> tuple[dict[str, NDArray[np.generic]], dict[str, str]]:
    """Fit the whole model on a folder of clips.

    Returns
    -------
    arrays : dict of float32, int64 and bool arrays
    metadata : dict of str, for the header of the file

    Raises
    ------
    ValueError
        If too few clips of an action can be used.
    """
    clips = load_clips(folder)
    for action in ("walk", "run"):
        clips[action] = [clip for clip in clips[action] if is_plain_gait(clip)]
    clips["jump"] = [clip for clip in clips["jump"] if jump_landmarks(clip)]
    for action, need in N_COMPONENTS.items():
        got = len(clips[action])
        if got <= need:
            raise ValueError(f"{folder}: expected over {need} usable {action}s, got {got}")
    every = [clip for used in clips.values() for clip in used]
    skeleton = every[0].skeleton
    varies = [clip.channels.std(axis=0) > CONSTANT_STD_DEG for clip in every]
    moving = skeleton.is_rotation & np.any(varies, axis=0)
    fitted = {
        "offsets": skeleton.offsets,
        "end_site_offsets": skeleton.end_site_offsets,
        "rest": np.mean([clip.channels.mean(axis=0) for clip in every], axis=0),
    }
    for action, used in clips.items():
        statistics = fit_action(action, used, moving)
        fitted |= {f"{action}.{field}": value for field, value in statistics.items()}
    arrays: dict[str, NDArray[np.generic]] = {
        key: np.ascontiguousarray(value, np.float32) for key, value in fitted.items()
    }
    arrays |= {"parents": skeleton.parents, "end_site_parents": skeleton.end_site_parents}
    arrays["moving"] = moving
    header = {
        "joint_names": skeleton.joint_names,
        "channel_names": skeleton.channel_names,
        "clips": {action: [clip.name for clip in used] for action, used in clips.items()},
        "source": "Statistics of clips from mocap.cs.cmu.edu; the database was created with "
        "funding from NSF EIA-0196217.",
    }
    return arrays, {"model": json.dumps(header)}


def main(arguments: Sequence[str] | None = None) -> None:
    """Fit the model and write it."""
    parser = argparse.ArgumentParser(
        prog="python -m data_tools.fit_motion_model",
        description="Fit the motion model behind the embedded data set on a folder of CMU clips.",
    )
    parser.add_argument("folder", type=Path, help="folder with clips.csv and the BVH files")
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        default=MODEL_FILE,
        help="file to write (default: the model inside the package)",
    )
    options = parser.parse_args(arguments)
    arrays, metadata = fit_model(options.folder)
    options.output.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(options.output, save(arrays, metadata))
    used = json.loads(metadata["model"])["clips"]
    counts = ", ".join(f"{len(names)} {action}" for action, names in used.items())
    print(f"{options.output}: {options.output.stat().st_size / 1000:.0f} kB, from {counts}")


if __name__ == "__main__":
    main()
