"""Read and write BVH files.

A BVH file has two parts. HIERARCHY names the joints, their offsets and their channels;
MOTION holds one line of numbers a frame, in the order in which the channels appeared.
The reader is strict: what is not a BVH file is refused with the line that shows it.
"""

from __future__ import annotations

import os
import tempfile
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mocaplab.motion import CHANNEL_NAMES, FloatArray, Motion, Skeleton

_CHANNEL_SPELLING = {name.lower(): name for name in CHANNEL_NAMES}


class BVHError(ValueError):
    """A file that is not a correct BVH file.

    Attributes
    ----------
    path : str
    line : int or None, counted from 1; None when the whole file is meant
    expected, got : str
    """

    def __init__(self, path: str | os.PathLike[str], line: int | None, expected: str, got: str):
        self.path, self.line, self.expected, self.got = str(path), line, expected, got
        where = self.path if line is None else f"{self.path}:{line}"
        super().__init__(f"{where}: expected {expected}, got {got}")


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
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        if b"\0" in raw:
            raise BVHError(path, None, "a text file", "binary data") from None
        text = raw.decode("latin-1")  # old exporters write joint names in local code pages
    if not text.strip():
        raise BVHError(path, None, "a BVH file", "an empty file")
    reader = _Lines(path, text)
    skeleton = _read_hierarchy(reader)
    n_frames = _read_count(reader)
    frame_time = _read_frame_time(reader)
    channels = _read_frames(reader, n_frames, skeleton.n_channels)
    return Motion(skeleton, frame_time, channels, name=Path(path).stem)


class _Lines:
    """The lines of a file, one at a time, blank ones passed over."""

    def __init__(self, path: str | os.PathLike[str], text: str):
        self.path, self.text = path, text
        self.start = 0  # where the next line begins in text
        self.number = 0  # of the line read last, counted from 1

    def next(self, expected: str) -> list[str]:
        """Return the words of the next line that is not blank."""
        while self.start < len(self.text):
            end = self.text.find("\n", self.start)
            end = len(self.text) if end < 0 else end
            words = self.text[self.start : end].split()
            self.start, self.number = end + 1, self.number + 1
            if words:
                return words
        raise self.error(expected, "the end of the file")

    def error(self, expected: str, got: str, line: int | None = None) -> BVHError:
        """Build the error for the line read last, or for another one."""
        return BVHError(self.path, line or self.number, expected, got)

    def rest(self) -> Iterator[tuple[int, list[str]]]:
        """List the number and the words of all lines that are left."""
        for i, line in enumerate(self.text[self.start :].split("\n"), start=self.number + 1):
            yield i, line.split()


@dataclass
class _Joint:
    """What the hierarchy says of one joint."""

    name: str
    parent: int
    offset: list[float] | None = None
    channels: tuple[str, ...] | None = None


def _read_hierarchy(reader: _Lines) -> Skeleton:
    """Read from HIERARCHY up to and with the MOTION line."""
    words = reader.next("HIERARCHY")
    if words[0].upper() != "HIERARCHY":
        raise reader.error("HIERARCHY", _quote(words))
    joints: list[_Joint] = []
    sites: list[tuple[int, list[float]]] = []
    open_joints: list[int] = []  # the joints whose braces are open, innermost last
    while True:
        expected = "JOINT, End Site, OFFSET, CHANNELS or }" if open_joints else "ROOT or MOTION"
        words = reader.next(expected)
        key = words[0].upper()
        if not open_joints:
            if key == "MOTION" and joints:
                break
            if key != "ROOT" or joints:
                raise reader.error("MOTION" if joints else "ROOT", _quote(words))
        if key == "ROOT" and not open_joints or key == "JOINT" and open_joints:
            _open_joint(reader, words, joints, open_joints)
        elif key == "END":
            sites.append((open_joints[-1], _read_end_site(reader)))
        elif key == "OFFSET":
            joints[open_joints[-1]].offset = _read_offset(reader, words)
        elif key == "CHANNELS":
            joints[open_joints[-1]].channels = _read_channels(reader, words)
        elif key == "}":
            _close_joint(reader, joints[open_joints.pop()])
        else:
            raise reader.error(expected, _quote(words))
    return Skeleton(
        joint_names=tuple(joint.name for joint in joints),
        parents=np.array([joint.parent for joint in joints]),
        offsets=np.array([joint.offset for joint in joints], dtype=np.float64),
        channel_names=tuple(joint.channels or () for joint in joints),
        end_site_parents=np.array([parent for parent, _ in sites], dtype=np.int64),
        end_site_offsets=np.array([offset for _, offset in sites]).reshape(-1, 3),
    )


