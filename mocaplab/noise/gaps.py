"""Gaps: samples that a capture did not record.

A mask is a bool array of shape (T, C): True = observed, False = hidden. Only the channels
in ``Skeleton.is_cleaned`` are ever hidden. The first and the last frame stay observed, so
every gap has two ends to fill between, and no channel is hidden from end to end.
"""

from __future__ import annotations

import csv
import io
import os
from difflib import get_close_matches
from pathlib import Path

import numpy as np

from mocaplab.files import FormatError, write_atomically
from mocaplab.motion import BoolArray, Motion, Skeleton, moving_channels
from mocaplab.noise.angular import check_amount

PAPER_FPS = 120.0
"""Frames per second of all clips in paper A, which gives its probability per frame."""
GAP_MEAN_S = 0.125
"""Mean length of a gap: 15 frames at 120 frames per second (paper A names no length)."""
GAP_COLUMNS = ("channel", "first_frame", "last_frame")
"""The head of a table of gaps."""


def draw_runs(
    shape: tuple[int, ...],
    frame_time: float,
    start_probability: float,
    mean_s: float,
    rng: np.random.Generator,
) -> BoolArray:
    """Draw runs of frames: when each starts is random, and so is how long it lasts.

    Parameters
    ----------
    shape : (T, ...), one independent course of events for each entry after T
    frame_time : float, seconds
    start_probability : float in [0, 1]
        That a run starts within 1/120 s. It is converted to the frame rate, so the same
        number gives as many runs a second at 30 as at 120 frames per second.
    mean_s : float, seconds
        Mean length. Lengths are geometric, the discrete form of an exponential decay, and
        at least one frame.

    Returns
    -------
    array of the given shape, bool: True inside a run
    """
    per_frame = 1.0 - (1.0 - start_probability) ** (PAPER_FPS * frame_time)
    mean_frames = max(mean_s / frame_time, 1.0)
    starts = rng.random(shape) < per_frame
    lengths = rng.geometric(1.0 / mean_frames, size=shape)
    frames = np.arange(shape[0]).reshape(-1, *[1] * (len(shape) - 1))
    # A frame is inside if any run that started before it, or in it, ends after it.
    ends = np.maximum.accumulate(np.where(starts, frames + lengths, 0), axis=0)
    inside: BoolArray = ends > frames
    return inside


def gap_mask(
    motion: Motion,
    start_probability: float,
    mean_s: float = GAP_MEAN_S,
    *,
    whole_joints: bool = False,
    rng: np.random.Generator,
) -> BoolArray:
    """Choose which samples of a motion are hidden by short gaps (paper A, section 4).

    Parameters
    ----------
    motion : Motion
    start_probability : float in [0, 1]
        That a gap starts in a channel within 1/120 s, which is a frame of the paper. The
        paper's own 0.1 would hide three quarters of a clip; 0.001 hides about 1.5 % at the
        default length. See :func:`draw_runs` for other frame rates.
    mean_s : float, seconds, mean length of a gap
    whole_joints : bool
        Hide all angles of a joint together, as a lost marker does, in place of single
        channels as in the paper.
    rng : numpy.random.Generator

    Returns
    -------
    array, shape (T, C), bool: True = observed, False = hidden
    """
    check_amount(start_probability, 1, "the gap probability")
    if not 0 < mean_s < np.inf:
        raise ValueError(f"the mean gap length must be over 0 seconds, got {mean_s}")
    skeleton = motion.skeleton
    width = skeleton.n_joints if whole_joints else skeleton.n_channels
    shape = (motion.n_frames, width)
    hidden = draw_runs(shape, motion.frame_time, start_probability, mean_s, rng)
    if whole_joints:
        hidden = hidden[:, skeleton.channel_joint]
    hidden[[0, -1]] = False
    mask: BoolArray = ~(hidden & skeleton.is_cleaned)
    return mask


def long_gap_mask(
    motion: Motion, seconds: float, *, n_joints: int = 3, rng: np.random.Generator
) -> BoolArray:
    """Choose one long gap in each of a few joints that move (paper A, section 4, Figure 10).

    The paper hides single knees for 2 to 4 seconds, and up to 5 (600 frames). Which joints
    and when is random; all angles of a joint are hidden together.

    Parameters
    ----------
    motion : Motion
    seconds : float, length of each gap, rounded to whole frames
    n_joints : int
        Number of joints; all that move, if there are fewer.
    rng : numpy.random.Generator

    Returns
    -------
    array, shape (T, C), bool: True = observed, False = hidden

    Raises
    ------
    ValueError
        If the gap does not fit between the first and the last frame.
    """
    if not 0 <= seconds < np.inf or n_joints < 0:
        raise ValueError(
            f"a long gap must last 0 seconds or more, in 0 joints or more, got {seconds} s in "
            f"{n_joints} joints"
        )
    length = round(min(seconds / motion.frame_time, motion.n_frames))
    room = motion.n_frames - 2 - length  # the first and the last frame stay observed
    if room < 0:
        raise ValueError(
            f"motion {motion.name!r}: expected a gap shorter than the clip, "
            f"{motion.duration_s:.3g} s, got {seconds:g} s"
        )
    moving = np.unique(motion.skeleton.channel_joint[moving_channels(motion)])
    joints = rng.choice(moving, size=min(n_joints, moving.size), replace=False)
    first = rng.integers(1, 2 + room, size=joints.size)
    frames = np.arange(motion.n_frames)[:, None]
    inside = (frames >= first) & (frames < first + length)  # (T, joints)
    hidden = np.zeros((motion.n_frames, motion.skeleton.n_joints), dtype=bool)
    hidden[:, joints] = inside
    return ~(hidden[:, motion.skeleton.channel_joint] & motion.skeleton.is_cleaned)


