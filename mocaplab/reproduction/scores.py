"""Errors by clip out of the rows of all jobs, and ratios of them with intervals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mocaplab.comparison.bootstrap import Interval, mean_intervals, paired_interval
from mocaplab.comparison.job import Job
from mocaplab.comparison.report import BEST_CLIPS, method_label
from mocaplab.comparison.result import Result
from mocaplab.evaluation import mean_of_known
from mocaplab.reproduction.needs import NOISE
from mocaplab.reproduction.plan import Plan

RMS_ALL = "rms_all_deg"
ByClip = dict[str, float]
NOTHING = Interval(np.nan, np.nan, np.nan)


def label_of(method: str) -> str:
    """Return how figures call a method; a fully trained network's name ends with +."""
    name = method.rstrip("+")
    return method_label(name) + (", fully trained" if method.endswith("+") else "")


class Scores:
    """What all jobs gave, by method, noise and group of splits.

    Parameters
    ----------
    results : dict from Job to Result
    plan : Plan
    """

    def __init__(self, results: Mapping[Job, Result], plan: Plan):
        self.plan, self.results = plan, results
        self.actions: dict[str, str] = {}
        self._rows: dict[tuple[str, str, str], list[dict[str, Any]]] = {}
        for job, result in results.items():
            group = job.holdout.partition("_")[0]
            usual = job.epochs is None and plan.epochs_of(job.method) is not None
            key = (job.method + ("+" if usual else ""), job.corruption, group)
            self._rows.setdefault(key, []).extend(result["rows"])
            self.actions |= {row["clip"]: row["action"] for row in result["rows"]}

    def rows(
        self, method: str, recipe: str = NOISE, group: str = "holdout"
    ) -> list[dict[str, Any]]:
        """Return all rows, one a clip and repetition; none if the method was not tested so."""
        return self._rows.get((method, recipe, group), [])

    def tested(self, methods: Sequence[str], recipes: Sequence[str], group: str) -> bool:
        """Tell whether any of some methods has rows of any of some noises."""
        wanted = {(method, recipe, group) for method in methods for recipe in recipes}
        return any((key[0].rstrip("+"), *key[1:]) in wanted for key in self._rows)

    def by_clip(
        self, method: str, recipe: str = NOISE, group: str = "holdout", measure: str = RMS_ALL
    ) -> ByClip:
        """Average over repetitions: clip -> error."""
        found: dict[str, list[float]] = {}
        for row in self.rows(method, recipe, group):
            found.setdefault(row["clip"], []).append(row[measure])
        means = {clip: mean_of_known(values) for clip, values in found.items()}
        return {clip: mean for clip, mean in means.items() if not np.isnan(mean)}

    def numbered(self, several: Sequence[ByClip]) -> list[str]:
        """Order clips as in the paper's figures: grouped by action; those that all have."""
        clips = set.intersection(*(set(errors) for errors in several)) if several else set()
        return sorted(clips, key=lambda clip: (self.actions[clip], clip))

    def mean(self, errors: ByClip) -> Interval:
        """Average over clips, with an interval."""
        if not errors:
            return NOTHING
        values = [[errors[clip] for clip in sorted(errors)]]
        return mean_intervals(values, rng=np.random.default_rng(self.plan.seed))[0]

    def ratio(self, ours: ByClip, theirs: ByClip) -> tuple[Interval, int]:
        """Divide two mean errors over the clips that both have; also tell how many those are."""
        clips = sorted(set(ours) & set(theirs))
        if not clips:
            return NOTHING, 0
        ratio = paired_interval(
            [ours[clip] for clip in clips],
            [theirs[clip] for clip in clips],
            how="ratio",
            rng=np.random.default_rng(self.plan.seed),
        )
        return ratio, len(clips)

    def ms_per_frame(self, method: str, recipe: str = NOISE) -> Interval:
        """Tell the median milliseconds a frame over clips, and the fastest and slowest clip."""
        times = [1000 * row["seconds"] / row["frames"] for row in self.rows(method, recipe)]
        if not times:
            return NOTHING
        return Interval(float(np.median(times)), min(times), max(times))

    def too_few(self, n_clips: int) -> str:
        """Say that clips are too few for a verdict, or nothing if they are enough."""
        return f"{n_clips} clips are too few" if n_clips < BEST_CLIPS else ""
