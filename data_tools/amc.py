"""Read AMC files: the motions that go with an ASF skeleton (:mod:`data_tools.asf`).

A frame is a line with its number, and then a line for the root and for every bone that has
angles: its name and its values.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from data_tools.acclaim import AcclaimError, Line, read_lines
from data_tools.asf import AsfSkeleton
from mocaplab.motion import FloatArray


@dataclass(frozen=True, eq=False)
class AmcMotion:
    """The values of an AMC file.

    Parameters
    ----------
    skeleton : AsfSkeleton
    root_positions : array, shape (T, 3), file length units
    root_angles_deg : array, shape (T, 3), in the skeleton's root order
    angles_deg : dict of a bone's name to an array, shape (T, len(dofs)); only bones with dofs
    name : str
    """

    skeleton: AsfSkeleton
    root_positions: FloatArray
    root_angles_deg: FloatArray
    angles_deg: dict[str, FloatArray]
    name: str

    @property
    def n_frames(self) -> int:
        """Number of frames T."""
        return len(self.root_positions)


def load_amc(path: str | os.PathLike[str], skeleton: AsfSkeleton) -> AmcMotion:
    """Read an AMC file.

    Parameters
    ----------
    path : path of the file
    skeleton : AsfSkeleton
        The skeleton that the file was made for; every bone with dofs must be in each frame.

    Returns
    -------
    AmcMotion

    Raises
    ------
    AcclaimError
        If the file is not correct or does not fit the skeleton; the message names the line.
    OSError
        If the file cannot be read.
    """
    lines = iter(read_lines(path, "an AMC"))
    first = _read_head(path, lines)
    widths = {"root": 6} | {bone.name: len(bone.dofs) for bone in skeleton.bones if bone.dofs}
    values: dict[str, list[tuple[float, ...]]] = {name: [] for name in widths}
    number, n_frames, start = _frame_number(first), 0, first
    for line in lines:
        name = line.words[0]
        if len(line.words) == 1 and name not in widths:
            _check_complete(start, values, n_frames)
            n_frames += 1
            if _frame_number(line) != number + n_frames:
                raise line.error(f"frame number {number + n_frames}")
            start = line
            continue
        if name not in widths:
            raise line.error("a bone of the skeleton with angles, or a frame number", repr(name))
        if len(values[name]) != n_frames:
            raise line.error(f"{name} once in a frame", "a second one")
        if len(line.words) != widths[name] + 1:
            raise line.error(f"{widths[name]} numbers after {name}", f"{len(line.words) - 1}")
        values[name].append(line.numbers(line.words[1:], f"{widths[name]} finite numbers"))
    _check_complete(start, values, n_frames)
    root = np.array(values.pop("root"))
    return AmcMotion(
        skeleton=skeleton,
        root_positions=root[:, :3],
        root_angles_deg=root[:, 3:],
        angles_deg={name: np.array(rows) for name, rows in values.items()},
        name=Path(path).stem,
    )


def _read_head(path: str | os.PathLike[str], lines: Iterator[Line]) -> Line:
    """Read the keywords above the frames; return the line of the first frame's number."""
    keywords: list[str] = []
    for line in lines:
        word = line.words[0].lower()
        if not word.startswith(":"):
            for needed in (":fully-specified", ":degrees"):
                if needed not in keywords:
                    raise line.error(f"{needed.upper()} above the first frame")
            return line
        if word not in (":fully-specified", ":degrees") or len(line.words) != 1:
            raise line.error(":FULLY-SPECIFIED or :DEGREES")
        keywords.append(word)
    raise AcclaimError(path, None, "frames below the keywords", "the end of the file")


def _frame_number(line: Line) -> int:
    word = line.words[0]
    if len(line.words) != 1 or not word.isdecimal() or len(word) > 18:
        raise line.error("a frame number")
    return int(word)


def _check_complete(start: Line, values: dict[str, list[tuple[float, ...]]], n_frames: int) -> None:
    """Refuse a frame that lacks a bone; the error names the line that began it."""
    for name, rows in values.items():
        if len(rows) != n_frames + 1:
            raise start.error(f"{name} in the frame that begins here", "none")
