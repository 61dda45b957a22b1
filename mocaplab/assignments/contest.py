"""Tasks without a best answer: beat a score. The score goes into a file for a leaderboard."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import orjson

from mocaplab import __version__
from mocaplab.assignments.grading import NotRight, graded_student, quiet_call
from mocaplab.exercises.answers import NOT_YET
from mocaplab.files import write_atomically

PUBLIC_SEED = 2017
"""The seed of the clips that everybody is scored on."""


@dataclass(frozen=True)
class Contest:
    """A task that is scored; less is better.

    Parameters
    ----------
    assignment : str
    unit : str, of the score
    score : takes the student's function and a seed, returns the score
        It raises :class:`mocaplab.assignments.grading.NotRight` if the function does not keep to
        the rules.
    baseline : the function to beat
    goal : float below 1; full points for this share of the baseline's score
    """

    assignment: str
    unit: str
    score: Callable[[Any, int], float]
    baseline: Callable[..., Any]
    goal: float


@dataclass(frozen=True)
class Entry:
    """What a student's function scored."""

    contest: Contest
    score: float
    baseline: float
    second: Entry | None = None

    def __str__(self) -> str:
        unit, limit = self.contest.unit, self.contest.goal * self.baseline
        found = f"Your score: {self.score:.4g} {unit}. The one to beat: {self.baseline:.4g} {unit}."
        if self.score >= self.baseline:
            return f"{found} Not beaten yet."
        if self.score > limit:
            return f"{found} Beaten: half of the points. All of them for {limit:.4g} or less."
        return f"{found} Beaten well: all points."

    def points(self, most: float) -> float:
        """Return all points at the goal, half for any better score than the baseline, or 0."""
        share = 1.0 if self.score <= self.contest.goal * self.baseline else 0.5
        own = most * share if self.score < self.baseline else 0.0
        return own if self.second is None else min(own, self.second.points(most))

    def confirm(self, answer: Any, seed: int) -> Entry:
        """Score the function on other clips too: only the smaller of the points count."""
        return replace(self, second=_score(self.contest, answer, seed))


def enter(contest: Contest, answer: Any, typed: str) -> Entry:
    """Score a function on the public clips and write the file for the leaderboard.

    The file is ``score-<assignment>.json`` in the working folder.

    Parameters
    ----------
    contest : Contest
    answer : the student's function
    typed : str, the id in the first cell

    Raises
    ------
    NotRight
        If there is no function, or it does not keep to the rules.
    """
    student = graded_student(typed)
    entry = _score(contest, answer, PUBLIC_SEED)
    record = {
        "assignment": contest.assignment,
        "student": student,
        "score": entry.score,
        "unit": contest.unit,
        "baseline": entry.baseline,
        "seed": PUBLIC_SEED,
        "mocaplab": __version__,
    }
    text = orjson.dumps(record, option=orjson.OPT_INDENT_2)
    write_atomically(f"score-{contest.assignment}.json", text)
    return entry


def call_or_refuse(answer: Any, *arguments: Any) -> Any:
    """Call a student's function as :func:`mocaplab.assignments.grading.quiet_call` does.

    Raises
    ------
    NotRight
        If it fails, or returns nothing.
    """
    result, problem = quiet_call(answer, *arguments)
    if problem or result is None:
        raise NotRight(problem or f"{NOT_YET} So far, your function returns nothing.")
    return result


def _score(contest: Contest, answer: Any, seed: int) -> Entry:
    if answer is None or answer is ...:
        raise NotRight(NOT_YET)
    score = contest.score(answer, seed)
    if not np.isfinite(score):
        raise NotRight("Your score is no finite number. Does your result have NaN in it?")
    return Entry(contest, float(score), float(contest.score(contest.baseline, seed)))
