"""Motions drawn from the statistical model, for those who have no recordings at hand.

``motion_model.py`` says what the model is; here it is sampled. To draw a motion:

1. pick a style: random component scores, which then drift slowly, because nobody takes
   the same step twice;
2. let time pass: the phase of a cycle runs on at a nearly constant rate, and the window
   of a jump or a kick is passed through once, with rest before and after;
3. evaluate the series, which gives every angle and the speed of the root;
4. keep every angle inside its recorded range, turn the whole towards a heading, and set
   the feet on the floor (``foot_placement.py``).
"""

from __future__ import annotations

import itertools

import numpy as np

from mocaplab.foot_placement import place_feet
from mocaplab.motion import FloatArray, Motion
from mocaplab.motion_model import (
    FRAME_TIME,
    ActionModel,
    cosine_basis,
    fourier_basis,
    load_motion_model,
    turn_root,
)

ACTIONS = ("walk", "jog", "run", "jump", "kick")
# The paper's mix (paper A, section 5): how many, and the shortest and longest in seconds.
MIX = {
    "walk": (40, 2.4, 5.0),
    "jog": (20, 1.6, 3.0),
    "run": (20, 1.3, 2.0),
    "jump": (10, 2.2, 3.6),
    "kick": (10, 2.2, 4.5),
}
# Within this time of every frame some foot touches the floor; 0 where one always does.
AIRBORNE_S = {"walk": 0.0, "jog": 0.25, "run": 0.25, "jump": 0.5, "kick": 0.15}

MAX_SCORE = 1.5  # standard deviations; few clips say little about rare styles
SCORE_DRIFT = 0.2  # how much the style changes within a clip, relative to between clips
RATE_DRIFT = 0.015  # relative change of the cycle's rate within a clip
HEADING_DRIFT_DEG = 1.5
TEMPO_SPREAD = 0.03  # relative, of jumps and kicks
REST_S = 1.5  # a long clip repeats its event when there is time for this much rest
EASE_S = 0.06  # how gently an event starts out of rest and ends in it
FADE_S = 0.4  # how gently one repetition leads over to the next
KNEE = 0.9  # share of the recorded range in which angles stay as they are


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
    statistics = load_motion_model().actions[action]
    n_frames, n_scores = round(duration_s / FRAME_TIME) + 1, len(statistics.std)

    drift = SCORE_DRIFT * _slow_noise(n_frames, n_scores, rng)
    scores = style * statistics.std * (_bounded_normal(n_scores, rng) + drift)
    is_cycle = len(statistics.knots_s) == 0
    features = (_cycle_features if is_cycle else _event_features)(statistics, scores, rng)
    heading = statistics.heading[0] + statistics.heading[1] * _bounded_normal(1, rng)
    heading = heading + np.radians(HEADING_DRIFT_DEG) * _slow_noise(n_frames, 1, rng)[:, 0]

    motion = _pose(statistics, features, heading, name)
    cosine, sine = np.cos(heading), np.sin(heading)
    side, forward = features[:, -2], features[:, -1]
    velocity = np.stack([side * cosine + forward * sine, forward * cosine - side * sine], axis=1)
    return place_feet(motion, velocity, airborne_s=AIRBORNE_S[action])


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


def soft_limit(values: FloatArray, limits: FloatArray) -> FloatArray:
    """Keep values strictly inside limits, bending them smoothly before they get there.

    Unusual scores can ask a knee to bend backwards. Cutting the angle off at its limit
    would stop the joint dead, a corner that no recording has and that shows as a spike of
    acceleration. So values up to the share ``KNEE`` of the half range stay as they are,
    and those beyond approach the limit along a tanh, which joins on without a corner.

    Parameters
    ----------
    values : array, shape (T, C)
    limits : array, shape (2, C), lowest and highest

    Returns
    -------
    array, shape (T, C)
    """
    middle, half = limits.mean(axis=0), np.maximum(np.ptp(limits, axis=0) / 2, 1e-9)
    u = (values - middle) / half
    bent = KNEE + (1 - KNEE) * np.tanh((np.abs(u) - KNEE) / (1 - KNEE))
    return np.asarray(middle + half * np.where(np.abs(u) > KNEE, np.sign(u) * bent, u))


