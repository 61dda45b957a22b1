"""Euler angles over time, and their two traps: full turns and branch switches.

A rotation has many Euler triples: each angle may have full turns added, and there is an
alternate triple (:func:`alternate_euler`). Files jump between them, which looks like a
violent movement and is none. Angles are in degrees, orders as in :mod:`mocaplab.rotations`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from mocaplab.motion import BoolArray, FloatArray, Motion, Skeleton

JUMP_DEG = 90.0
"""Nothing turns this far in one frame: at 30 frames per second, it would be 2,700 degrees per
second, three times as much as the fastest joints."""
TREMBLING_DEG = 20.0
"""A joint that steps by more than this in half of all frames trembles too much to repair."""

_SAMPLES_AT_ONCE = 1 << 18  # frames times joints; more take more memory, and are no faster


def wrap_degrees(angles_deg: ArrayLike) -> FloatArray:
    """Bring angles into [-180, 180) degrees, without any rounding."""
    angles: FloatArray = np.fmod(np.asarray(angles_deg, dtype=np.float64), 360.0)
    angles = np.where(angles >= 180.0, angles - 360.0, angles)
    return np.where(angles < -180.0, angles + 360.0, angles)


def unwrap_degrees(angles_deg: ArrayLike) -> FloatArray:
    """Add full turns along axis 0 so that no step is over 180 degrees; NaN stays NaN."""
    angles = np.asarray(angles_deg, dtype=np.float64)
    return angles + _full_turns(angles)


def _full_turns(angles: FloatArray) -> FloatArray:
    """Find what unwrapping adds, as exact multiples of 360; gaps hold the turns before them."""
    held = _hold(angles)
    return 360.0 * np.round((np.unwrap(held, axis=0, period=360.0) - held) / 360.0)


def check_order(order: str) -> None:
    """Refuse, with a ValueError, what is not one of the 12 Euler orders."""
    if len(order) != 3 or set(order) - set("XYZ") or order[1] in (order[0], order[2]):
        raise ValueError(f"expected three letters out of XYZ, neighbours different, got {order!r}")


def alternate_euler(angles_deg: ArrayLike, order: str) -> FloatArray:
    """Return the other Euler triple of the same rotation.

    Every rotation has two triples (up to full turns): for three different axes
    (a, b, c) and (a + 180, 180 - b, c + 180); for a repeated axis, such as "ZXZ",
    (a + 180, -b, c + 180).

    Parameters
    ----------
    angles_deg : array, shape (..., 3), degrees
    order : str of three letters, neighbours different; ValueError for any other
    """
    check_order(order)
    angles = np.asarray(angles_deg, dtype=np.float64)
    a, b, c = np.moveaxis(angles, -1, 0)
    return np.stack([a + 180.0, -b if order[0] == order[2] else 180.0 - b, c + 180.0], axis=-1)


def align_euler(angles_deg: ArrayLike, reference_deg: ArrayLike, order: str) -> FloatArray:
    """Choose, of all triples of the same rotation, the one nearest to a reference.

    Parameters
    ----------
    angles_deg, reference_deg : array, shape (..., 3), degrees
        NaN in the angles stays NaN; NaN in the reference leaves that angle's turns.
    order : str of three letters

    Returns
    -------
    array, shape (..., 3), degrees: the same rotations as ``angles_deg``
    """
    angles = np.asarray(angles_deg, dtype=np.float64)
    reference = np.asarray(reference_deg, dtype=np.float64)
    reference = np.where(np.isnan(reference), angles, reference)
    same = _nearest_turn(angles, reference)
    other = _nearest_turn(alternate_euler(angles, order), reference)
    nearer = np.linalg.norm(other - reference, axis=-1) < np.linalg.norm(same - reference, axis=-1)
    return np.where(nearer[..., None], other, same)


def _nearest_turn(angles_deg: FloatArray, reference_deg: FloatArray) -> FloatArray:
    """Add full turns; an angle that is near enough comes back bit for bit."""
    return angles_deg + 360.0 * np.round((reference_deg - angles_deg) / 360.0)


def continuity(angles_deg: ArrayLike, order: str) -> tuple[FloatArray, FloatArray]:
    """Find what makes Euler angles continuous over time without changing any rotation.

    Two kinds of jumps are found: full turns (179 to -179 degrees) and switches to the
    alternate triple (see :func:`alternate_euler`), which are jumps of about 180 degrees
    in two channels at once. Both are undone by ``sign * angles_deg + offset``, and put
    back by ``sign * (continuous - offset)``.

    The alternate triple is a mirror image that keeps distances, and its alternate is
    the triple itself. So whether frame t leaves the branch of frame t - 1 does not
    depend on the branch that frame t - 1 was in, and one cumulative sum does what
    looks like a loop over frames. Where angles are missing, it is a loop.

    Parameters
    ----------
    angles_deg : array, shape (T, ..., 3), degrees; NaN where nothing was observed
    order : str of three letters

    Returns
    -------
    sign, offset : arrays, shape (T, ..., 3)
        Plus or minus 1, and a multiple of 180 degrees. Frame 0 stays as it is. Both
        go on through gaps, so that a filled gap can be put back too.
    """
    angles = np.asarray(angles_deg, dtype=np.float64)
    other = alternate_euler(angles, order)
    if np.isnan(angles).any():
        on_other_branch, continuous = _follow(angles, other)
    else:
        stay = np.linalg.norm(wrap_degrees(angles[1:] - angles[:-1]), axis=-1)
        switch = np.linalg.norm(wrap_degrees(other[1:] - angles[:-1]), axis=-1)
        on_other_branch = np.zeros((*angles.shape[:-1], 1), dtype=bool)
        on_other_branch[1:, ..., 0] = np.cumsum(switch < stay, axis=0) % 2 == 1
        continuous = np.unwrap(np.where(on_other_branch, other, angles), axis=0, period=360.0)
    turns = np.round((continuous - np.where(on_other_branch, other, angles)) / 360.0)
    sign = np.where(on_other_branch, [1.0, -1.0, 1.0], 1.0)
    half_turns = np.where(on_other_branch, alternate_euler(np.zeros(3), order), 0.0)
    return sign, half_turns + 360.0 * _hold(turns)


def _follow(angles: FloatArray, other: FloatArray) -> tuple[BoolArray, FloatArray]:
    """Go from frame to frame, comparing each angle with the last one that was observed."""
    on_other_branch = np.zeros((*angles.shape[:-1], 1), dtype=bool)
    continuous = angles.copy()
    last = _hold(angles)[0]
    for t in range(1, len(angles)):
        stay, switch = wrap_degrees(angles[t] - last), wrap_degrees(other[t] - last)
        nearer = np.nansum(switch**2, axis=-1) < np.nansum(stay**2, axis=-1)
        unseen = np.isnan(angles[t])
        on_other_branch[t, ..., 0] = np.where(
            unseen.all(axis=-1), on_other_branch[t - 1, ..., 0], nearer
        )
        continuous[t] = last + np.where(on_other_branch[t], switch, stay)
        last = np.where(unseen, last, continuous[t])
    return on_other_branch, continuous


def _hold(values: FloatArray) -> FloatArray:
    """Replace NaN along axis 0 by the value before it, leading NaN by the value after."""
    observed = ~np.isnan(values)
    frames = np.arange(len(values)).reshape(-1, *[1] * (values.ndim - 1))
    last = np.maximum.accumulate(np.where(observed, frames, -1), axis=0)
    first = np.argmax(observed, axis=0)[None]
    held = np.take_along_axis(values, np.where(last < 0, first, last), axis=0)
    return np.nan_to_num(held, nan=0.0)  # only a channel that was never observed


def channels_of_order(skeleton: Skeleton) -> dict[str, tuple[list[int], list[list[int]]]]:
    """Group joints by their Euler order, so that all joints of one order go together.

    Returns
    -------
    dict from order ("ZYX", or shorter for hinges) to (joints, a list of each one's rotation
    channels in file order); joints without rotation channels are left out
    """
    groups: dict[str, tuple[list[int], list[list[int]]]] = {}
    for joint in range(skeleton.n_joints):
        columns = np.flatnonzero((skeleton.channel_joint == joint) & skeleton.is_rotation)
        order = "".join(skeleton.channel_kind[c][0] for c in columns)
        if order:
            joints, columns_of_joint = groups.setdefault(order, ([], []))
            joints.append(joint)
            columns_of_joint.append(columns.tolist())
    return groups


def rotation_triples(skeleton: Skeleton) -> list[tuple[int, list[int], str]]:
    """List the joints that have three rotation channels.

    Returns
    -------
    list of (joint, the three channel indices in file order, Euler order)
    """
    return sorted(
        (joint, columns, order)
        for order, (joints, columns_of_joint) in channels_of_order(skeleton).items()
        for joint, columns in zip(joints, columns_of_joint, strict=True)
        if len(order) == 3
    )


def motion_continuity(motion: Motion) -> tuple[FloatArray, FloatArray]:
    """Find what makes a whole motion continuous: sign and offset, each of shape (T, C).

    See :func:`continuity`. A joint with one or two rotations has no alternate: only full
    turns are undone. Positions keep sign 1 and offset 0. So does a joint with such strong
    noise that an angle steps by more than ``TREMBLING_DEG`` in half of all frames: a step of
    over 180 degrees may be noise there, and to undo it would bend the rest of the clip.
    """
    sign = np.ones_like(motion.channels)
    offset = np.zeros_like(motion.channels)
    at_once = max(1, _SAMPLES_AT_ONCE // motion.n_frames)  # joints
    for order, (_, all_columns) in channels_of_order(motion.skeleton).items():
        for i in range(0, len(all_columns), at_once):
            columns = all_columns[i : i + at_once]
            angles = motion.channels[:, columns]
            trembles = _trembles(angles)
            if len(order) == 3:
                turned, added = continuity(angles, order)
            else:
                turned, added = np.ones_like(angles), _full_turns(angles)
            sign[:, columns] = np.where(trembles, 1.0, turned)
            offset[:, columns] = np.where(trembles, 0.0, added)
    return sign, offset


def _trembles(angles: FloatArray) -> BoolArray:
    """Tell which joints step by more than ``TREMBLING_DEG`` in half of all frames.

    The angles have shape (T, joints, n), what is returned (joints, 1).
    """
    if len(angles) < 2:
        return np.zeros((angles.shape[1], 1), dtype=bool)
    steps = np.abs(wrap_degrees(np.diff(_hold(angles), axis=0)))
    too_far = np.median(steps, axis=0) > TREMBLING_DEG
    return np.asarray(too_far.any(axis=-1, keepdims=True))


def make_continuous(motion: Motion) -> Motion:
    """Remove full turns and branch switches from every joint of a motion.

    The pose of every frame stays the same; only its description in Euler angles
    changes. NaN stays NaN. See :func:`continuity`.
    """
    sign, offset = motion_continuity(motion)
    return motion.with_channels(sign * motion.channels + offset)


def align_to(motion: Motion, reference: Motion) -> Motion:
    """Describe a motion by the Euler angles that are nearest to a reference's.

    Use it to compare two files, or to go back to a file's own convention: the pose
    of every frame stays the same. See :func:`align_euler`.

    Raises
    ------
    ValueError
        If the two have different joints, channels or numbers of frames.
    """
    if not motion.skeleton.same_as(reference.skeleton) or motion.n_frames != reference.n_frames:
        raise ValueError(
            f"motion {motion.name!r} ({motion.n_frames} frames) and reference "
            f"{reference.name!r} ({reference.n_frames} frames) must have the same joints, "
            f"channels and number of frames"
        )
    channels = motion.channels.copy()
    nearest = np.where(np.isnan(reference.channels), channels, reference.channels)
    for order, (_, columns) in channels_of_order(motion.skeleton).items():
        angles, near = channels[:, columns], nearest[:, columns]
        if len(order) == 3:
            channels[:, columns] = align_euler(angles, near, order)
        else:
            channels[:, columns] = _nearest_turn(angles, near)
    return motion.with_channels(channels)
