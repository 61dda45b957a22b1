"""Read ASF files: the skeletons of CMU's own motion capture format, Acclaim's ASF/AMC.

An ASF file holds one skeleton: a root and bones. Each bone has a direction and a length in
the world's axes at rest, a frame of axes in which its angles are told, and the angles
(degrees of freedom) that it has. :mod:`data_tools.amc` reads the motions that go with it.

The reader takes what CMU's files hold and refuses the rest of the format (bones that
change their lengths, a root that does not start at zero), because it could not test it.

Source: the Acclaim format as CMU documents it, and 02.asf of mocap.cs.cmu.edu.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path

from data_tools.acclaim import AcclaimError, Line, fields_of, read_lines
from data_tools.asf_bones import ORDERS, Bone, read_bones

SECTIONS = ("version", "name", "units", "documentation", "root", "bonedata", "hierarchy", "skin")
NEEDED = ("units", "root", "bonedata", "hierarchy")


@dataclass(frozen=True)
class AsfSkeleton:
    """The bones of an ASF file, each parent before its children, depth first.

    The root itself is a point, not a bone: it is where the first bones begin.

    Parameters
    ----------
    name : str
    length_factor : float
        What the file calls ``length``: a length in inches is the file's number divided by it.
    root_order : str such as "XYZ", the axis of the turn that is applied first named first
    bones : tuple of Bone
    """

    name: str
    length_factor: float
    root_order: str
    bones: tuple[Bone, ...]

    @property
    def cm_per_unit(self) -> float:
        """Centimetres in one file unit; 5.6444 in CMU's files, whose factor is 0.45."""
        return 2.54 / self.length_factor


def load_asf(path: str | os.PathLike[str]) -> AsfSkeleton:
    """Read an ASF file.

    Parameters
    ----------
    path : path of the file

    Returns
    -------
    AsfSkeleton

    Raises
    ------
    AcclaimError
        If the file is not correct; the message names the line.
    OSError
        If the file cannot be read.
    """
    sections: dict[str, list[Line]] = {}
    for line in read_lines(path, "an ASF"):
        if line.words[0].startswith(":"):
            key = line.words[0][1:].lower()
            if key not in SECTIONS or key in sections:
                raise line.error("each once of " + ", ".join(f":{name}" for name in SECTIONS))
            sections[key] = []
        elif not sections:
            raise line.error("a section such as :version")
        sections[key].append(line)
    for key in NEEDED:
        if key not in sections:
            raise AcclaimError(path, None, f"a section :{key}", "none")
    name = " ".join(sections["name"][0].words[1:]) if "name" in sections else ""
    bones = read_bones(sections["bonedata"])
    return AsfSkeleton(
        name=name or Path(path).stem,
        length_factor=_read_length_factor(sections["units"]),
        root_order=_read_root_order(sections["root"]),
        bones=_depth_first(sections["hierarchy"], bones),
    )


def _read_length_factor(lines: list[Line]) -> float:
    fields = fields_of(lines[0], lines[1:], ("mass", "length", "angle"))
    if fields["angle"].words[1:] != ("deg",):
        raise fields["angle"].error("angle deg")
    line = fields["length"]
    values = line.numbers(line.words[1:], "length and a number above 0")
    if len(values) != 1 or values[0] <= 0:
        raise line.error("length and a number above 0")
    return values[0]


def _read_root_order(lines: list[Line]) -> str:
    """Read the order of the root's turns; its place and its axes at rest must be zero."""
    fields = fields_of(lines[0], lines[1:], ("order", "axis", "position", "orientation"))
    order = tuple(word.upper() for word in fields["order"].words[1:])
    if order[:3] != ("TX", "TY", "TZ") or order[3:] not in [
        tuple("R" + letter for letter in turn) for turn in ORDERS
    ]:
        raise fields["order"].error("order TX TY TZ and RX, RY, RZ in any order")
    axis = fields["axis"]
    if len(axis.words) != 2 or axis.words[1].upper() not in ORDERS:
        raise axis.error("axis and an order such as XYZ")
    for key in ("position", "orientation"):
        if any(fields[key].three_numbers(fields[key].words[1:])):
            raise fields[key].error(f"{key} 0 0 0, as in CMU's files")
    return "".join(word[1] for word in order[3:])


def _depth_first(lines: list[Line], bones: dict[str, Bone]) -> tuple[Bone, ...]:
    """Read :hierarchy, whose lines name a parent and its children, and sort the bones."""
    if [line.words[0].lower() for line in (lines[1:2] + lines[-1:])] != ["begin", "end"]:
        raise lines[0].error("begin and end below this line")
    children: dict[str, tuple[str, ...]] = {}
    seen = {"root"}
    for line in lines[2:-1]:
        parent = line.words[0]
        if parent not in seen or parent in children:
            raise line.error("root or the name of a child above, once", repr(parent))
        for child in line.words[1:]:
            if child not in bones or child in seen:
                raise line.error("bones of :bonedata, each the child of one", repr(child))
            seen.add(child)
        children[parent] = line.words[1:]
    for name in bones:
        if name not in seen:
            raise lines[0].error(f"bone {name!r} below this line", "none")
    ordered: list[Bone] = []
    waiting = [("root", -1)]
    while waiting:
        name, parent_index = waiting.pop()
        if name != "root":
            ordered.append(replace(bones[name], parent=parent_index))
        index = len(ordered) - 1
        waiting += [(child, index) for child in reversed(children.get(name, ()))]
    return tuple(ordered)
