"""Sample submissions: right, empty, wrong, copied and hostile ones, made from the solutions.

Each comes with the automatic points that it must get. They prove that the grading works before
the first student hands anything in.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import groupby
from pathlib import Path
from typing import Any, NamedTuple

from data_tools.assignment_notebooks import (
    BEGIN,
    answers_of,
    automatic_points,
    fill_in,
    grade_id,
    replace_solution,
    run_cells,
    write_notebook,
)
from data_tools.wrong_answers import WRONG_ANSWERS, WrongAnswer

FLAGGED = None
"""The expected points of a submission that cannot be graded and must be reported."""


class Sample(NamedTuple):
    """A submission, and what it must get."""

    student: str
    notebook: Any  # or the text of a file that is no notebook
    expected: float | None


def plain_samples(name: str, source: Any, release: Any) -> Iterator[Sample]:
    """Make the right, the empty and the wrong submissions of an assignment."""
    answers, points = answers_of(source), automatic_points(source)
    yield Sample("right", fill_in(release, answers, "right"), sum(points.values()))
    yield Sample("empty", release, 0.0)
    for number, wrongs in enumerate(wrong_sets(name), start=1):
        student = f"wrong-{number}"
        changed = {w.exercise: replace_solution(answers[w.exercise], w.old, w.new) for w in wrongs}
        lost = sum(points[f"check-{w.exercise}"] - w.points for w in wrongs)
        notebook = fill_in(release, answers | changed, student)
        yield Sample(student, notebook, sum(points.values()) - lost)


def wrong_sets(name: str) -> list[list[WrongAnswer]]:
    """Put the first wrong answer of every exercise together, the second, and so on."""
    wrongs = sorted(WRONG_ANSWERS[name], key=lambda wrong: wrong.exercise)
    by_exercise = [list(group) for _, group in groupby(wrongs, key=lambda wrong: wrong.exercise)]
    longest = max(len(group) for group in by_exercise)
    return [[group[i] for group in by_exercise if i < len(group)] for i in range(longest)]


def hostile_samples(source: Any, release: Any, *, own_numbers: str) -> Iterator[Sample]:
    """Make submissions that try the grading itself.

    Parameters
    ----------
    source, release : the two editions of the assignment
    own_numbers : name of an exercise whose answer is a list of numbers from the student's data
    """
    answers, points = answers_of(source), automatic_points(source)
    full = sum(points.values())
    function = next(n for n, text in answers.items() if "def " in text)
    without_it = full - points[f"check-{function}"]
    right = {"answers": answers, "release": release}

    loop = replace_solution(answers[function], "", "while True:\n    pass")
    yield _changed("endless-loop", {**right, "answers": answers | {function: loop}}, without_it)
    yield _changed("exits", right, FLAGGED, begin="exit()")
    yield _changed("kills-kernel", right, FLAGGED, begin="import os; os._exit(1)")
    yield _changed("prints-much", right, full, begin='for i in range(50_000):\n    print("x" * 60)')
    before, after = answers[function].split(BEGIN)
    warns = f'{before}import warnings\n    warnings.warn("this is no error")\n    {BEGIN}{after}'
    yield _changed("warns", {**right, "answers": answers | {function: warns}}, full)
    renamed = answers[function].replace("def ", "def renamed_")
    yield _changed("renames", {**right, "answers": answers | {function: renamed}}, without_it)
    yield _changed("deletes-checks", right, full, edit=_delete_checks)
    yield _changed("deletes-exercise", right, FLAGGED, edit=lambda nb: _drop(nb, function))
    yield _changed("edits-checks", {**right, "answers": {}}, 0.0, edit=_edit_checks)
    yield _changed("wrong-kernel", right, full, edit=_other_kernel)

    numbers = _numbers_of(source, own_numbers, "right")
    copied = {**right, "answers": answers | {own_numbers: numbers}}
    stolen = _changed("copies", copied, full - points[f"check-{own_numbers}"])
    yield stolen._replace(notebook=fill_in(release, copied["answers"], "right"))
    yield Sample("no-notebook", "this is not JSON", FLAGGED)


def _changed(
    student: str,
    right: dict[str, Any],
    expected: float | None,
    *,
    begin: str = "",
    edit: Callable[[Any], None] = lambda notebook: None,
) -> Sample:
    notebook = fill_in(right["release"], right["answers"], student)
    if begin:
        first = next(cell for cell in notebook.cells if cell.cell_type == "code")
        first.source += f"\n{begin}"
    edit(notebook)
    return Sample(student, notebook, expected)


def _is_check(cell: Any) -> bool:
    return cell.cell_type == "code" and bool(cell.metadata.get("nbgrader", {}).get("grade"))


def _delete_checks(notebook: Any) -> None:
    notebook.cells = [cell for cell in notebook.cells if not _is_check(cell)]


def _drop(notebook: Any, exercise: str) -> None:
    gone = (exercise, f"check-{exercise}")
    notebook.cells = [cell for cell in notebook.cells if grade_id(cell) not in gone]


def _edit_checks(notebook: Any) -> None:
    for cell in filter(_is_check, notebook.cells):
        cell.source = "100"
        cell.metadata.nbgrader.points = 100


def _other_kernel(notebook: Any) -> None:
    notebook.metadata.kernelspec = {"display_name": "R", "language": "R", "name": "ir"}


def _numbers_of(source: Any, exercise: str, student: str) -> str:
    """Return the answer of another student as he would read it aloud: numbers only."""
    _, namespace = run_cells(fill_in(source, {}, student), student)
    variable = answers_of(source)[exercise].split(" =")[0]
    return f"{variable} = {namespace[variable].tolist()}"


def write_samples(samples: list[Sample], course: Path, name: str) -> None:
    """Write submissions to where nbgrader looks for them."""
    for sample in samples:
        folder = course / "submitted" / sample.student
        if isinstance(sample.notebook, str):
            (folder / name).mkdir(parents=True)
            (folder / name / f"{name}.ipynb").write_text(sample.notebook)
        else:
            write_notebook(sample.notebook, folder, name)