def _open_joint(
    reader: _Lines, words: list[str], joints: list[_Joint], open_joints: list[int]
) -> None:
    """Add the joint that a ROOT or JOINT line names; the brace may end that line."""
    brace_here = words[-1] == "{" and len(words) > 1
    name = " ".join(words[1:-1] if brace_here else words[1:])
    if not name:
        raise reader.error("a joint name", _quote(words))
    if any(joint.name == name for joint in joints):
        raise reader.error("a new joint name", f"{name!r} a second time")
    if not brace_here:
        _read_brace(reader)
    joints.append(_Joint(name, open_joints[-1] if open_joints else -1))
    open_joints.append(len(joints) - 1)


def _close_joint(reader: _Lines, joint: _Joint) -> None:
    if joint.offset is None:
        raise reader.error(f"an OFFSET in joint {joint.name!r}", "}")
    if joint.channels is None:
        raise reader.error(f"CHANNELS in joint {joint.name!r}", "}")


def _read_brace(reader: _Lines) -> None:
    words = reader.next("{")
    if words != ["{"]:
        raise reader.error("{", _quote(words))


def _read_end_site(reader: _Lines) -> list[float]:
    if reader.text[: reader.start].rstrip()[-1] != "{":
        _read_brace(reader)
    offset = _read_offset(reader, reader.next("OFFSET"))
    words = reader.next("}")
    if words != ["}"]:
        raise reader.error("}", _quote(words))
    return offset


def _read_offset(reader: _Lines, words: list[str]) -> list[float]:
    if words[0].upper() != "OFFSET" or len(words) != 4:
        raise reader.error("OFFSET and three numbers", _quote(words))
    return [_number(reader, word) for word in words[1:]]


def _read_channels(reader: _Lines, words: list[str]) -> tuple[str, ...]:
    names = words[2:]
    if len(words) < 2 or not words[1].isdecimal() or int(words[1]) != len(names):
        raise reader.error("CHANNELS, a count and as many names", _quote(words))
    for name in names:
        if name.lower() not in _CHANNEL_SPELLING:
            raise reader.error(f"one of {', '.join(CHANNEL_NAMES)}", repr(name))
    channels = tuple(_CHANNEL_SPELLING[name.lower()] for name in names)
    if len(set(channels)) != len(channels):
        raise reader.error("every channel once", _quote(words))
    return channels


def _read_count(reader: _Lines) -> int:
    words = reader.next("Frames:")
    if words[0].lower() != "frames:" or len(words) != 2 or not words[1].isdecimal():
        raise reader.error("Frames: and a whole number", _quote(words))
    if int(words[1]) == 0:
        raise reader.error("at least one frame", "0")
    return int(words[1])


def _read_frame_time(reader: _Lines) -> float:
    words = reader.next("Frame Time:")
    if [word.lower() for word in words[:2]] != ["frame", "time:"] or len(words) != 3:
        raise reader.error("Frame Time: and a number of seconds", _quote(words))
    frame_time = _number(reader, words[2])
    if frame_time <= 0:
        raise reader.error("a frame time above 0", words[2])
    return frame_time


