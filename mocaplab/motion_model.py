"""The statistical motion model: what its file holds, and how it turns into postures.

The idea is the cycle model of Troje (2002), "Decomposing biological motion", Journal of
Vision 2(5):2. A walk repeats itself once per gait cycle, so every joint angle can be
written as a Fourier series of the cycle's phase: an average posture plus a few harmonics.
The coefficients of one clip, put in a row, are a single point in a space where two walks
can be averaged sensibly. Principal component analysis across the clips then finds the few
directions in which walks differ (long or short strides, arms that swing or do not). So

    features(phase) = basis(phase) @ (mean + sum of score[n] * components[n])

is a walk for any small scores; with all scores 0 it is the average walk. A jump or a kick
happens once and has no cycle: there, cosines over a time window around the event take the
place of the Fourier series, and all else is the same.

The file holds these statistics and no recording. ``data_tools/fit_motion_model.py`` makes
it from CMU clips; ``mocaplab.synthesis`` draws motions from it.
"""

from __future__ import annotations

import dataclasses
import json
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from mocaplab.euler import align_euler
from mocaplab.motion import BoolArray, FloatArray, Motion, Skeleton
from mocaplab.rotations import axis_angle_to_matrix, euler_to_matrix

FRAME_TIME = 0.0083333  # seconds, as the CMU files have it
CM_PER_UNIT = 2.54 / 0.45  # CMU's length unit
MODEL_FILE = Path(__file__).parent / "data" / "motion_model.safetensors"
JOG_BLEND = 0.65  # how far a jog lies from the walk to the run


@dataclass(frozen=True, eq=False)
class ActionModel:
    """The statistics of one action; K terms of the series, F features, N components.

    The features of a frame are the angles that move, in degrees, with the heading taken
    out; then the root's height above the floor (file units) and its velocity to the side
    and forward (units / s). A velocity, unlike a position, repeats with the cycle.

    Parameters
    ----------
    mean : array, shape (K, F)
        Series of the average clip.
    components : array, shape (N, K, F)
        How the series changes per unit of each score.
    std : array, shape (N,)
        Standard deviation of the scores across clips.
    log_rate : array, shape (1 + N,)
        Logarithm of cycles per second: its mean, and its change per unit of each score.
    heading : array, shape (2,), radians
        Mean and standard deviation of the direction of travel, from +z towards +x.
    limits : array, shape (2, C)
        Smallest and largest recorded value of every channel.
    acceleration : array, shape (C,), degrees / s^2
        Root mean square of the recorded angular acceleration.
    knots_s : array, shape (n,), seconds
        Start of the window, landmarks, end of the window; empty for a cycle.
    """

    mean: FloatArray
    components: FloatArray
    std: FloatArray
    log_rate: FloatArray
    heading: FloatArray
    limits: FloatArray
    acceleration: FloatArray
    knots_s: FloatArray

    def evaluate(self, basis: FloatArray, scores: FloatArray) -> FloatArray:
        """Sum the series, with scores that may change from frame to frame.

        Parameters
        ----------
        basis : array, shape (T, K), from ``fourier_basis`` or ``cosine_basis``
        scores : array, shape (T, N)

        Returns
        -------
        array, shape (T, F)
        """
        shares = np.concatenate([np.ones((len(scores), 1)), scores], axis=1)  # (T, 1 + N)
        series = np.concatenate([self.mean[None], self.components])  # (1 + N, K, F)
        # One product of (T, (1 + N) K) and ((1 + N) K, F): much faster than a sum of three.
        terms = (shares[:, :, None] * basis[:, None, :]).reshape(len(basis), -1)
        return np.asarray(terms @ series.reshape(terms.shape[1], -1))


@dataclass(frozen=True, eq=False)
class MotionModel:
    """Everything in the model file.

    Parameters
    ----------
    skeleton : Skeleton, that of the CMU clips
    moving : array, shape (C,), bool
        The rotation channels that move in some clip.
    rest : array, shape (C,)
        Value of the channels that do not move.
    actions : dict from "walk", "jog", "run", "jump", "kick" to ActionModel
    """

    skeleton: Skeleton
    moving: BoolArray
    rest: FloatArray
    actions: dict[str, ActionModel]


