"""Take the pictures of the course map out of the stored notebooks.

    python -m data_tools.course_pictures

Run it after ``python -m data_tools.run_notebooks``: a picture is a figure that a cell drew, or a
few of them side by side. Pictures that no cell draws come from data_tools/draw_*.py.
"""

from __future__ import annotations

import base64
import io
import json
from pathlib import Path

import numpy as np
from matplotlib import image

from mocaplab.files import write_atomically

NOTEBOOKS = Path(__file__).parent.parent / "notebooks"
FIGURES = {
    "noise_and_gaps.png": ("02_noise_and_gaps", ["c01"]),
    "smoothing.png": ("03_classical_smoothing", ["c34"]),
    "building_ebf.png": ("04_building_ebf", ["c02"]),
    "training_ebf.png": ("05_training_ebf", ["c32", "c42"]),
    "filling_gaps.png": ("06_filling_gaps_ebd", ["c04"]),
    "streaming.png": ("08_streaming", ["c46"]),
    "two_sources.png": ("09_two_sources", ["c56"]),
    "reproduction.png": ("10_reproducing_the_paper", ["c17"]),
    "beyond.png": ("11_beyond_the_paper", ["c29"]),
}
"""For each picture the notebook and the cells that draw it, from left to right."""


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


def side_by_side(figures: list[bytes]) -> bytes:
    """Put PNG files next to each other, their lower edges in line, on white."""
    if len(figures) == 1:
        return figures[0]
    pictures = [image.imread(io.BytesIO(figure))[..., :3] for figure in figures]
    height = max(len(picture) for picture in pictures)
    above = [height - len(picture) for picture in pictures]
    row = [
        np.pad(picture, ((rows, 0), (0, 0), (0, 0)), constant_values=1)
        for picture, rows in zip(pictures, above, strict=True)
    ]
    buffer = io.BytesIO()
    image.imsave(buffer, np.hstack(row))
    return buffer.getvalue()


def main() -> None:
    """Write all pictures."""
    for name, (notebook, cell_ids) in FIGURES.items():
        figures = [figure(notebook, cell_id) for cell_id in cell_ids]
        write_atomically(NOTEBOOKS / "images" / name, side_by_side(figures))


if __name__ == "__main__":
    main()
