"""Tables and plots of a comparison: means over clips, with paired bootstrap intervals."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mocaplab.comparison.bootstrap import Interval, percentile_interval, resampled_means
from mocaplab.comparison.job import ORACLE, Job
from mocaplab.comparison.methods import METHODS, network_label, part_network
from mocaplab.comparison.result import Result
from mocaplab.evaluation import format_table, mean_of_known
from mocaplab.measures.by_name import MEASURES
from mocaplab.motion import FloatArray

BASELINE = "gaussian_tuned"
"""What methods are compared with: it costs nothing, and fixed widths are weak opponents."""

BEST_CLIPS = 6
"""With fewer clips none is called the best: were all five for one method, chance alone would
do that 1 time in 16."""

TABLE_MEASURES = ("rms_all_deg", "rms_moving_deg")
"""What tables and plots show of every corruption; all other measures are in table.csv."""


EXPLANATION = """\
Every method was fitted on the clips outside the holdout, corrupted by the same recipe with \
other noise. Means over clips; 95 % intervals and ratios by a bootstrap over clips, the same \
draws for all methods. A few clips can have most of the say in a mean, such as those in which a \
thumb joint spins: the median over clips stands beside it. Bold: the best, where the interval \
of its distance to the second best does not reach 0. The oracle Gaussian chooses its widths by \
looking at the clean signal: a bound, not a method. Frames per second are of one core, and of a \
busy one if others were at work."""


@dataclass(frozen=True)
class Estimate:
    """The mean of one measure for one method, over the clips of one action or of all."""

    corruption: str
    measure: str
    method: str
    action: str  # "all" for all clips
    clips: int
    mean: Interval
    median: float  # over clips; the mean may be the work of one violent clip
    ratio: Interval  # to BASELINE, on the same clips; NaN where it makes no sense
    best: bool  # its distance to the second best method has an interval without 0


def method_label(name: str) -> str:
    """Return how tables call a method."""
    if name == ORACLE:
        return "oracle Gaussian (sees the clean signal)"
    parts = part_network(name)
    return network_label(*parts) if parts else METHODS[name].label


def between(estimate: Estimate, digits: int = 3) -> str:
    """Spell the interval of a mean; one clip alone tells nothing about others, so it has none."""
    low, high = estimate.mean.low, estimate.mean.high
    return f"{low:.{digits}f} - {high:.{digits}f}" if estimate.clips > 1 else "-"


def results_to_csv(results: Mapping[Job, Result]) -> str:
    """Write all rows, a line for every holdout, corruption, method, clip and repetition."""
    lines = [
        {"holdout": job.holdout, "corruption": job.corruption, "method": job.method, **row}
        for job, result in results.items()
        for row in result["rows"]
    ]
    return _to_csv(lines)


def _to_csv(lines: Sequence[Mapping[str, object]]) -> str:
    text = io.StringIO()
    writer = csv.DictWriter(text, list(lines[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(lines)
    return text.getvalue()


def estimates_to_csv(estimates: Iterable[Estimate], speeds: Mapping[tuple[str, str], float]) -> str:
    """Write all estimates, a line each."""
    return _to_csv(
        [
            {
                "corruption": e.corruption,
                "measure": e.measure,
                "unit": MEASURES[e.measure].unit,
                "method": e.method,
                "action": e.action,
                "clips": e.clips,
                "mean": e.mean.value,
                "low": e.mean.low if e.clips > 1 else np.nan,
                "high": e.mean.high if e.clips > 1 else np.nan,
                "median": e.median,
                f"ratio_to_{BASELINE}": e.ratio.value,
                "ratio_low": e.ratio.low,
                "ratio_high": e.ratio.high,
                "best": int(e.best),
                "frames_per_second": round(speeds[e.corruption, e.method]),
            }
            for e in estimates
        ]
    )


def frames_per_second(results: Mapping[Job, Result]) -> dict[tuple[str, str], float]:
    """Measure how fast each method cleans, by corruption and method: the median over clips.

    Other work on the machine slows it; it is no part of what must come out the same again.
    """
    speeds: dict[tuple[str, str], list[float]] = {}
    for job, result in results.items():
        found = speeds.setdefault((job.corruption, job.method), [])
        found += [row["frames"] / max(row["seconds"], 1e-9) for row in result["rows"]]
    return {key: float(np.median(found)) for key, found in speeds.items()}


def estimate(results: Mapping[Job, Result], *, seed: int = 0) -> list[Estimate]:
    """Average over clips, and say how far to trust it.

    Repetitions of a clip are averaged first, but those where the measure is NaN, such as one
    without a gap of some length: the clip is the unit that is drawn anew. A
    method that lacks clips of a corruption, because a job failed, is left out there, and a
    clip for which a measure is NaN is left out of that measure.

    Parameters
    ----------
    results : dict from Job to what it returned
    seed : int, for the bootstrap

    Returns
    -------
    list of Estimate
    """
    found = []
    for corruption in dict.fromkeys(job.corruption for job in results):
        jobs = {job: r for job, r in results.items() if job.corruption == corruption}
        actions, tables = _tables(jobs)
        for measure, (methods, values) in tables.items():
            known = ~np.isnan(values).any(axis=0)
            for action in [*sorted(set(actions.tolist())), "all"]:
                chosen = known & (True if action == "all" else actions == action)
                if chosen.any():
                    means = _column(measure, methods, values[:, chosen], seed)
                    found += [
                        Estimate(corruption, measure, method, action, int(chosen.sum()), *rest)
                        for method, rest in zip(methods, means, strict=True)
                    ]
    return found


def _tables(
    results: Mapping[Job, Result],
) -> tuple[np.ndarray, dict[str, tuple[list[str], FloatArray]]]:
    """Arrange the rows of one corruption.

    Returns the action of every clip, and for every measure the methods and their values,
    shape (methods, clips).
    """
    action_of: dict[str, str] = {}
    rows_of: dict[str, dict[str, list[dict[str, float]]]] = {}
    for job, result in results.items():
        of_method = rows_of.setdefault(job.method, {})
        for row in result["rows"]:
            action_of[row["clip"]] = row["action"]
            of_method.setdefault(row["clip"], []).append(row)
    clips = sorted(action_of)
    # A clip may be in several holdouts; a method must have its rows of all of them.
    most = {clip: max(len(rows.get(clip, ())) for rows in rows_of.values()) for clip in clips}
    methods = [
        method
        for method, rows in rows_of.items()
        if all(len(rows.get(clip, ())) == most[clip] for clip in clips)
    ]
    tables = {}
    for measure in next(iter(results)).measures:
        values = [
            [mean_of_known(row[measure] for row in rows_of[method][clip]) for clip in clips]
            for method in methods
        ]
        tables[measure] = methods, np.array(values, dtype=np.float64)
    return np.array([action_of[clip] for clip in clips]), tables


def _column(
    measure: str, methods: Sequence[str], values: FloatArray, seed: int
) -> list[tuple[Interval, float, Interval, bool]]:
    """Estimate mean and median of every method, its ratio to the baseline, and which is best."""
    draws = resampled_means(values, rng=np.random.default_rng(seed))
    means = values.mean(axis=1)
    intervals = [percentile_interval(m, d) for m, d in zip(means, draws, strict=True)]
    ratios = [Interval(np.nan, np.nan, np.nan)] * len(methods)
    best = None
    if MEASURES[measure].lower_is_better:
        if BASELINE in methods and (draws[methods.index(BASELINE)] > 0).all():
            base = methods.index(BASELINE)
            ratios = [
                percentile_interval(m / means[base], d / draws[base])
                for m, d in zip(means, draws, strict=True)
            ]
        ranked = sorted((i for i, m in enumerate(methods) if m != ORACLE), key=lambda i: means[i])
        if len(ranked) > 1 and values.shape[1] >= BEST_CLIPS:
            first, second = ranked[:2]
            lead = percentile_interval(means[first] - means[second], draws[first] - draws[second])
            best = first if lead.excludes(0) else None
    medians = np.median(values, axis=1).tolist()
    return [(intervals[i], medians[i], ratios[i], i == best) for i in range(len(methods))]


def estimates_to_markdown(
    estimates: Sequence[Estimate], speeds: Mapping[tuple[str, str], float]
) -> str:
    """Write a table for each corruption and each kind of RMS; inside gaps, if there are any."""
    parts = []
    for corruption in dict.fromkeys(e.corruption for e in estimates):
        parts.append(f"## {corruption}")
        for measure in (*TABLE_MEASURES, "gap_rms_deg"):
            chosen = [e for e in estimates if (e.corruption, e.measure) == (corruption, measure)]
            if chosen:
                parts.append(f"{MEASURES[measure].title}\n\n{_table(chosen, speeds)}")
    return "\n\n".join(parts) + "\n"


def _table(estimates: Sequence[Estimate], speeds: Mapping[tuple[str, str], float]) -> str:
    """Lay out methods and actions; the mean over all clips has its interval."""
    actions = {e.action: f"{e.action} ({e.clips})" for e in estimates}
    rows = [["method", *actions.values(), "95 %", "median", "/ tuned Gaussian", "frames/s"]]
    for method in dict.fromkeys(e.method for e in estimates):
        of_method = [e for e in estimates if e.method == method]
        means = [f"**{e.mean.value:.3f}**" if e.best else f"{e.mean.value:.3f}" for e in of_method]
        last = of_method[-1]
        ratio = "" if np.isnan(last.ratio.value) else "{:.2f} ({:.2f} - {:.2f})".format(*last.ratio)
        if last.clips == 1 and ratio:
            ratio = f"{last.ratio.value:.2f}"
        ratio = "1" if method == BASELINE else ratio
        speed = f"{speeds[last.corruption, method]:,.0f}"
        median = f"{last.median:.3f}"
        rows.append([method_label(method), *means, between(last), median, ratio, speed])
    return format_table(rows)


def draw_plots(
    estimates: Sequence[Estimate], speeds: Mapping[tuple[str, str], float], folder: Path
) -> list[Path]:
    """Write two pictures for each corruption: errors with intervals, and error over speed."""
    import matplotlib.pyplot as plt

    from mocaplab.plotting import plot_cost, plot_intervals

    paths = []
    for corruption in dict.fromkeys(e.corruption for e in estimates):
        name = re.sub(r"[^\w.+-]", "_", corruption)
        rows = {
            measure: {
                method_label(e.method): e
                for e in estimates
                if (e.corruption, e.measure, e.action) == (corruption, measure, "all")
            }
            for measure in TABLE_MEASURES
        }
        height = 1 + 0.35 * max(map(len, rows.values()))
        figure, axes = plt.subplots(1, 2, figsize=(13, height), layout="constrained")
        for ax, (measure, chosen) in zip(axes, rows.items(), strict=True):
            means = {label: e.mean for label, e in chosen.items()}
            plot_intervals(means, unit=MEASURES[measure].title, ax=ax)
        figure.suptitle(f"{corruption}: mean and 95 % interval")
        paths.append(folder / f"errors_{name}.png")
        figure.savefig(paths[-1], dpi=120)
        plt.close(figure)

        chosen = rows[TABLE_MEASURES[0]]
        figure, ax = plt.subplots(figsize=(9, 5), layout="constrained")
        plot_cost(
            {label: e.mean for label, e in chosen.items()},
            {label: speeds[corruption, e.method] for label, e in chosen.items()},
            unit=MEASURES[TABLE_MEASURES[0]].title,
            ax=ax,
        )
        ax.set_title(corruption)
        paths.append(folder / f"cost_{name}.png")
        figure.savefig(paths[-1], dpi=120)
        plt.close(figure)
    return paths
