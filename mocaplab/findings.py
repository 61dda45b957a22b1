"""What was found in a motion, in words; :mod:`mocaplab.doctor` does the looking."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from mocaplab.motion import BoolArray

Kind = Literal[
    "missing",
    "frame time",
    "rest pose",
    "jump",
    "full turn",
    "branch switch",
    "near gimbal lock",
    "constant",
]
Severity = Literal["warning", "note"]


@dataclass(frozen=True)
class Finding:
    """One thing that was found in a motion."""

    kind: Kind
    where: str  # a joint, a channel, or "" for the whole motion
    frames: tuple[tuple[int, int], ...]  # first and last frame of every run; () for all
    severity: Severity
    message: str  # a sentence: what it is, and what to do

    @property
    def n_frames(self) -> int:
        """Number of frames in all runs."""
        return sum(last - first + 1 for first, last in self.frames)


ADVICE = {
    "missing": "a gap; fill it before anything else, mocaplab clean does",
    "jump": "too far for one frame in any Euler angles; look at the joint, and repair or hold it",
    "full turn": "no movement, the angle is only written otherwise; make_continuous joins it up",
    "branch switch": "no movement, only the other triple of angles; make_continuous goes back",
    "near gimbal lock": "two axes nearly coincide and angles swing; smooth quaternions here",
    "constant": "no movement at all; leave out of averages, and pass through unchanged",
}


def findings_of(kind: Kind, names: Sequence[str], where: BoolArray) -> list[Finding]:
    """Make one finding of each column of (T, columns) that has any True."""
    found = []
    for column in np.flatnonzero(where.any(axis=0)).tolist():
        edges = np.flatnonzero(np.diff(where[:, column].astype(int), prepend=0, append=0))
        runs = tuple((int(a), int(b) - 1) for a, b in zip(edges[::2], edges[1::2], strict=True))
        severity: Severity = "note" if kind == "near gimbal lock" else "warning"
        shown = ", ".join(str(a) if a == b else f"{a} to {b}" for a, b in runs[:3])
        frames = f"frame{'' if runs == ((runs[0][0],) * 2,) else 's'} {shown}"
        more = f" and {len(runs) - 3} more times" if len(runs) > 3 else ""
        number = _number(kind, int(where[:, column].sum()))
        message = f"{names[column]}: {number}, {frames}{more}: {ADVICE[kind]}."
        found.append(Finding(kind, names[column], runs, severity, message))
    return found


def summarize(findings: Sequence[Finding], *, most: int = 3) -> list[str]:
    """Put findings into few lines, one for each kind.

    Parameters
    ----------
    findings : as :func:`mocaplab.doctor.diagnose` returns them
    most : how many joints or channels to name, those with the most frames first
    """
    lines = []
    for kind in get_args(Kind):
        group = [finding for finding in findings if finding.kind == kind]
        if kind not in ADVICE:
            lines += [finding.message for finding in group]
        elif group:
            group.sort(key=lambda finding: -finding.n_frames)
            total = len(group) if kind == "constant" else sum(finding.n_frames for finding in group)
            where = ", ".join(finding.where for finding in group[:most])
            more = f" and {len(group) - most} more" if len(group) > most else ""
            lines.append(f"{_number(kind, total)} in {where}{more}: {ADVICE[kind]}")
    return lines


def _number(kind: Kind, n: int) -> str:
    """Say how many; "3 branch switches"."""
    nouns = {
        "missing": ("missing sample", "missing samples"),
        "branch switch": ("branch switch", "branch switches"),
        "near gimbal lock": ("frame near gimbal lock", "frames near gimbal lock"),
        "constant": ("constant angle", "constant angles"),
    }
    return f"{n} {nouns.get(kind, (kind, f'{kind}s'))[n != 1]}"
