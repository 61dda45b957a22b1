"""mocaplab reproduce from end to end, on few short clips and networks of one epoch."""

import shutil

import matplotlib
import pytest
from reproduction_cases import few_clips, small_plan

from mocaplab.bvh import save_bvh
from mocaplab.cli import main
from mocaplab.comparison.job_runner import this_process
from mocaplab.reproduction import costs, driver

matplotlib.use("agg")


@pytest.fixture(scope="module")
def few(embedded):
    return few_clips(embedded)


def tables(folder):
    return {p.name: p.read_text() for p in folder.iterdir() if p.suffix in (".csv", ".md")}


def test_a_run_that_was_stopped_gives_the_same_tables(few, tmp_path):
    figures = ("3", "7", "8", "b5")
    plan = small_plan(few, figures)
    claims, failed = driver.reproduce(few, None, plan, figures, tmp_path / "a", this_process)
    assert not failed
    assert {claim.figure for claim in claims} == {"3", "7", "8", "b5"}
    first = tables(tmp_path / "a")
    assert {"report.md", "claims.csv", "figure_03.csv", "figure_08.md", "figure_b5.csv"} <= set(
        first
    )
    # As if it had been stopped: some rows and all reports are not there yet.
    shutil.copytree(tmp_path / "a", tmp_path / "b")
    rows = sorted((tmp_path / "b" / "rows").iterdir())
    for path in [*rows[::2], *(p for p in (tmp_path / "b").iterdir() if p.is_file())]:
        path.unlink()
    driver.reproduce(few, None, plan, figures, tmp_path / "b", this_process)
    assert tables(tmp_path / "b") == first


def test_given_networks_must_be_of_these_clips(few, tmp_path):
    with pytest.raises(ValueError, match=r"expected ebf-holdout_1\.safetensors and blend-"):
        driver.count_given(tmp_path, few, 0, 3)
    from mocaplab.comparison.network_methods import train_method
    from mocaplab.splits import make_splits

    splits = make_splits("paper", few.actions, seed=0, n_holdouts=3)
    train = [few.clips[i] for i in splits["holdout_1"].train]
    for name in ("ebf", "blend"):
        train_method(name, train, 1, tmp_path / f"{name}-holdout_1.safetensors", None)
    assert driver.count_given(tmp_path, few, 0, 3) == 1
    with pytest.raises(ValueError, match="was trained on other clips than those outside holdout_1"):
        driver.count_given(tmp_path, few, 1, 3)


@pytest.fixture
def folder(few, tmp_path):
    clips = tmp_path / "clips"
    clips.mkdir()
    for clip, action in zip(few.clips, few.actions, strict=True):
        save_bvh(clip, clips / f"{action}_{clip.name[-2:]}.bvh")
    return clips


def test_the_command(folder, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(costs, "START_S", 0.0)
    monkeypatch.setattr(driver, "measure_steps", lambda dataset, networks: {"ebf": 0.5})
    out = tmp_path / "out"
    command = ["reproduce", "8", "--data", str(folder), "-o", str(out), "--workers", "1"]
    assert main([*command, "--budget", "0.05"]) == 0
    printed = capsys.readouterr().out
    assert "1 figures, budget 0.05 min: 1 of 5 holdouts" in printed
    assert "clips of clips" in printed
    assert "2 cannot be tested here" in printed
    assert (out / "report.md").exists()
    assert (out / "plan.json").exists()
    assert main([*command, "--budget", "7"]) == 2
    assert "budget_min (0.05, now 7.0)" in capsys.readouterr().err


def test_refusals(folder, tmp_path, capsys):
    out = ["-o", str(tmp_path / "out")]
    for arguments, message in (
        ([], "say which figures, or all"),
        (["8"], "say how many minutes it may take"),
        (["elevn", "--budget", "5"], "no figure 'elevn'; the nearest names are"),
        (["8", "--budget", "5", "--data", str(tmp_path / "none")], "is not a folder"),
        (["8", "--budget", "5", "--models", str(tmp_path)], "expected ebf-holdout_1"),
    ):
        assert main(["reproduce", *arguments, *out]) == 2
        assert message in capsys.readouterr().err
    with pytest.raises(SystemExit):
        main(["reproduce", "8", "--budget", "-1"])
    assert "must be minutes above 0, got '-1'" in capsys.readouterr().err


def test_the_list_needs_no_clips(capsys):
    assert main(["reproduce", "--list"]) == 0
    assert "Figure 10: gaps of up to 4 seconds" in capsys.readouterr().out
