"""What is wrong with a motion file, said in plain sentences.

:func:`diagnose` looks for the traps that spoil cleaning and learning from motion capture
without any warning. It changes nothing. Frames count from 0.
"""

from __future__ import annotations

import numpy as np

from mocaplab.euler import JUMP_DEG, motion_continuity, rotation_triples, wrap_degrees
from mocaplab.findings import ADVICE, Finding, findings_of
from mocaplab.motion import BoolArray, FloatArray, Motion, moving_channels
from mocaplab.poses import motion_to_quaternions

NEAR_LOCK_DEG = 5.0
"""This near to gimbal lock, the outer angles may move 11 times as fast as the joint."""
REST_POSE_DEG = 30.0
"""How far some joint of a rest pose is from the movement; arms held out are at 60 or more.
Half of that will do for a pose that is the skeleton as it was drawn."""
DRAWN_DEG = 12.0
"""A pose with all angles below this is the skeleton as it was drawn; some files bend the
fingers by 10 degrees even there."""
FASTEST_DEG_PER_S = 900.0
"""Three joints of a person do not turn faster at once in more than one frame of twenty:
over walks, runs, jumps, kicks and dances of the CMU collection, the most is 652."""
FASTEST_HEIGHTS_PER_S = 8.0
"""The fastest sprinters run 12.4 m/s, seven times their height a second."""
USUAL_FPS = (120, 60, 30)
"""The rates that are tried when the stated one cannot be; 30 and 120 are mixed up the most."""
SMOOTH_RATIO = 1.3
"""In a smooth motion, joints turn twice as far in two frames as in one; in pure noise, just
as far. Below this, speed tells of noise and says nothing about the frame rate."""


def diagnose(motion: Motion) -> list[Finding]:
    """List what a motion suffers from, the most pressing first.

    Found are missing samples (NaN), a frame time that people could not keep up with, a
    rest pose put in front of the movement, joints that jump, full turns, switches of the
    Euler branch, frames near gimbal lock, and joint angles that never move. Full turns and
    switches are not looked for in joints that tremble so much that noise and turns cannot
    be told apart (:func:`mocaplab.euler.motion_continuity`).

    **The rule for the frame time.** Two speeds are taken that 95 of 100 frames keep below:
    that of the third fastest joint, and that of the root in body heights per second. If
    one is beyond people at the stated rate, but both are within reach at 120, 60 or 30
    frames per second, the frame time is doubted. A motion that is too slow is never
    doubted, since people may move as slowly as they like.

    Parameters
    ----------
    motion : Motion
        As the file has it: not yet made continuous.

    Returns
    -------
    list of Finding, empty for a motion with nothing to mention
    """
    quaternions = motion_to_quaternions(motion)
    steps = _angle_deg(quaternions[1:], quaternions[:-1])  # (T - 1, J)
    rest = _rest_pose(motion, quaternions, steps)
    later = sum(
        finding.n_frames for finding in rest
    )  # the steps away from the rest pose are told once
    labels = motion.skeleton.channel_labels
    names = motion.skeleton.joint_names
    turns, switches = _turns_and_switches(motion)
    jumps = np.zeros((motion.n_frames, len(names)), dtype=bool)
    jumps[1 + later :] = steps[later:] > JUMP_DEG
    return [
        *findings_of("missing", labels, np.isnan(motion.channels)),
        *_frame_time(motion, quaternions[later:]),
        *rest,
        *findings_of("jump", names, jumps),
        *findings_of("full turn", labels, turns),
        *findings_of("branch switch", names, switches),
        *findings_of("near gimbal lock", names, _near_lock(motion)),
        *_constant(motion),
    ]


def _angle_deg(p: FloatArray, q: FloatArray) -> FloatArray:
    """Angle between rotations, degrees, exact for small ones too; 0 where one is missing."""
    far, near = np.sort(np.linalg.norm([q + p, q - p], axis=-1), axis=0)[::-1]
    angle: FloatArray = np.degrees(4 * np.arctan2(near, far))
    return np.nan_to_num(angle)


def _turns_and_switches(motion: Motion) -> tuple[BoolArray, BoolArray]:
    """Where a channel takes a full turn, (T, C), and a joint switches its branch, (T, J)."""
    sign, offset = motion_continuity(motion)
    turns = np.diff(offset, axis=0, prepend=offset[:1]) != 0
    switches = np.zeros((motion.n_frames, motion.skeleton.n_joints), dtype=bool)
    for joint, columns, _ in rotation_triples(motion.skeleton):
        middle = sign[:, columns[1]]
        switches[:, joint] = np.diff(middle, prepend=middle[0]) != 0
        turns[:, columns] &= ~switches[:, joint, None]  # its half turns are told already
    return turns, switches


