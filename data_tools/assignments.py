"""Make the editions of the graded assignments and prove that the grading works.

    python -m data_tools.assignments                      all of them: make assignments
    python -m data_tools.assignments bvh_kinematics       only these

A course of its own is made in ``notebooks/assignments/build``, which is thrown away and made
anew each time. Sample submissions go through nbgrader's own commands, and what they get is
compared with what they must get; the exit status is 1 if anything differs.
"""

from __future__ import annotations

import argparse
import csv
import io
import os
import shutil
import subprocess
import sys
import time
from collections import defaultdict
from collections.abc import Collection
from pathlib import Path
from typing import NamedTuple

import orjson

from data_tools.assignment_notebooks import COURSE, assignment_names, read_notebook
from data_tools.sample_submissions import (
    Sample,
    hostile_samples,
    plain_samples,
    write_samples,
)
from mocaplab.files import write_atomically

HOSTILE = ("bvh_kinematics", "rest")
"""The assignment that gets hostile submissions too, and its exercise with typed numbers."""
CELL_TIMEOUT_S = 30


class Result(NamedTuple):
    """What nbgrader made of a sample submission."""

    assignment: str
    student: str
    points: float | None
    expected: float | None

    @property
    def as_expected(self) -> bool:
        """Tell whether it got what it must get."""
        return self.points == self.expected


class Course:
    """A course folder and nbgrader's commands in it.

    Parameters
    ----------
    folder : Path, replaced if it exists
    """

    def __init__(self, folder: Path):
        self.folder = folder
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        shutil.copytree(COURSE / "source", folder / "source")
        shutil.copy(COURSE / "nbgrader_config.py", folder)

    def nbgrader(self, *arguments: str) -> bool:
        """Run an nbgrader command, its words into log.txt, and tell whether it succeeded."""
        scripts = str(Path(sys.executable).parent)  # nbgrader calls alembic by its name
        paths = os.pathsep.join([str(Path.cwd()), os.environ.get("PYTHONPATH", "")])
        environment = {
            **os.environ,
            "PATH": f"{scripts}{os.pathsep}{os.environ.get('PATH', '')}",
            "PYTHONPATH": paths.rstrip(os.pathsep),
        }
        with open(self.folder / "log.txt", "a", encoding="utf-8") as log:
            command = [sys.executable, "-m", "nbgrader", *arguments]
            done = subprocess.run(
                command, cwd=self.folder, env=environment, stdout=log, stderr=subprocess.STDOUT
            )
        return done.returncode == 0

    def automatic_points(self, assignment: str, student: str) -> float | None:
        """Return the points of all check cells, or None if the submission was not graded."""
        from nbgrader.api import Gradebook

        if not (self.folder / "autograded" / student / assignment).exists():
            return None
        with Gradebook(f"sqlite:///{self.folder / 'gradebook.db'}") as gradebook:
            submission = gradebook.find_submission(assignment, student)
            grades = [grade for book in submission.notebooks for grade in book.grades]
            return float(sum(grade.auto_score or 0.0 for grade in grades))


def grade_samples(course: Course, name: str, students: Collection[str] = ()) -> list[Result]:
    """Take one assignment through the whole loop: generate, submit, grade, feedback.

    Parameters
    ----------
    course : Course
    name : str, the assignment
    students : names of the sample submissions, none for all
    """
    if not course.nbgrader("generate_assignment", name, "--force"):
        raise SystemExit(f"{name}: nbgrader cannot generate it; see {course.folder / 'log.txt'}")
    source = read_notebook(course.folder / "source", name)
    release = read_notebook(course.folder / "release", name)
    samples: list[Sample] = list(plain_samples(name, source, release))
    if name == HOSTILE[0]:
        samples += hostile_samples(source, release, own_numbers=HOSTILE[1])
    samples = [sample for sample in samples if not students or sample.student in students]
    write_samples(samples, course.folder, name)
    course.nbgrader("autograde", name, "--force", f"--Execute.timeout={CELL_TIMEOUT_S}")
    course.nbgrader("generate_feedback", name, "--force")
    solution = course.folder / "autograded" / "right" / name
    if solution.exists():
        shutil.copytree(solution, course.folder / "solution" / name)
    return [
        Result(name, s.student, course.automatic_points(name, s.student), s.expected)
        for s in samples
    ]


def leaderboard(course: Course) -> str:
    """Collect the scores of all graded submissions, the best first, as CSV."""
    paths = course.folder.glob("autograded/*/*/score-*.json")
    scores = [orjson.loads(path.read_bytes()) for path in paths]
    scores.sort(key=lambda score: (score["assignment"], score["score"]))
    table = io.StringIO()
    writer = csv.writer(table, lineterminator="\n")
    writer.writerow(["assignment", "place", "student", "score", "unit", "baseline"])
    places: defaultdict[str, int] = defaultdict(int)
    for score in scores:
        places[score["assignment"]] += 1
        place = places[score["assignment"]]
        values = (f"{score['score']:.5g}", score["unit"], f"{score['baseline']:.5g}")
        writer.writerow([score["assignment"], place, score["student"], *values])
    return table.getvalue()


def result_table(results: list[Result]) -> str:
    """Return the table of all results as text."""
    lines = [f"{'assignment':18} {'submission':18} {'points':>8} {'expected':>9}"]
    for result in results:
        points, expected = ("flagged" if p is None else f"{p:g}" for p in result[2:])
        mark = "" if result.as_expected else "   <- differs"
        lines.append(f"{result.assignment:18} {result.student:18} {points:>8} {expected:>9}{mark}")
    return "\n".join(lines)


def main() -> None:
    """Make the editions that the command line names, and print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("names", nargs="*", help="assignments (default: all)")
    parser.add_argument("--to", type=Path, default=COURSE / "build", help="folder of the course")
    options = parser.parse_args()
    names = options.names or assignment_names()
    start = time.perf_counter()
    course = Course(options.to.resolve())
    results: list[Result] = []
    for name in names:
        began = time.perf_counter()
        results += grade_samples(course, name)
        print(f"{name}: {time.perf_counter() - began:.0f} s", flush=True)
    course.nbgrader("export", "--to", "grades.csv")
    write_atomically(course.folder / "leaderboard.csv", leaderboard(course))
    table = result_table(results)
    write_atomically(course.folder / "summary.txt", table + "\n")
    wrong = sum(not result.as_expected for result in results)
    print(f"\n{table}\n")
    minutes = (time.perf_counter() - start) / 60
    print(f"{len(results)} submissions, {wrong} not as expected, in {minutes:.1f} minutes")
    print(f"The editions, the gradebook and the feedback are in {course.folder}")
    sys.exit(bool(wrong))


if __name__ == "__main__":
    main()
