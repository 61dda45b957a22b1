"""All figures by name: what each asks, what it needs, and how it is drawn."""

from __future__ import annotations

from difflib import get_close_matches

from mocaplab.reproduction.figure import Figure
from mocaplab.reproduction.figures_detail import DETAIL
from mocaplab.reproduction.figures_gaps import GAP_FIGURES
from mocaplab.reproduction.figures_noise import NOISE_FIGURES
from mocaplab.reproduction.figures_over_time import OVER_TIME
from mocaplab.reproduction.figures_own import OWN
from mocaplab.reproduction.figures_sources import SOURCE_FIGURES
from mocaplab.reproduction.figures_streaming import STREAMING
from mocaplab.reproduction.figures_tables import TABLES

_LISTS = (OVER_TIME, TABLES, NOISE_FIGURES, GAP_FIGURES, OWN, DETAIL, STREAMING, SOURCE_FIGURES)
FIGURES: dict[str, Figure] = {
    figure.name: figure
    for figure in sorted(
        (figure for some in _LISTS for figure in some),
        key=lambda figure: int(figure.name) if figure.name.isdigit() else 99,
    )
}
"""Every figure and table; a new one is one entry in one of the lists."""


def read_names(names: list[str]) -> tuple[str, ...]:
    """Read the names of figures, or "all".

    Raises
    ------
    ValueError
        If there is no such figure; the message has the nearest names.
    """
    if names == ["all"]:
        return tuple(FIGURES)
    for name in names:
        if name not in FIGURES:
            near = ", ".join(get_close_matches(name, FIGURES, cutoff=0.0))
            raise ValueError(
                f"no figure {name!r}; the nearest names are {near}; all are {', '.join(FIGURES)}; "
                "mocaplab reproduce --list explains them"
            )
    return tuple(name for name in FIGURES if name in names)


def list_figures() -> str:
    """Explain all figures, a few lines each."""
    parts = []
    for figure in FIGURES.values():
        fitted = sorted({method for need in figure.needs for method in need.methods})
        parts.append(
            f"{figure.name:>13}  {figure.title}\n{'':15}{figure.asks}\n"
            + (f"{'':15}fits {', '.join(fitted)}" if fitted else f"{'':15}fits paper B's network")
        )
    return "\n".join(parts)
