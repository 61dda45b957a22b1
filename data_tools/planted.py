"""Wrong answers that students really give, planted to prove that each loses its points.

A wrong answer is the solution with one text in it replaced, or, where ``old`` is empty, another
solution. The first of every exercise together make the sample submission "wrong-1", the second
"wrong-2", and so on.
"""

from __future__ import annotations

from typing import NamedTuple


class WrongAnswer(NamedTuple):
    """A wrong answer to an exercise."""

    exercise: str  # the name of the cell that it stands in
    old: str
    new: str
    hint: str  # a part of what the check says to it
    points: float = 0.0  # what it is worth all the same
