"""mocaplab evaluate --data, as a user calls it."""

import csv
import os
import stat

import pytest

from mocaplab.bvh import save_bvh
from mocaplab.cli import main
from mocaplab.commands.compare import load_clips, read_methods, read_recipes
from mocaplab.comparison import job, job_runner
from mocaplab.comparison.methods import METHODS
from mocaplab.corruption import CORRUPTIONS


@pytest.fixture
def folder(embedded, tmp_path):
    clips = tmp_path / "clips"
    clips.mkdir()
    for clip in embedded.clips[:4]:
        save_bvh(clip.slice_frames(0, 60), clips / f"{clip.name}.bvh")
    return clips


def numbers(path):
    with open(path, newline="") as file:
        rows = list(csv.DictReader(file))
    return [
        {k: v for k, v in row.items() if k not in ("seconds", "frames_per_second")} for row in rows
    ]


def test_comparison_on_processes_and_on_a_cluster(folder, tmp_path, capsys):
    distributed = pytest.importorskip("distributed")
    command = ["evaluate", "--data", str(folder), "--methods", "noisy,gaussian_tuned,oracle"]
    command += ["--noise", "angular:0.5,gaps", "--holdouts", "2", "--repeats", "2"]
    assert main([*command, "--workers", "2", "-o", str(tmp_path / "a")]) == 0
    printed = capsys.readouterr()
    assert "2 holdouts (paper)" in printed.out
    assert "12 jobs" in printed.out
    assert "| Gaussian tuned " in printed.out
    assert "12/12" in printed.err  # the progress bar
    names = {path.name for path in (tmp_path / "a").iterdir() if path.is_file()}
    assert names == {
        "results.csv",
        "table.csv",
        "table.md",
        "errors_angular_0.5.png",
        "cost_angular_0.5.png",
        "errors_gaps_0.001.png",
        "cost_gaps_0.001.png",
        "gaps_gaps_0.001.png",
    }
    assert "by length of the gap" in (tmp_path / "a" / "table.md").read_text()
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=":0"
    ) as cluster:
        scheduler = ["--scheduler", cluster.scheduler_address]
        assert main([*command, *scheduler, "-o", str(tmp_path / "b")]) == 0
    for name in ("results.csv", "table.csv"):
        assert numbers(tmp_path / "a" / name) == numbers(tmp_path / "b" / name)
    rows = numbers(tmp_path / "a" / "results.csv")
    assert len(rows) == 2 * 3 * 4 * 2  # corruptions, methods, clips, repetitions


def refused(arguments, capsys):
    """Run evaluate, which must fail, and return the last line that it prints."""
    assert main(["evaluate", *map(str, arguments)]) == 2
    line = capsys.readouterr().err.splitlines()[-1]
    assert line.startswith("mocaplab evaluate: error: ")
    return line


def test_failed_jobs_are_listed_and_the_others_are_written(folder, tmp_path, capsys, monkeypatch):
    measures = job.usable_measures

    def one_too_many(clip):
        names, refused = measures(clip)
        return [*names, "nothing"], refused

    monkeypatch.setattr(job, "usable_measures", one_too_many)
    line = refused(
        ["--data", folder, "--methods", "noisy", "--holdouts", 2, "-o", tmp_path / "out"], capsys
    )
    assert "2 of 2 jobs failed" in line
    assert len(list((tmp_path / "out" / "failed").iterdir())) == 2


def test_the_table_says_that_jobs_failed(folder, tmp_path, capsys, monkeypatch):
    run_jobs = job_runner.run_jobs

    def one_fails(*arguments):
        results, _ = run_jobs(*arguments)
        lost = next(iter(results))
        del results[lost]
        return results, {lost: "no reason"}

    monkeypatch.setattr(job_runner, "run_jobs", one_fails)
    refused(
        ["--data", folder, "--methods", "noisy", "--holdouts", 2, "-o", tmp_path / "out"], capsys
    )
    text = (tmp_path / "out" / "table.md").read_text()
    assert "1 of 2 jobs failed, and what they lack is left out" in text


def test_the_shortest_clip_decides_before_any_work(folder, embedded, tmp_path, capsys):
    save_bvh(embedded.clips[4].slice_frames(0, 8), folder / "walk_99.bvh")
    command = ["--data", folder, "--methods", "noisy", "--holdouts", 2, "-o", tmp_path / "out"]
    line = refused([*command, "--noise", "long_gaps:0.2"], capsys)
    assert "motion 'walk_99': expected a gap shorter than the clip" in line
    assert main(["evaluate", *map(str, command)]) == 0
    left_out = "acceleration_error_cm_s2 is left out: walk_99: expected at least 9 frames, got 8"
    assert left_out in capsys.readouterr().out


