"""Copy a motion from one skeleton to another: another body, other channels, other names.

What is copied is how far each joint has turned away from its rest pose, seen from the world.
The limits of that are worth knowing:

- Both skeletons must rest in the same pose, bones pointing the same ways. This is checked;
  a T-pose and an A-pose do not fit together.
- Nobody looks after contacts. Feet may slide or sink in, and hands that met may miss each
  other, the more so the more the proportions of the two bodies differ.
- The root's path is scaled by the length of the legs, so that long legs make long steps.
- A joint that is there only in the target stays at rest. Bones that change their lengths,
  which files with positions on every joint can say, do not do so in the target.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from difflib import get_close_matches

import numpy as np

from mocaplab.euler import (
    align_to,
    alternate_euler,
    channels_of_order,
    make_continuous,
    wrap_degrees,
)
from mocaplab.kinematics import forward_kinematics, local_transforms
from mocaplab.motion import FloatArray, Motion, Skeleton
from mocaplab.rotations import matrix_to_euler, matrix_to_rotation_vector
from mocaplab.skeletons.rest_pose import check_rest_poses, leg_ratio

REST_TOLERANCE_DEG = 15.0
"""How far a bone of the target may point from where the source's bone points at rest."""

MOVES_DEG = 1.0
"""A joint that never turns away from rest by more than this does not move."""

HINGE_TOLERANCE_DEG = 1e-3
"""How much of a turn a joint with fewer than three rotations may lose."""


def retarget(
    motion: Motion,
    skeleton: Skeleton,
    joint_map: Mapping[str, str | None] | None = None,
    *,
    scale: float | None = None,
    rest_tolerance_deg: float = REST_TOLERANCE_DEG,
) -> Motion:
    """Make another skeleton do what a motion does; read above what this can and cannot do.

    Parameters
    ----------
    motion : Motion, without NaN
    skeleton : Skeleton, the target
    joint_map : dict from names of the motion's joints to names of the target's, or to None
        None lets the movement of a joint go. By default equal names are joined.
    scale : float, optional
        Factor of the root's path. By default the ratio of the lengths of the legs: of the
        bones between the root and the mapped joint that lies lowest at rest, Y being up.
    rest_tolerance_deg : float, degrees
        See the first limit above.

    Returns
    -------
    Motion
        On the target; Euler angles continuous, near the source's where the channels are the
        same. Mapped joints have the source's orientations, to rounding.

    Raises
    ------
    ValueError
        If the map names joints that are not there, or one twice; the root of the target
        gets nothing; a joint that moves goes nowhere, and not to None; the rest poses
        differ; the target lacks the channels for what it should do; the leg has no length;
        or a sample is missing.
    """
    source = motion.skeleton
    if np.isnan(motion.channels).any():
        frame, channel = np.argwhere(np.isnan(motion.channels))[0]
        label = source.channel_labels[channel]
        raise ValueError(
            f"cannot retarget {motion.name!r}: {label} is NaN in frame {frame}; fill the gaps first"
        )
    pairs = _joint_pairs(motion, skeleton, joint_map)
    check_rest_poses(source, skeleton, pairs, rest_tolerance_deg)
    if scale is None:
        scale = leg_ratio(source, skeleton, pairs)
    if not 0 < scale < np.inf:
        raise ValueError(f"expected a scale above 0, got {scale}")
    positions, orientations = forward_kinematics(motion)
    turns = _local_turns(skeleton, orientations, pairs)
    channels = np.empty((motion.n_frames, skeleton.n_channels))
    _set_positions(channels, skeleton, scale * positions[:, pairs[0]])
    _set_rotations(channels, skeleton, turns)
    result = make_continuous(replace(motion, skeleton=skeleton, channels=channels))
    return align_to(result, motion) if skeleton.same_as(source) else result


