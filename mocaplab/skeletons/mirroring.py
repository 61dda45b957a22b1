"""Left and right: which joints are pairs, and a motion in the mirror."""

from __future__ import annotations

import re

import numpy as np

from mocaplab.motion import FloatArray, IntArray, Motion, Skeleton

_SIDES = (
    (r"Left", "Right"),
    (r"left", "right"),
    (r"^L(?=[A-Z_])", "R"),  # LThumb, L_Knee
    (r"^l(?=[A-Z_])", "r"),  # lThigh
    (r"(?<=[._])L$", "R"),  # thigh.L
    (r"(?<=[._])l$", "r"),
)


def left_right_pairs(skeleton: Skeleton) -> list[tuple[int, int]]:
    """Find the joints whose names differ by side only: LeftLeg and RightLeg, lThigh and rThigh.

    Returns
    -------
    list of (left, right), joint indices

    Raises
    ------
    ValueError
        If there is none.
    """
    index = {name: joint for joint, name in enumerate(skeleton.joint_names)}
    pairs = []
    for joint, name in enumerate(skeleton.joint_names):
        others = (re.sub(left, right, name) for left, right in _SIDES)
        partner = next((index[other] for other in others if other != name and other in index), None)
        if partner is not None:
            pairs.append((joint, partner))
    if not pairs:
        raise ValueError(
            f"expected joints named LeftLeg and RightLeg or lThigh and rThigh, got "
            f"{', '.join(skeleton.joint_names)}"
        )
    return pairs


def mirror(motion: Motion) -> Motion:
    """Return what a mirror would show: left and right are exchanged.

    Turns about the axis from left to right stay and the other two change their sign, in
    whatever Euler order; positions along that axis change theirs. The axis is the one along
    which the offsets of left and right differ most. It is exact for a skeleton whose halves
    mirror each other; otherwise the poses fit the bones of the other side.

    Parameters
    ----------
    motion : Motion

    Raises
    ------
    ValueError
        If no two joints are named as left and right, or two differ in their channels.
    """
    source, sign = limb_mirror(motion.skeleton)
    alone = source == np.arange(len(source))  # the spine, and whatever has no partner
    sign = np.where(alone, _mirror_sign(motion.skeleton), sign)
    return motion.with_channels(motion.channels[:, source] * sign)


def limb_mirror(skeleton: Skeleton) -> tuple[IntArray, FloatArray]:
    """Find the channel that each channel takes its value from in a mirror, and its sign.

    Only joints that have a partner change; all others keep their values.

    Returns
    -------
    source : array, shape (C,), int
    sign : array, shape (C,), 1 or -1

    Raises
    ------
    ValueError
        If no two joints are named as left and right, or two differ in their channels.
    """
    pairs = left_right_pairs(skeleton)
    kinds = zip(skeleton.channel_joint.tolist(), skeleton.channel_kind, strict=True)
    column = {joint_and_kind: channel for channel, joint_and_kind in enumerate(kinds)}
    source = np.arange(skeleton.n_channels)
    for here, there in [*pairs, *((right, left) for left, right in pairs)]:
        if set(skeleton.channel_names[here]) != set(skeleton.channel_names[there]):
            names = f"{skeleton.joint_names[here]!r} and {skeleton.joint_names[there]!r}"
            raise ValueError(f"expected the same channels in joints {names}, to swap them")
        for kind in skeleton.channel_names[here]:
            source[column[here, kind]] = column[there, kind]
    paired = source != np.arange(len(source))
    return source, np.where(paired, _mirror_sign(skeleton), 1.0)


def _mirror_sign(skeleton: Skeleton) -> FloatArray:
    """Return 1 for turns about the lateral axis and for positions along the others, else -1."""
    axis = _lateral_axis(skeleton)
    lateral = np.array([kind[0] == axis for kind in skeleton.channel_kind])
    return np.where(lateral == skeleton.is_rotation, 1.0, -1.0)


def _lateral_axis(skeleton: Skeleton) -> str:
    """Return the axis along which the offsets of left and right joints differ most."""
    left, right = np.array(left_right_pairs(skeleton)).T
    apart = np.abs(skeleton.offsets[left] - skeleton.offsets[right]).sum(axis=0)
    return "XYZ"[np.argmax(apart)]
