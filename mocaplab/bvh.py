"""Read and write BVH files.

A BVH file has two parts. HIERARCHY names the joints, their offsets and their channels;
MOTION holds one line of numbers a frame, in the order in which the channels appeared.
The reader is strict: what is not a BVH file is refused with the line that shows it.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from mocaplab.bvh_hierarchy import (
    BVHError,
    Lines,
    hierarchy_lines,
    is_count,
    quote,
    read_hierarchy,
    to_number,
)
from mocaplab.files import write_atomically
from mocaplab.motion import FloatArray, Motion

__all__ = ["BVHError", "load_bvh", "save_bvh"]


def load_bvh(path: str | os.PathLike[str]) -> Motion:
    """Read a BVH file.

    Parameters
    ----------
    path : path of the file

    Returns
    -------
    Motion
        Channels exactly as in the file: degrees and file length units, file order.

    Raises
    ------
    BVHError
        If the file is not a correct BVH file; the message names the line.
    OSError
        If the file cannot be read.
    """
    raw = Path(path).read_bytes()
    if b"\0" in raw:
        raise BVHError(path, None, "a text file", "binary data")
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = raw.decode("latin-1")  # old exporters write joint names in local code pages
    if not text.strip():
        raise BVHError(path, None, "a BVH file", "an empty file")
    reader = Lines(path, text.replace("\r\n", "\n").replace("\r", "\n"))
    skeleton = read_hierarchy(reader)
    n_frames = _read_count(reader)
    frame_time = _read_frame_time(reader)
    channels = _read_frames(reader, n_frames, skeleton.n_channels)
    return Motion(skeleton, frame_time, channels, name=Path(path).stem)


def _read_field(reader: Lines, key: str, expected: str) -> str:
    """Read a line such as ``Frames: 10``; blanks around the colon do not matter."""
    words = reader.next(f"{key}: and {expected}")
    found, colon, value = reader.line.partition(":")
    if " ".join(found.split()).lower() != key.lower() or not colon:
        raise reader.error(f"{key}: and {expected}", quote(words))
    return value.strip()


def _read_count(reader: Lines) -> int:
    value = _read_field(reader, "Frames", "a whole number")
    if not is_count(value):
        raise reader.error("Frames: and a whole number", quote([value]))
    if int(value) == 0:
        raise reader.error("at least one frame", value)
    return int(value)


def _read_frame_time(reader: Lines) -> float:
    value = _read_field(reader, "Frame Time", "a number of seconds")
    frame_time = to_number(reader, value)
    if frame_time <= 0:
        raise reader.error("a frame time above 0", value)
    return frame_time


def _read_frames(reader: Lines, n_frames: int, n_channels: int) -> FloatArray:
    """Parse all numbers at once; only when something is off, look for the line.

    Where lines break does not matter as long as the number of values is right.
    """
    text = reader.text[reader.start :]
    try:
        values = np.fromiter(map(float, text.split()), dtype=np.float64)
    except ValueError:
        raise _frames_error(reader, n_frames, n_channels) from None
    right = len(values) == n_frames * n_channels and "_" not in text  # float("1_0") is 10
    if not right or not np.isfinite(values).all():
        raise _frames_error(reader, n_frames, n_channels)
    return values.reshape(n_frames, n_channels)


def _frames_error(reader: Lines, n_frames: int, n_channels: int) -> BVHError:
    """Find the first line of the motion block that is wrong."""
    frames, last = 0, reader.number
    for number, words in reader.rest():
        for word in words:
            to_number(reader, word, number)
        if not words:
            continue
        if len(words) != n_channels:
            return reader.error(f"{n_channels} numbers", f"{len(words)}", number)
        frames, last = frames + 1, number
        if frames > n_frames:
            return reader.error(f"{n_frames} frames, as declared", "one more", number)
    return reader.error(f"{n_frames} frames, as declared", f"{frames}", last)


def save_bvh(motion: Motion, path: str | os.PathLike[str]) -> None:
    """Write a BVH file.

    Every number is written with as many digits as reading it back exactly takes. The
    file is written under a temporary name and then moved, so that a failure leaves
    no half file and an existing file stays whole.

    Parameters
    ----------
    motion : Motion
    path : path of the file; an existing file is replaced

    Raises
    ------
    ValueError
        If a sample is NaN (a BVH file has no way to say "not observed"), the joints or
        End Sites are not in depth-first order, which is the only order a file can have,
        or a joint has a name that a line of the file cannot hold.
    OSError
        If the file cannot be written.
    """
    missing = np.isnan(motion.channels)
    if missing.any():
        frame, channel = np.argwhere(missing)[0]
        raise ValueError(
            f"cannot write {path}: {motion.skeleton.channel_labels[channel]} is NaN in frame "
            f"{frame}; fill the gaps first"
        )
    lines = hierarchy_lines(motion.skeleton)
    lines += ["MOTION", f"Frames: {motion.n_frames}", f"Frame Time: {motion.frame_time!r}"]
    lines += [" ".join(map(repr, row)) for row in motion.channels.tolist()]
    write_atomically(path, "\n".join(lines) + "\n")
