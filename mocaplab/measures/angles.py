"""How far the angles of a motion are from the clean ones.

If no angle moves in the clean motion, the errors over what moves are 0: cleaners return such
channels as they came, so there is nothing to get wrong.
"""

from __future__ import annotations

import numpy as np

from mocaplab.euler import wrap_degrees
from mocaplab.motion import FloatArray, Motion, moving_channels
from mocaplab.poses import motion_to_quaternions
from mocaplab.quaternions import (
    quaternion_inverse,
    quaternion_multiply,
    quaternion_to_rotation_vector,
)


def check_pair(motion: Motion, clean: Motion) -> None:
    """Refuse, with a ValueError, two motions that cannot be compared sample by sample.

    They need the same joints, channels, number of frames and frame time (within 1 %: files
    round it), and no sample may be NaN.
    """
    if not motion.skeleton.same_as(clean.skeleton):
        raise ValueError(
            f"expected motion {motion.name!r} to have the joints and channels of {clean.name!r} "
            f"({clean.skeleton.n_joints} joints, {clean.skeleton.n_channels} channels), got "
            f"{motion.skeleton.n_joints} joints, {motion.skeleton.n_channels} channels"
        )
    if motion.n_frames != clean.n_frames:
        raise ValueError(
            f"expected {clean.n_frames} frames as in {clean.name!r}, got {motion.n_frames} in "
            f"{motion.name!r}"
        )
    if not np.isclose(motion.frame_time, clean.frame_time, rtol=0.01, atol=0):
        raise ValueError(
            f"expected {clean.frame_time:.6g} s a frame as in {clean.name!r}, got "
            f"{motion.frame_time:.6g} s in {motion.name!r}"
        )
    for each in (motion, clean):
        check_complete(each)


def check_complete(motion: Motion) -> None:
    """Refuse, with a ValueError, a motion with gaps."""
    missing = np.isnan(motion.channels)
    if missing.any():
        frame, channel = np.argwhere(missing)[0]
        label = motion.skeleton.channel_labels[channel]
        raise ValueError(
            f"motion {motion.name!r}: {label} is NaN in frame {frame}; fill the gaps first"
        )


def rms_all_deg(motion: Motion, clean: Motion) -> float:
    """Root mean square angle error over all joint angles but the root's (paper A).

    Channels that never move count too and dilute it; see :func:`rms_moving_deg`.

    Parameters
    ----------
    motion, clean : Motion
        Of one skeleton, in the same Euler branch
        (:func:`mocaplab.euler.align_to`).

    Returns
    -------
    float, degrees; 0 if there is no joint but the root

    Raises
    ------
    ValueError
        If the two have different joints, channels, lengths or frame times, or gaps. So do
        all measures that compare two motions.
    """
    check_pair(motion, clean)
    return _rms((motion.channels - clean.channels)[:, clean.skeleton.is_cleaned])


def rms_moving_deg(motion: Motion, clean: Motion) -> float:
    """Root mean square angle error over the channels that move in the clean motion.

    Parameters
    ----------
    motion, clean : Motion
        As for :func:`rms_all_deg`.

    Returns
    -------
    float, degrees; 0 if nothing moves
    """
    check_pair(motion, clean)
    return _rms((motion.channels - clean.channels)[:, moving_channels(clean)])


def _rms(error: FloatArray) -> float:
    return float(np.sqrt(np.mean(error**2))) if error.size else 0.0


def harm_deg(output: Motion, clean_input: Motion) -> float:
    """Tell how much cleaning changes a motion that was clean already, RMS.

    A good method leaves such a motion alone. This is :func:`rms_moving_deg` with the input
    as the truth.

    Parameters
    ----------
    output : Motion
        What the method made of ``clean_input``.
    clean_input : Motion

    Returns
    -------
    float, degrees; 0 if nothing moves
    """
    return rms_moving_deg(output, clean_input)


def geodesic_deg(motion: Motion, clean: Motion) -> float:
    """Mean angle between the local rotations of joints and those they should have.

    Two orientations are always one turn apart about some axis; the angle of that turn is the
    shortest way between them (Huynh 2009, "Metrics for 3D rotations"). It does not depend on
    how the Euler angles tell a rotation. The mean is over frames, and over the joints that
    have a channel that moves in the clean motion.

    Returns
    -------
    float, degrees; 0 if nothing moves
    """
    check_pair(motion, clean)
    joints = np.unique(clean.skeleton.channel_joint[moving_channels(clean)])
    if not len(joints):
        return 0.0
    q, truth = (motion_to_quaternions(each)[:, joints] for each in (motion, clean))
    turn = quaternion_to_rotation_vector(quaternion_multiply(quaternion_inverse(truth), q))
    return float(np.degrees(np.linalg.norm(turn, axis=-1)).mean())


def quaternion_l1(motion: Motion, clean: Motion) -> float:
    """L1 distance between quaternions, summed over joints, mean over frames (paper B, Eq. 1).

    The absolute differences of w, x, y and z are added up. q and -q are the same rotation,
    so the sign nearer to the clean quaternion is taken first; the paper does not say so.

    Returns
    -------
    float, no unit; it grows with the number of joints
    """
    check_pair(motion, clean)
    q, truth = motion_to_quaternions(motion), motion_to_quaternions(clean)
    opposite = np.sum(q * truth, axis=-1, keepdims=True) < 0
    distance = np.abs(np.where(opposite, -q, q) - truth)
    return float(distance.sum(axis=(1, 2)).mean())


def euler_mae_rad(motion: Motion, clean: Motion) -> float:
    """Absolute difference of Euler angles, wrapped to half a turn (paper B, Eq. 2).

    The paper calls it the mean absolute error. As printed, the mean is over frames only, and
    joints and axes are summed; so it is here. Divide by the number of rotation channels for
    the mean error of one angle.

    Parameters
    ----------
    motion, clean : Motion
        In the same Euler branch: full turns do not count, but alternate triples do.

    Returns
    -------
    float, radians; it grows with the number of joints
    """
    check_pair(motion, clean)
    error = wrap_degrees(motion.channels - clean.channels)[:, clean.skeleton.is_rotation]
    return float(np.radians(np.abs(error)).sum(axis=1).mean())
