"""The pictures of the course map come out of the stored notebooks."""

from __future__ import annotations

import io

import numpy as np
import pytest
from matplotlib import image

from data_tools.course_pictures import FIGURES, NOTEBOOKS, figure, side_by_side


def png(height: int, width: int, grey: float) -> bytes:
    buffer = io.BytesIO()
    image.imsave(buffer, np.full((height, width, 3), grey))
    return buffer.getvalue()


def test_figures_stand_side_by_side_on_one_line():
    pixels = image.imread(io.BytesIO(side_by_side([png(4, 3, 0.0), png(2, 5, 0.2)])))[..., :3]
    assert pixels.shape == (4, 8, 3)
    assert (pixels[:, :3] == 0).all()
    assert (pixels[:2, 3:] == 1).all()
    np.testing.assert_allclose(pixels[2:, 3:], 0.2, atol=0.003)


def test_a_single_figure_stays_as_it_is():
    assert side_by_side([png(2, 2, 0.5)]) == png(2, 2, 0.5)


@pytest.mark.parametrize("name", FIGURES)
def test_every_picture_has_its_cells(name):
    notebook, cell_ids = FIGURES[name]
    assert (NOTEBOOKS / "images" / name).exists()
    for cell_id in cell_ids:
        assert figure(notebook, cell_id).startswith(b"\x89PNG")


def test_a_cell_without_a_picture_is_named():
    with pytest.raises(ValueError, match="05_training_ebf: cell c00 has no picture"):
        figure("05_training_ebf", "c00")