def test_other_settings_in_the_same_folder_are_refused(folder, tmp_path, capsys):
    command = ["--data", folder, "--methods", "noisy", "--holdouts", 2, "-o", tmp_path / "out"]
    assert main(["evaluate", *map(str, command)]) == 0
    line = refused([*command, "--seed", 1], capsys)
    assert "was made with other settings: seed (0, now 1)" in line
    assert "choose another output folder" in line


def test_wrong_names(folder, tmp_path, capsys):
    out = ["-o", tmp_path / "out"]
    line = refused(["--data", folder, "--methods", "gausian_tuned", *out], capsys)
    assert "no method 'gausian_tuned'; the nearest names are gaussian_tuned, " in line
    assert "all are noisy, pchip, " in line
    line = refused(["--data", folder, "--noise", "angula:1", *out], capsys)
    assert "the nearest names are angular" in line
    out += ["--holdouts", 2]
    assert "must lie in" in refused(["--data", folder, "--noise", "angular:-1", *out], capsys)


def test_folders_that_do_not_serve(folder, tmp_path, capsys):
    (tmp_path / "empty").mkdir()
    assert "no .bvh file in" in refused(
        ["--data", tmp_path / "empty", "-o", tmp_path / "out"], capsys
    )
    assert "is not a folder" in refused(["--data", tmp_path / "no", "-o", tmp_path / "x"], capsys)
    (tmp_path / "file").write_text("")
    assert "file" in refused(["--data", folder, "-o", tmp_path / "file"], capsys)
    line = refused(["--data", folder, "-o", tmp_path / "out"], capsys)
    assert "5 holdouts need at least 5 clips of one action" in line


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="root may write anywhere")
def test_an_output_folder_without_permission(folder, tmp_path, capsys):
    (tmp_path / "locked").mkdir(mode=stat.S_IRUSR | stat.S_IXUSR)
    line = refused(["--data", folder, "-o", tmp_path / "locked", "--holdouts", 2], capsys)
    assert "no permission" in line


def test_a_scheduler_that_does_not_answer(folder, tmp_path, capsys, monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr("mocaplab.comparison.job_runner.CONNECT_S", 1)
    command = ["--data", folder, "--holdouts", 2, "--methods", "noisy", "-o", tmp_path / "out"]
    line = refused([*command, "--scheduler", "tcp://127.0.0.1:1"], capsys)
    assert "no Dask scheduler answers at tcp://127.0.0.1:1" in line


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([], "say which clips"),
        (["x.bvh", "--data", "y"], "give no files with it"),
        (["--reference", "x.bvh", "--data", "y"], "give no files with it"),
        (["x.bvh", "--methods", "all"], "--methods does not go without --data"),
        (["x.bvh", "--split", "action", "-o", "y"], "--split, --output do not go without --data"),
        (["--data", "x", "--all-clips"], "--all-clips does not go with --data"),
    ],
)
def test_options_that_do_not_go_together(arguments, words, capsys):
    assert words in refused(arguments, capsys)


def test_all_noise():
    recipes = read_recipes("all")
    assert recipes[:4] == ["angular:0.1", "angular:0.5", "angular:0.9", "spatial:0.5"]
    assert {recipe.split(":")[0] for recipe in recipes} == set(CORRUPTIONS)
    assert len(set(recipes)) == len(recipes) == len(CORRUPTIONS) + 2
    assert read_recipes("0.5,angular:0.50,gaps+0.1") == ["angular:0.5", "gaps:0.001+angular:0.1"]


def test_all_methods_are_all_but_the_networks(capsys):
    assert read_methods("all") == [*METHODS, "oracle"]
    assert "trained for minutes: ebf," in capsys.readouterr().out
    assert read_methods("ebf, noisy,ebf") == ["ebf", "noisy"]
    assert read_methods("all,ebf") == [*METHODS, "oracle", "ebf"]
    assert read_methods("ebf@0.5") == ["ebf@angular:0.5"]


def test_subjects_are_read_from_the_list(folder):
    assert load_clips(str(folder))[1] is None
    names = sorted(path.stem for path in folder.glob("*.bvh"))
    lines = [f"{name},walk,{i}" for i, name in enumerate(names)]
    (folder / "clips.csv").write_text("\n".join(["clip,action,subject", *lines]))
    dataset, subjects = load_clips(str(folder))
    assert [clip.name for clip in dataset.clips] == names
    assert subjects == [0, 1, 2, 3]
    (folder / "clips.csv").write_text("clip,action\nx,walk\n")
    assert load_clips(str(folder))[1] is None


def test_splits_by_subject_need_subjects(folder, tmp_path, capsys):
    command = ["--data", folder, "--split", "subject", "--holdouts", 2, "-o", tmp_path / "out"]
    assert "has the column subject" in refused(command, capsys)
