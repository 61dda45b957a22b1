"""The error inside gaps by their length, from estimates with known means."""

import numpy as np

from mocaplab.comparison.bootstrap import Interval
from mocaplab.comparison.gap_report import SHOWN_METHODS, draw_gap_plots, gap_tables
from mocaplab.comparison.report import Estimate, method_label

METHODS = ("noisy", "pchip", "spline", "pca", "lowrank", "kalman", "wiener")


def make_estimates(corruption="gaps:0.001"):
    """Two lengths of gaps: 12 clips have short gaps, one has a long one."""
    ratio = Interval(np.nan, np.nan, np.nan)
    found = []
    for i, method in enumerate(METHODS):
        for measure, clips, value in (
            ("rms_all_deg", 12, 9.0),
            ("gap_rms_deg", 12, 10.0 - i),
            ("gap_rms_from_0.05_s_deg", 12, 2.0 + i),
            ("gap_rms_from_2_s_deg", 1, 8.0 + i),
        ):
            for action in ("walk", "all"):
                mean = Interval(value, value - 1, value + 1)
                found.append(
                    Estimate(corruption, measure, method, action, clips, mean, 1.0, ratio, False)
                )
    return found


def test_table_has_a_column_for_each_length_that_there_is():
    title, _, header, _, first, *others = gap_tables(make_estimates()).strip().splitlines()
    assert title.startswith("gaps:0.001: RMS over the hidden angles")
    cells = [cell.strip() for cell in header.strip("|").split("|")]
    assert cells == ["method", "0.05 - 0.125 s (12)", "2 s up (1)"]
    cells = [cell.strip() for cell in first.strip("|").split("|")]
    assert cells == [method_label("noisy"), "2.00 (1.00 - 3.00)", "8.00 (-)"]
    assert len(others) == len(METHODS) - 1


def test_nothing_without_gaps(tmp_path):
    estimates = [e for e in make_estimates() if e.measure == "rms_all_deg"]
    assert gap_tables(estimates) == ""
    assert draw_gap_plots(estimates, tmp_path) == []


def test_plot_shows_lines_and_the_best(tmp_path, monkeypatch):
    import matplotlib.pyplot as plt

    shown = []
    close = plt.close
    monkeypatch.setattr(plt, "close", lambda figure: (shown.append(figure), close(figure)))
    paths = draw_gap_plots([*make_estimates(), *make_estimates("0.5+gaps")], tmp_path)
    assert [path.name for path in paths] == ["gaps_gaps_0.001.png", "gaps_0.5+gaps.png"]
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in paths)
    labels = [text.get_text() for text in shown[0].axes[0].get_legend().get_texts()]
    best = ["noisy", *reversed(METHODS)][:SHOWN_METHODS]
    assert labels == [method_label(method) for method in best]
