import json

import pytest
import torch
from safetensors.torch import save_file

from mocaplab.checkpoints import CheckpointError
from mocaplab.two_sources.model_files import (
    FORMAT,
    SourceModel,
    build_source_network,
    load_source_model,
    save_source_model,
    shipped_source_model,
)
from mocaplab.two_sources.networks import PredictionConfig, TwoSourceConfig
from mocaplab.two_sources.robust import RobustConfig

CONFIGS = [
    RobustConfig(3, n_trust=4),
    TwoSourceConfig(3, n_hidden=4, faithful=True),
    PredictionConfig(3, n_hidden=4),
]


@pytest.mark.parametrize("config", CONFIGS, ids=lambda config: type(config).__name__)
def test_what_was_saved_is_read(config, tmp_path):
    network = build_source_network(config, seed=3)
    model = SourceModel(network, ("a", "b", "c"), 1 / 120, {"seed": 3})
    save_source_model(model, tmp_path / "model.safetensors")
    read = load_source_model(tmp_path / "model.safetensors")
    assert read.segments == ("a", "b", "c")
    assert read.frame_time == 1 / 120
    assert read.info == {"seed": 3}
    assert read.network.config == config
    for name, value in network.state_dict().items():
        assert torch.equal(read.network.state_dict()[name], value)


def header(**changes):
    good = {
        "format": FORMAT,
        "network": "TwoSourceLSTM",
        "config": {"n_joints": 3, "n_hidden": 4},
        "segments": ["a", "b", "c"],
        "frame_time": 0.01,
        "info": {},
    }
    return {"mocaplab": json.dumps({**good, **changes})}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"format": "mocaplab-network-1"}, "expected format mocaplab-sources-1"),
        ({"network": "Unknown"}, "damaged"),
        ({"config": {"n_joints": -1}}, "n_joints must be a whole number"),
        ({}, "the weights do not fit"),
    ],
)
def test_other_files_are_refused(changes, message, tmp_path):
    path = tmp_path / "model.safetensors"
    save_file({"model.x": torch.zeros(2)}, path, header(**changes))
    with pytest.raises(CheckpointError, match=message):
        load_source_model(path)


def test_what_does_not_fit_together_is_refused():
    network = build_source_network(CONFIGS[0], seed=0)
    with pytest.raises(ValueError, match="expected 3 different segments"):
        SourceModel(network, ("a", "b"), 0.01, {})
    with pytest.raises(ValueError, match="frame time in seconds"):
        SourceModel(network, ("a", "b", "c"), -1, {})
    with pytest.raises(TypeError, match="configuration of paper B"):
        build_source_network({"n_joints": 3}, seed=0)


@pytest.mark.parametrize(
    ("name", "network", "n_segments", "frames_a_second"),
    [
        ("fusion", "RobustFusion", 22, 120),
        ("two_sources", "TwoSourceLSTM", 22, 120),
        ("prediction", "PredictionLSTM", 21, 25),
    ],
)
def test_models_come_with_the_package(name, network, n_segments, frames_a_second):
    model = shipped_source_model(name)
    assert type(model.network).__name__ == network
    assert len(model.segments) == n_segments
    assert 1 / model.frame_time == pytest.approx(frames_a_second, rel=0.01)
    assert len(model.info["losses"]) > 0


def test_a_model_that_does_not_come_along_is_refused():
    with pytest.raises(ValueError, match="fusion, two_sources, prediction, got 'ebf'"):
        shipped_source_model("ebf")
