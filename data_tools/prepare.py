"""What a clip of the CMU database goes through on its way in.

Two things are wrong with some of the public files (the numbers below were measured on 78
CMU clips of known rate, see ``tests/test_prepare.py``):

1. *A T-pose in front.* The public BVH conversions put one made-up frame before the
   recording. It is taken away when it is there: every joint of the first frame is within
   ``REST_DEG`` of no rotation at all, and the step to the second frame, a mean over the
   joints, is at least ``STEP_DEG`` and ``STEP_RATIO`` times the largest of the next ten.
   The DAZ-friendly files fade from a T-pose over some frames; those are not touched.
2. *A wrong frame time.* CMU recorded at 120 fps, some takes at 60. A header that says the
   one while the take is the other plays the motion at double or half speed. Gravity and
   the stride show it. In runs, jumps and kicks the hips fall for a moment with 1.1 to
   2.1 g (legs swing as well, so it is not exactly one), at double speed with 3.7 to 5.2,
   at half speed with 0.35 to 0.7. In walks the ankles part and meet at 0.2 to 1.1 strides
   a second. Past the limits below, the header's rate is halved or doubled. Where nothing
   can be measured, the header is believed. Of the 78 clips, told at double speed on
   purpose, 70 of 73 were found out, and none at its true speed was taken for a liar; a
   walk at half speed is never found out, for it may dawdle.

The numbers of a clip are never changed, only frame 0 and the frame time.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from mocaplab.kinematics import forward_kinematics, local_transforms
from mocaplab.motion import FloatArray, Motion

REST_DEG, STEP_DEG, STEP_RATIO = 45.0, 3.0, 1.8
RATES_FPS = (120.0, 60.0)
"""The rates at which CMU recorded."""
M_PER_UNIT = 0.0254 / 0.45
GRAVITY = 9.81 / M_PER_UNIT  # file units per second squared
FALL_S = 0.1  # the fall is measured over so long
FALL_G = {"jog": (0.5, 1.9), "run": (0.65, 2.6), "jump": (0.75, 2.6), "kick": (0.75, 2.6)}
# Some walks dawdle at 0.2 strides a second: too slow proves nothing.
STRIDES_PER_S = {"walk": (0.0, 1.35), "jog": (0.0, 1.8), "run": (0.0, 1.8)}
FEET = (("LeftFoot", "RightFoot"), ("lfoot", "rfoot"))


@dataclass(frozen=True, eq=False)
class Prepared:
    """A clip that is ready for use, and what was done to it.

    Parameters
    ----------
    motion : Motion
    notes : tuple of str, one for every change or doubt; empty if there was none
    """

    motion: Motion
    notes: tuple[str, ...]

    @property
    def is_usual(self) -> bool:
        """True at 120 fps, the rate that all clips of a data set must share."""
        return _is_near(self.motion.fps, RATES_FPS[0])


def _is_near(fps: float, rate: float) -> bool:
    return abs(fps / rate - 1) < 0.01


def turns_deg(rotations: FloatArray) -> FloatArray:
    """Angles of rotation matrices, shape (..., 3, 3) to (...), degrees from 0 to 180."""
    cosine = (np.trace(rotations, axis1=-2, axis2=-1) - 1) / 2
    return np.asarray(np.degrees(np.arccos(np.clip(cosine, -1, 1))))


def has_tpose_frame(motion: Motion) -> bool:
    """Tell whether the first frame is a T-pose that was put in front of the recording.

    Angles between poses are compared, not channels: a full turn in a channel is no step.
    """
    if motion.n_frames < 4:
        return False
    rotations = local_transforms(motion.slice_frames(0, 12))[1]
    steps = turns_deg(np.swapaxes(rotations[:-1], -1, -2) @ rotations[1:]).mean(axis=1)
    return bool(
        turns_deg(rotations[0]).max() <= REST_DEG
        and steps[0] >= STEP_DEG
        and steps[0] >= STEP_RATIO * steps[1:].max()
    )


def fall_g(motion: Motion) -> float | None:
    """Largest downward acceleration of the hips, in g, if the header's rate is right.

    A parabola is fitted to every tenth of a second of the root's height.

    Returns
    -------
    float, or None when the root has no height or the clip is too short
    """
    heights = np.flatnonzero(
        (motion.skeleton.channel_joint == 0)
        & [kind == "Yposition" for kind in motion.skeleton.channel_kind]
    )
    n = 2 * round(FALL_S * motion.fps / 2) + 1
    if len(heights) == 0 or n < 5 or motion.n_frames < 2 * n:
        return None
    t = (np.arange(n) - n // 2) * motion.frame_time
    fit = np.linalg.pinv(np.stack([np.ones(n), t, t**2], axis=1))[2]
    pieces = np.lib.stride_tricks.sliding_window_view(motion.channels[:, heights[0]], n)
    return float(max(0.0, -2 * (pieces @ fit).min()) / GRAVITY)


def strides_per_s(motion: Motion) -> float | None:
    """Strides (two steps) a second: the main frequency at which the ankles part and meet.

    Returns
    -------
    float, or None without ankles of a known name, or for less than a second
    """
    names = motion.skeleton.joint_names
    pair = next((pair for pair in FEET if set(pair) <= set(names)), None)
    if pair is None or motion.duration_s < 1:
        return None
    positions, _ = forward_kinematics(motion)
    apart = positions[:, names.index(pair[0])] - positions[:, names.index(pair[1])]
    apart = apart[:, [0, 2]] - apart[:, [0, 2]].mean(axis=0)
    along = apart @ np.linalg.svd(apart, full_matrices=False)[2][0]
    n = max(8192, motion.n_frames)
    power = np.abs(np.fft.rfft(along * np.hanning(len(along)), n))
    return float(np.fft.rfftfreq(n, motion.frame_time)[power.argmax()])


def true_fps(motion: Motion, action: str) -> float:
    """Find the rate at which a clip was recorded: the header's, or 120 or 60 instead.

    Parameters
    ----------
    motion : Motion, without a T-pose in front
    action : str, such as "walk"; an unknown one is not checked
    """
    measured = [
        (measure(motion), limits[action])
        for measure, limits in ((fall_g, FALL_G), (strides_per_s, STRIDES_PER_S))
        if action in limits
    ]
    if _is_near(motion.fps, 120) and any(v is not None and v > high for v, (_, high) in measured):
        return 60.0
    if _is_near(motion.fps, 60) and any(v is not None and v < low for v, (low, _) in measured):
        return 120.0
    return motion.fps


def prepare(motion: Motion, action: str) -> Prepared:
    """Take away a leading T-pose and correct a frame time that cannot be true.

    Parameters
    ----------
    motion : Motion, as the file has it
    action : str, what the clip shows

    Returns
    -------
    Prepared
    """
    notes = []
    if has_tpose_frame(motion):
        motion = motion.slice_frames(1, motion.n_frames)
        notes.append("took away the T-pose in front")
    fps = true_fps(motion, action)
    if not _is_near(fps, motion.fps):
        notes.append(f"set {fps:g} fps: at the header's {motion.fps:.4g} a {action} is impossible")
        motion = replace(motion, frame_time=1 / fps)
    if not any(_is_near(motion.fps, rate) for rate in RATES_FPS):
        notes.append(f"{motion.fps:.4g} fps is not a rate at which CMU recorded")
    return Prepared(motion, tuple(notes))
