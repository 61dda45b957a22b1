"""The notebooks of graded assignments: submissions made from them, and cells run without a kernel.

nbgrader's own run starts a kernel for each submission. To try many answers fast, the cells can
also be executed here, one after the other, and scored by nbgrader's rules.
"""

from __future__ import annotations

import ast
import contextlib
import copy
import io
import os
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import nbformat

COURSE = Path(__file__).parent.parent / "notebooks" / "assignments"
BEGIN, END = "### BEGIN SOLUTION", "### END SOLUTION"


class CellScore(NamedTuple):
    """What a check cell gives."""

    points: float
    most: float
    text: str  # what it printed, or the hint


def assignment_names(course: Path = COURSE) -> list[str]:
    """List the assignments of a course folder, in the order of the syllabus."""
    names = [path.name for path in (course / "source").iterdir() if path.is_dir()]
    return sorted(names)


def read_notebook(folder: Path, name: str) -> Any:
    """Read the notebook of an assignment from ``folder/name/name.ipynb``."""
    return nbformat.read(folder / name / f"{name}.ipynb", as_version=4)  # type: ignore[no-untyped-call]


def write_notebook(notebook: Any, folder: Path, name: str) -> None:
    """Write the notebook of an assignment to ``folder/name/name.ipynb``."""
    (folder / name).mkdir(parents=True, exist_ok=True)
    text: str = nbformat.writes(notebook)  # type: ignore[no-untyped-call]
    (folder / name / f"{name}.ipynb").write_text(text + "\n", encoding="utf-8")


def grade_id(cell: Any) -> str:
    """Return the name of a cell in nbgrader, or nothing for a cell that it does not know."""
    return str(cell.metadata.get("nbgrader", {}).get("grade_id", ""))


def answers_of(source: Any) -> dict[str, str]:
    """Return the solutions of an assignment: the name of the cell -> what stands in it."""
    known = [cell for cell in source.cells if cell.metadata.get("nbgrader", {}).get("solution")]
    return {grade_id(cell): cell.source for cell in known}


def automatic_points(source: Any) -> dict[str, float]:
    """Return the points of every check cell."""
    checks = [cell for cell in source.cells if cell.cell_type == "code"]
    return {
        grade_id(cell): float(cell.metadata.nbgrader.points)
        for cell in checks
        if cell.metadata.get("nbgrader", {}).get("grade")
    }


def fill_in(release: Any, answers: Mapping[str, str], student: str) -> Any:
    """Return a copy of the student edition with a name and answers in it."""
    notebook = copy.deepcopy(release)
    for cell in notebook.cells:
        cell.source = answers.get(grade_id(cell), cell.source)
        cell.source = cell.source.replace('student = "your-id"', f'student = "{student}"')
    return notebook


def replace_solution(source: str, old: str, new: str) -> str:
    """Change a solution: put ``new`` in place of ``old``, or of all of it if ``old`` is empty."""
    if old:
        if source.count(old) != 1:
            raise ValueError(f"expected {old!r} once in the solution, got it {source.count(old)} x")
        return source.replace(old, new)
    before, rest = source.split(BEGIN)
    after = rest.split(END)[1]
    indent = before[before.rfind("\n") + 1 :]
    lines = [indent + line if line else "" for line in new.splitlines()]
    return before[: len(before) - len(indent)] + "\n".join(lines) + after


def run_cells(notebook: Any, student: str) -> tuple[dict[str, CellScore], dict[str, Any]]:
    """Run the code cells of a notebook as if nbgrader graded it for this student.

    Returns
    -------
    scores : name of the check cell -> what it gives
    namespace : all that the cells defined
    """
    namespace: dict[str, Any] = {"__name__": "__main__"}
    scores: dict[str, CellScore] = {}
    before = Path.cwd(), os.environ.get("NBGRADER_EXECUTION")
    with tempfile.TemporaryDirectory() as root:
        here = Path(root) / student / "assignment"
        here.mkdir(parents=True)
        (here / "assignment.ipynb").touch()
        os.chdir(here)
        os.environ["NBGRADER_EXECUTION"] = "autograde"
        try:
            for cell in notebook.cells:
                if cell.cell_type == "code":
                    value, text, failed = _run(cell.source, namespace)
                    if cell.metadata.get("nbgrader", {}).get("grade"):
                        most = float(cell.metadata.nbgrader.points)
                        points = 0.0 if failed else most if value is None else float(value)
                        scores[grade_id(cell)] = CellScore(points, most, text)
        finally:
            os.chdir(before[0])
            os.environ.pop("NBGRADER_EXECUTION")
            if before[1] is not None:
                os.environ["NBGRADER_EXECUTION"] = before[1]
    return scores, namespace


def _run(code: str, namespace: dict[str, Any]) -> tuple[Any, str, bool]:
    """Run one cell: the value of its last line, what it printed or its error, and if it failed."""
    printed = io.StringIO()
    try:
        tree = ast.parse(code)
        last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
        with contextlib.redirect_stdout(printed):
            exec(compile(tree, "<cell>", "exec"), namespace)
            value = None
            if isinstance(last, ast.Expr):
                value = eval(compile(ast.Expression(last.value), "<cell>", "eval"), namespace)
    except Exception as error:
        return None, f"{type(error).__name__}: {error}", True
    return value, printed.getvalue(), False
