"""One assignment through all of nbgrader: release, submissions, grading, feedback, CSV."""

from __future__ import annotations

import csv
import json

import pytest

from data_tools.assignments import Course, grade_samples, leaderboard, result_table

STUDENTS = {
    "right",
    "empty",
    "wrong-1",
    "endless-loop",
    "kills-kernel",
    "prints-much",
    "warns",
    "deletes-checks",
    "edits-checks",
    "wrong-kernel",
    "copies",
    "no-notebook",
}
NAME = "bvh_kinematics"


@pytest.fixture(scope="module")
def graded(tmp_path_factory):
    course = Course(tmp_path_factory.mktemp("grading") / "course")
    return course, grade_samples(course, NAME, STUDENTS)


def test_every_sample_gets_what_it_must_get(graded):
    course, results = graded
    assert {result.student for result in results} == STUDENTS
    log = (course.folder / "log.txt").read_text()
    assert all(result.as_expected for result in results), f"{result_table(results)}\n{log[-3000:]}"


def test_results_can_be_exported(graded):
    course, results = graded
    assert course.nbgrader("export", "--to", "grades.csv")
    with open(course.folder / "grades.csv", newline="") as file:
        rows = {row["student_id"]: row for row in csv.DictReader(file)}
    assert {student: float(row["score"]) for student, row in rows.items()} == {
        result.student: result.points or 0.0 for result in results
    }
    assert {float(row["max_score"]) for row in rows.values()} == {100.0}


def test_feedback_shows_the_hint(graded):
    course, _ = graded
    feedback = course.folder / "feedback"
    page = (feedback / "wrong-1" / NAME / f"{NAME}.html").read_text()
    assert "That is the way in one frame" in page
    copied = (feedback / "copies" / NAME / f"{NAME}.html").read_text()
    assert "This is right for the data of" in copied
    much = feedback / "prints-much" / NAME / f"{NAME}.html"
    assert "Output truncated" in much.read_text()
    assert much.stat().st_size < 1.2 * (feedback / "right" / NAME / f"{NAME}.html").stat().st_size


def test_leaderboard_has_those_who_were_scored(graded):
    course, _ = graded
    rows = list(csv.DictReader(leaderboard(course).splitlines()))
    assert {"right", "wrong-1"} <= {row["student"] for row in rows}
    assert not {"empty", "kills-kernel"} & {row["student"] for row in rows}
    scores = [float(row["score"]) for row in rows]
    assert scores == sorted(scores)
    path = course.folder / "autograded" / "copies" / NAME / f"score-{NAME}.json"
    assert json.loads(path.read_text())["student"] == "copies"


def test_the_written_question_waits_for_a_person(graded):
    from nbgrader.api import Gradebook

    course, _ = graded
    with Gradebook(f"sqlite:///{course.folder / 'gradebook.db'}") as gradebook:
        waiting = gradebook.find_submission(NAME, "right").needs_manual_grade
        assert waiting
        assert not gradebook.find_submission(NAME, "empty").needs_manual_grade
