"""Model files: exact, safe, and refused when they do not fit."""

import json
import pickle
from dataclasses import replace

import pytest
import torch
from safetensors import safe_open
from safetensors.torch import load_file, save_file

from mocaplab.checkpoints import CheckpointError, load_checkpoint, save_checkpoint
from mocaplab.training import TrainConfig, train


@pytest.fixture(scope="module")
def checkpoint(embedded):
    return train(embedded.clips[:2], TrainConfig(epochs=1, n_frames=60), progress=False)


@pytest.fixture
def path(checkpoint, tmp_path):
    save_checkpoint(checkpoint, tmp_path / "model.safetensors")
    return tmp_path / "model.safetensors"


def test_a_model_comes_back_as_it_was(checkpoint, path):
    back = load_checkpoint(path)
    for name, value in checkpoint.model.state_dict().items():
        assert torch.equal(back.model.state_dict()[name], value)
    assert back.channel_labels == checkpoint.channel_labels
    assert back.gaussian_s == checkpoint.gaussian_s
    assert (back.gaussian_per_channel_s == checkpoint.gaussian_per_channel_s).all()
    assert (back.constant == checkpoint.constant).all()
    assert back.info == checkpoint.info
    assert not back.model.training


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(FileNotFoundError, match="no such model file"):
        load_checkpoint(tmp_path / "none.safetensors")


class Bomb:
    def __reduce__(self):
        return (pytest.fail, ("the file was executed",))


@pytest.mark.parametrize("content", [b"", b"HIERARCHY", pickle.dumps(Bomb())])
def test_other_files_are_refused_and_not_executed(tmp_path, content):
    (tmp_path / "x.safetensors").write_bytes(content)
    with pytest.raises(CheckpointError, match="not a model file"):
        load_checkpoint(tmp_path / "x.safetensors")


def test_a_cut_file_is_refused(path):
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(CheckpointError, match="not a model file"):
        load_checkpoint(path)


def tamper(path, edit_header=None, drop=None):
    with safe_open(path, framework="pt") as file:
        header = json.loads(file.metadata()["mocaplab"])
    tensors = load_file(path)
    if edit_header:
        edit_header(header)
    if drop:
        del tensors[drop]
    save_file(tensors, path, {"mocaplab": json.dumps(header)})


@pytest.mark.parametrize(
    ("edit", "drop", "message"),
    [
        (
            lambda h: h.update(format="mocaplab-network-9"),
            None,
            "expected format mocaplab-network-1",
        ),
        (lambda h: h["config"].update(n_channels=7), None, "damaged"),
        (lambda h: h["config"].update(unknown=7), None, "damaged"),
        (lambda h: h.pop("config"), None, "damaged"),
        (lambda h: h["config"].update(n_hidden=10**5), None, "do not fit the configuration"),
        (lambda h: h["config"].update(n_layers=0), None, "n_layers must be a whole number"),
        (lambda h: h["config"].update(radius=1.5), None, "radius must be a whole number"),
        (lambda h: h["config"].update(dropout="x"), None, "damaged"),
        (lambda h: h.update(frame_time=float("nan")), None, "frame_time must be above 0"),
        (lambda h: h.update(frame_time="x"), None, "damaged"),
        (lambda h: h.update(channel_labels=["a"]), None, "damaged"),
        (lambda h: h.update(info={}), None, "damaged"),
        (lambda h: h.update(info=None), None, "damaged"),
        (None, "model.lstm.weight_ih_l0", "damaged"),
        (None, "constant", "damaged"),
    ],
)
def test_tampered_files_are_refused(path, edit, drop, message):
    tamper(path, edit, drop)
    with pytest.raises(CheckpointError, match=message):
        load_checkpoint(path)


@pytest.mark.parametrize("header", ["[1]", "3", "null", "[" * 100_000, "{"])
def test_a_header_that_is_no_dictionary_is_refused(path, header):
    save_file(load_file(path), path, {"mocaplab": header})
    with pytest.raises(CheckpointError, match="not a model file"):
        load_checkpoint(path)


def test_weights_that_are_not_finite_are_refused(path):
    with safe_open(path, framework="pt") as file:
        metadata = file.metadata()
    tensors = load_file(path)
    tensors["model.encoder.0.weight"][0, 0] = torch.nan
    save_file(tensors, path, metadata)
    with pytest.raises(CheckpointError, match="a weight is not finite"):
        load_checkpoint(path)


def test_another_skeleton_or_frame_rate_is_refused_with_advice(checkpoint, walk, small_motion):
    checkpoint.require(walk.skeleton, walk.frame_time, "walk")
    with pytest.raises(ValueError, match=r"another skeleton.*does not know.*mocaplab train"):
        checkpoint.require(small_motion.skeleton, walk.frame_time, "small")
    slow = replace(walk, frame_time=1 / 30)
    with pytest.raises(ValueError, match=r"trained at 120 frames per second, this file has 30"):
        checkpoint.require(slow.skeleton, slow.frame_time, "slow")
