"""Read and write BVH files.

A BVH file has two parts. HIERARCHY names the joints, their offsets and their channels;
MOTION holds one line of numbers a frame, in the order in which the channels appeared.
The reader is strict: what is not a BVH file is refused with the line that shows it.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import cast

import numpy as np
import orjson
import simdjson
from numpy.typing import NDArray

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

__all__ = ["BVHError", "load_bvh", "round_changes", "save_bvh"]

_BLOCK = 1 << 15  # characters taken at once: a block and all copies of it stay in the cache


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
        text = raw.decode("utf-8").removeprefix("\ufeff")  # faster than "utf-8-sig"
    except UnicodeDecodeError:
        text = raw.decode("latin-1")  # old exporters write joint names in local code pages
    if not text or text.isspace():
        raise BVHError(path, None, "a BVH file", "an empty file")
    if _has_lone_returns(raw):  # an old Mac's line ends
        text = text.replace("\r\n", "\n").replace("\r", "\n")
    reader = Lines(path, text)
    skeleton = read_hierarchy(reader)
    n_frames = _read_count(reader)
    frame_time = _read_frame_time(reader)
    channels = _read_frames(reader, n_frames, skeleton.n_channels)
    return Motion(skeleton, frame_time, channels, name=Path(path).stem)


def _has_lone_returns(raw: bytes) -> bool:
    r"""Tell whether an \r stands without the \n of Windows, which is read as a blank."""
    if b"\r" not in raw:
        return False
    # In blocks that stay in the cache; each knows the first character of the next.
    blocks = (raw[start : start + _BLOCK + 1] for start in range(0, len(raw), _BLOCK))
    return raw.endswith(b"\r") or any(map(_has_lone_return, blocks))


def _has_lone_return(block: bytes) -> bool:
    text = np.frombuffer(block, dtype=np.uint8)
    lone = text[:-1] == ord("\r")
    lone &= text[1:] != ord("\n")
    return bool(lone.any())


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
    if frame_time < 1e-9:
        raise reader.error("a frame time above 0", value)
    return frame_time


def _read_frames(reader: Lines, n_frames: int, n_channels: int) -> FloatArray:
    """Parse all numbers at once; only when something is off, look for the line.

    Where lines break does not matter as long as the number of values is right.
    """
    if n_frames * n_channels > len(reader.text) - reader.start:  # never allocate what is not there
        raise _frames_error(reader, n_frames, n_channels)
    values = np.empty((n_frames, n_channels))
    try:
        _parse_numbers(reader.text, reader.start, values.reshape(-1))
    except ValueError:
        raise _frames_error(reader, n_frames, n_channels) from None
    values.flags.writeable = False  # so that Motion need not copy it
    return values


def _parse_numbers(text: str, start: int, values: FloatArray) -> None:
    """Turn the words of a text from start on into numbers, bit for bit as ``float`` does.

    Parameters
    ----------
    values : array, shape (N,), to be filled

    Raises
    ------
    ValueError
        If a word is no finite number, or there are more or fewer than N words.
    """
    if text.find("_", start) >= 0:  # float("1_0") is 10
        raise ValueError("a word that only Python takes for a number")
    parser = simdjson.Parser()
    done = 0
    while start < len(text):
        end = text.find("\n", start + _BLOCK)  # a block ends where a line does
        end = len(text) if end < 0 else end
        words = text[start:end]
        if "\r" in words:  # looking for two characters takes long
            words = words.replace("\r\n", "\n")
        words = words.replace("\n", " ").replace("\t", " ").strip()
        part = _parse_as_json(parser, words)
        if part is None:  # blanks in a row? Parting all words takes longer
            part = _parse_as_json(parser, " ".join(words.split()))
        if part is None:
            part = np.fromiter(map(float, words.split()), dtype=np.float64)
        values[done : done + len(part)] = part  # fails if the part does not fit any more
        done, start = done + len(part), end + 1
    if done != len(values) or not np.isfinite(values).all():
        raise ValueError("too few words, or one that is not finite")


def _parse_as_json(parser: simdjson.Parser, words: str) -> FloatArray | None:
    """Parse words with one blank between them, or give up (None): ``float`` must decide.

    With commas for blanks they are what JSON calls an array, and simdjson reads those
    exactly and ten times faster than ``float`` word by word. It refuses what JSON does not
    know, such as 1. or .5 or +1 or 007 or nan, and empty words between two blanks.
    """
    if "," in words or "[" in words or "{" in words:  # JSON knows these, BVH does not
        return None
    array = np.frombuffer(f"[{words}]".encode(), dtype=np.uint8)
    commas = (array == ord(" ")).view(np.uint8)  # like this it takes a third of replace's time
    commas *= ord(",") - ord(" ")
    array = array + commas
    if _has_minus_zero(array):
        return None
    try:
        # Not a variable: the parser refuses its next task while somebody holds its last.
        buffer = cast(simdjson.Array, parser.parse(array.tobytes())).as_buffer(of_type="d")
        return np.frombuffer(buffer, dtype=np.float64)
    except (ValueError, TypeError, RuntimeError):  # the last: a whole number of many digits
        return None


def _has_minus_zero(array: NDArray[np.uint8]) -> bool:
    """Tell whether there is a word -0: it is whole to JSON and would lose its sign."""
    here = array[:-2] == ord("-")  # much faster than b"-0," in array
    here &= array[1:-1] == ord("0")
    here &= (array[2:] == ord(",")) | (array[2:] == ord("]"))
    return bool(here.any())


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
    # JSON's way of writing rows of numbers, the shortest that reads back exactly, is
    # BVH's with commas and brackets between them, and orjson writes it very fast.
    rows = orjson.dumps(np.ascontiguousarray(motion.channels), option=orjson.OPT_SERIALIZE_NUMPY)
    block = rows[2:-2].replace(b"],[", b"\n").replace(b",", b" ")
    write_atomically(path, "\n".join(lines).encode() + b"\n" + block + b"\n")


def round_changes(before: Motion, after: Motion) -> Motion:
    """Round the samples that were changed to a millionth of a degree; it keeps files small."""
    same = after.channels == before.channels
    return after.with_channels(np.where(same, before.channels, after.channels.round(6)))
