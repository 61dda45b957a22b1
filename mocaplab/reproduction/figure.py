"""What a figure is: a name, a question, what it needs, and how it is drawn."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Picture

from mocaplab.motion import FloatArray
from mocaplab.reproduction.claims import Claim, Evidence
from mocaplab.reproduction.needs import Need
from mocaplab.reproduction.plots import plot_by_motion, style_of
from mocaplab.reproduction.scores import RMS_ALL, label_of

Row = dict[str, Any]
Lines = dict[str, tuple[FloatArray, str, str]]
Drawing = tuple[list[Row], Picture]


@dataclass(frozen=True)
class Figure:
    """One figure or table of a paper, or a question that it left open.

    Parameters
    ----------
    name : str, what a user types
    title : str, the paper's figure and what it shows
    asks : str, what to look for
    needs : tuple of Need
    draw : function from Evidence to (rows of the CSV file, picture); None if there is nothing
    claims : function from Evidence to the claims that are judged by it
    sources : bool, whether paper B's network is trained for it
    """

    name: str
    title: str
    asks: str
    needs: tuple[Need, ...]
    draw: Callable[[Evidence], Drawing | None]
    claims: Callable[[Evidence], list[Claim]]
    sources: bool = False


def new_picture(
    n_columns: int = 1, n_rows: int = 1, width: float = 6.0, height: float = 4.2
) -> tuple[Picture, list[Axes]]:
    """Make a picture with some axes."""
    picture, axes = plt.subplots(
        n_rows,
        n_columns,
        figsize=(width * n_columns, height * n_rows),
        layout="constrained",
        squeeze=False,
    )
    return picture, list(axes.flat)


def named(evidence: Evidence, methods: Sequence[str]) -> list[str]:
    """Return the names under which the best trained networks are scored."""
    return [evidence.plan.headline(method) for method in methods]


def motion_lines(
    evidence: Evidence, methods: Sequence[str], recipe: str, measure: str, *, every: bool
) -> tuple[Lines, list[str]]:
    """Collect the error of every motion: the lines of a plot, and the clips in their order.

    These are the clips that all methods were tested on. With ``every`` they are all clips, and
    lines have holes.
    """
    scores = evidence.scores
    errors = {m: scores.by_clip(m, recipe, measure=measure) for m in methods}
    errors = {m: found for m, found in errors.items() if found}
    tested = list(errors.values())
    clips = scores.numbered([max(tested, key=len)] if every and tested else tested)
    lines = {
        label_of(method): (np.array([found.get(clip, np.nan) for clip in clips]), *style)
        for number, (method, found) in enumerate(errors.items())
        for style in [style_of(method, number)]
    }
    return lines, clips


def draw_motions(
    evidence: Evidence,
    methods: Sequence[str],
    recipe: str,
    ax: Axes,
    measure: str = RMS_ALL,
    *,
    every: bool = False,
    log: bool = False,
) -> list[Row]:
    """Draw errors over the motions (see :func:`motion_lines`), and return them as rows."""
    lines, clips = motion_lines(evidence, methods, recipe, measure, every=every)
    actions = [evidence.scores.actions[clip] for clip in clips]
    plot_by_motion(lines, actions, ax, log=log)
    return [
        {
            "noise": recipe,
            "method": label,
            "motion": number,
            "clip": clip,
            "action": actions[number],
            measure: values[number],
        }
        for label, (values, _, _) in lines.items()
        for number, clip in enumerate(clips)
    ]
