"""Convert CMU's own ASF/AMC files to BVH, exactly.

    python -m data_tools.asfamc 02.asf 02_01.amc -o 02_01.bvh

An ASF bone tells its angles in a frame of its own, turned by C from the world's axes at
rest. Its turn relative to its parent is ``L = C M C^-1``, where M is the product of its
angles' turns, and its tip lies at ``start + G direction length``, where G is the product
of all L from the root down. BVH knows no C. But L alone is a rotation, so a joint at the
start of each bone, with L told as Euler angles, moves exactly as the bone does; the
direction and the length of the bone become the OFFSET of the joints at its tip.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

from data_tools.amc import AmcMotion, load_amc
from data_tools.asf import AsfSkeleton, load_asf
from mocaplab.bvh import save_bvh
from mocaplab.euler import make_continuous
from mocaplab.motion import FloatArray, Motion, Skeleton
from mocaplab.rotations import euler_to_matrix, matrix_to_euler

FPS = 120.0
"""Frames per second of most of CMU's trials; the files themselves do not say."""

ROTATIONS = ("Zrotation", "Yrotation", "Xrotation")
POSITIONS = ("Xposition", "Yposition", "Zposition")
ORDER = "ZYX"


def extrinsic_to_matrix(angles_deg: FloatArray, order: str) -> FloatArray:
    """Rotation matrices from turns about fixed axes, the first letter's applied first.

    Parameters
    ----------
    angles_deg : array, shape (..., n), degrees
    order : str of n letters; n may be 0

    Returns
    -------
    array, shape (..., 3, 3)
    """
    angles = np.asarray(angles_deg, dtype=np.float64)
    if not order:
        return np.broadcast_to(np.eye(3), (*angles.shape[:-1], 3, 3))
    return euler_to_matrix(angles[..., ::-1], order[::-1])  # fixed axes are moving ones reversed


def asf_local_rotations(motion: AmcMotion) -> FloatArray:
    """Turn of the root and of every bone relative to its parent, ``L = C M C^-1``.

    Returns
    -------
    array, shape (T, 1 + number of bones, 3, 3)
    """
    skeleton, n_frames = motion.skeleton, motion.n_frames
    turns = [extrinsic_to_matrix(motion.root_angles_deg, skeleton.root_order)]
    for bone in skeleton.bones:
        axes = extrinsic_to_matrix(np.array(bone.axis_deg), bone.axis_order)
        angles = motion.angles_deg.get(bone.name, np.zeros((n_frames, 0)))
        turns.append(axes @ extrinsic_to_matrix(angles, bone.dofs) @ axes.T)
    return np.stack(turns, axis=1)


def asf_forward_kinematics(motion: AmcMotion) -> tuple[FloatArray, FloatArray]:
    """Position of every bone's tip, and its turn from rest, as the ASF format defines them.

    Parameters
    ----------
    motion : AmcMotion

    Returns
    -------
    tips : array, shape (T, 1 + number of bones, 3), file length units
        The root's position first, then each bone's tip in the order of the skeleton.
    orientations : array, shape (T, 1 + number of bones, 3, 3)
    """
    orientations = asf_local_rotations(motion)
    tips = np.empty((*orientations.shape[:2], 3))
    tips[:, 0] = motion.root_positions
    for i, bone in enumerate(motion.skeleton.bones, start=1):
        parent = bone.parent + 1
        orientations[:, i] = orientations[:, parent] @ orientations[:, i]
        tips[:, i] = tips[:, parent] + orientations[:, i] @ bone.vector
    return tips, orientations


def asf_to_skeleton(skeleton: AsfSkeleton) -> Skeleton:
    """Build the BVH skeleton: the root, a joint where each bone starts, an End Site at each tip.

    Every joint has three rotations in the order Z, Y, X, as the public conversions do;
    the root has its position too. Lengths stay in file units.

    Returns
    -------
    Skeleton, of 1 + number of bones joints
    """
    bones = skeleton.bones
    is_parent = {bone.parent for bone in bones}
    leaves = [i for i in range(len(bones)) if i not in is_parent]
    return Skeleton(
        joint_names=("root", *(bone.name for bone in bones)),
        parents=np.array([-1, *(bone.parent + 1 for bone in bones)]),
        offsets=np.array(
            [
                np.zeros(3),
                *(bones[bone.parent].vector if bone.parent >= 0 else np.zeros(3) for bone in bones),
            ]
        ),
        channel_names=(POSITIONS + ROTATIONS, *(ROTATIONS for _ in bones)),
        end_site_parents=np.array([i + 1 for i in leaves], dtype=np.int64),
        end_site_offsets=np.array([bones[i].vector for i in leaves]).reshape(-1, 3),
    )


def amc_to_motion(motion: AmcMotion, fps: float = FPS) -> Motion:
    """Convert a motion to BVH's terms: the same positions, told in Euler angles of the joints.

    Parameters
    ----------
    motion : AmcMotion
    fps : float, frames per second

    Returns
    -------
    Motion
        Its Euler angles are continuous over time (:func:`mocaplab.euler.make_continuous`).

    Raises
    ------
    ValueError
        If fps is not above 0.
    """
    if not 0 < fps < np.inf:
        raise ValueError(f"expected fps above 0, got {fps}")
    angles = matrix_to_euler(asf_local_rotations(motion), ORDER)  # (T, J, 3)
    channels = np.concatenate([motion.root_positions, angles.reshape(motion.n_frames, -1)], axis=1)
    skeleton = asf_to_skeleton(motion.skeleton)
    return make_continuous(Motion(skeleton, 1.0 / fps, channels, name=motion.name))


def convert(skeleton_path: Path | str, motion_path: Path | str, fps: float = FPS) -> Motion:
    """Read an ASF and an AMC file and convert them; see :func:`amc_to_motion`."""
    return amc_to_motion(load_amc(motion_path, load_asf(skeleton_path)), fps)


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; return 0, or 2 after a message about what is wrong."""
    parser = argparse.ArgumentParser(
        prog="python -m data_tools.asfamc",
        description="Convert a motion of CMU's own format (ASF skeleton, AMC motion) to BVH. "
        "Every joint of the result is where the ASF's own kinematics put it.",
        epilog="example: python -m data_tools.asfamc 02.asf 02_01.amc -o 02_01.bvh",
    )
    parser.add_argument("skeleton", metavar="SKELETON.asf", help="the subject's skeleton")
    parser.add_argument("motion", metavar="MOTION.amc", help="a trial of the same subject")
    parser.add_argument(
        "-o", "--output", metavar="OUT.bvh", help="file to write (default: MOTION.bvh, here)"
    )
    parser.add_argument(
        "--fps",
        type=float,
        default=FPS,
        help="frames per second; AMC files do not say, but CMU's index of trials does "
        "(default: %(default)g)",
    )
    options = parser.parse_args(arguments)
    output = Path(options.output or Path(options.motion).with_suffix(".bvh").name)
    try:
        motion = convert(options.skeleton, options.motion, options.fps)
        save_bvh(motion, output)
    except (ValueError, OSError) as error:
        print(f"asfamc: {error}", file=sys.stderr)
        return 2
    print(
        f"{output}: {motion.n_frames} frames at {motion.fps:g} fps, "
        f"{motion.skeleton.n_joints} joints"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