def _near_lock(motion: Motion) -> BoolArray:
    """Where the middle angle of a joint is nearly 90 degrees, (T, J).

    A joint cannot have one channel twice, so its three axes differ, and lock is there.
    """
    near = np.zeros((motion.n_frames, motion.skeleton.n_joints), dtype=bool)
    for joint, columns, _ in rotation_triples(motion.skeleton):
        middle = np.abs(wrap_degrees(motion.channels[:, columns[1]]))
        near[:, joint] = np.abs(middle - 90.0) < NEAR_LOCK_DEG
    return near


def _constant(motion: Motion) -> list[Finding]:
    """Name the joint angles that never move; one frame alone says nothing about that."""
    observed = ~np.isnan(motion.channels).all(axis=0)
    still = motion.skeleton.is_cleaned & observed & ~moving_channels(motion)
    labels = [motion.skeleton.channel_labels[c] for c in np.flatnonzero(still)]
    advice = ADVICE["constant"]
    return [
        Finding("constant", label, (), "note", f"{label} is constant: {advice}.")
        for label in labels
        if motion.n_frames > 1
    ]


def _rest_pose(motion: Motion, quaternions: FloatArray, steps: FloatArray) -> list[Finding]:
    """Find a pose in frame 0 that is not part of the movement, and frames blended from it."""
    if motion.n_frames < 3 or motion.skeleton.n_joints < 2:
        return []
    away = _angle_deg(quaternions[1:, 1:], quaternions[0, 1:]).max(axis=1)  # (T - 1,)
    pace = steps[:, 1:].max(axis=1)
    usual = np.percentile(pace[1:], 95)
    angles = wrap_degrees(motion.channels[0, motion.skeleton.is_cleaned])
    drawn = bool(np.all(np.abs(angles) < DRAWN_DEG))
    nearest = away[0] if drawn else away.min()
    # Twice the usual step: in strong noise, every frame is far from every other.
    if away[0] <= 2 * usual or nearest < REST_POSE_DEG / (2 if drawn else 1):
        return []
    last = int(np.argmin(np.append(pace > 2 * usual, False))) - 1
    frames = "Frame 0 is" if last == 0 else f"Frames 0 to {last} are"
    message = (
        f"{frames} a rest pose and no part of the movement: a joint is {away[0]:.0f} degrees "
        f"from frame 1; leave {'it' if last == 0 else 'them'} out."
    )
    return [Finding("rest pose", "", ((0, last),), "warning", message)]


def _frame_time(motion: Motion, quaternions: FloatArray) -> list[Finding]:
    """Doubt a frame time that people could not keep up with."""
    if len(quaternions) < 3:
        return []
    one, two = (_angle_deg(quaternions[n:], quaternions[:-n]) for n in (1, 2))
    if np.median(two.max(axis=1)) < SMOOTH_RATIO * np.median(one.max(axis=1)):
        return []
    # The third fastest: thumbs and collars jump for reasons of their own.
    third = np.sort(one, axis=1)[:, -min(3, one.shape[1])]
    turn_deg = float(np.percentile(third, 95))  # per frame
    heights = _root_step(motion)
    slowed = max(turn_deg / FASTEST_DEG_PER_S, heights / FASTEST_HEIGHTS_PER_S)
    possible = [fps for fps in USUAL_FPS if fps < 0.9 * motion.fps and fps * slowed <= 1]
    if motion.fps * slowed <= 1 or not possible:
        return []
    message = (
        f"At {motion.fps:.4g} frames per second, joints turn {turn_deg * motion.fps:,.0f} degrees "
        f"and the root goes {heights * motion.fps:.1f} body heights per second, which people "
        f"cannot; {possible[0]} would be possible: check the frame time."
    )
    return [Finding("frame time", "", (), "warning", message)]


def _root_step(motion: Motion) -> float:
    """How far the root goes in a frame, in body heights; 95 of 100 steps are shorter."""
    skeleton = motion.skeleton
    drawn = np.zeros((skeleton.n_joints, 3))
    for joint, parent in enumerate(skeleton.parents.tolist()):
        if parent >= 0:
            drawn[joint] = drawn[parent] + skeleton.offsets[joint]
    height = float(np.ptp(drawn, axis=0).max())  # drawn standing, or with arms held out
    path = motion.channels[:, (skeleton.channel_joint == 0) & ~skeleton.is_rotation]
    steps = np.linalg.norm(np.nan_to_num(np.diff(path, axis=0)), axis=1)
    return float(np.percentile(steps, 95)) / height if height > 0 else 0.0
