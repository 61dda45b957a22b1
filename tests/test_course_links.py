"""Links to Binder and Colab, written when the repository has an address."""

import shutil
from pathlib import Path

import nbformat
import pytest

from data_tools.course_links import CELL, link_notebook, link_readme, links

NOTEBOOKS = Path(__file__).parent.parent / "notebooks"
REPOSITORY = "https://github.com/someone/mocaplab"


def test_links_have_the_form_of_both_services():
    text = links(REPOSITORY + ".git", "main", "notebooks/00_start_here.ipynb")
    assert text == (
        "[Binder](https://mybinder.org/v2/gh/someone/mocaplab/main"
        "?labpath=notebooks%2F00_start_here.ipynb) or "
        "[Colab](https://colab.research.google.com/github/someone/mocaplab/blob/main/"
        "notebooks/00_start_here.ipynb)"
    )


@pytest.mark.parametrize("address", ["someone/mocaplab", "https://elsewhere.org/a/b", ""])
def test_another_address_is_refused(address):
    with pytest.raises(ValueError, match=r"expected https://github\.com/OWNER/REPOSITORY"):
        links(address, "main", "notebooks/00_start_here.ipynb")


def test_every_row_of_the_map_gets_its_links_once():
    text = (NOTEBOOKS.parent / "README.md").read_text("utf-8")
    once = link_readme(text, REPOSITORY, "main")
    assert once.count("mybinder.org") == len(list(NOTEBOOKS.glob("*.ipynb")))
    moved = link_readme(once, "https://github.com/other/mocaplab", "main")
    assert "someone" not in moved
    assert link_readme(moved, REPOSITORY, "main") == once


def test_a_notebook_gets_links_and_a_cell_that_installs(tmp_path):
    path = Path(shutil.copy(NOTEBOOKS / "00_start_here.ipynb", tmp_path))
    before = nbformat.read(path, as_version=4)
    link_notebook(path, "https://github.com/other/mocaplab", "main")
    link_notebook(path, REPOSITORY, "main")
    after = nbformat.read(path, as_version=4)
    nbformat.validate(after)
    first, install, *rest = after.cells
    assert first.source.startswith(before.cells[0].source)
    assert first.source.count("mybinder.org") == 1
    assert install.id == CELL
    assert f"mocaplab[lab] @ git+{REPOSITORY}@main" in install.source
    assert rest == before.cells[1:]
