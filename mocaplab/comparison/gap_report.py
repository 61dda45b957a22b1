"""The part of a comparison about gaps: the error inside them, by how long they are."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from mocaplab.comparison.report import Estimate, between, method_label
from mocaplab.evaluation import format_table
from mocaplab.measures.by_name import GAP_MEASURES
from mocaplab.measures.gaps import GAP_EDGES_S

SHOWN_METHODS = 6
"""A plot shows so many methods, the best ones: more lines cannot be told apart."""


def gap_tables(estimates: Sequence[Estimate]) -> str:
    """Write a table of errors by the length of gaps for each corruption that has gaps.

    Methods that fill gaps in the same way and smooth in another differ little here.
    """
    parts = []
    for corruption, table in _by_corruption(estimates).items():
        lengths = {e.measure: f"{_length(e.measure)} ({e.clips})" for e in table}
        rows = [["method", *lengths.values()]]
        for method in dict.fromkeys(e.method for e in table):
            of_method = {e.measure: e for e in table if e.method == method}
            cells = [f"{e.mean.value:.2f} ({between(e, 2)})" for e in of_method.values()]
            rows.append([method_label(method), *cells])
        parts.append(
            f"\n{corruption}: RMS over the hidden angles in degrees, by length of the gap (in "
            "brackets the clips that have such gaps), with 95 % intervals\n\n"
            f"{format_table(rows)}\n"
        )
    return "".join(parts)


def draw_gap_plots(estimates: Sequence[Estimate], folder: Path) -> list[Path]:
    """Write a picture of errors by the length of gaps for each corruption that has gaps.

    It shows straight lines alone ("noisy") and the best of the other methods.
    """
    import matplotlib.pyplot as plt

    paths = []
    for corruption, table in _by_corruption(estimates).items():
        lengths = list(dict.fromkeys(e.measure for e in table))
        total = {
            e.method: e.mean.value
            for e in estimates
            if (e.corruption, e.measure, e.action) == (corruption, "gap_rms_deg", "all")
        }
        ranked = sorted(total, key=lambda method: (method != "noisy", total[method]))
        shown = ranked[:SHOWN_METHODS]
        figure, ax = plt.subplots(figsize=(8, 4), layout="constrained")
        for i, method in enumerate(shown):
            of_method = [e for e in table if e.method == method]
            x = [lengths.index(e.measure) + 0.1 * (i - len(shown) / 2) for e in of_method]
            means = [e.mean for e in of_method]
            ends = [[m.value - m.low for m in means], [m.high - m.value for m in means]]
            y = [m.value for m in means]
            label = method_label(method)
            ax.errorbar(x, y, yerr=ends, marker="osD^vP"[i], ms=5, lw=1, capsize=2, label=label)
        ax.set_xticks(range(len(lengths)), [_length(measure) for measure in lengths])
        ax.set(xlabel="length of the gap", ylabel="RMS over the hidden angles, degrees")
        ax.set_ylim(bottom=0)
        ax.set_title(f"{corruption}: mean over clips and 95 % interval")
        ax.legend(frameon=False, fontsize="small")
        ax.spines[["top", "right"]].set_visible(False)
        name = re.sub(r"[^\w.+-]", "_", corruption)
        paths.append(folder / f"gaps_{name}.png")
        figure.savefig(paths[-1], dpi=120)
        plt.close(figure)
    return paths


def _by_corruption(estimates: Sequence[Estimate]) -> dict[str, list[Estimate]]:
    """Pick the errors by length over all clips, for every corruption that has gaps."""
    tables: dict[str, list[Estimate]] = {}
    for e in estimates:
        if e.measure in GAP_MEASURES and e.action == "all":
            tables.setdefault(e.corruption, []).append(e)
    return tables


def _length(measure: str) -> str:
    """Say which gaps a measure of ``GAP_MEASURES`` counts."""
    place = list(GAP_MEASURES).index(measure)
    low, high = GAP_EDGES_S[place : place + 2]
    return f"{low:g} s up" if place == len(GAP_MEASURES) - 1 else f"{low:g} - {high:g} s"
