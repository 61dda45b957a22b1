"""Motions drawn from a statistical model, for those who have no recordings at hand.

The model file holds no recording, only statistics of CMU clips
(``data_tools/fit_motion_model.py`` makes it): walking and running as Fourier series over
the gait cycle, jumping and kicking as cosine series over a window around the event, and
how both vary from clip to clip, as principal components (Troje 2002, "Decomposing
biological motion", Journal of Vision 2(5):2). There is no jog among the clips: a jog here
is the walk blended with the run.

To draw a motion: pick a style (component scores), let it drift slowly, evaluate the
series, keep every angle inside its recorded range, then set the feet on the floor.
"""

from __future__ import annotations

import itertools
import json
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from mocaplab.kinematics import forward_kinematics
from mocaplab.motion import BoolArray, FloatArray, Motion, Skeleton
from mocaplab.rotations import align_euler, axis_angle_to_matrix, euler_to_matrix

ACTIONS = ("walk", "jog", "run", "jump", "kick")
FRAME_TIME = 0.0083333  # seconds, as the CMU files have it
CM_PER_UNIT = 2.54 / 0.45  # CMU's length unit
MODEL_FILE = Path(__file__).parent / "data" / "motion_model.safetensors"

JOG_BLEND = 0.65  # how far from the walk to the run
DRIFT = 0.2  # how much the style changes within a clip, relative to between clips
RATE_DRIFT = 0.015  # relative change of the cycle's rate within a clip
MAX_SCORE = 1.5  # scores are cut here, in standard deviations
TOUCH_CM = 2.0  # a foot this far above the floor carries half its weight or less
ODD_CM_S = 40.0  # a foot whose speed disagrees with the model's by this much hardly counts
# Within this time of every frame some foot touches the floor; 0 where one always does.
AIRBORNE_S = {"walk": 0.0, "jog": 0.25, "run": 0.25, "jump": 0.5, "kick": 0.15}
# The paper's mix (paper A, section 5): how many, and the shortest and longest in seconds.
MIX = {
    "walk": (40, 2.4, 5.0),
    "jog": (20, 1.6, 3.0),
    "run": (20, 1.3, 2.0),
    "jump": (10, 2.2, 3.6),
    "kick": (10, 2.2, 4.5),
}


