"""Motions as unit quaternions of chosen segments: what the networks of paper B see.

Paper B (section "Datasets") has 22 segments: those of the SMPL body, of which the AMASS
collection keeps the first 22 joints. The CMU skeleton of 31 joints has a counterpart for each
of them, ``CMU_SEGMENTS``. Left out are the two hip joints, which never turn; Neck1, because SMPL
has one neck where CMU has two; and six joints of fingers and thumbs, which nobody's markers saw.
LeftShoulder and RightShoulder stand for SMPL's collars; in the BVH conversion of CMU they never
turn either. Results over the segments that move are therefore told too (:func:`moving_segments`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mocaplab.euler import channels_of_order
from mocaplab.motion import BoolArray, FloatArray, Motion, Skeleton
from mocaplab.poses import motion_to_quaternions
from mocaplab.quaternions import align_hemisphere, as_quaternion, slerp
from mocaplab.resampling import nominal_fps, sample_times

_LEG, _ARM = ("UpLeg", "Leg", "Foot", "ToeBase"), ("Shoulder", "Arm", "ForeArm", "Hand")
CMU_SEGMENTS = (
    "Hips",
    *(f"{side}{bone}" for side in ("Left", "Right") for bone in _LEG),
    *("LowerBack", "Spine", "Spine1", "Neck", "Head"),
    *(f"{side}{bone}" for side in ("Left", "Right") for bone in _ARM),
)
"""The 22 of CMU's 31 joints that stand for the joints of the SMPL body; the root first."""

MOVING_RAD = np.radians(0.01)
"""A segment that never turns further than this from where it began does not move."""


@dataclass(frozen=True, eq=False)
class SegmentClip:
    """The rotations of chosen segments over time, each relative to its parent.

    Parameters
    ----------
    quaternions : array, shape (T, J, 4), unit, w first
        Their signs are chosen so that none jumps over time.
    frame_time : float, seconds
    segments : tuple of J str
    name, action : str

    Raises
    ------
    ValueError
        If the shape does not fit, a number is not finite, or a length is not 1.
    """

    quaternions: FloatArray
    frame_time: float
    segments: tuple[str, ...]
    name: str = ""
    action: str = ""

    def __post_init__(self) -> None:
        q = np.asarray(self.quaternions, dtype=np.float64)
        expected = (len(self.segments), 4)
        if q.ndim != 3 or q.shape[1:] != expected or not len(q):
            raise ValueError(f"clip {self.name!r}: expected shape (T, *{expected}), got {q.shape}")
        if not np.isfinite(q).all():
            frame, joint = np.argwhere(~np.isfinite(q))[0][:2]
            raise ValueError(
                f"clip {self.name!r}: expected numbers, got NaN or infinity for "
                f"{self.segments[joint]} in frame {frame}; fill the gaps first"
            )
        if not 0 < self.frame_time < np.inf:
            raise ValueError(
                f"clip {self.name!r}: expected a frame time above 0 s, got {self.frame_time}"
            )
        aligned = align_hemisphere(as_quaternion(q))
        aligned.flags.writeable = False
        object.__setattr__(self, "quaternions", aligned)

    @property
    def n_frames(self) -> int:
        """Number of frames T."""
        return len(self.quaternions)


def segment_names(skeleton: Skeleton) -> tuple[str, ...]:
    """Choose the segments of a skeleton: ``CMU_SEGMENTS``, or all joints that can turn.

    Returns
    -------
    tuple of str
        CMU's 22 if the skeleton has all of them; otherwise every joint with rotation channels.
    """
    if set(CMU_SEGMENTS) <= set(skeleton.joint_names):
        return CMU_SEGMENTS
    turning = sorted(j for joints, _ in channels_of_order(skeleton).values() for j in joints)
    return tuple(skeleton.joint_names[j] for j in turning)


def motion_to_segments(
    motion: Motion, segments: Sequence[str] | None = None, action: str = ""
) -> SegmentClip:
    """Take the rotations of chosen segments out of a motion.

    Parameters
    ----------
    motion : Motion, without NaN
    segments : names of joints, or None for those of :func:`segment_names`
    action : str

    Raises
    ------
    ValueError
        If the skeleton has no joint of that name, or the motion has gaps.
    """
    names = tuple(segment_names(motion.skeleton) if segments is None else segments)
    unknown = [name for name in names if name not in motion.skeleton.joint_names]
    if unknown:
        raise ValueError(f"motion {motion.name!r}: expected a joint {unknown[0]!r}, found none")
    joints = [motion.skeleton.joint_names.index(name) for name in names]
    quaternions = motion_to_quaternions(motion)[:, joints]
    return SegmentClip(quaternions, motion.frame_time, names, motion.name, action)


def moving_segments(clips: Sequence[SegmentClip]) -> BoolArray:
    """Tell which segments turn at all in any of the clips, shape (J,)."""
    moves = np.zeros(len(clips[0].segments), dtype=bool)
    for clip in clips:
        # |q - p| is twice the sine of a quarter of the angle between two rotations.
        apart = np.linalg.norm(clip.quaternions - clip.quaternions[:1], axis=-1)
        moves |= (2 * apart > MOVING_RAD).any(axis=0)
    return moves


def resample_segments(clip: SegmentClip, fps: float) -> SegmentClip:
    """Show a clip at another frame rate, turning evenly between its frames (slerp).

    Paper B brings all motions to 25 frames per second for prediction. As in
    :func:`mocaplab.resampling.resample`, the first frame stays and nothing is smoothed.

    Raises
    ------
    ValueError
        If fps is not above 0.
    """
    if not 0 < fps < np.inf:
        raise ValueError(f"clip {clip.name!r}: expected fps above 0, got {fps}")
    times = sample_times(clip.n_frames, nominal_fps(1 / clip.frame_time), fps)
    before = np.floor(times).astype(np.int64)
    after = np.minimum(before + 1, clip.n_frames - 1)
    q = slerp(clip.quaternions[before], clip.quaternions[after], (times - before)[:, None])
    return replace(clip, quaternions=q, frame_time=1 / fps)


def all_windows(quaternions: FloatArray, n_frames: int = 60) -> FloatArray:
    """Cut out every run of consecutive frames (paper B: 60), without copying.

    Returns
    -------
    array, shape (T - n_frames + 1, n_frames, J, 4); none if there are fewer frames
    """
    if len(quaternions) < n_frames:
        return np.empty((0, n_frames, *quaternions.shape[1:]))
    windows = np.lib.stride_tricks.sliding_window_view(quaternions, n_frames, axis=0)
    return np.moveaxis(windows, -1, 1)


def mean_pose(clips: Sequence[SegmentClip]) -> FloatArray:
    """Find the mean rotation of every segment over all frames of all clips.

    Returns
    -------
    array, shape (J, 4), unit
        The eigenvector of the sum of q q' with the largest eigenvalue, for which q and -q are
        the same (Markley et al. 2007, "Averaging quaternions").
    """
    if not clips:
        raise ValueError("a mean pose needs at least one clip")
    products = sum(np.einsum("tja,tjb->jab", c.quaternions, c.quaternions) for c in clips)
    vectors = np.linalg.eigh(products)[1]
    mean: FloatArray = vectors[..., -1]
    return np.where(mean[..., :1] < 0, -mean, mean)
