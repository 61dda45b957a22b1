"""Write links that open the course in Binder and Colab: into the README and every notebook.

    python -m data_tools.course_links https://github.com/OWNER/REPOSITORY

Run it once, when the repository has a public address, and again after it has moved. Each notebook
also gets a cell that installs the library where it is missing, as it is in Colab.
"""

from __future__ import annotations

import argparse
import re
from pathlib import Path
from urllib.parse import quote

import nbformat

from mocaplab.files import write_atomically

ROOT = Path(__file__).parent.parent
CELL = "install"
"""The id of the cell that installs the library."""
BEFORE = "**Open it, with nothing installed, in** "


def links(repository: str, branch: str, path: str) -> str:
    """Return the Markdown of both links to a notebook.

    Parameters
    ----------
    repository : str, https://github.com/OWNER/REPOSITORY
    branch : str
    path : str, of the notebook in the repository

    Raises
    ------
    ValueError
        If the repository is elsewhere: both services know GitHub's addresses.
    """
    found = re.fullmatch(r"https://github\.com/([\w.-]+)/([\w.-]+?)(?:\.git)?/?", repository)
    if not found:
        raise ValueError(f"expected https://github.com/OWNER/REPOSITORY, got {repository!r}")
    name = f"{found[1]}/{found[2]}"
    binder = f"https://mybinder.org/v2/gh/{name}/{quote(branch)}?labpath={quote(path, safe='')}"
    colab = f"https://colab.research.google.com/github/{name}/blob/{quote(branch)}/{quote(path)}"
    return f"[Binder]({binder}) or [Colab]({colab})"


def link_readme(text: str, repository: str, branch: str) -> str:
    """Put links behind every notebook of the course map, in place of older ones."""

    def with_links(row: re.Match[str]) -> str:
        return f"{row[1]}<br>{links(repository, branch, row[2])}"

    return re.sub(
        r"(\| \[[^\]]+\]\((notebooks/[^)]+\.ipynb)\))(?:<br>\[Binder\]\S+ or \S+)?",
        with_links,
        text,
    )


def link_notebook(path: Path, repository: str, branch: str) -> None:
    """Put links into the first cell of a notebook, and the cell that installs behind it."""
    notebook = nbformat.read(path, as_version=4)  # type: ignore[no-untyped-call]
    first = notebook.cells[0]
    text = re.sub(rf"\n\n{re.escape(BEFORE)}[^\n]*", "", first.source)
    first.source = f"{text}\n\n{BEFORE}{links(repository, branch, f'notebooks/{path.name}')}."
    install = nbformat.v4.new_code_cell(  # type: ignore[no-untyped-call]
        "# In Colab the library is missing at first: get it.\n"
        "from importlib.util import find_spec\n\n"
        'if find_spec("mocaplab") is None:\n'
        f'    %pip install -q "mocaplab[lab] @ git+{repository}@{branch}"',
        id=CELL,
    )
    others = [cell for cell in notebook.cells[1:] if cell.id != CELL]
    notebook.cells = [first, install, *others]
    written: str = nbformat.writes(notebook)  # type: ignore[no-untyped-call]
    write_atomically(path, written + "\n")


def main() -> None:
    """Write all links."""
    parser = argparse.ArgumentParser(
        description=(__doc__ or "").splitlines()[0],
        epilog="example: python -m data_tools.course_links https://github.com/OWNER/REPOSITORY",
    )
    parser.add_argument("repository", help="https://github.com/OWNER/REPOSITORY")
    parser.add_argument("--branch", default="main", help="default: %(default)s")
    options = parser.parse_args()
    readme = ROOT / "README.md"
    text = link_readme(readme.read_text("utf-8"), options.repository, options.branch)
    write_atomically(readme, text)
    notebooks = sorted((ROOT / "notebooks").glob("*.ipynb"))
    for path in notebooks:
        link_notebook(path, options.repository, options.branch)
    print(f"wrote links into README.md and {len(notebooks)} notebooks")


if __name__ == "__main__":
    main()