def _read_frames(reader: _Lines, n_frames: int, n_channels: int) -> FloatArray:
    """Parse all numbers at once; only when something is off, look for the line."""
    with warnings.catch_warnings():
        warnings.simplefilter("error", DeprecationWarning)  # numpy's word for "not a number"
        try:
            values = np.fromstring(reader.text[reader.start :], dtype=np.float64, sep=" ")
        except (DeprecationWarning, ValueError):
            values = np.empty(0)
    if len(values) != n_frames * n_channels or not np.isfinite(values).all():
        raise _frames_error(reader, n_frames, n_channels)
    return values.reshape(n_frames, n_channels)


def _frames_error(reader: _Lines, n_frames: int, n_channels: int) -> BVHError:
    """Find the first line of the motion block that is wrong."""
    frames = 0
    number = reader.number
    for number, words in reader.rest():
        for word in words:
            _number(reader, word, number)
        if not words:
            continue
        if len(words) != n_channels:
            return reader.error(f"{n_channels} numbers", f"{len(words)}", number)
        frames += 1
        if frames > n_frames:
            return reader.error(f"{n_frames} frames, as declared", "one more", number)
    return reader.error(f"{n_frames} frames, as declared", f"{frames}", number)


def _number(reader: _Lines, word: str, line: int | None = None) -> float:
    try:
        value = float(word)
    except ValueError:
        raise reader.error("a number", repr(word[:40]), line) from None
    if not np.isfinite(value) or "_" in word:
        raise reader.error("a finite number", repr(word), line)
    return value


def _quote(words: list[str]) -> str:
    text = " ".join(words)
    return repr(text if len(text) <= 60 else text[:57] + "...")


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
        If a sample is NaN (a BVH file has no way to say "not observed"), or the joints
        are not in depth-first order, which is the only order a file can have.
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
    lines = _hierarchy_lines(motion.skeleton)
    lines += ["MOTION", f"Frames: {motion.n_frames}", f"Frame Time: {motion.frame_time!r}"]
    lines += [" ".join(map(repr, row)) for row in motion.channels.tolist()]
    write_atomically(path, "\n".join(lines) + "\n")


def write_atomically(path: str | os.PathLike[str], content: str | bytes) -> None:
    """Write a file so that nobody ever sees half of it.

    Raises
    ------
    OSError
        If the file cannot be written; an older file of that name is then unharmed.
    """
    path = Path(path)
    if path.is_dir():
        raise IsADirectoryError(f"cannot write {path}: it is a folder")
    data = content.encode() if isinstance(content, str) else content
    handle, temporary = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
        umask = os.umask(0)
        os.umask(umask)
        os.chmod(temporary, 0o666 & ~umask)  # mkstemp makes files that only we may read
        os.replace(temporary, path)
    except BaseException:
        os.unlink(temporary)
        raise


def _hierarchy_lines(skeleton: Skeleton) -> list[str]:
    """Write the joints in file order, which is depth first."""
    lines = ["HIERARCHY"]
    sites: dict[int, list[list[float]]] = {}
    for parent, offset in zip(
        skeleton.end_site_parents.tolist(), skeleton.end_site_offsets.tolist(), strict=True
    ):
        sites.setdefault(parent, []).append(offset)

    depth = 0
    open_joints: list[int] = []

    def put(text: str) -> None:
        lines.append("  " * depth + text)

    def close_until(parent: int) -> None:
        nonlocal depth
        while open_joints and open_joints[-1] != parent:
            joint = open_joints.pop()
            for offset in sites.get(joint, []):
                put("End Site")
                put("{")
                put("  OFFSET " + " ".join(map(repr, offset)))
                put("}")
            depth -= 1
            put("}")
        if not open_joints and parent >= 0:
            raise ValueError("joints must be in depth-first order to be written")

    for joint, parent in enumerate(skeleton.parents.tolist()):
        close_until(parent)
        put(("ROOT " if parent < 0 else "JOINT ") + skeleton.joint_names[joint])
        put("{")
        depth += 1
        open_joints.append(joint)
        put("OFFSET " + " ".join(map(repr, skeleton.offsets[joint].tolist())))
        names = skeleton.channel_names[joint]
        put(" ".join(["CHANNELS", str(len(names)), *names]))
    close_until(-1)
    return lines
