"""Tables and plots of a comparison, from rows with known means."""

import csv
import io
from dataclasses import replace

import numpy as np
import pytest

from mocaplab.comparison.bootstrap import mean_intervals, paired_interval
from mocaplab.comparison.job import ORACLE, Job
from mocaplab.comparison.methods import METHODS
from mocaplab.comparison.report import (
    BASELINE,
    between,
    draw_plots,
    estimate,
    estimates_to_csv,
    estimates_to_markdown,
    frames_per_second,
    method_label,
    results_to_csv,
)
from mocaplab.splits import Split

MEASURES = ("rms_all_deg", "rms_moving_deg", "gap_rms_deg", "jitter_cm_s3")


def make_results(errors, *, holdouts=1):
    """Make results out of errors, shape (methods, clips, repetitions), of half walks."""
    results = {}
    for method, values in errors.items():
        of_holdout = np.array_split(np.arange(len(values)), holdouts)
        for number, clips in enumerate(of_holdout):
            job = Job(
                f"holdout_{number}", Split((99,), (1,)), "angular:0.5", method, MEASURES, 0, 2
            )
            rows = [
                {
                    "clip": f"clip_{i}",
                    "action": "walk" if i % 2 else "run",
                    "repetition": r,
                    "frames": 100,
                    "seconds": 0.5,
                    "rms_all_deg": value,
                    "rms_moving_deg": 2 * value,
                    "gap_rms_deg": np.nan if i < 2 else value,
                    "jitter_cm_s3": 1.0,
                }
                for i in clips
                for r, value in enumerate(values[i])
            ]
            results[job] = {"fingerprint": {}, "fit_s": 0.0, "notes": [], "rows": rows}
    return results


@pytest.fixture
def errors():
    rng = np.random.default_rng(0)
    hard = rng.lognormal(size=(12, 1))
    return {
        "noisy": 3 * hard + rng.uniform(0, 0.1, (12, 2)),
        BASELINE: hard + rng.uniform(0, 0.1, (12, 2)),
        "savgol": 0.9 * hard + rng.uniform(0, 0.1, (12, 2)),
        ORACLE: 0.5 * hard + rng.uniform(0, 0.1, (12, 2)),
    }


def find(estimates, method, measure="rms_all_deg", action="all"):
    wanted = (method, measure, action)
    return next(e for e in estimates if (e.method, e.measure, e.action) == wanted)


@pytest.mark.parametrize("holdouts", [1, 3])
def test_means_and_intervals_are_over_clips_not_rows(errors, holdouts):
    estimates = estimate(make_results(errors, holdouts=holdouts), seed=5)
    order = np.argsort([f"clip_{i}" for i in range(12)])
    for method, values in errors.items():
        found = find(estimates, method)
        assert found.clips == 12
        assert found.mean.value == pytest.approx(values.mean())
        per_clip = values.mean(axis=1)[order]
        expected = mean_intervals([per_clip], rng=np.random.default_rng(5))[0]
        np.testing.assert_allclose(found.mean, expected)
        baseline = errors[BASELINE].mean(axis=1)[order]
        ratio = paired_interval(per_clip, baseline, how="ratio", rng=np.random.default_rng(5))
        np.testing.assert_allclose(found.ratio, ratio)
    assert find(estimates, "noisy", action="walk").mean.value == pytest.approx(
        errors["noisy"][1::2].mean()
    )


def test_the_best_is_one_that_is_surely_better(errors):
    estimates = estimate(make_results(errors))
    assert [
        e.method for e in estimates if e.measure == "rms_all_deg" and e.action == "all" and e.best
    ] == ["savgol"]  # the oracle is none, though smaller
    errors["savgol"] = errors[BASELINE] * np.tile([[0.9], [1.09]], (6, 1))
    estimates = estimate(make_results(errors))
    assert not any(e.best for e in estimates if e.action == "all")
    few = {method: values[:4] for method, values in errors.items() if method != "savgol"}
    assert not any(e.best for e in estimate(make_results(few)))


def test_clips_without_a_value_are_left_out_of_that_measure(errors):
    estimates = estimate(make_results(errors))
    found = find(estimates, "noisy", "gap_rms_deg")
    assert found.clips == 10
    assert found.mean.value == pytest.approx(errors["noisy"][2:].mean())
    none = {method: values[:2] for method, values in errors.items()}
    assert "gap_rms_deg" not in {e.measure for e in estimate(make_results(none))}


def test_a_measure_that_is_no_error_has_no_best_and_no_ratio(errors):
    found = find(estimate(make_results(errors)), "noisy", "jitter_cm_s3")
    assert np.isnan(found.ratio.value)
    assert not found.best


def test_a_method_that_lacks_clips_is_left_out(errors):
    results = make_results(errors, holdouts=3)
    lost = next(job for job in results if job.method == "savgol")
    del results[lost]
    assert {e.method for e in estimate(results)} == {"noisy", BASELINE, ORACLE}


