"""The slider is moved as a reader moves it, through its value."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import matplotlib
import matplotlib.pyplot as plt
import pytest

pytest.importorskip("ipywidgets", reason="sliders need pip install 'mocaplab[lab]'")

from mocaplab.sliders import PictureSlider

matplotlib.use("Agg")

PNG = b"\x89PNG"


@pytest.fixture
def drawn():
    return []


@pytest.fixture
def slider(drawn):
    def draw(value):
        drawn.append(value)
        fig, ax = plt.subplots(figsize=(2, 1))
        ax.plot([0, value])
        ax.set_title(f"{value:g}")
        return fig

    return PictureSlider(draw, 0, 2, step=0.1, start=0.5, label="k", alt='a "line"')


def test_every_value_draws_a_picture_of_its_own(slider, drawn):
    pictures = {bytes(slider.picture.value)}
    for value in (slider.slider.min, slider.slider.max, 1.0):
        slider.slider.value = value
        pictures.add(bytes(slider.picture.value))
    assert drawn == [0.5, 0.0, 2.0, 1.0]
    assert len(pictures) == 4
    assert all(picture.startswith(PNG) for picture in pictures)


def test_figures_are_closed(slider):
    before = plt.get_fignums()
    slider.slider.value = 2
    assert plt.get_fignums() == before


def test_a_page_without_a_kernel_shows_the_picture(slider):
    bundle = slider._repr_mimebundle_()
    assert "application/vnd.jupyter.widget-view+json" in bundle
    assert 'alt="a &quot;line&quot;"' in bundle["text/html"]
    assert "data:image/png;base64," in bundle["text/html"]
    assert "k = 0.5" in bundle["text/html"]


def test_repr_says_what_it_sets(slider):
    assert repr(slider) == "PictureSlider(k: 0 to 2)"


def test_without_ipywidgets_the_error_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "ipywidgets", None)
    monkeypatch.delitem(sys.modules, "mocaplab.sliders")
    with pytest.raises(ImportError, match="mocaplab"):
        import mocaplab.sliders  # noqa: F401


def test_the_slider_of_notebook_02():
    path = Path(__file__).parent.parent / "notebooks" / "02_noise_and_gaps.ipynb"
    names: dict[str, object] = {}
    for cell in json.loads(path.read_text("utf-8"))["cells"]:
        if cell["cell_type"] == "code" and "slider" not in names:
            exec("".join(cell["source"]), names)
    plt.close("all")
    slider = names["slider"]
    pictures = set()
    for value in (slider.slider.min, 0.5, slider.slider.max):
        slider.slider.value = value
        pictures.add(bytes(slider.picture.value))
    assert len(pictures) == 3
    assert plt.get_fignums() == []