def _bounded_normal(size: int, rng: np.random.Generator) -> FloatArray:
    """Draw standard normal numbers, pulled smoothly inside plus and minus MAX_SCORE."""
    return MAX_SCORE * np.tanh(rng.standard_normal(size) / MAX_SCORE)


def _slow_noise(n_frames: int, size: int, rng: np.random.Generator) -> FloatArray:
    """Draw smooth curves of unit variance, slower than half a hertz, shape (T, size)."""
    rate = rng.uniform(0.08, 0.4, (4, size))
    start = rng.uniform(0.0, 1.0, (4, size))
    cycles = np.arange(n_frames)[:, None, None] * FRAME_TIME * rate + start
    return np.asarray(np.cos(2 * np.pi * cycles).sum(axis=1) / np.sqrt(2.0))


def _cycle_features(
    statistics: ActionModel, scores: FloatArray, rng: np.random.Generator
) -> FloatArray:
    """Features of a walk, jog or run that starts anywhere in its cycle, shape (T, F)."""
    log_rate = statistics.log_rate[0] + scores @ statistics.log_rate[1:]
    log_rate = log_rate + RATE_DRIFT * _slow_noise(len(scores), 1, rng)[:, 0]
    phase = rng.uniform() + np.cumsum(np.exp(log_rate)) * FRAME_TIME
    return statistics.evaluate(fourier_basis(phase, len(statistics.mean) // 2), scores)


def _event_features(
    statistics: ActionModel, scores: FloatArray, rng: np.random.Generator
) -> FloatArray:
    """Features of a jump or kick, repeated if there is time, shape (T, F)."""
    n_frames, length_s = len(scores), statistics.knots_s[-1]
    n_parts = max(1, int(n_frames * FRAME_TIME / (length_s + REST_S)))
    bounds = np.linspace(0, n_frames, n_parts + 1).astype(int)
    parts = itertools.pairwise(bounds.tolist())
    time_s = np.concatenate([_event_time(last - first, statistics, rng) for first, last in parts])
    features = statistics.evaluate(cosine_basis(time_s / length_s, len(statistics.mean)), scores)
    if n_frames > 1:  # the path is travelled as fast as time passes: not at all, at rest
        features[:, -2:] *= np.gradient(time_s, FRAME_TIME).clip(0.0)[:, None]
    # From the last pose of one part to the first of the next is a step; add a ramp minus
    # that step, so that the features change smoothly.
    frames = np.arange(n_frames)
    for bound in bounds[1:-1]:
        u = np.clip((frames - bound) * FRAME_TIME / FADE_S / 2 + 0.5, 0.0, 1.0)
        ramp = u**3 * (10 - 15 * u + 6 * u**2)
        features += np.outer(ramp - (frames >= bound), features[bound] - features[bound - 1])
    return features


def _event_time(n_frames: int, statistics: ActionModel, rng: np.random.Generator) -> FloatArray:
    """Time inside the event's window, which stands still before and after, shape (T,).

    A part longer than the window has the event near its middle; a shorter one is cut so
    that the landmarks stay in.
    """
    length_s, event_s = statistics.knots_s[-1], statistics.knots_s[1:-1].mean()
    spare_s = n_frames * FRAME_TIME - length_s
    share = rng.uniform(0.4, 0.6) if spare_s > 0 else event_s / length_s
    time_s = np.arange(n_frames) * FRAME_TIME - spare_s * share
    time_s = event_s + (time_s - event_s) * (1 + TEMPO_SPREAD * _bounded_normal(1, rng)[0])
    # A clip between 0 and the length, but with both corners rounded off over EASE_S.
    started = np.logaddexp(0, time_s / EASE_S) - np.logaddexp(0, (time_s - length_s) / EASE_S)
    return np.asarray(EASE_S * started)


def _pose(statistics: ActionModel, features: FloatArray, heading: FloatArray, name: str) -> Motion:
    """Turn features into channels; the path along the floor is left at 0."""
    model = load_motion_model()
    moving = model.moving
    channels = np.tile(model.rest, (len(features), 1))
    channels[:, moving] = features[:, :-3]
    channels[:, :3] = 0.0
    channels[:, 1] = features[:, -3]
    motion = turn_root(Motion(model.skeleton, FRAME_TIME, channels, name), heading)
    channels = motion.channels.copy()
    channels[:, moving] = soft_limit(channels[:, moving], statistics.limits[:, moving])
    return motion.with_channels(channels)
