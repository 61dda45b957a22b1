"""Jumps and kicks: their landmarks, their direction, and their cosine series.

These happen once, so clips are lined up by landmarks instead of a cycle: each clip's time
is warped so that, say, every take-off falls on the same moment of a common window.
"""

from __future__ import annotations

import numpy as np

from data_tools.model_clips import frame_features
from mocaplab.kinematics import forward_kinematics
from mocaplab.measures.movement import foot_heights
from mocaplab.motion import BoolArray, FloatArray, Motion
from mocaplab.motion_model import CM_PER_UNIT, FRAME_TIME, cosine_basis

N_COSINES = 48  # half periods over a window of about 2 s: 11 Hz
WINDOW_S = {"jump": (1.0, 0.8), "kick": (1.05, 0.95)}  # before the first, after the last landmark
FLIGHT_CM = 8.0  # both feet above the standing height by this much: in flight


def jump_landmarks(motion: Motion) -> list[int]:
    """Frames of crouch, take-off, landing and lowest point after it; empty if not one jump."""
    low = foot_heights(motion).min(axis=1)
    airborne = (low - np.median(low)) * CM_PER_UNIT > FLIGHT_CM
    edges = np.flatnonzero(np.diff(airborne.astype(int)))
    if len(edges) != 2:
        return []
    up, down = edges.tolist()
    height = motion.channels[:, 1]
    return [int(height[:up].argmin()), up, down, down + int(height[down : down + 60].argmin())]


def kick_landmarks(motion: Motion) -> list[int]:
    """Frames of backswing, ball contact and follow-through of the right foot."""
    foot = right_foot(motion)
    contact = int(np.linalg.norm(np.diff(foot, axis=0), axis=1).argmax())
    back, after = max(contact - 40, 0), contact + 5
    backswing = back + int(foot[back:contact, 1].argmax())
    return [backswing, contact, after + int(foot[after : after + 40, 1].argmax())]


def jump_direction(motion: Motion, landmarks: list[int]) -> float:
    """Mean direction that the hips face between the first and the last landmark.

    Radians from +z towards +x. A jump on the spot travels nowhere, so its path has none.
    """
    forward = forward_kinematics(motion)[1][landmarks[0] : landmarks[-1], 0, :, 2].mean(axis=0)
    return float(np.arctan2(forward[0], forward[2]))


def kick_direction(motion: Motion, landmarks: list[int]) -> float:
    """Direction that the kicking foot moves around the ball contact, from +z towards +x."""
    foot = right_foot(motion)
    x, _, z = foot[landmarks[1] + 4] - foot[landmarks[1] - 4]
    return float(np.arctan2(x, z))


def right_foot(motion: Motion) -> FloatArray:
    """Position of the right ankle, shape (T, 3), file length units."""
    return forward_kinematics(motion)[0][:, motion.skeleton.joint_names.index("RightFoot")]


def event_knots(action: str, landmarks: list[list[int]]) -> FloatArray:
    """Lay out the common window: the mean time between landmarks, and margins.

    Returns
    -------
    array, shape (n,), seconds
        Start of the window, the landmarks, end of the window.
    """
    before, after = WINDOW_S[action]
    steps = np.mean([np.diff(frames) for frames in landmarks], axis=0) * FRAME_TIME
    return np.cumsum([0.0, before, *steps, after])


def fit_event(
    motion: Motion,
    moving: BoolArray,
    direction_rad: float,
    landmarks: list[int],
    knots_s: FloatArray,
) -> FloatArray:
    """Fit the cosine series of one jump or kick, warped so that landmarks meet the knots.

    Parameters
    ----------
    motion : Motion
    moving : array, shape (C,), the rotation channels to fit
    direction_rad : float, from +z towards +x
    landmarks : list of frames
    knots_s : array, from ``event_knots``

    Returns
    -------
    array, shape (N_COSINES, F)
        The last two features are velocities to the side and forward, units per second.
    """
    from scipy.interpolate import CubicSpline, PchipInterpolator

    before, after = knots_s[1], knots_s[-1] - knots_s[-2]
    first, last = landmarks[0] - before / FRAME_TIME, landmarks[-1] + after / FRAME_TIME
    time_s = np.arange(0.0, knots_s[-1], FRAME_TIME)
    # PCHIP, because a warp must never run backwards, and it is monotone between knots.
    frame = PchipInterpolator(knots_s, [first, *landmarks, last])(time_s)
    frame = frame.clip(0, motion.n_frames - 1)  # a clip that ends early holds its last pose
    floor = float(np.median(foot_heights(motion).min(axis=1)))
    recorded = frame_features(motion, moving, direction_rad, floor)
    values = CubicSpline(np.arange(motion.n_frames), recorded)(frame)
    values[:, -2:] = np.gradient(values[:, -2:], FRAME_TIME, axis=0)
    basis = cosine_basis(time_s / knots_s[-1], N_COSINES)
    return np.asarray(np.linalg.solve(basis.T @ basis, basis.T @ values))