def test_a_method_that_lacks_rows_of_a_clip_in_two_holdouts_is_left_out(errors):
    once, again = make_results(errors), make_results(errors)
    twice = once | {replace(job, holdout="another"): result for job, result in again.items()}
    assert find(estimate(twice), "savgol").clips == 12
    del twice[next(job for job in twice if job.method == "savgol")]
    assert {e.method for e in estimate(twice)} == {"noisy", BASELINE, ORACLE}


def test_the_same_seed_gives_the_same_table(errors):
    results = make_results(errors)
    first, second, other = (find(estimate(results, seed=s), "savgol") for s in (1, 1, 2))
    assert first == second
    assert first.mean != other.mean


def test_csv_files_hold_everything(errors):
    results = make_results(errors)
    rows = list(csv.DictReader(io.StringIO(results_to_csv(results))))
    assert len(rows) == 4 * 12 * 2
    assert rows[0]["corruption"] == "angular:0.5"
    assert rows[0]["holdout"] == "holdout_0"
    assert float(rows[1]["rms_all_deg"]) == errors["noisy"][0, 1]
    estimates = estimate(results)
    table = list(
        csv.DictReader(io.StringIO(estimates_to_csv(estimates, frames_per_second(results))))
    )
    assert len(table) == len(estimates)
    assert {row["action"] for row in table} == {"run", "walk", "all"}
    assert table[0]["unit"] == "deg"
    assert table[0]["frames_per_second"] == "200"


def test_markdown_shows_both_kinds_of_rms_cost_and_the_best(errors):
    results = make_results(errors)
    text = estimates_to_markdown(estimate(results), frames_per_second(results))
    assert text.startswith("## angular:0.5\n")
    assert "RMS over all joint angles, degrees" in text
    assert "RMS over the angles that move, degrees" in text
    rows = [line for line in text.splitlines() if line.startswith(f"| {METHODS['savgol'].label} ")]
    assert len(rows) == 3  # the third is of the samples inside gaps
    assert f"**{errors['savgol'].mean():.3f}**" in rows[0]
    assert rows[0].rstrip(" |").endswith("200")
    assert "sees the clean signal" in text
    assert "| run (6) | walk (6) | all (12) |" in " ".join(text.split())


def test_markdown_shows_errors_inside_gaps_where_there_are_gaps(errors):
    results = make_results(errors)
    title = "RMS over the hidden angles, degrees"
    text = estimates_to_markdown(estimate(results), frames_per_second(results))
    assert "| all (10) |" in " ".join(text[text.index(title) :].split())  # two clips have none
    for result in results.values():
        for row in result["rows"]:
            row["gap_rms_deg"] = np.nan
    text = estimates_to_markdown(estimate(results), frames_per_second(results))
    assert title not in text


def test_the_median_over_clips_stands_beside_the_mean(errors):
    errors["noisy"][0] = 1000.0
    found = find(estimate(make_results(errors)), "noisy")
    assert found.median == pytest.approx(np.median(errors["noisy"].mean(axis=1)))
    results = make_results(errors)
    text = estimates_to_markdown(estimate(results), frames_per_second(results))
    row = next(line for line in text.splitlines() if line.startswith(f"| {METHODS['noisy'].label}"))
    assert f"| {found.median:.3f} |" in " ".join(row.split())


def test_one_clip_has_no_interval(errors):
    results = make_results({method: values[:1] for method, values in errors.items()})
    estimates, speeds = estimate(results), frames_per_second(results)
    assert between(find(estimates, "savgol")) == "-"
    rows = estimates_to_markdown(estimates, speeds).splitlines()
    row = next(line for line in rows if line.startswith(f"| {METHODS['savgol'].label} "))
    assert [cell.strip() for cell in row.split("|")][4] == "-"
    table = list(csv.DictReader(io.StringIO(estimates_to_csv(estimates, speeds))))
    assert {(line["low"], line["high"]) for line in table} == {("nan", "nan")}


def test_a_draw_without_a_value_is_left_out_of_its_clip(errors):
    results = make_results(errors)
    for result in results.values():
        result["rows"][0]["gap_rms_deg"] = 7.0  # the first clip has a gap in its first draw only
    assert find(estimate(results), "savgol", "gap_rms_deg").clips == 11


def test_plots_are_written_and_show_every_method(errors, tmp_path, monkeypatch):
    import matplotlib.pyplot as plt

    shown = []
    close = plt.close
    monkeypatch.setattr(plt, "close", lambda figure: (shown.append(figure), close(figure)))
    results = make_results(errors)
    paths = draw_plots(estimate(results), frames_per_second(results), tmp_path)
    assert [path.name for path in paths] == ["errors_angular_0.5.png", "cost_angular_0.5.png"]
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in paths)
    left, right = shown[0].axes
    ranked = [method_label(m) for m in (ORACLE, "savgol", BASELINE, "noisy")]
    for ax in (left, right):
        assert [tick.get_text() for tick in ax.get_yticklabels()] == ranked
    cost = shown[1].axes[0]
    assert cost.get_xscale() == "log"
    assert len(cost.get_legend().get_texts()) == 4
