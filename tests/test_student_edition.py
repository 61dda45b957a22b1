"""The course without its solutions: nothing else is missing, and nothing is left of them."""

import json

import nbformat
import pytest

from data_tools.student_edition import NOTEBOOKS, write_course

NAMES = sorted(path.name for path in NOTEBOOKS.glob("*.ipynb"))


@pytest.fixture(scope="module")
def course(tmp_path_factory):
    folder = tmp_path_factory.mktemp("course")
    return folder, write_course(folder)


def cells_of(path):
    return json.loads(path.read_text("utf-8"))["cells"]


def is_solution(cell):
    return "solution" in cell["metadata"].get("tags", [])


@pytest.mark.parametrize("name", NAMES)
def test_solutions_and_nothing_else_are_left_out(course, name):
    folder, _ = course
    nbformat.validate(nbformat.read(folder / name, as_version=4))
    whole, edition = cells_of(NOTEBOOKS / name), cells_of(folder / name)
    assert [cell["id"] for cell in edition] == [c["id"] for c in whole if not is_solution(c)]
    text = (folder / name).read_text("utf-8")
    solutions = [cell for cell in whole if is_solution(cell)]
    for cell in solutions:
        longest = max(cell["source"], key=len).strip()  # a line that stands nowhere else
        others = [c for c in whole if not is_solution(c)]
        if not any(longest in "".join(c["source"]) for c in others):
            assert json.dumps(longest)[1:-1] not in text
    exercises = [c for c in edition if "exercise" in c["metadata"].get("tags", [])]
    assert len(exercises) >= 3
    assert len(solutions) >= len(exercises)


def test_pictures_come_along(course):
    folder, n_solutions = course
    assert n_solutions >= 3 * len(NAMES)
    pictures = {path.name for path in (NOTEBOOKS / "images").iterdir()}
    assert {path.name for path in (folder / "images").iterdir()} == pictures


def test_the_course_itself_is_not_overwritten():
    with pytest.raises(ValueError, match="choose another folder"):
        write_course(NOTEBOOKS)
