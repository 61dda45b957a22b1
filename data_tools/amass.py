"""Read motions of the AMASS collection, paper B's form of CMU: ``.npz`` files.

AMASS must be asked for at amass.is.tue.mpg.de and may not be passed on. Of each file only the
rotations of the first 22 joints are read, those of the SMPL body; fingers, shape and soft tissue
are left out. Nothing in a file is executed.
"""

from __future__ import annotations

import os
import zipfile
from pathlib import Path

import numpy as np

from mocaplab.motion import FloatArray
from mocaplab.quaternions import rotation_vector_to_quaternion
from mocaplab.two_sources.segments import SegmentClip

SMPL_JOINTS = (
    *("pelvis", "left_hip", "right_hip", "spine1", "left_knee", "right_knee", "spine2"),
    *("left_ankle", "right_ankle", "spine3", "left_foot", "right_foot", "neck"),
    *("left_collar", "right_collar", "head", "left_shoulder", "right_shoulder"),
    *("left_elbow", "right_elbow", "left_wrist", "right_wrist"),
)
"""The 22 joints of the SMPL body without hands, in the order of the files."""

RATE_NAMES = ("mocap_framerate", "mocap_frame_rate")
"""What the frame rate is called in the older files, and in those for SMPL-X."""


def load_amass(path: str | os.PathLike[str], action: str = "") -> SegmentClip:
    """Read one motion: rotation vectors in ``poses``, frames a second in ``mocap_framerate``.

    Parameters
    ----------
    path : path of a ``.npz`` file
    action : str

    Returns
    -------
    SegmentClip, of ``SMPL_JOINTS``

    Raises
    ------
    ValueError
        If the file is no such archive, lacks one of the two, or holds something else in it.
    OSError
        If it cannot be read.
    """
    path = Path(path)
    try:
        with open(path, "rb") as file, np.load(file, allow_pickle=False) as archive:
            names = archive.files
            rate_name = next((name for name in RATE_NAMES if name in names), None)
            if "poses" not in names or rate_name is None:
                raise ValueError(f"expected poses and {RATE_NAMES[0]}, got {', '.join(names)}")
            poses, rate = archive["poses"], archive[rate_name]
        return _clip(poses, rate, path.stem, action)
    except (ValueError, TypeError, AttributeError, KeyError, EOFError, zipfile.BadZipFile) as error:
        raise ValueError(f"{path}: not a motion of AMASS ({error})") from None


def _clip(poses: np.ndarray, rate: np.ndarray, name: str, action: str) -> SegmentClip:
    n = 3 * len(SMPL_JOINTS)
    if poses.ndim != 2 or poses.shape[1] < n or not len(poses) or poses.dtype.kind != "f":
        raise ValueError(
            f"expected poses of shape (T, {n} or more), got {poses.shape} of {poses.dtype}"
        )
    fps = float(np.asarray(rate, dtype=np.float64).reshape(-1)[0]) if rate.size == 1 else 0.0
    if not 1 <= fps <= 1000:
        raise ValueError(f"expected a frame rate from 1 to 1000, got {rate}")
    vectors: FloatArray = poses[:, :n].astype(np.float64).reshape(len(poses), -1, 3)
    q = rotation_vector_to_quaternion(vectors)
    return SegmentClip(q, 1 / fps, SMPL_JOINTS, name, action)