@lru_cache(maxsize=1)
def load_motion_model() -> MotionModel:
    """Read the model that comes with the package, and make the jog from walk and run."""
    from safetensors import safe_open

    with safe_open(MODEL_FILE, framework="numpy") as file:
        header = json.loads(file.metadata()["model"])
        arrays: dict[str, FloatArray] = {
            key: file.get_tensor(key).astype(np.float64)
            for key in file.keys()  # noqa: SIM118
        }
    skeleton = Skeleton(
        joint_names=header["joint_names"],
        parents=arrays["parents"].astype(np.int64),
        offsets=arrays["offsets"],
        channel_names=header["channel_names"],
        end_site_parents=arrays["end_site_parents"].astype(np.int64),
        end_site_offsets=arrays["end_site_offsets"],
    )
    names = [field.name for field in dataclasses.fields(ActionModel)]
    actions = {
        action: ActionModel(**{name: arrays[f"{action}.{name}"] for name in names})
        for action in header["clips"]
    }
    actions["jog"] = _blend(actions["walk"], actions["run"], JOG_BLEND)
    return MotionModel(skeleton, arrays["moving"].astype(bool), arrays["rest"], actions)


def _blend(walk: ActionModel, run: ActionModel, share: float) -> ActionModel:
    """Interpolate two cycle models; the components of both stay, with smaller spread."""

    def mix(a: FloatArray, b: FloatArray) -> FloatArray:
        return (1 - share) * a + share * b

    mean_rate = mix(walk.log_rate[:1], run.log_rate[:1])
    lowest = np.minimum(walk.limits[0], run.limits[0])
    highest = np.maximum(walk.limits[1], run.limits[1])
    return ActionModel(
        mean=mix(walk.mean, run.mean),
        components=np.concatenate([walk.components, run.components]),
        std=np.concatenate([(1 - share) * walk.std, share * run.std]),
        log_rate=np.concatenate([mean_rate, walk.log_rate[1:], run.log_rate[1:]]),
        heading=mix(walk.heading, run.heading),
        limits=np.stack([lowest, highest]),
        acceleration=mix(walk.acceleration, run.acceleration),
        knots_s=walk.knots_s,
    )


def fourier_basis(phase: ArrayLike, n_harmonics: int) -> FloatArray:
    """Evaluate a constant, then the cosine and then the sine of every harmonic.

    Parameters
    ----------
    phase : array, shape (T,), in cycles
    n_harmonics : int

    Returns
    -------
    array, shape (T, K), with K = 1 + 2 * n_harmonics
    """
    angle = 2 * np.pi * np.asarray(phase)[:, None] * np.arange(1, n_harmonics + 1)
    return np.concatenate([np.ones((len(angle), 1)), np.cos(angle), np.sin(angle)], axis=1)


def cosine_basis(position: ArrayLike, n_terms: int) -> FloatArray:
    """Evaluate cosines of 0, 1, 2, ... half periods over a window.

    Parameters
    ----------
    position : array, shape (T,), 0 at the start of the window, 1 at its end
    n_terms : int

    Returns
    -------
    array, shape (T, n_terms)
        Every term is level at both ends, so a motion comes to rest there.
    """
    return np.cos(np.pi * np.asarray(position)[:, None] * np.arange(n_terms))


def turn_root(motion: Motion, angle_rad: ArrayLike) -> Motion:
    """Turn the root about the vertical axis; its position stays.

    Parameters
    ----------
    motion : Motion, whose root has the channels X, Y, Z position and Z, Y, X rotation
    angle_rad : float or array, shape (T,), from +z towards +x

    Returns
    -------
    Motion
    """
    angles = motion.channels[:, 3:6]
    matrix = axis_angle_to_matrix("Y", angle_rad) @ euler_to_matrix(angles, "ZYX")
    z = np.arctan2(matrix[:, 1, 0], matrix[:, 0, 0])
    y = np.arcsin(np.clip(-matrix[:, 2, 0], -1.0, 1.0))
    x = np.arctan2(matrix[:, 2, 1], matrix[:, 2, 2])
    # Of all angles that say the same, take those nearest to the old ones: no jumps by 360.
    near = angles.copy()
    near[:, 1] += np.degrees(angle_rad)
    channels = motion.channels.copy()
    channels[:, 3:6] = align_euler(np.degrees(np.stack([z, y, x], axis=1)), near, "ZYX")
    return motion.with_channels(channels)
