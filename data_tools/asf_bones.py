"""The :bonedata part of an ASF file: each bone between a begin and an end."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import permutations

import numpy as np

from data_tools.acclaim import Line, fields_of
from mocaplab.motion import FloatArray

ORDERS = tuple("".join(letters) for letters in permutations("XYZ"))
DOFS = ("rx", "ry", "rz")


@dataclass(frozen=True)
class Bone:
    """One bone, as the file describes it.

    Parameters
    ----------
    name : str
    parent : int, index of the parent bone; -1 for the root
    direction : three floats, from the bone's start to its tip, in the world's axes at rest
    length : float, file length units
    axis_deg, axis_order : the turns about the world's axes, in this order, that lead to the
        frame in which the bone's angles are told
    dofs : str such as "XYZ" or "X": the axes of its angles, the one applied first named first
    limits_deg : for each angle, the lowest and the highest value; empty if the file has none
    """

    name: str
    parent: int
    direction: tuple[float, float, float]
    length: float
    axis_deg: tuple[float, float, float]
    axis_order: str
    dofs: str
    limits_deg: tuple[tuple[float, float], ...]

    @property
    def vector(self) -> FloatArray:
        """From the bone's start to its tip at rest, shape (3,), file length units."""
        return np.array(self.direction) * self.length


def read_bones(lines: list[Line]) -> dict[str, Bone]:
    """Read the blocks of :bonedata; who is whose parent is not known yet."""
    bones: dict[str, Bone] = {}
    block: list[Line] | None = None
    for line in lines[1:]:
        key = line.words[0].lower()
        if (key == "begin") != (block is None):
            raise line.error("begin" if block is None else "end")
        if key == "begin":
            block = [line]
        elif key == "end" and block:
            bone = _read_bone(block)
            if bone.name in bones or bone.name == "root":
                raise block[0].error("a bone with a new name", repr(bone.name))
            bones[bone.name], block = bone, None
        elif block:
            block.append(line)
    if block:
        raise block[0].error("an end of the bone that begins here", "none")
    return bones


def _read_bone(block: list[Line]) -> Bone:
    """Read the lines from begin up to, not including, end."""
    lines, limits = block[1:], []
    where = [i for i, line in enumerate(lines) if line.words[0].lower() == "limits"]
    if where:  # they fill the lines up to the end, one pair for each angle
        lines, limits = lines[: where[0]], lines[where[0] :]
    keys = ("id", "name", "direction", "length", "axis")
    has_dofs = any(line.words[0].lower() == "dof" for line in lines)
    fields = fields_of(block[0], lines, (*keys, "dof") if has_dofs else keys)
    name, length, axis = fields["name"], fields["length"], fields["axis"]
    if len(name.words) != 2:
        raise name.error("name and one word")
    lengths = length.numbers(length.words[1:], "length and a number above 0")
    if len(lengths) != 1 or lengths[0] <= 0:
        raise length.error("length and a number above 0")
    if len(axis.words) != 5 or axis.words[4].upper() not in ORDERS:
        raise axis.error("axis, three numbers and an order such as XYZ")
    dofs: tuple[str, ...] = ()
    if has_dofs:
        dofs = tuple(word.lower() for word in fields["dof"].words[1:])
        if not dofs or set(dofs) - set(DOFS) or len(set(dofs)) != len(dofs):
            raise fields["dof"].error("dof and each at most once of " + ", ".join(DOFS))
    direction = fields["direction"].three_numbers(fields["direction"].words[1:])
    if abs(math.hypot(*direction) - 1.0) > 1e-3:
        raise fields["direction"].error("a direction of length 1")
    return Bone(
        name=name.words[1],
        parent=-1,
        direction=direction,
        length=lengths[0],
        axis_deg=axis.three_numbers(axis.words[1:4]),
        axis_order=axis.words[4].upper(),
        dofs="".join(dof[1].upper() for dof in dofs),
        limits_deg=_read_limits(limits, len(dofs)),
    )


def _read_limits(lines: list[Line], n_dofs: int) -> tuple[tuple[float, float], ...]:
    """Read pairs such as (-160.0 20.0), one a line; "inf" is allowed here."""
    pairs = []
    for i, line in enumerate(lines):
        text = " ".join(line.words[1:] if i == 0 else line.words)
        words = text.removeprefix("(").removesuffix(")").split()
        try:
            low, high = map(float, words)
        except ValueError:
            raise line.error("limits such as (-160.0 20.0)") from None
        if not (text.startswith("(") and text.endswith(")") and low <= high):
            raise line.error("limits such as (-160.0 20.0)")
        pairs.append((low, high))
    if lines and len(pairs) != n_dofs:
        raise lines[0].error(f"{n_dofs} pairs of limits, one for each dof", str(len(pairs)))
    return tuple(pairs)
