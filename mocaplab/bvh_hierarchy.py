"""The HIERARCHY part of a BVH file: the words that name the joints, read and written.

Also what every part of the reader needs: the lines of a file, and the error that names one.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from mocaplab.files import FormatError
from mocaplab.motion import CHANNEL_NAMES, Skeleton

_CHANNEL_SPELLING = {name.lower(): name for name in CHANNEL_NAMES}


class BVHError(FormatError):
    """A file that is not a correct BVH file."""


def _lines_of(text: str) -> Iterator[str]:
    """List the lines of a text, a block at a time: nobody asks for most of them."""
    start = 0
    while start < len(text):
        end = text.find("\n", start + 4096)
        if end < 0:
            yield from text[start:].removesuffix("\n").split("\n")
            return
        yield from text[start:end].split("\n")
        start = end + 1


class Lines:
    """The lines of a file, one at a time, blank ones passed over."""

    def __init__(self, path: str | os.PathLike[str], text: str):
        self.path, self.text = path, text
        self._lines = _lines_of(text)
        self.start = 0  # where the next line begins in text
        self.line = ""  # the line read last
        self.number = 0  # and its number, counted from 1

    def next(self, expected: str) -> list[str]:
        """Return the words of the next line that is not blank."""
        for line in self._lines:
            self.line = line
            self.start += len(line) + 1
            self.number += 1
            if words := line.split():
                return words
        raise self.error(expected, "the end of the file")

    def error(self, expected: str, got: str, line: int | None = None) -> BVHError:
        """Build the error for the line read last, or for another one."""
        return BVHError(self.path, line or self.number, expected, got)

    def rest(self) -> Iterator[tuple[int, list[str]]]:
        """List the number and the words of all lines that are left."""
        for i, line in enumerate(self.text[self.start :].split("\n"), start=self.number + 1):
            yield i, line.split()


def is_count(word: str) -> bool:
    """Tell whether a word is a whole number that a file can mean."""
    return word.isdecimal() and len(word) < 19


def to_number(reader: Lines, word: str, line: int | None = None) -> float:
    """Turn a word into a finite number, or raise the error for its line."""
    try:
        value = float(word)
    except ValueError:
        raise reader.error("a number", repr(word[:40]), line) from None
    if not math.isfinite(value) or "_" in word:
        raise reader.error("a finite number", repr(word[:40]), line)
    return value


def quote(words: list[str]) -> str:
    """Quote a line for an error message, cut where it is long."""
    text = " ".join(words)
    return repr(text if len(text) <= 60 else text[:57] + "...")


@dataclass
class _Joint:
    """What the hierarchy says of one joint."""

    name: str
    parent: int
    offset: list[float] | None = None
    channels: tuple[str, ...] | None = None


def read_hierarchy(reader: Lines) -> Skeleton:
    """Read from HIERARCHY up to and with the MOTION line."""
    words = reader.next("HIERARCHY")
    if [word.upper() for word in words] != ["HIERARCHY"]:
        raise reader.error("HIERARCHY", quote(words))
    joints: list[_Joint] = []
    sites: list[tuple[int, list[float]]] = []
    open_joints: list[int] = []  # the joints whose braces are open, innermost last
    while True:
        expected = "JOINT, End Site, OFFSET, CHANNELS or }" if open_joints else "ROOT or MOTION"
        words = reader.next(expected)
        key = words[0].upper()
        if not open_joints:
            if key == "MOTION" and len(words) == 1 and joints:
                break
            if key != "ROOT" or joints:
                raise reader.error("MOTION" if joints else "ROOT", quote(words))
            _open_joint(reader, words, joints, open_joints)
            continue
        joint = joints[open_joints[-1]]
        if key == "JOINT":
            _check_complete(joint, reader, words)
            _open_joint(reader, words, joints, open_joints)
        elif key == "END":
            sites.append((open_joints[-1], _read_end_site(reader, words)))
        elif key == "OFFSET" and joint.offset is None:
            joint.offset = _read_offset(reader, words)
        elif key == "CHANNELS" and joint.channels is None:
            joint.channels = _read_channels(reader, words)
        elif words == ["}"]:
            _check_complete(joint, reader, words)
            open_joints.pop()
        elif key in ("OFFSET", "CHANNELS"):
            raise reader.error(f"{key} of joint {joint.name!r} once", "a second one")
        else:
            raise reader.error(expected, quote(words))
    if not any(joint.channels for joint in joints):
        raise reader.error("at least one channel", "none")
    return Skeleton(
        joint_names=tuple(joint.name for joint in joints),
        parents=np.array([joint.parent for joint in joints]),
        offsets=np.array([joint.offset for joint in joints], dtype=np.float64),
        channel_names=tuple(joint.channels or () for joint in joints),
        end_site_parents=np.array([parent for parent, _ in sites], dtype=np.int64),
        end_site_offsets=np.array([offset for _, offset in sites]).reshape(-1, 3),
    )


def _open_joint(
    reader: Lines, words: list[str], joints: list[_Joint], open_joints: list[int]
) -> None:
    """Add the joint that a ROOT or JOINT line names; the brace may end that line."""
    name = _joint_name(reader.line)
    if not name:
        raise reader.error("a joint name", quote(words))
    if name in [joint.name for joint in joints]:
        raise reader.error("a new joint name", f"{name!r} a second time")
    if not words[-1].endswith("{"):
        _read_brace(reader)
    joints.append(_Joint(name, open_joints[-1] if open_joints else -1))
    open_joints.append(len(joints) - 1)


def _joint_name(line: str) -> str:
    """Take the name out of a line such as ``JOINT Left Arm {``; blanks inside it stay."""
    words = line.strip().removesuffix("{").split(maxsplit=1)
    return words[1].rstrip() if len(words) == 2 else ""


def _check_complete(joint: _Joint, reader: Lines, words: list[str]) -> None:
    """Refuse to go on to a child or a brace before the joint has all that it needs.

    CHANNELS after a child would also put the columns of MOTION in another order.
    """
    for key, value in (("OFFSET", joint.offset), ("CHANNELS", joint.channels)):
        if value is None:
            raise reader.error(f"{key} of joint {joint.name!r} first", quote(words))


def _read_brace(reader: Lines) -> None:
    words = reader.next("{")
    if words != ["{"]:
        raise reader.error("{", quote(words))


def _read_end_site(reader: Lines, words: list[str]) -> list[float]:
    head = " ".join(words).lower()
    if head.removesuffix("{").rstrip() != "end site":
        raise reader.error("End Site", quote(words))
    if not head.endswith("{"):
        _read_brace(reader)
    offset = _read_offset(reader, reader.next("OFFSET"))
    words = reader.next("}")
    if words != ["}"]:
        raise reader.error("}", quote(words))
    return offset


def _read_offset(reader: Lines, words: list[str]) -> list[float]:
    if words[0].upper() != "OFFSET" or len(words) != 4:
        raise reader.error("OFFSET and three numbers", quote(words))
    return [to_number(reader, word) for word in words[1:]]


def _read_channels(reader: Lines, words: list[str]) -> tuple[str, ...]:
    names = words[2:]
    if len(words) < 2 or not is_count(words[1]) or int(words[1]) != len(names):
        raise reader.error("CHANNELS, a count and as many names", quote(words))
    channels = tuple([_CHANNEL_SPELLING.get(name.lower(), "") for name in names])
    if "" in channels:
        unknown = names[channels.index("")]
        raise reader.error(f"one of {', '.join(CHANNEL_NAMES)}", repr(unknown))
    if len(set(channels)) != len(channels):
        raise reader.error("every channel once", quote(words))
    return channels


def hierarchy_lines(skeleton: Skeleton) -> list[str]:
    """Write the joints in file order, which is depth first."""
    lines = ["HIERARCHY"]
    open_joints: list[int] = []
    parents, offsets = skeleton.end_site_parents, skeleton.end_site_offsets
    sites = list(zip(parents.tolist(), offsets.tolist(), strict=True))

    def put(text: str) -> None:
        lines.append("  " * len(open_joints) + text)

    def put_sites() -> None:
        """Write the next End Sites as soon as their joint is the innermost one."""
        while sites and open_joints and sites[0][0] == open_joints[-1]:
            _, offset = sites.pop(0)
            put("End Site")
            put("{")
            put("  OFFSET " + " ".join(map(repr, offset)))
            put("}")

    def close_until(parent: int) -> None:
        while open_joints and open_joints[-1] != parent:
            open_joints.pop()
            put("}")
            put_sites()

    for joint, parent in enumerate(skeleton.parents.tolist()):
        close_until(parent)
        if parent >= 0 and not open_joints:
            raise ValueError("joints must be in depth-first order to be written")
        name = skeleton.joint_names[joint]
        if not name or _joint_name(f"JOINT {name}") != name or set(name) & set("\r\n\0"):
            raise ValueError(f"a BVH file cannot hold the joint name {name!r}")
        put(("ROOT " if parent < 0 else "JOINT ") + name)
        put("{")
        open_joints.append(joint)
        put("OFFSET " + " ".join(map(repr, skeleton.offsets[joint].tolist())))
        names = skeleton.channel_names[joint]
        put(" ".join(["CHANNELS", str(len(names)), *names]))
        put_sites()
    close_until(-1)
    if sites:
        raise ValueError("End Sites must be in depth-first order to be written")
    return lines
