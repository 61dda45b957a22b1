"""Take the pictures of the course map out of the stored notebooks.

    python -m data_tools.course_pictures

Run it after ``python -m data_tools.run_notebooks``: a picture is a figure that a cell drew.
"""

from __future__ import annotations

import base64
import json
from pathlib import Path

from mocaplab.files import write_atomically

NOTEBOOKS = Path(__file__).parent.parent / "notebooks"
FIGURES = {
    "noise_and_gaps.png": ("02_noise_and_gaps", "c01"),
    "smoothing.png": ("03_classical_smoothing", "c34"),
    "building_ebf.png": ("04_building_ebf", "c02"),
    "filling_gaps.png": ("06_filling_gaps_ebd", "c04"),
    "two_sources.png": ("09_two_sources", "c56"),
    "beyond.png": ("11_beyond_the_paper", "c29"),
}
"""For each picture the notebook and the cell that draws it."""


def figure(notebook: str, cell_id: str) -> bytes:
    """Return the first figure that a stored cell drew, a PNG file.

    Raises
    ------
    ValueError
        If there is no such cell, or it drew nothing.
    """
    cells = json.loads((NOTEBOOKS / f"{notebook}.ipynb").read_text(encoding="utf-8"))["cells"]
    for cell in cells:
        for output in cell.get("outputs", []) if cell["id"] == cell_id else []:
            if "image/png" in output.get("data", {}):
                return base64.b64decode(output["data"]["image/png"])
    raise ValueError(f"{notebook}: cell {cell_id} has no picture; run the notebook first")


def main() -> None:
    """Write all pictures."""
    for name, (notebook, cell_id) in FIGURES.items():
        write_atomically(NOTEBOOKS / "images" / name, figure(notebook, cell_id))


if __name__ == "__main__":
    main()
