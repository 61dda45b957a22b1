"""A slider that redraws a picture, for notebooks; saved pages show the picture still."""

from __future__ import annotations

import base64
import html
import io
from collections.abc import Callable
from typing import Any

import matplotlib.pyplot as plt
from matplotlib.figure import Figure

try:
    import ipywidgets
except ImportError as error:
    raise ImportError(
        "mocaplab.sliders needs ipywidgets, which is not installed; "
        "run: pip install 'mocaplab[lab]'"
    ) from error


class PictureSlider(ipywidgets.VBox):  # type: ignore[misc]
    """A slider over a picture; whenever the slider is let go, the picture is drawn anew.

    Parameters
    ----------
    draw : called as ``draw(value)``, returns a Figure, which is closed after use
    low, high, step, start : float, of the slider
    label : str, what the slider sets, with its unit
    alt : str, what the picture shows, for readers who cannot see it

    Attributes
    ----------
    slider : ipywidgets.FloatSlider
    picture : ipywidgets.Image, a PNG
    """

    def __init__(
        self,
        draw: Callable[[float], Figure],
        low: float,
        high: float,
        *,
        step: float,
        start: float,
        label: str,
        alt: str,
    ) -> None:
        self.draw, self.alt = draw, alt
        self.slider = ipywidgets.FloatSlider(
            value=start, min=low, max=high, step=step, description=label, continuous_update=False
        )
        self.picture = ipywidgets.Image(value=_png(draw(start)), format="png")
        self.slider.observe(self._redraw, names="value")
        super().__init__([self.slider, self.picture])

    def _redraw(self, change: dict[str, Any]) -> None:
        self.picture.value = _png(self.draw(change["new"]))

    def __repr__(self) -> str:
        slider = self.slider
        return f"PictureSlider({slider.description}: {slider.min:g} to {slider.max:g})"

    def to_html(self) -> str:
        """Return the picture as it is now, for a page without a kernel."""
        data = base64.b64encode(self.picture.value).decode()
        return (
            f'<img alt="{html.escape(self.alt)}" src="data:image/png;base64,{data}"><br>'
            f"<em>{html.escape(self.slider.description)} = {self.slider.value:g}. "
            "A still picture: run the cell to move the slider.</em>"
        )

    def _repr_mimebundle_(self, **kwargs: Any) -> dict[str, Any]:
        # A page that cannot show widgets, or has no state of theirs, takes the HTML.
        bundle = super()._repr_mimebundle_(**kwargs) or {}
        return {**bundle, "text/html": self.to_html()}


def _png(figure: Figure) -> bytes:
    """Save a figure as a PNG and close it, so that the notebook does not show it twice."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=80)
    plt.close(figure)
    return buffer.getvalue()