@dataclass(frozen=True, eq=False)
class ActionModel:
    """The statistics of one action; K terms of the series, F features, N components.

    The features are the moving angles in degrees, heading removed, then the root's height
    above the floor (file units) and its velocity to the side and forward (units / s).

    Parameters
    ----------
    mean : array, shape (K, F)
    components : array, shape (N, K, F)
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


@dataclass(frozen=True, eq=False)
class MotionModel:
    """The skeleton, which channels move, the value of those that do not, and the actions."""

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
        joint_names=tuple(header["joint_names"]),
        parents=arrays["parents"].astype(np.int64),
        offsets=arrays["offsets"],
        channel_names=tuple(tuple(names) for names in header["channel_names"]),
        end_site_parents=arrays["end_site_parents"].astype(np.int64),
        end_site_offsets=arrays["end_site_offsets"],
    )
    fields = list(ActionModel.__dataclass_fields__)
    actions = {
        action: ActionModel(**{field: arrays[f"{action}.{field}"] for field in fields})
        for action in ("walk", "run", "jump", "kick")
    }
    actions["jog"] = _blend(actions["walk"], actions["run"], JOG_BLEND)
    return MotionModel(skeleton, arrays["moving"].astype(bool), arrays["rest"], actions)


def _blend(walk: ActionModel, run: ActionModel, share: float) -> ActionModel:
    """Interpolate two cycle models; the components of both stay, with smaller spread."""

    def mix(a: FloatArray, b: FloatArray) -> FloatArray:
        return (1 - share) * a + share * b

    return ActionModel(
        mean=mix(walk.mean, run.mean),
        components=np.concatenate([walk.components, run.components]),
        std=np.concatenate([(1 - share) * walk.std, share * run.std]),
        log_rate=np.concatenate(
            [mix(walk.log_rate[:1], run.log_rate[:1]), walk.log_rate[1:], run.log_rate[1:]]
        ),
        heading=mix(walk.heading, run.heading),
        limits=np.stack(
            [
                np.minimum(walk.limits[0], run.limits[0]),
                np.maximum(walk.limits[1], run.limits[1]),
            ]
        ),
        acceleration=mix(walk.acceleration, run.acceleration),
        knots_s=np.empty(0),
    )


def fourier_basis(phase: ArrayLike, n_harmonics: int) -> FloatArray:
    """Constant, then cosine and sine of each harmonic; phase in cycles, shape (T,) -> (T, K)."""
    angle = 2 * np.pi * np.asarray(phase)[:, None] * np.arange(1, n_harmonics + 1)
    return np.concatenate([np.ones((len(angle), 1)), np.cos(angle), np.sin(angle)], axis=1)


def cosine_basis(position: ArrayLike, n_terms: int) -> FloatArray:
    """Cosines of 0, 1, 2, ... half periods over positions 0 to 1; shape (T,) -> (T, n_terms)."""
    return np.cos(np.pi * np.asarray(position)[:, None] * np.arange(n_terms))


def turn_root(motion: Motion, angle_rad: ArrayLike) -> Motion:
    """Turn the root about the vertical axis; its position stays.

    Parameters
    ----------
    motion : Motion, whose root has the channels X, Y, Z position and Z, Y, X rotation
    angle_rad : float or array, shape (T,), from +z towards +x
    """
    angles = motion.channels[:, 3:6]
    matrix = axis_angle_to_matrix("Y", angle_rad) @ euler_to_matrix(angles, "ZYX")
    z = np.arctan2(matrix[:, 1, 0], matrix[:, 0, 0])
    y = np.arcsin(np.clip(-matrix[:, 2, 0], -1.0, 1.0))
    x = np.arctan2(matrix[:, 2, 1], matrix[:, 2, 2])
    near = angles.copy()
    near[:, 1] += np.degrees(angle_rad)
    channels = motion.channels.copy()
    channels[:, 3:6] = align_euler(np.degrees(np.stack([z, y, x], axis=1)), near, "ZYX")
    return motion.with_channels(channels)


def foot_points(motion: Motion) -> FloatArray:
    """Ankle, ball and toe tip of both feet.

    Parameters
    ----------
    motion : Motion, on a CMU skeleton, whose first joints are the root and the legs

    Returns
    -------
    array, shape (T, 2, 3, 3), file length units
        Left and right foot; ankle, ball, tip; x, y, z.
    """
    skeleton = motion.skeleton
    names = skeleton.joint_names
    # Arms and spine do not move the feet, and leaving them out is three times as fast.
    n = max(names.index("LeftToeBase"), names.index("RightToeBase")) + 1
    tips = np.flatnonzero(skeleton.end_site_parents < n)
    legs = Skeleton(
        joint_names=names[:n],
        parents=skeleton.parents[:n],
        offsets=skeleton.offsets[:n],
        channel_names=skeleton.channel_names[:n],
        end_site_parents=skeleton.end_site_parents[tips],
        end_site_offsets=skeleton.end_site_offsets[tips],
    )
    short = Motion(legs, motion.frame_time, motion.channels[:, : legs.n_channels])
    positions, orientations = forward_kinematics(short)
    feet = []
    for side in ("Left", "Right"):
        ball = names.index(side + "ToeBase")
        site = int(np.flatnonzero(legs.end_site_parents == ball)[0])
        tip = positions[:, ball] + orientations[:, ball] @ legs.end_site_offsets[site]
        feet.append(np.stack([positions[:, ball - 1], positions[:, ball], tip], axis=1))
    return np.stack(feet, axis=1)


def foot_heights(motion: Motion) -> FloatArray:
    """Height of the lowest point of the left and the right foot, shape (T, 2), file units."""
    return np.asarray(foot_points(motion)[..., 1].min(axis=-1))


def synthesize(
    action: str,
    *,
    duration_s: float,
    rng: np.random.Generator,
    style: float = 1.0,
    name: str = "",
) -> Motion:
    """Draw a motion from the model.

    Parameters
    ----------
    action : one of ``ACTIONS``
    duration_s : float, seconds
        Any length of at least one frame. A walk, jog or run goes on; a jump or kick is
        cut around its event when short, and waits and is repeated when long.
    rng : numpy.random.Generator
    style : float
        How far the clip may be from the average: 0 gives the mean motion, 1 the spread
        of the recorded clips.
    name : str

    Returns
    -------
    Motion
        On the CMU skeleton at 120 frames per second; the floor is y = 0.

    Raises
    ------
    ValueError
        If the action is unknown, or the duration or the style is out of range.
    """
    if action not in ACTIONS:
        raise ValueError(f"expected an action out of {', '.join(ACTIONS)}, got {action!r}")
    if not (np.isfinite(duration_s) and duration_s >= 0):
        raise ValueError(f"expected a duration of 0 seconds or more, got {duration_s}")
    if not 0 <= style <= 2:
        raise ValueError(f"expected a style between 0 and 2, got {style}")
    model = load_motion_model()
    statistics = model.actions[action]
    n = round(duration_s / FRAME_TIME) + 1
    drawn = _draw_scores(statistics, n, style, rng)
    values = (_draw_window if len(statistics.knots_s) else _draw_cycle)(statistics, drawn, rng)
    heading = statistics.heading[0] + statistics.heading[1] * _cut_normal(rng, 1)
    heading = heading + np.radians(1.5) * _slow_noise(n, 1, rng)[:, 0]
    return _place(model, action, values, heading, name)


def embedded_clips(seed: int = 0) -> list[tuple[Motion, str]]:
    """Draw the 100 clips of the embedded data set, in the paper's mix.

    Returns
    -------
    list of (motion, action)
        40 walks, 20 jogs, 20 runs, 10 jumps, 10 kicks, named "walk_01" and so on; the
        same for the same seed.
    """
    clips: list[tuple[Motion, str]] = []
    for action, (count, shortest, longest) in MIX.items():
        for number in range(1, count + 1):
            rng = np.random.default_rng([seed, len(clips)])
            duration_s = float(rng.uniform(shortest, longest))
            name = f"{action}_{number:02d}"
            clips.append((synthesize(action, duration_s=duration_s, rng=rng, name=name), action))
    return clips


def _cut_normal(rng: np.random.Generator, size: int) -> FloatArray:
    """Draw standard normal numbers, pulled smoothly inside plus and minus MAX_SCORE."""
    return MAX_SCORE * np.tanh(rng.standard_normal(size) / MAX_SCORE)


def _slow_noise(n: int, size: int, rng: np.random.Generator) -> FloatArray:
    """Smooth random curves of unit variance, slower than half a hertz, shape (n, size)."""
    rate = rng.uniform(0.08, 0.4, (4, size))
    start = rng.uniform(0.0, 1.0, (4, size))
    cycles = np.arange(n)[:, None, None] * FRAME_TIME * rate + start
    return np.asarray(np.cos(2 * np.pi * cycles).sum(axis=1) / np.sqrt(2.0))


def _draw_scores(
    statistics: ActionModel, n: int, style: float, rng: np.random.Generator
) -> FloatArray:
    """Draw component scores that drift slowly around a style, shape (n, N)."""
    size = len(statistics.std)
    drift = DRIFT * _slow_noise(n, size, rng)
    return style * statistics.std * (_cut_normal(rng, size) + drift)


def _evaluate(statistics: ActionModel, basis: FloatArray, scores: FloatArray) -> FloatArray:
    """Sum the series with slowly changing coefficients: (T, K), (T, N) -> (T, F)."""
    shares = np.concatenate([np.ones((len(scores), 1)), scores], axis=1)
    terms = (shares[:, :, None] * basis[:, None, :]).reshape(len(basis), -1)  # (T, (1 + N) K)
    series = np.concatenate([statistics.mean[None], statistics.components])
    return np.asarray(terms @ series.reshape(terms.shape[1], -1))


def _draw_cycle(
    statistics: ActionModel, scores: FloatArray, rng: np.random.Generator
) -> FloatArray:
    """Features of a walk, jog or run that starts anywhere in its cycle, shape (T, F)."""
    log_rate = statistics.log_rate[0] + scores @ statistics.log_rate[1:]
    log_rate = log_rate + RATE_DRIFT * _slow_noise(len(scores), 1, rng)[:, 0]
    phase = rng.uniform() + np.cumsum(np.exp(log_rate)) * FRAME_TIME
    return _evaluate(statistics, fourier_basis(phase, len(statistics.mean) // 2), scores)


def _draw_window(
    statistics: ActionModel, scores: FloatArray, rng: np.random.Generator
) -> FloatArray:
    """Features of a jump or kick, with rest before and after where there is time."""
    length = statistics.knots_s[-1]
    event = float(np.mean(statistics.knots_s[1:-1]))
    n, wait_s, ease_s, fade_s = len(scores), 1.5, 0.06, 0.4
    # Rests and repetitions fill long durations; every part has rest at both ends.
    bounds = np.linspace(0, n, max(1, int(n * FRAME_TIME / (length + wait_s))) + 1).astype(int)
    position = np.empty(n)
    for first, last in itertools.pairwise(bounds):
        spare = (last - first) * FRAME_TIME - length
        share = rng.uniform(0.4, 0.6) if spare > 0 else event / length
        local = np.arange(last - first) * FRAME_TIME - spare * share
        tempo = 1 + 0.03 * _cut_normal(rng, 1)[0]
        local = event + (local - event) * tempo
        # The window's time starts and stops gently, so that rest and action join smoothly.
        inside = np.logaddexp(0, local / ease_s) - np.logaddexp(0, (local - length) / ease_s)
        position[first:last] = ease_s * inside
    values = _evaluate(statistics, cosine_basis(position / length, len(statistics.mean)), scores)
    speed = np.gradient(position, FRAME_TIME) if n > 1 else np.ones(1)
    values[:, -2:] *= speed.clip(0.0)[:, None]  # the path is travelled as fast as time passes
    time_s = np.arange(n) * FRAME_TIME
    for bound in bounds[1:-1]:  # from the last pose of one part to the first of the next
        u = np.clip((time_s - time_s[bound]) / fade_s / 2 + 0.5, 0.0, 1.0)
        ramp = u**3 * (10 - 15 * u + 6 * u**2)
        step = values[bound] - values[bound - 1]
        values += np.outer(ramp - (np.arange(n) >= bound), step)
    return values


def soft_limit(values: FloatArray, limits: FloatArray, knee: float = 0.9) -> FloatArray:
    """Keep values strictly inside limits, bending them smoothly before they get there.

    Parameters
    ----------
    values : array, shape (T, C)
    limits : array, shape (2, C), lowest and highest
    knee : float
        Up to this share of the half range values stay as they are.
    """
    middle, half = limits.mean(axis=0), np.maximum(np.ptp(limits, axis=0) / 2, 1e-9)
    u = (values - middle) / half
    bent = knee + (1 - knee) * np.tanh((np.abs(u) - knee) / (1 - knee))
    return np.asarray(middle + half * np.where(np.abs(u) > knee, np.sign(u) * bent, u))


def _place(
    model: MotionModel, action: str, values: FloatArray, heading: FloatArray, name: str
) -> Motion:
    """Turn features into channels, with the feet on the floor and not sliding."""
    n = len(values)
    limits = model.actions[action].limits
    channels = np.tile(model.rest, (n, 1))
    channels[:, model.moving] = values[:, :-3]
    channels[:, 0:3] = 0.0
    channels[:, 1] = values[:, -3]
    motion = turn_root(Motion(model.skeleton, FRAME_TIME, channels, name), heading)
    channels = motion.channels.copy()
    channels[:, model.moving] = soft_limit(channels[:, model.moving], limits[:, model.moving])
    feet = foot_points(motion.with_channels(channels))

    low = feet[..., 1].min(axis=(1, 2))
    rise = _lift(low, _touching(low, AIRBORNE_S[action]))
    channels[:, 1] += rise
    feet[..., 1] += rise[:, None, None]

    cosine, sine = np.cos(heading), np.sin(heading)
    side, forward = values[:, -2], values[:, -1]
    modelled = np.stack([side * cosine + forward * sine, forward * cosine - side * sine], axis=1)
    velocity = _stance_velocity(feet, modelled)
    path = np.cumsum(velocity, axis=0) * FRAME_TIME
    channels[:, [0, 2]] = path - path[0]
    return motion.with_channels(channels)


def _touching(low: FloatArray, airborne_s: float) -> FloatArray:
    """How surely the lower foot touches the floor, between 0 and 1, shape (T,)."""
    radius = round(airborne_s / FRAME_TIME)
    if radius == 0:
        return np.ones(len(low))
    padded = np.pad(low, radius, constant_values=np.inf)
    nearby = np.lib.stride_tricks.sliding_window_view(padded, 2 * radius + 1).min(axis=1)
    return np.asarray(np.exp(-(((low - nearby) * CM_PER_UNIT / TOUCH_CM) ** 2)))


def _lift(low: FloatArray, weight: FloatArray, stiffness: float = 100.0) -> FloatArray:
    """Smooth correction of the root's height that brings touching feet to the floor.

    Whittaker's smoother: least squares of the feet's height where they touch plus the
    squared second differences of the correction, so a flight is bridged by a cubic.
    """
    from scipy.linalg import solveh_banded

    n = len(low)
    if n < 3:
        return np.full(n, -low.min())
    rows = np.zeros((3, n))  # diagonals of D' D, where D takes second differences
    for i, a in enumerate((1.0, -2.0, 1.0)):
        for j, b in enumerate((1.0, -2.0, 1.0)[i:], start=i):
            rows[2 - (j - i), j : j + n - 2] += a * b
    rows *= stiffness
    rows[2] += weight + 1e-6
    return np.asarray(solveh_banded(rows, -weight * low))


def _stance_velocity(feet: FloatArray, modelled: FloatArray) -> FloatArray:
    """Horizontal velocity of the root at which a foot on the floor stands still.

    Parameters
    ----------
    feet : array, shape (T, 2, 3, 3), for a root that moves up and down only
    modelled : array, shape (T, 2), units / s, used where no foot is on the floor

    Returns
    -------
    array, shape (T, 2), x and z, units / s
    """
    from scipy.ndimage import gaussian_filter1d

    if len(feet) < 2:
        return modelled
    points = feet[:, :, 1:].reshape(len(feet), 4, 3)  # balls and tips
    height_cm = points[..., 1] * CM_PER_UNIT
    backward = -np.gradient(points[..., [0, 2]], FRAME_TIME, axis=0)
    # A point that is low but would need another speed than the model's is not standing: a
    # toe that lifts off, or a toe before the heel (which has no point of its own) rolls.
    odd = np.linalg.norm(backward - modelled[:, None], axis=-1) * CM_PER_UNIT / ODD_CM_S
    weight = np.exp(-((height_cm.clip(0.0) / TOUCH_CM) ** 2) - odd**2)
    total = weight.sum(axis=1)[:, None]
    standing = (weight[..., None] * backward).sum(axis=1) / total.clip(1e-12)
    trust = total / (total + 0.1)
    velocity = trust * standing + (1 - trust) * modelled
    return np.asarray(gaussian_filter1d(velocity, 3.0, axis=0, mode="nearest"))
