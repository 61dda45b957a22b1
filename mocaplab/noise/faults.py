"""Faults that real captures have and the papers leave out.

Spikes, frozen and dropped frames, left and right mixed up, drift and rounding. As
everywhere, the root stays clean and so do channels that never move.

How often a fault comes is given in hertz, faults a second, and how long it stays in
seconds; spikes, which are one frame long, are given as a share of all samples. So a clip
at 30 frames per second is spoilt as much as one at 120.
"""

from __future__ import annotations

import numpy as np

from mocaplab.euler import align_to
from mocaplab.motion import BoolArray, Motion, moving_channels
from mocaplab.noise.angular import check_amount, movement_std
from mocaplab.noise.gaps import PAPER_FPS, draw_runs, hide
from mocaplab.skeletons.mirroring import limb_mirror

SPIKE_STD = 3.0
"""Height of a spike in standard deviations of its channel: outside all true movement."""
FAULT_S = 0.05
"""Mean time for which frames are frozen, dropped or swapped: 6 frames at 120 a second."""


def spikes(motion: Motion, share: float, *, rng: np.random.Generator) -> Motion:
    """Throw single samples far off, as a marker does that is taken for another.

    Each spike is one frame long, in one channel, ``SPIKE_STD`` deviations of the channel up
    or down.

    Parameters
    ----------
    motion : Motion
    share : float in [0, 1], the share of all samples that are spikes
    rng : numpy.random.Generator
    """
    check_amount(share, 1, "the share of spikes")
    hit = rng.random(motion.channels.shape) < share
    sign = rng.choice([-1.0, 1.0], size=hit.shape)
    return motion.with_channels(motion.channels + hit * sign * SPIKE_STD * movement_std(motion))


def frozen_frames(motion: Motion, rate_hz: float, *, rng: np.random.Generator) -> Motion:
    """Hold the whole pose for some frames, as a system does that waits for data.

    The root moves on, because this library takes its path as clean.

    Parameters
    ----------
    motion : Motion
    rate_hz : float in [0, 1000], freezes a second, each ``FAULT_S`` long on average
    rng : numpy.random.Generator
    """
    frozen = _draw_frames(motion, rate_hz, rng)
    held = np.maximum.accumulate(np.where(frozen, 0, np.arange(motion.n_frames)))
    cleaned = motion.skeleton.is_cleaned
    return motion.with_channels(np.where(cleaned, motion.channels[held], motion.channels))


def dropped_frames(motion: Motion, rate_hz: float, *, rng: np.random.Generator) -> Motion:
    """Lose whole frames: NaN in every joint angle but the root's.

    The first and the last frame stay.

    Parameters
    ----------
    motion : Motion
    rate_hz : float in [0, 1000], drops a second, each ``FAULT_S`` long on average
    rng : numpy.random.Generator
    """
    dropped = _draw_frames(motion, rate_hz, rng)
    return hide(motion, ~(dropped[:, None] & motion.skeleton.is_cleaned))


def hold_gaps(motion: Motion) -> Motion:
    """Put the last observed value in place of NaN, as files do that cannot say "missing".

    A gap at the start of a clip has none, and stays NaN.
    """
    frames = np.arange(motion.n_frames)[:, None]
    last = np.maximum.accumulate(np.where(np.isnan(motion.channels), 0, frames), axis=0)
    return motion.with_channels(np.take_along_axis(motion.channels, last, axis=0))


def swaps(motion: Motion, rate_hz: float, *, rng: np.random.Generator) -> Motion:
    """Take left for right for some frames, as pose estimators do.

    Each limb does what the other one did, in a mirror: turns about the axis from left to
    right stay, the other two change their sign, in whatever Euler order. That axis is the
    one along which the offsets of left and right differ most.

    Parameters
    ----------
    motion : Motion
    rate_hz : float in [0, 1000], swaps a second, each ``FAULT_S`` long on average
    rng : numpy.random.Generator

    Raises
    ------
    ValueError
        If no two joints are named as left and right, or two differ in their channels.
    """
    source, sign = limb_mirror(motion.skeleton)
    swapped = _draw_frames(motion, rate_hz, rng)
    # One side may be a full turn ahead of the other, which is no movement.
    mirrored = align_to(motion.with_channels(sign * motion.channels[:, source]), motion)
    touched = swapped[:, None] & moving_channels(motion)
    return motion.with_channels(np.where(touched, mirrored.channels, motion.channels))


def drift(motion: Motion, rate_deg: float, *, rng: np.random.Generator) -> Motion:
    """Let every angle wander off slowly, as inertial suits do.

    This is the "angle random walk" by which gyroscopes are rated: independent steps add
    up, so that the deviation after t seconds is ``rate_deg`` times the square root of t.
    The first frame is right.

    Parameters
    ----------
    motion : Motion
    rate_deg : float in [0, 180], degrees per square root of a second
    rng : numpy.random.Generator
    """
    check_amount(rate_deg, 180, "the drift in degrees per square root of a second")
    steps = rng.normal(size=motion.channels.shape) * rate_deg * np.sqrt(motion.frame_time)
    steps[0] = 0.0
    return motion.with_channels(motion.channels + steps.cumsum(axis=0) * moving_channels(motion))


def quantise(motion: Motion, step_deg: float, *, rng: np.random.Generator) -> Motion:
    """Round every angle that moves to whole steps, as a file with few digits does.

    Parameters
    ----------
    motion : Motion
    step_deg : float in [0, 180], degrees; 0 rounds nothing
    rng : numpy.random.Generator
        Not used: it is there because every corruption is called in the same way.
    """
    check_amount(step_deg, 180, "the step in degrees")
    if step_deg == 0:
        return motion
    rounded = np.round(motion.channels / step_deg) * step_deg
    return motion.with_channels(np.where(moving_channels(motion), rounded, motion.channels))


def _draw_frames(motion: Motion, rate_hz: float, rng: np.random.Generator) -> BoolArray:
    """Draw runs of frames, shape (T,); the first and the last frame are never in one."""
    check_amount(rate_hz, 1000, "the rate in hertz")
    probability = float(-np.expm1(-rate_hz / PAPER_FPS))  # of one or more in 1/120 s
    inside = draw_runs((motion.n_frames,), motion.frame_time, probability, FAULT_S, rng)
    inside[[0, -1]] = False
    return inside
