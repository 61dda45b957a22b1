"""How far a cleaned motion is from the clean one, and the table that compares methods."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mocaplab.filters import Denoiser, filter_motion
from mocaplab.motion import Corrupted, FloatArray, Motion, moving_channels


def rms_all_deg(motion: Motion, clean: Motion) -> float:
    """Root mean square angle error over all joint angles but the root's (paper A).

    Channels that never move count too and dilute it; see :func:`rms_moving_deg`.

    Parameters
    ----------
    motion, clean : Motion
        Of one skeleton, in the same Euler branch
        (:func:`mocaplab.euler.align_to`).

    Returns
    -------
    float, degrees
    """
    return _rms(motion.channels - clean.channels, clean.skeleton.is_cleaned)


def rms_moving_deg(motion: Motion, clean: Motion) -> float:
    """Root mean square angle error over the channels that move in the clean motion.

    Parameters
    ----------
    motion, clean : Motion

    Returns
    -------
    float, degrees; 0 if nothing moves
    """
    return _rms(motion.channels - clean.channels, moving_channels(clean))


def _rms(error: FloatArray, columns: np.ndarray) -> float:
    return float(np.sqrt(np.mean(error[:, columns] ** 2))) if columns.any() else 0.0


METRICS = {"rms_all_deg": rms_all_deg, "rms_moving_deg": rms_moving_deg}


@dataclass(frozen=True)
class Score:
    """What one method scored on some clips."""

    method: str
    corruption: str  # such as "0.5 noise"
    metric: str  # a name in METRICS
    unit: str
    seed: int
    per_clip: dict[str, float]  # clip name -> value

    @property
    def mean(self) -> float:
        """The mean over clips."""
        return float(np.mean(list(self.per_clip.values())))


class Untouched:
    """The denoiser that does nothing but fill gaps by lerp: the score to start from."""

    def denoise(self, observed: Motion, mask: np.ndarray) -> Motion:
        """Return the observed motion, gaps filled."""
        return filter_motion(observed, lambda m: m.channels)


def compare_methods(
    clips: Iterable[Corrupted], methods: Mapping[str, Denoiser], *, corruption: str, seed: int
) -> list[Score]:
    """Clean every clip with every method and score the results.

    Parameters
    ----------
    clips : Corrupted clips
    methods : name -> Denoiser
    corruption : str, how the clips were corrupted, for the table
    seed : int, the seed that they were corrupted with

    Returns
    -------
    list of Score, one a method and metric
    """
    per_clip: dict[tuple[str, str], dict[str, float]] = {}
    for clip in clips:
        for method, denoiser in methods.items():
            cleaned = denoiser.denoise(clip.observed, clip.mask)
            for metric, measure in METRICS.items():
                values = per_clip.setdefault((method, metric), {})
                values[clip.clean.name] = measure(cleaned, clip.clean)
    return [
        Score(method, corruption, metric, "deg", seed, values)
        for (method, metric), values in per_clip.items()
    ]


def table_by_action(
    scores: Sequence[Score], metric: str, actions: Mapping[str, str]
) -> list[list[str]]:
    """Arrange scores as rows of methods and columns of actions, means over clips.

    Parameters
    ----------
    scores : list of Score; several of one method and metric are averaged
    metric : str, a name in METRICS
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
        means = [float(np.mean(v)) for v in values.values()]
        means.append(float(np.mean([x for v in values.values() for x in v])))
        rows.append([method, *(f"{mean:.3f}" for mean in means)])
    return rows


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
