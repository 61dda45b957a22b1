"""The graded assignments: full marks for the solutions, none for nothing, a hint for mistakes."""

from __future__ import annotations

import os
import subprocess
import sys
from importlib import import_module
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from data_tools.assignment_notebooks import (
    BEGIN,
    COURSE,
    END,
    answers_of,
    assignment_names,
    automatic_points,
    fill_in,
    grade_id,
    read_notebook,
    replace_solution,
    run_cells,
)
from data_tools.sample_submissions import wrong_sets
from data_tools.wrong_answers import WRONG_ANSWERS
from mocaplab.assignments.grading import NotRight, graded_student

NAMES = assignment_names()


@pytest.fixture(scope="module")
def sources():
    return {name: read_notebook(COURSE / "source", name) for name in NAMES}


@pytest.fixture(scope="module")
def releases(tmp_path_factory, sources):
    """What nbgrader makes of all sources for the students."""
    course = tmp_path_factory.mktemp("course")
    (course / "source").symlink_to(COURSE / "source")
    (course / "nbgrader_config.py").write_text((COURSE / "nbgrader_config.py").read_text())
    code = (
        "import sys; from nbgrader.apps import GenerateAssignmentApp as App\n"
        "for name in sys.argv[1:]:\n"
        "    App.clear_instance(); App.launch_instance([name, '--force'])\n"
    )
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    done = subprocess.run(
        [sys.executable, "-c", code, *NAMES],
        cwd=course,
        env={**os.environ, "PATH": path},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr[-3000:]
    return {name: read_notebook(course / "release", name) for name in NAMES}


def only(notebook, exercises):
    """Leave out the cells of all other exercises: they cost time."""
    wanted = {"", "setup", *exercises, *(f"check-{e}" for e in exercises)}
    notebook.cells = [cell for cell in notebook.cells if grade_id(cell) in wanted]
    return notebook


@pytest.mark.parametrize("name", NAMES)
def test_source_is_well_made(sources, name):
    source = sources[name]
    known = [cell for cell in source.cells if "nbgrader" in cell.metadata]
    assert {cell.metadata.nbgrader.schema_version for cell in known} == {3}
    assert len({grade_id(cell) for cell in known}) == len(known)
    points = sum(cell.metadata.nbgrader.get("points", 0) for cell in known)
    assert points == 100
    assert sum(automatic_points(source).values()) == 80
    assert len({cell.id for cell in source.cells}) == len(source.cells)
    for before, cell in pairwise(known):
        # nbgrader can put a deleted check back only behind the cell that it belongs to
        if grade_id(cell).startswith("check-"):
            assert grade_id(cell) == f"check-{grade_id(before)}"
            # Hidden data, or the student's own.
            assert ("BEGIN HIDDEN TESTS" in cell.source) != ("require_own(" in cell.source)
            assert "raises-exception" in cell.metadata.tags  # "Run All" goes on behind it
    assert not any(cell.get("outputs") for cell in source.cells)


@pytest.mark.parametrize("name", NAMES)
def test_release_has_no_solution_and_no_hidden_test(sources, releases, name):
    text = "\n".join(cell.source for cell in releases[name].cells)
    for word in ("SOLUTION", "HIDDEN", '"hidden', "seed=", "confirm("):
        assert word not in text
    for answer in answers_of(sources[name]).values():
        secret = answer.split(BEGIN)[-1].split(END)[0] if BEGIN in answer else answer
        lines = [line.strip() for line in secret.splitlines()]
        for line in lines:
            if len(line) > 12:
                assert line not in text


@pytest.mark.parametrize("name", NAMES)
def test_solutions_get_all_points(sources, name):
    scores, _ = run_cells(fill_in(sources[name], {}, "ann"), "ann")
    assert {k: s.points for k, s in scores.items()} == automatic_points(sources[name]), scores


@pytest.mark.parametrize("name", NAMES)
def test_untouched_edition_gets_none_and_says_so(releases, name):
    scores, _ = run_cells(releases[name], "ann")
    assert sum(score.points for score in scores.values()) == 0
    assert all("Not answered yet" in score.text for score in scores.values()), scores


@pytest.mark.parametrize("name", NAMES)
def test_every_exercise_has_three_wrong_answers(sources, name):
    checked = {check.removeprefix("check-") for check in automatic_points(sources[name])}
    counts = {e: sum(w.exercise == e for w in WRONG_ANSWERS[name]) for e in checked}
    assert min(counts.values()) >= 3, counts
    assert {w.exercise for w in WRONG_ANSWERS[name]} == checked


@pytest.mark.parametrize(
    ("name", "number"), [(n, i) for n in NAMES for i in range(len(wrong_sets(n)))]
)
def test_wrong_answers_lose_their_points_and_draw_their_hints(sources, name, number):
    wrongs = wrong_sets(name)[number]
    answers = answers_of(sources[name])
    changed = {w.exercise: replace_solution(answers[w.exercise], w.old, w.new) for w in wrongs}
    notebook = fill_in(sources[name], changed, "ann")
    scores, _ = run_cells(only(notebook, {w.exercise for w in wrongs}), "ann")
    for wrong in wrongs:
        score = scores[f"check-{wrong.exercise}"]
        assert wrong.hint in score.text
        assert score.points == wrong.points


@pytest.mark.parametrize("name", NAMES)
def test_data_differ_between_students_and_not_between_calls(sources, name):
    """The first exercise with typed numbers: what is right for one student is wrong for others."""
    own = next(c for c in sources[name].cells if "require_own(" in c.source)
    exercise = grade_id(own).removeprefix("check-")
    variable = answers_of(sources[name])[exercise].split(" =")[0]

    def graded(answers, typed, student):
        notebook = only(fill_in(sources[name], answers, typed), {exercise})
        scores, namespace = run_cells(notebook, student)
        return scores[f"check-{exercise}"], namespace[variable]

    _, numbers = graded({}, "ann", "ann")
    copied = {exercise: f"{variable} = {np.asarray(numbers).tolist()}"}
    assert graded(copied, "ann", "ann")[0].points > 0
    with_id, _ = graded(copied, "ann", "bob")
    assert with_id.points == 0
    assert "right for the data of 'ann'" in with_id.text
    without_id, _ = graded(copied, "bob", "bob")
    assert without_id.points == 0


# ------------------------------------------------------------------ whose work it is


def test_at_home_the_typed_id_counts(monkeypatch):
    monkeypatch.delenv("NBGRADER_EXECUTION", raising=False)
    assert graded_student(" ann ") == "ann"
    for nothing in ("", "  ", None, 7):
        with pytest.raises(NotRight, match="between quotes"):
            graded_student(nothing)


def test_while_graded_the_folder_counts(monkeypatch, tmp_path):
    monkeypatch.setenv("NBGRADER_EXECUTION", "autograde")
    here = tmp_path / "autograded" / "bob" / "bvh_kinematics"
    here.mkdir(parents=True)
    (here / "bvh_kinematics.ipynb").touch()
    monkeypatch.chdir(here)
    assert graded_student("ann") == "bob"
    monkeypatch.chdir(tmp_path)
    with pytest.raises(NotRight, match="chdir"):
        graded_student("ann")


# ------------------------------------------------------------------ data of many students


@pytest.mark.parametrize(
    ("module", "check"),
    [
        ("bvh", "check_rest"),
        ("rotations", "check_angles"),
        ("noise", "check_snr"),
        ("smoothing", "check_sigma"),
        ("filter", "check_by_hand"),
        ("gaps", "check_steps"),
    ],
)
def test_no_student_has_data_for_which_a_mistake_is_right(monkeypatch, module, check):
    module = import_module(f"mocaplab.assignments.{module}")
    asked = {}

    def keep(answer, right, mistakes, *, rtol=0.005, atol=0.0, otherwise=""):
        asked.update(right=np.ravel(right), mistakes=mistakes, rtol=rtol, atol=atol)
        return "kept"

    monkeypatch.setattr(module, "judge_numbers", keep)
    for number in range(25):
        assert getattr(module, check)(None, module.draw_work(f"s{number:03d}")) == "kept"
        for hint, values in asked["mistakes"].items():
            near = np.allclose(
                np.ravel(values), asked["right"], rtol=asked["rtol"], atol=asked["atol"]
            )
            assert not near, (number, hint)
