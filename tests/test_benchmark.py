"""The corrupted benchmark: repeatable, complete, checked, and continued when interrupted."""

import json
from functools import partial

import numpy as np
import pytest

from data_tools import benchmark
from data_tools.benchmark import main, verify
from data_tools.corruptions import RECIPES, read_file
from mocaplab.corruption import CORRUPTIONS, corrupt, parse_recipe
from mocaplab.datasets import Dataset
from mocaplab.files import write_atomically
from mocaplab.noise.draws import draw_seed

FEW = ("noise_0.1", "noise_0.5", "noise_0.9", "gaps", "noise_0.5_gaps")
N_FILES = 2 * 2 * len(FEW)


write_benchmark = partial(benchmark.write_benchmark, names=FEW)
"""Write a few of the corruptions: every one is tested where it is defined."""


@pytest.fixture(scope="module")
def few(embedded):
    """Two short clips."""
    clips = tuple(embedded[name].slice_frames(0, 40) for name in ("walk_01", "jump_02"))
    return Dataset("few", clips, ("walk", "jump"))


def bytes_of(folder):
    files = [path for path in folder.rglob("*") if path.is_file()]
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in files}


def test_the_same_seed_gives_the_same_bytes(few, tmp_path):
    for name, seed in (("a", 0), ("b", 0), ("c", 1)):
        write_benchmark(few, tmp_path / name, seed=seed, repetitions=2)
    a, b, c = (bytes_of(tmp_path / name) for name in "abc")
    assert a == b
    assert len(a) == N_FILES + 1
    assert all(a[path] != c[path] for path in a)
    assert len(set(a.values())) == len(a)  # no noise comes twice


def test_what_the_files_hold(few, tmp_path):
    manifest = write_benchmark(few, tmp_path, seed=0, repetitions=2)
    assert verify(tmp_path, few) == []
    assert manifest == json.loads((tmp_path / "manifest.json").read_text())
    for path, file in manifest["files"].items():
        observed, mask = read_file(tmp_path / path)
        clean = few[file["clip"]].channels
        assert observed.dtype == np.float32
        assert observed.shape == mask.shape == clean.shape
        np.testing.assert_array_equal(np.isnan(observed), ~mask)
        recipe = manifest["corruptions"][file["corruption"]]
        assert (mask.all()) == ("gaps" not in recipe)
        hidden = ~mask[:, few.skeleton.is_cleaned]
        assert file["hidden_share"] == pytest.approx(hidden.mean(), abs=1e-6)
        noise = RECIPES[file["corruption"]].partition("angular:")[2].partition("+")[0]
        decibels = -20 * np.log10(float(noise)) if noise else None
        assert file["snr_db"] == pytest.approx(decibels, abs=0.6)
        again = corrupt(
            few[file["clip"]], RECIPES[file["corruption"]], rng=np.random.default_rng(file["rng"])
        )
        np.testing.assert_array_equal(observed, again.observed.channels.astype(np.float32))
        root = few.skeleton.channel_joint == 0
        np.testing.assert_allclose(observed[:, root], clean[:, root], atol=1e-4)
    assert manifest["clips"]["walk_01"]["frames"] == 40


def test_float64_holds_the_exact_numbers(few, tmp_path):
    write_benchmark(few, tmp_path, seed=0, repetitions=1, dtype="float64")
    observed, mask = read_file(tmp_path / "gaps" / "walk_01_r0.npz")
    assert observed.dtype == np.float64
    np.testing.assert_array_equal(observed[mask], few["walk_01"].channels[mask])


def test_seeds_do_not_depend_on_what_else_there_is(few, tmp_path):
    write_benchmark(few, tmp_path / "both", seed=0, repetitions=2)
    write_benchmark(few.select([1], "one"), tmp_path / "one", seed=0, repetitions=1)
    path = "noise_0.5/jump_02_r0.npz"
    assert (tmp_path / "both" / path).read_bytes() == (tmp_path / "one" / path).read_bytes()
    seeds = [draw_seed(0, d, c, r) for d in "ab" for c in FEW for r in range(3)]
    assert len(set(map(tuple, seeds))) == len(seeds)


def test_an_interrupted_run_goes_on(few, tmp_path, monkeypatch):
    whole = tmp_path / "whole"
    write_benchmark(few, whole, seed=0, repetitions=2)
    calls = []

    def write_five(path, content):
        calls.append(path)
        if len(calls) == 6:
            raise KeyboardInterrupt
        write_atomically(path, content)

    monkeypatch.setattr(benchmark, "write_atomically", write_five)
    with pytest.raises(KeyboardInterrupt):
        write_benchmark(few, tmp_path / "part", seed=0, repetitions=2)
    assert verify(tmp_path / "part") == ["not complete: give the same command again"]
    assert len(list((tmp_path / "part").glob("*/*.npz"))) == 5
    calls.clear()

    def count(path, content):
        calls.append(path)
        write_atomically(path, content)

    monkeypatch.setattr(benchmark, "write_atomically", count)
    write_benchmark(few, tmp_path / "part", seed=0, repetitions=2)
    assert len(calls) == N_FILES - 5 + 1
    assert bytes_of(tmp_path / "part") == bytes_of(whole)


