"""The lines of ASF and AMC files, and the error that names one."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from mocaplab.files import FormatError


class AcclaimError(FormatError):
    """An ASF or AMC file that is not correct, or not of the kind that CMU writes."""


@dataclass(frozen=True)
class Line:
    """A line that is not blank, without its comment."""

    path: str
    number: int
    words: tuple[str, ...]

    def error(self, expected: str, got: str | None = None) -> AcclaimError:
        """Build the error for this line."""
        text = " ".join(self.words)
        shown = repr(text if len(text) <= 60 else text[:57] + "...")
        return AcclaimError(self.path, self.number, expected, got or shown)

    def numbers(self, words: Iterable[str], expected: str) -> tuple[float, ...]:
        """Turn words into numbers that are finite."""
        values = []
        for word in words:
            try:
                value = float(word)
            except ValueError:
                raise self.error(expected, repr(word[:40])) from None
            if not math.isfinite(value) or "_" in word:  # float("1_0") is 10
                raise self.error(expected, repr(word[:40]))
            values.append(value)
        return tuple(values)

    def three_numbers(self, words: Sequence[str]) -> tuple[float, float, float]:
        """Turn three words into three numbers."""
        if len(words) != 3:
            raise self.error(f"{self.words[0]} and three numbers")
        x, y, z = self.numbers(words, f"three numbers after {self.words[0]}")
        return x, y, z


def read_lines(path: str | os.PathLike[str], kind: str) -> list[Line]:
    """Read a text file as lines of words; comments and blank lines are left out."""
    raw = Path(path).read_bytes()
    if b"\0" in raw:
        raise AcclaimError(path, None, f"{kind} file", "binary data")
    text = raw.decode("latin-1").replace("\r\n", "\n").replace("\r", "\n")
    split = (line.partition("#")[0].split() for line in text.split("\n"))
    lines = [Line(str(path), i, tuple(words)) for i, words in enumerate(split, 1) if words]
    if not lines:
        raise AcclaimError(path, None, f"{kind} file", "an empty file")
    return lines


def fields_of(head: Line, lines: list[Line], keys: tuple[str, ...]) -> dict[str, Line]:
    """Sort lines by their first words, each of which must be there once."""
    found: dict[str, Line] = {}
    for line in lines:
        key = line.words[0].lower()
        if key not in keys or key in found:
            raise line.error("each once of " + ", ".join(keys))
        found[key] = line
    for key in keys:
        if key not in found:
            raise head.error(f"{key} below this line", "none")
    return found
