import csv

import numpy as np
import pytest

from data_tools import paper_b, paper_b_models, paper_b_scores
from data_tools.paper_b_models import RECIPES, prediction_clips, split_clips, train_model
from mocaplab.bvh import save_bvh
from mocaplab.datasets import Dataset, load_folder
from mocaplab.two_sources.model_files import load_source_model, save_source_model

TINY = {"epochs": 1, "steps": 1, "batch_size": 2, "progress": False, "n_hidden": 4}


@pytest.fixture(scope="module")
def folder(embedded, tmp_path_factory):
    """Three clips of two actions each, 2.5 seconds long."""
    path = tmp_path_factory.mktemp("clips")
    for action in ("walk", "kick"):
        long = [c for c in embedded.clips if c.name.startswith(action) and c.n_frames >= 300]
        for clip in long[:3]:
            save_bvh(clip.slice_frames(0, 300), path / f"{clip.name}.bvh")
    return path


@pytest.fixture(scope="module")
def clips(folder):
    return split_clips(load_folder(folder))


def test_the_split_is_by_motion_with_all_actions_in_each_part(clips):
    parts = [
        {clip.name for clip in part.clips} for part in (clips.train, clips.validation, clips.test)
    ]
    assert len(set.union(*parts)) == sum(map(len, parts)) == 6
    for part in (clips.train, clips.validation, clips.test):
        assert set(part.actions) == {"walk", "kick"}


def test_prediction_is_at_25_frames_a_second_without_the_root(clips):
    (clip, *_) = prediction_clips(clips.test)
    assert clip.frame_time == 1 / 25
    assert clip.n_frames == 63
    assert "Hips" not in clip.segments
    assert len(clip.segments) == 21


def test_everything_is_compared(clips, folder, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(paper_b_scores, "REPEATS", 1)
    for module in (paper_b, paper_b_scores):
        monkeypatch.setattr(module, "PURE_SHARES", (0.0, 1.0))
    for name in RECIPES:
        save_source_model(train_model(name, clips, **TINY), tmp_path / f"{name}.safetensors")
    output = tmp_path / "results"
    arguments = [str(folder), "--models", str(tmp_path), "-o", str(output)]
    assert paper_b.main(arguments) == 0
    printed = capsys.readouterr().out
    for text in ("EBF on the mean", "gated Gaussian mean", "constant velocity", "400 ms", "kick"):
        assert text in printed
    with open(output / "fusion.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    names = {row["method"] for row in rows}
    assert {"source A", "mean", "plain", "faithful", "robust", "robust, no poses"} <= names
    assert len(rows) == len(names) * 2
    error = {row["method"]: float(row["all"]) for row in rows if row["clip"].startswith("walk")}
    assert error["mean"] < (error["source A"] + error["source B"]) / 2


def test_command_trains_and_writes_a_model(folder, tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(RECIPES, "robust", {"epochs": 1, "steps": 1, "batch_size": 2})
    path = tmp_path / "fusion.safetensors"
    assert paper_b_models.main([str(folder), "-o", str(path)]) == 0
    model = load_source_model(path)
    assert len(model.segments) == 22
    assert model.frame_time == pytest.approx(1 / 120, rel=1e-4)
    assert len(model.info["train"]["clips"]) == 2
    assert not path.with_name("fusion.safetensors.part").exists()
    assert "wrote" in capsys.readouterr().out
    # Mean and covariance of the poses of the training clips are in the file.
    assert np.linalg.eigvalsh(model.network.covariance.numpy()).min() > -1e-6


def test_a_wrong_folder_is_an_error(tmp_path, capsys):
    assert paper_b.main([str(tmp_path / "none")]) == 2
    assert paper_b_models.main([str(tmp_path), "-o", str(tmp_path / "m")]) == 2
    assert "no .bvh file" in capsys.readouterr().err


def test_clips_of_one_action_are_split_too(embedded):
    some = Dataset("some", embedded.clips[:5], ("walk",) * 5)
    assert len(split_clips(some).train) == 3