def _joint_pairs(
    motion: Motion, target: Skeleton, joint_map: Mapping[str, str | None] | None
) -> dict[int, int]:
    """Return which joint of the source each mapped joint of the target follows."""
    source = motion.skeleton
    if joint_map is None:
        joint_map = {name: name for name in source.joint_names if name in target.joint_names}
    pairs: dict[int, int] = {}
    for name, target_name in joint_map.items():
        joint = _index(source, name, "the motion")
        if target_name is not None:
            follower = _index(target, target_name, "the target")
            if follower in pairs:
                first = source.joint_names[pairs[follower]]
                raise ValueError(
                    f"target joint {target_name!r} can follow one joint, got {first!r} and {name!r}"
                )
            pairs[follower] = joint
    if 0 not in pairs:
        raise ValueError(
            f"the target's root {target.joint_names[0]!r} must follow a joint of the motion; "
            f"map one to it"
        )
    turned = np.linalg.norm(matrix_to_rotation_vector(local_transforms(motion)[1]), axis=-1)
    farthest_deg = np.degrees(turned.max(axis=0))
    lost = [
        f"{name} ({degrees:.0f} degrees)"
        for joint, (name, degrees) in enumerate(zip(source.joint_names, farthest_deg, strict=True))
        if degrees > MOVES_DEG and name not in joint_map and joint not in pairs.values()
    ]
    if lost:
        raise ValueError(
            f"these joints of {motion.name!r} turn, but are mapped to nothing: {', '.join(lost)}; "
            f"map each to a joint of the target, or to None to let its movement go"
        )
    return pairs


def _index(skeleton: Skeleton, name: str, whose: str) -> int:
    if name in skeleton.joint_names:
        return skeleton.joint_names.index(name)
    near = get_close_matches(name, skeleton.joint_names, cutoff=0.0)
    raise ValueError(f"{whose} has no joint {name!r}; the nearest names are {', '.join(near)}")


def _local_turns(target: Skeleton, orientations: FloatArray, pairs: dict[int, int]) -> FloatArray:
    """Rotations relative to the parents, shape (T, J, 3, 3), that lead to the orientations."""
    world = np.empty((len(orientations), target.n_joints, 3, 3))
    local = np.broadcast_to(np.eye(3), world.shape).copy()
    for joint, parent in enumerate(target.parents.tolist()):
        if joint in pairs:
            world[:, joint] = orientations[:, pairs[joint]]
            upper = world[:, parent] if parent >= 0 else np.eye(3)
            local[:, joint] = np.swapaxes(upper, -1, -2) @ world[:, joint]
        else:
            world[:, joint] = world[:, parent]
    return local


def _set_positions(channels: FloatArray, target: Skeleton, path: FloatArray) -> None:
    """Write the path, shape (T, 3), to the root, and to the other joints where they rest."""
    for channel in np.flatnonzero(~target.is_rotation):
        joint, axis = target.channel_joint[channel], "XYZ".index(target.channel_kind[channel][0])
        channels[:, channel] = path[:, axis] if joint == 0 else target.offsets[joint, axis]
    for axis, letter in enumerate("XYZ"):
        missing = f"{letter}position" not in target.channel_names[0]
        if missing and np.ptp(path[:, axis]) > 1e-6 * max(1.0, np.abs(path).max()):
            raise ValueError(
                f"the root moves along {letter}, but the target's root "
                f"{target.joint_names[0]!r} has no {letter}position"
            )


def _set_rotations(channels: FloatArray, target: Skeleton, turns: FloatArray) -> None:
    """Write the turns, shape (T, J, 3, 3), as Euler angles in each joint's order."""
    groups = channels_of_order(target)
    free = {joint for joints, _ in groups.values() for joint in joints}
    still = [joint for joint in range(target.n_joints) if joint not in free]
    _check_lost(target, still, matrix_to_rotation_vector(turns[:, still]) * (180 / np.pi))
    for order, (joints, columns) in groups.items():
        n = len(order)
        if n == 3:
            angles = matrix_to_euler(turns[:, joints], order)
        else:  # a hinge is a joint with three rotations, of which the last ones must stay 0
            full = order + "".join(letter for letter in "XYZ" if letter not in order)
            angles = matrix_to_euler(turns[:, joints], full)
            other = wrap_degrees(alternate_euler(angles, full))
            left, left_by_other = (np.abs(a[..., n:]).max(axis=-1) for a in (angles, other))
            angles = np.where((left_by_other < left)[..., None], other, angles)
            _check_lost(target, joints, angles[..., n:])
        channels[:, columns] = angles[..., :n]


def _check_lost(target: Skeleton, joints: list[int], lost_deg: FloatArray) -> None:
    """Refuse turns, shape (T, joints, n), that no channel can hold."""
    for i, joint in enumerate(joints):
        worst = float(np.abs(lost_deg[:, i]).max(initial=0.0))
        if worst > HINGE_TOLERANCE_DEG:
            has = ", ".join(target.channel_names[joint]) or "no channels"
            raise ValueError(
                f"target joint {target.joint_names[joint]!r} has {has}: it cannot turn as the "
                f"motion asks, by {worst:.3g} degrees"
            )
