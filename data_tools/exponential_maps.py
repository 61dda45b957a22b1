"""Read motions in exponential-map text, as the prediction field passes them on.

Human3.6M in this form has 99 numbers a line, CMU 117: three of the root's path, then three for
every joint, 32 and 38 of them. The three numbers of a joint are its axis times its angle in
radians. A comma stands between numbers. The files say neither names nor the frame rate: joints
are counted from 0, the root, and the rate must be given (Human3.6M was recorded at 50).
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from mocaplab.files import FormatError
from mocaplab.quaternions import rotation_vector_to_quaternion
from mocaplab.two_sources.segments import SegmentClip

COLUMNS = {99: "Human3.6M", 117: "CMU"}
"""How many numbers a line has, and in which collection."""


def load_exponential_map(
    path: str | os.PathLike[str],
    fps: float,
    joints: Sequence[int] | None = None,
    action: str = "",
) -> SegmentClip:
    """Read one motion.

    Parameters
    ----------
    path : path of a text file
    fps : float, frames per second
    joints : numbers of the joints to keep, or None for all of them
        Many joints of both collections never turn;
        :func:`mocaplab.two_sources.segments.moving_segments` tells which do.
    action : str

    Returns
    -------
    SegmentClip, of segments ``joint_00``, ``joint_01`` and so on

    Raises
    ------
    FormatError
        If a line does not have 99 or 117 numbers, or not as many as the first one.
    ValueError
        If fps is not above 0, or there is no such joint.
    OSError
        If it cannot be read.
    """
    if not 0 < fps < np.inf:
        raise ValueError(f"expected fps above 0, got {fps}")
    path = Path(path)
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except UnicodeDecodeError:
        raise FormatError(path, None, "numbers with commas between", "no text") from None
    rows: list[list[float]] = []
    for number, line in enumerate(lines, start=1):
        if line.strip():
            rows.append(_numbers(line, path, number, len(rows[0]) if rows else None))
    if not rows:
        raise FormatError(path, None, "lines of 99 or 117 numbers", "none")
    values = np.array(rows)[:, 3:]
    n = values.shape[1] // 3
    kept = list(range(n) if joints is None else joints)
    wrong = [joint for joint in kept if not 0 <= joint < n]
    if wrong:
        raise ValueError(f"{path}: expected joints from 0 to {n - 1}, got {wrong[0]}")
    q = rotation_vector_to_quaternion(values.reshape(len(values), n, 3)[:, kept])
    names = tuple(f"joint_{joint:02}" for joint in kept)
    return SegmentClip(q, 1 / fps, names, path.stem, action)


def _numbers(line: str, path: Path, number: int, width: int | None) -> list[float]:
    words = line.split(",")
    expected = str(width) if width else " or ".join(map(str, COLUMNS))
    if len(words) != width if width else len(words) not in COLUMNS:
        raise FormatError(path, number, f"{expected} numbers with commas", str(len(words)))
    try:
        values = [float(word) for word in words]
    except ValueError:
        raise FormatError(path, number, "numbers", line.strip()[:40]) from None
    if not np.isfinite(values).all():
        raise FormatError(path, number, "finite numbers", "NaN or infinity")
    return values
