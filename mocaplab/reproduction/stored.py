"""Results of a longer run on recorded clips, which come with the package: numbers, no motion.

``python -m data_tools.store_reproduction FOLDER`` puts them there.
"""

from __future__ import annotations

import csv
from importlib.resources import files
from pathlib import Path
from typing import NamedTuple

STORED = "claims", "figure_05", "figure_08", "figure_09", "figure_timing"
"""What is kept of a run, as far as it has it: the claims, and errors of every motion."""


class Table(NamedTuple):
    """A table of a run."""

    label: str  # what it was made with
    rows: list[dict[str, str]]


def read_table(text: str) -> Table:
    """Read a CSV file of ``mocaplab reproduce``, the line that says what it was made with too.

    Raises
    ------
    ValueError
        If that line is missing.
    """
    first, _, rest = text.partition("\n")
    if not first.startswith("# ") or not rest:
        raise ValueError(f"expected a CSV file of mocaplab reproduce, got {first[:40]!r}")
    return Table(first[2:], list(csv.DictReader(rest.splitlines())))


def stored_table(name: str, folder: Path | None = None) -> Table | None:
    """Return a table of the stored run, or of another folder; None if it has no such table.

    Parameters
    ----------
    name : str, such as ``"claims"`` or ``"figure_08"``
    folder : Path, the output folder of a run, or None for what comes with the package
    """
    place = files("mocaplab") / "data" / "reproduction" if folder is None else folder
    path = place / f"{name}.csv"
    return read_table(path.read_text(encoding="utf-8")) if path.is_file() else None
