"""A folder of files: all that can be cleaned is, and what was done is not done again."""

import os
import shutil

import numpy as np
import pytest

from mocaplab.bvh import load_bvh, save_bvh
from mocaplab.cleaner import folder as module
from mocaplab.cleaner.folder import MANIFEST, clean_folder, find_files
from mocaplab.cleaner.one_file import CleanSettings

QUICK = CleanSettings("ebf")


@pytest.fixture
def folder(embedded, tmp_path):
    """Two good files, one in a subfolder."""
    (tmp_path / "in" / "deep").mkdir(parents=True)
    save_bvh(embedded.clips[0].slice_frames(0, 60), tmp_path / "in" / "a.bvh")
    save_bvh(embedded.clips[1].slice_frames(0, 60), tmp_path / "in" / "deep" / "b.BVH")
    return tmp_path / "in"


@pytest.fixture(autouse=True)
def one_process(monkeypatch):
    monkeypatch.setattr(module, "count_cores", lambda: 1)


def test_good_files_are_cleaned_and_bad_ones_named(folder, tmp_path, capsys):
    (folder / "bad.bvh").write_text("nonsense")
    out = tmp_path / "out"
    with pytest.raises(ValueError, match=r"1 of 3 files could not be cleaned: bad\.bvh"):
        clean_folder(folder, out, QUICK)
    captured = capsys.readouterr()
    assert "bad.bvh:1: expected HIERARCHY" in captured.err
    assert "cleaned   2 of 3 files" in captured.out
    assert not (out / "bad.bvh").exists()
    for name in ("a.bvh", "deep/b.BVH"):
        before, after = load_bvh(folder / name), load_bvh(out / name)
        assert after.channels.shape == before.channels.shape
        assert (after.channels != before.channels).any()
    # The same command goes on: only what is missing, and what is newer than its output.
    times = {name: (out / name).stat().st_mtime_ns for name in ("a.bvh", "deep/b.BVH")}
    shutil.copy(folder / "a.bvh", folder / "bad.bvh")
    newer = (out / "a.bvh").stat().st_mtime + 5
    os.utime(folder / "a.bvh", (newer, newer))
    clean_folder(folder, out, QUICK)
    assert "skipped   1 files" in capsys.readouterr().out
    assert (out / "bad.bvh").exists()
    assert (out / "a.bvh").stat().st_mtime_ns != times["a.bvh"]
    assert (out / "deep" / "b.BVH").stat().st_mtime_ns == times["deep/b.BVH"]
    # Other settings never mix with what is there.
    with pytest.raises(ValueError, match="cleaned with other settings"):
        clean_folder(folder, out, CleanSettings("ebf", detect=True))


def test_files_that_others_made_are_not_overwritten(folder, tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    (out / "a.bvh").write_text("mine")
    with pytest.raises(ValueError, match="this command did not make"):
        clean_folder(folder, out, QUICK)
    assert (out / "a.bvh").read_text() == "mine"


def test_an_empty_folder(tmp_path):
    (tmp_path / "empty").mkdir()
    with pytest.raises(ValueError, match=r"there are no \.bvh files in"):
        clean_folder(tmp_path / "empty", tmp_path / "out", QUICK)
    assert not (tmp_path / "out").exists()


def test_the_same_folder(folder):
    with pytest.raises(ValueError, match="must be another"):
        clean_folder(folder, folder, QUICK)


def test_an_output_folder_inside_is_not_read(folder):
    (folder / "out").mkdir()
    shutil.copy(folder / "a.bvh", folder / "out" / "a.bvh")
    found = find_files(folder, folder / "out")
    assert [str(path.relative_to(folder)) for path in found] == ["a.bvh", "deep/b.BVH"]


def test_two_files_with_one_output(folder, tmp_path):
    shutil.copy(folder / "a.bvh", folder / "A.BVH")
    if len(list(folder.glob("*.*"))) < 2:
        pytest.skip("this disk does not tell A.BVH from a.bvh")
    with pytest.raises(ValueError, match=r"same output: .*A\.BVH, .*a\.bvh"):
        clean_folder(folder, tmp_path / "out", QUICK)


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="root may write anywhere")
def test_an_output_folder_that_cannot_be_written(folder, tmp_path):
    (tmp_path / "locked").mkdir(mode=0o500)
    with pytest.raises(OSError, match=r"permission|denied"):
        clean_folder(folder, tmp_path / "locked" / "out", QUICK)


def test_an_output_that_is_a_file(folder, tmp_path):
    (tmp_path / "out").write_text("")
    with pytest.raises(OSError, match="out"):
        clean_folder(folder, tmp_path / "out", QUICK)


def test_a_stop_leaves_whole_files_and_the_list_of_settings(folder, tmp_path, monkeypatch):
    """What is in the output folder after a stop is whole, and is not cleaned again."""

    def stop_after_one(todo, settings):
        source, target = next(iter(todo.items()))
        outcome, notes = module.clean_in_worker(source, target, settings)
        yield source, outcome, notes
        raise KeyboardInterrupt

    out = tmp_path / "out"
    with monkeypatch.context() as patch:
        patch.setattr(module, "_run", stop_after_one)
        with pytest.raises(KeyboardInterrupt):
            clean_folder(folder, out, QUICK)
    assert (out / MANIFEST).exists()
    assert sorted(p.name for p in out.rglob("*") if p.is_file()) == ["a.bvh", MANIFEST]
    assert np.isfinite(load_bvh(out / "a.bvh").channels).all()
    todo = {s: t for s, t in find_files(folder, out).items() if not module.is_done(s, t)}
    assert [path.name for path in todo] == ["b.BVH"]