def test_verify_finds_damage_and_a_rerun_mends_it(few, tmp_path):
    write_benchmark(few, tmp_path, seed=0, repetitions=1)
    before = bytes_of(tmp_path)
    (tmp_path / "gaps" / "walk_01_r0.npz").unlink()
    damaged = tmp_path / "noise_0.9" / "jump_02_r0.npz"
    damaged.write_bytes(damaged.read_bytes()[:-1])
    (tmp_path / "gaps" / "other.npz").write_bytes(b"")
    wrong = verify(tmp_path, few.select([1], "one"))
    assert [line.split(":")[0] for line in wrong] == [
        "noise_0.9/jump_02_r0.npz",
        "gaps/walk_01_r0.npz",
        "gaps/other.npz",
        "clip walk_01",
    ]
    (tmp_path / "gaps" / "other.npz").unlink()
    write_benchmark(few, tmp_path, seed=0, repetitions=1)
    assert bytes_of(tmp_path) == before


def test_other_settings_are_refused(few, tmp_path):
    write_benchmark(few, tmp_path, seed=0, repetitions=1)
    with pytest.raises(ValueError, match="differs in seed, repetitions; choose another folder"):
        write_benchmark(few, tmp_path, seed=1, repetitions=2)
    with pytest.raises(ValueError, match="differs in clips"):
        write_benchmark(few.select([0], "one"), tmp_path, seed=0, repetitions=1)
    for settings in ({"repetitions": 0}, {"dtype": "int8"}):
        with pytest.raises(ValueError, match="at least one repetition"):
            write_benchmark(few, tmp_path, seed=0, **settings)


def test_the_command(few, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(benchmark, "load_dataset", lambda *source: few)
    out = str(tmp_path / "out")
    assert main(["embedded", "-o", out, "--repetitions", "1", "--only", *FEW]) == 0
    assert "noise_0.5_gaps       2 files" in capsys.readouterr().out
    assert main(["--verify", out]) == 0
    assert main(["some_folder", "--verify", out]) == 0
    (tmp_path / "out" / "gaps" / "walk_01_r0.npz").unlink()
    assert main(["--verify", out]) == 1
    assert "got no file" in capsys.readouterr().out
    assert main(["embedded", "-o", out, "--repetitions", "0"]) == 2
    (tmp_path / "out" / "manifest.json").write_text("[]")
    assert main(["--verify", out]) == 2
    assert main(["--verify", str(tmp_path / "nothing")]) == 2
    for arguments in (["-o", out], ["embedded", "-o", out, "--only", "nothing"]):
        with pytest.raises(SystemExit) as stop:
            main(arguments)
        assert stop.value.code == 2


def test_a_refused_seed_leaves_no_folder(few, tmp_path):
    with pytest.raises(ValueError, match="seed of 0 or more"):
        write_benchmark(few, tmp_path / "b", seed=-1, repetitions=1)
    assert not (tmp_path / "b").exists()


def test_an_interrupted_rerun_keeps_what_was_known(few, tmp_path, monkeypatch):
    write_benchmark(few, tmp_path, seed=0, repetitions=1)
    hashes = iter(range(3))

    def stop_soon(path):
        if next(hashes, None) is None:
            raise KeyboardInterrupt
        return original(path)

    original = benchmark._sha256
    monkeypatch.setattr(benchmark, "_sha256", stop_soon)
    with pytest.raises(KeyboardInterrupt):
        write_benchmark(few, tmp_path, seed=0, repetitions=1)
    monkeypatch.undo()
    assert verify(tmp_path) == []


@pytest.mark.parametrize(
    "text", ['{"files": {"a": 1}}', '{"files": {"a": {}}, "complete": true}', "[]"]
)
def test_a_damaged_manifest_is_refused(tmp_path, text):
    (tmp_path / "manifest.json").write_text(text)
    with pytest.raises(ValueError, match="expected the manifest"):
        verify(tmp_path)


def test_every_corruption_of_the_library_is_there():
    used = {
        corruption.name for recipe in RECIPES.values() for corruption, _ in parse_recipe(recipe)
    }
    assert used == set(CORRUPTIONS)
    assert {"noise_0.1", "noise_0.5", "noise_0.9", "long_gaps", "swaps"} <= set(RECIPES)
    assert RECIPES["drift"] == "drift:2"


def test_what_a_clip_cannot_have_is_left_out_and_named(few, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(benchmark, "load_dataset", lambda *source: few)
    out = tmp_path / "out"
    assert (
        main(["embedded", "-o", str(out), "--repetitions", "1", "--only", "long_gaps", "drift"])
        == 0
    )
    printed = capsys.readouterr().out
    assert "long_gaps            0 files" in printed
    reason = "motion 'walk_01': expected a gap shorter than the clip, 0.325 s, got 1 s"
    assert f"left out long_gaps/walk_01_r0.npz: {reason}" in printed
    manifest = json.loads((out / "manifest.json").read_text())
    assert manifest["left_out"]["long_gaps/walk_01_r0.npz"] == reason
    assert sorted(manifest["files"]) == ["drift/jump_02_r0.npz", "drift/walk_01_r0.npz"]
    assert verify(out, few) == []
