"""Walks and runs: which clips to use, where their gait cycles are, and their Fourier series.

Clips that would spoil a mean are left out by rule: those whose lower foot rises or sinks
by more than 20 cm (stairs), that turn by more than 30 degrees, or whose path is 5 percent
longer than a straight line.
"""

from __future__ import annotations

import numpy as np

from data_tools.model_clips import frame_features
from mocaplab.kinematics import forward_kinematics
from mocaplab.measures.movement import foot_heights
from mocaplab.motion import BoolArray, FloatArray, Motion
from mocaplab.motion_model import CM_PER_UNIT, fourier_basis

N_HARMONICS = 8  # of the gait cycle: 7 Hz in a walk, 11 Hz in a run
MAX_RISE_CM, MAX_TURN_DEG, MAX_DETOUR = 20.0, 30.0, 1.05


def is_plain_gait(motion: Motion) -> bool:
    """Tell whether a clip is walking or running straight on, on a level floor."""
    heights_cm = foot_heights(motion).min(axis=1) * CM_PER_UNIT
    if np.ptp(heights_cm) > MAX_RISE_CM:
        return False
    forward = forward_kinematics(motion)[1][:, 0, :, 2]
    heading = np.unwrap(np.arctan2(forward[:, 0], forward[:, 2]))
    path = motion.channels[:, [0, 2]]
    length = np.linalg.norm(np.diff(path, axis=0), axis=1).sum()
    straight = np.linalg.norm(path[-1] - path[0])
    return bool(np.degrees(np.ptp(heading)) < MAX_TURN_DEG and length < MAX_DETOUR * straight)


def travel_direction(motion: Motion) -> float:
    """Direction from the first to the last frame, radians from +z towards +x."""
    x, z = motion.channels[-1, [0, 2]] - motion.channels[0, [0, 2]]
    return float(np.arctan2(x, z))


def gait_phase(motion: Motion, direction_rad: float) -> FloatArray:
    """Find where in the gait cycle every frame is.

    Parameters
    ----------
    motion : Motion, a walk or run of at least two steps
    direction_rad : float, the direction of travel, from +z towards +x

    Returns
    -------
    array, shape (T,), in cycles
        A whole number when the left foot passes the right one, a half when the right
        foot passes the left one.
    """
    positions = forward_kinematics(motion)[0]
    names = motion.skeleton.joint_names
    apart = positions[:, names.index("LeftFoot")] - positions[:, names.index("RightFoot")]
    ahead = apart[:, 0] * np.sin(direction_rad) + apart[:, 2] * np.cos(direction_rad)
    # One foot may swing farther than the other; passing is halfway between the extremes.
    ahead -= (np.percentile(ahead, 98) + np.percentile(ahead, 2)) / 2
    at = np.flatnonzero(np.diff(np.signbit(ahead)))
    at = at[np.concatenate([[True], np.diff(at) > 20])]  # no step is shorter than 1/6 s
    frame = at + ahead[at] / (ahead[at] - ahead[at + 1])  # passing lies between two frames
    halves = np.arange(len(at)) / 2 + (0.0 if ahead[at[0] + 1] > 0 else 0.5)
    # Straight lines between passings, and the mean rate before the first and after the last.
    rate = (halves[-1] - halves[0]) / (frame[-1] - frame[0])
    t = np.arange(motion.n_frames)
    phase = np.interp(t, frame, halves)
    return np.asarray(phase + rate * (np.minimum(t - frame[0], 0) + np.maximum(t - frame[-1], 0)))


def fit_cycle(motion: Motion, moving: BoolArray, direction_rad: float) -> tuple[FloatArray, float]:
    """Fit the Fourier series of one walk or run by least squares.

    Parameters
    ----------
    motion : Motion
    moving : array, shape (C,), the rotation channels to fit
    direction_rad : float, the direction of travel, from +z towards +x

    Returns
    -------
    coefficients : array, shape (2 * N_HARMONICS + 1, F)
        The last two features are velocities to the side and forward, units per second.
    rate : float, cycles per second
    """
    floor = float(np.percentile(foot_heights(motion).min(axis=1), 20))
    values = frame_features(motion, moving, direction_rad, floor)
    values[:, -2:] = np.gradient(values[:, -2:], motion.frame_time, axis=0)
    phase = gait_phase(motion, direction_rad)
    # A straight trend is fitted beside the series and dropped: a clip that leans over
    # slowly must not show as a first harmonic.
    trend = np.linspace(-1.0, 1.0, motion.n_frames)[:, None]
    basis = np.concatenate([fourier_basis(phase, N_HARMONICS), trend], axis=1)
    # A clip of little more than one cycle leaves some harmonics nearly free; the ridge
    # keeps those small, but never the average posture.
    ridge = 1e-3 * motion.n_frames * np.eye(basis.shape[1])
    ridge[0, 0] = 0.0
    solution = np.linalg.solve(basis.T @ basis + ridge, basis.T @ values)
    return solution[:-1], float((phase[-1] - phase[0]) / motion.duration_s)
