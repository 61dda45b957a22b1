"""The recorded clips that the motion model is fitted on: read, told alike, described.

Two files can tell the same posture by different numbers: every triple of Euler angles has
a second branch, and any angle may be a whole turn off. Means over clips make sense only
when all clips tell alike, so every clip is brought to the same branch and turn first.
"""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from mocaplab.bvh import load_bvh
from mocaplab.euler import alternate_euler, make_continuous, rotation_triples, wrap_degrees
from mocaplab.motion import BoolArray, FloatArray, Motion, Skeleton
from mocaplab.motion_model import turn_root

ACTIONS = ("walk", "run", "jump", "kick")
SHORT_REACH, SPIN_DEG = 2.0, 110.0


def load_clips(folder: Path) -> dict[str, list[Motion]]:
    """Read the clips that ``clips.csv`` lists, continuous and on one Euler branch.

    Parameters
    ----------
    folder : path of the folder with ``clips.csv`` (columns clip, action) and the BVH files

    Returns
    -------
    dict from action (of the four that are fitted) to motions, by name
    """
    clips: dict[str, list[Motion]] = {action: [] for action in ACTIONS}
    reference: FloatArray | None = None  # the middle pose of the first walk
    with open(folder / "clips.csv", newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["action"] in clips]
    for row in sorted(rows, key=lambda row: (row["action"] != "walk", row["clip"])):
        motion = make_continuous(load_bvh(folder / f"{row['clip']}.bvh"))
        if reference is None:
            reference = np.median(motion.channels, axis=0)
        clips[row["action"]].append(hold_spinning(common_branch(motion, reference)))
    return clips


def common_branch(motion: Motion, reference: FloatArray) -> Motion:
    """Describe a clip by the Euler branch that clips share, and the turn nearest a pose.

    Parameters
    ----------
    motion : Motion, continuous
    reference : array, shape (C,), degrees

    Returns
    -------
    Motion
        The same poses. One choice is made for each joint and the whole clip, so the
        channels stay continuous.
    """
    channels = motion.channels.copy()
    for _, columns, order in rotation_triples(motion.skeleton):
        angles = channels[:, columns]
        # The branch with the middle angle between -90 and 90 is the one that clips share; the
        # nearest to the reference is not: a bent elbow lies between both.
        if np.median(np.abs(wrap_degrees(angles[:, 1]))) > 90.0:
            angles = alternate_euler(angles, order)
        turns = np.round((reference[columns] - np.median(angles, axis=0)) / 360.0)
        channels[:, columns] = angles + 360.0 * turns
    return motion.with_channels(channels)


def hold_spinning(motion: Motion) -> Motion:
    """Hold thumbs and fingers that spin at their median: few markers hold them.

    A joint is held when it reaches less than ``SHORT_REACH`` units and one of its angles
    spans more than ``SPIN_DEG`` within the clip, which no such joint can do.
    """
    skeleton = motion.skeleton
    short = joint_reach(skeleton)[skeleton.channel_joint] < SHORT_REACH
    spins = short & skeleton.is_rotation & (np.ptp(motion.channels, axis=0) > SPIN_DEG)
    held = np.isin(skeleton.channel_joint, skeleton.channel_joint[spins])
    return motion.with_channels(np.where(held, np.median(motion.channels, axis=0), motion.channels))


def joint_reach(skeleton: Skeleton) -> FloatArray:
    """Distance from every joint to the farthest End Site below it, with nothing rotated.

    It is the lever arm of the joint's angles: how far one radian moves the body.

    Returns
    -------
    array, shape (J,), file length units
    """
    positions = skeleton.offsets.copy()
    for joint, parent in enumerate(skeleton.parents.tolist()[1:], start=1):
        positions[joint] += positions[parent]
    reach = np.zeros(skeleton.n_joints)
    for parent, offset in zip(skeleton.end_site_parents, skeleton.end_site_offsets, strict=True):
        tip, joint = positions[parent] + offset, int(parent)
        while joint >= 0:
            reach[joint] = max(reach[joint], np.linalg.norm(tip - positions[joint]))
            joint = int(skeleton.parents[joint])
    return reach


def frame_features(
    motion: Motion, moving: BoolArray, direction_rad: float, floor: float
) -> FloatArray:
    """Describe every frame so that neither the heading nor the floor's height matters.

    Parameters
    ----------
    motion : Motion
    moving : array, shape (C,), the rotation channels to keep
    direction_rad : float, the direction of travel, from +z towards +x
    floor : float, height of the floor, file length units

    Returns
    -------
    array, shape (T, F)
        The moving angles in degrees, then the root's height, and its path to the side
        and forward in file length units.
    """
    turned = turn_root(motion, -direction_rad).channels
    cosine, sine = np.cos(direction_rad), np.sin(direction_rad)
    x, z = motion.channels[:, 0], motion.channels[:, 2]
    root = [motion.channels[:, 1] - floor, x * cosine - z * sine, x * sine + z * cosine]
    return np.concatenate([turned[:, moving], np.stack(root, axis=1)], axis=1)