def hide(motion: Motion, mask: BoolArray) -> Motion:
    """Put NaN where the mask is False."""
    return motion.with_channels(np.where(mask, motion.channels, np.nan))


def hidden_share(motion: Motion) -> float:
    """Return the share of the joint angles, the root's left out, that is NaN: 0 to 1."""
    cleaned = motion.channels[:, motion.skeleton.is_cleaned]
    return float(np.isnan(cleaned).mean()) if cleaned.size else 0.0


def save_gaps(mask: BoolArray, skeleton: Skeleton, path: str | os.PathLike[str]) -> None:
    """Write where the gaps are, because a BVH file cannot say it.

    The file is a table with a head, ``channel,first_frame,last_frame``, and a line a gap.
    Frames count from 0, and the last frame is hidden too.

    Parameters
    ----------
    mask : array, shape (T, C), bool: True = observed, False = hidden
    skeleton : Skeleton
    path : path of a ``.csv`` file

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    edge = np.zeros((1, mask.shape[1]), dtype=np.int8)
    steps = np.diff(
        (~mask).astype(np.int8), axis=0, prepend=edge, append=edge
    )  # 1 where a gap begins
    channel, first = np.nonzero(steps.T == 1)
    _, after = np.nonzero(steps.T == -1)
    table = io.StringIO()
    writer = csv.writer(table, lineterminator="\n")
    writer.writerow(GAP_COLUMNS)
    labels = skeleton.channel_labels
    rows = zip(channel.tolist(), first.tolist(), (after - 1).tolist(), strict=True)
    writer.writerows((labels[c], start, last) for c, start, last in rows)
    write_atomically(path, table.getvalue())


def load_gaps(path: str | os.PathLike[str], motion: Motion) -> BoolArray:
    """Read where the gaps of a motion are; see :func:`save_gaps` for the format.

    In a file written by hand, the name of a joint stands for all its angles.

    Returns
    -------
    array, shape (T, C), bool: True = observed, False = hidden

    Raises
    ------
    FormatError
        If the head is another, a channel or frame is not in the motion, or a gap is in the
        root or ends before it begins; it names the line.
    """
    mask = np.ones(motion.channels.shape, dtype=bool)
    columns = _columns_by_name(motion.skeleton)
    try:
        lines = Path(path).read_text(encoding="utf-8-sig").splitlines()
    except UnicodeDecodeError:
        raise FormatError(path, None, "a table of gaps", "bytes that are no text") from None
    head = ",".join(GAP_COLUMNS)
    if not lines or lines[0].replace(" ", "") != head:
        raise FormatError(path, 1, f"the head {head}", repr(lines[0] if lines else ""))
    last_frame = motion.n_frames - 1
    for number, row in enumerate(csv.reader(lines[1:]), start=2):
        if not row:
            continue
        if len(row) != 3 or not (row[1].strip().isdecimal() and row[2].strip().isdecimal()):
            raise FormatError(path, number, "a channel and two frames", repr(",".join(row)))
        name, first, last = row[0].strip(), int(row[1]), int(row[2])
        if name not in columns:
            near = get_close_matches(name, columns, cutoff=0.0)
            expected = f"an angle or a joint that is not the root, such as {', '.join(near)}"
            raise FormatError(path, number, expected, repr(name))
        if not first <= last <= last_frame:
            expected = f"0 <= first_frame <= last_frame <= {last_frame}"
            raise FormatError(path, number, expected, f"{first} and {last}")
        mask[first : last + 1, columns[name]] = False
    return mask


def _columns_by_name(skeleton: Skeleton) -> dict[str, list[int]]:
    """Find the channels that a name in a table of gaps can stand for."""
    columns: dict[str, list[int]] = {}
    for channel in np.flatnonzero(skeleton.is_cleaned).tolist():
        joint = skeleton.joint_names[skeleton.channel_joint[channel]]
        columns.setdefault(joint, []).append(channel)
        columns[skeleton.channel_labels[channel]] = [channel]
    return columns
