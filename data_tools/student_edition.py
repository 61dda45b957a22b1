"""Write the course without its solutions, for a class that shall find them.

    python -m data_tools.student_edition FOLDER

All notebooks and their pictures are copied; cells tagged "solution" are left out. What other cells
printed stays, so that the notebooks can be read before they are run.
"""

from __future__ import annotations

import argparse
import shutil
from pathlib import Path

import nbformat

from mocaplab.files import write_atomically

NOTEBOOKS = Path(__file__).parent.parent / "notebooks"
SOLUTION = "solution"
"""The tag of the cells that students do not get."""


def student_edition(path: Path) -> tuple[str, int]:
    """Return the text of a notebook without its solutions, and how many these were."""
    notebook = nbformat.read(path, as_version=4)  # type: ignore[no-untyped-call]
    kept = [cell for cell in notebook.cells if SOLUTION not in cell.metadata.get("tags", [])]
    n_solutions = len(notebook.cells) - len(kept)
    notebook.cells = kept
    text: str = nbformat.writes(notebook)  # type: ignore[no-untyped-call]
    return text + "\n", n_solutions


def write_course(folder: Path) -> int:
    """Write all notebooks and their pictures into a folder; return the number of solutions.

    Raises
    ------
    ValueError
        If the folder is that of the course itself.
    """
    if folder.resolve() == NOTEBOOKS.resolve():
        raise ValueError(f"{folder} is the course itself; choose another folder")
    folder.mkdir(parents=True, exist_ok=True)
    total = 0
    for path in sorted(NOTEBOOKS.glob("*.ipynb")):
        text, n_solutions = student_edition(path)
        write_atomically(folder / path.name, text)
        total += n_solutions
    shutil.copytree(NOTEBOOKS / "images", folder / "images", dirs_exist_ok=True)
    return total


def main() -> None:
    """Write the course where the command line says."""
    parser = argparse.ArgumentParser(
        description=(__doc__ or "").splitlines()[0],
        epilog="example: python -m data_tools.student_edition course",
    )
    parser.add_argument("folder", type=Path, help="where to; files of the same names are replaced")
    folder = parser.parse_args().folder
    try:
        print(f"wrote the course into {folder}, without {write_course(folder)} solutions")
    except (ValueError, OSError) as error:
        parser.error(str(error))


if __name__ == "__main__":
    main()
