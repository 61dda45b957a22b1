"""Scores of methods on clips, and the table that compares them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mocaplab.filters import Denoiser
from mocaplab.measures.by_name import find_measure
from mocaplab.motion import Corrupted, Motion


@dataclass(frozen=True)
class Score:
    """What one method scored on some clips."""

    method: str
    corruption: str  # such as "0.5 noise"
    metric: str  # a name in MEASURES
    unit: str
    seed: int
    per_clip: dict[str, float]  # clip name -> value, NaN where the clip has none

    @property
    def mean(self) -> float:
        """The mean over the clips that have a value; NaN if none has."""
        return mean_of_known(self.per_clip.values())


def mean_of_known(values: Iterable[float]) -> float:
    """Return the mean of the values that are not NaN; NaN if there is none."""
    known = [value for value in values if not np.isnan(value)]
    return float(np.mean(known)) if known else np.nan


def score_clip(cleaned: Motion, clip: Corrupted, measures: Iterable[str]) -> dict[str, float]:
    """Score what a method made of a clip: measure -> value. Every comparison scores with this.

    Raises
    ------
    ValueError
        If there is no measure of a name, or the clip cannot be measured by it.
    """
    return {name: float(find_measure(name).score(cleaned, clip)) for name in measures}


def compare_methods(
    clips: Iterable[Corrupted],
    methods: Mapping[str, Denoiser],
    *,
    corruption: str,
    seed: int,
    measures: Sequence[str] = ("rms_all_deg", "rms_moving_deg"),
) -> list[Score]:
    """Clean every clip with every method and score the results.

    Parameters
    ----------
    clips : Corrupted clips
    methods : name -> Denoiser
    corruption : str, how the clips were corrupted, for the table
    seed : int, the seed that they were corrupted with
    measures : names in :data:`mocaplab.measures.by_name.MEASURES`

    Returns
    -------
    list of Score, one a method and measure

    Raises
    ------
    ValueError
        If there is no measure of a name, or a clip cannot be measured by it.
    """
    units = {name: find_measure(name).unit for name in measures}
    per_clip: dict[tuple[str, str], dict[str, float]] = {}
    for clip in clips:
        for method, denoiser in methods.items():
            cleaned = denoiser.denoise(clip.observed, clip.mask)
            for name, value in score_clip(cleaned, clip, measures).items():
                per_clip.setdefault((method, name), {})[clip.clean.name] = value
    return [
        Score(method, corruption, name, units[name], seed, values)
        for (method, name), values in per_clip.items()
    ]


def table_by_action(
    scores: Sequence[Score], metric: str, actions: Mapping[str, str]
) -> list[list[str]]:
    """Arrange scores as rows of methods and columns of actions, means over clips.

    Clips without a value (NaN) are left out of the means; a dash stands where all are.

    Parameters
    ----------
    scores : list of Score; several of one method and metric are averaged
    metric : str, a name in MEASURES
    actions : clip name -> action

    Returns
    -------
    list of rows of text, the first one the header; for :func:`format_table`
    """
    counts = Counter(actions.values())
    header = ["method", *(f"{action} ({n})" for action, n in sorted(counts.items())), "all"]
    rows = [header]
    for method in dict.fromkeys(score.method for score in scores):
        values: dict[str, list[float]] = {action: [] for action in sorted(counts)}
        for score in scores:
            if (score.method, score.metric) == (method, metric):
                for clip, value in score.per_clip.items():
                    values[actions[clip]].append(value)
        means = [mean_of_known(v) for v in values.values()]
        means.append(mean_of_known(x for v in values.values() for x in v))
        rows.append([method, *map(_cell, means)])
    return rows


def _cell(value: float) -> str:
    if np.isnan(value):
        return "-"
    return f"{value:.3f}" if abs(value) < 1000 else f"{value:,.0f}"


def format_table(rows: Sequence[Sequence[str]]) -> str:
    """Lay out a table as Markdown, numbers to the right.

    Parameters
    ----------
    rows : list of rows of text, the first one the header
    """
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]

    def line(row: Sequence[str]) -> str:
        cells = [row[0].ljust(widths[0])]
        cells += [cell.rjust(width) for cell, width in zip(row[1:], widths[1:], strict=True)]
        return "| " + " | ".join(cells) + " |"

    rule = "|" + "|".join("-" * (w + 1) + ("-" if i == 0 else ":") for i, w in enumerate(widths))
    return "\n".join([line(rows[0]), rule + "|", *map(line, rows[1:])])
