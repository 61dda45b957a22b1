"""What every graded assignment needs: whose work it is, and how a check gives its points.

nbgrader gives the points of a cell unless the cell raises an error or writes to stderr. So a
check that is not right raises :class:`NotRight`, which shows its sentence and no traceback,
and the code of a student runs where its warnings cannot cost points.
"""

from __future__ import annotations

import contextlib
import copy
import hashlib
import io
import os
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from mocaplab.exercises.answers import call

RIGHT = "Right:"
LONGEST = 160  # letters of an error's text that a hint quotes
Work = TypeVar("Work")


class NotRight(AssertionError):
    """An answer that is not right yet; the text is the hint."""

    def _render_traceback_(self) -> list[str]:  # IPython shows this in place of a traceback
        return [str(self) if str(self).startswith("Not answered") else f"Not right yet. {self}"]


def require(sentence: str) -> None:
    """Print the sentence of a check if the answer is right.

    Raises
    ------
    NotRight
        With the sentence, if it does not begin with "Right:".
    """
    if not sentence.startswith(RIGHT):
        raise NotRight(sentence)
    print(sentence)


def graded_student(typed: str) -> str:
    """Return whose work this is.

    At home this is the name that the student typed. While nbgrader grades, it is the name of
    the folder that nbgrader runs the submission in, ``autograded/<student>/<assignment>``:
    what was typed does not count.

    Raises
    ------
    NotRight
        If nothing was typed, or the notebook has left its folder while it is graded.
    """
    if os.environ.get("NBGRADER_EXECUTION") == "autograde":
        here = Path.cwd()
        if not any(here.glob("*.ipynb")):
            raise NotRight("Your notebook changes its working folder. Take os.chdir out.")
        return here.parent.name
    if not isinstance(typed, str) or not typed.strip():
        raise NotRight('Put your id into the first cell: student = "...", between quotes.')
    return typed.strip()


def student_rng(student: str, what: str) -> np.random.Generator:
    """Return a random generator that is always the same for this student and purpose."""
    digest = hashlib.sha256(f"{what}\n{student}".encode()).digest()
    return np.random.default_rng(int.from_bytes(digest[:8], "little"))


def require_own(
    check: Callable[[Any, Work], str], draw: Callable[[str], Work], answer: Any, typed: str
) -> None:
    """Require that an answer is right for the data of the student whose work this is.

    Parameters
    ----------
    check : takes the answer and the data, returns a sentence
    draw : takes a student's id, returns the data
    answer : what the student gives
    typed : the id in the first cell

    Raises
    ------
    NotRight
        If it is wrong; an answer that was copied along with somebody's id is named as such.
    """
    owner = graded_student(typed)
    sentence = check(answer, draw(owner))
    copied = not sentence.startswith(RIGHT) and typed != owner
    if copied and check(answer, draw(typed)).startswith(RIGHT):
        raise NotRight(
            f"This is right for the data of {typed!r}; here the data of {owner!r} count. Put "
            f"your own id into the first cell, and answer again."
        )
    require(sentence)


def quiet_call(function: Any, *arguments: Any) -> tuple[Any, str]:
    """Call a student's function on copies; warnings and stderr cost no points.

    Returns
    -------
    result, and a sentence if it fails
    """
    with warnings.catch_warnings(), contextlib.redirect_stderr(io.StringIO()):
        warnings.simplefilter("ignore")
        result, problem = call(function, *copy.deepcopy(arguments))
    return result, problem if len(problem) <= LONGEST else f"{problem[:LONGEST]}..."
