from dataclasses import FrozenInstanceError

import numpy as np
import pytest
import torch

from mocaplab.two_sources.losses import unit
from mocaplab.two_sources.networks import (
    PAPER_WIDTH,
    PredictionConfig,
    PredictionLSTM,
    TwoSourceConfig,
    TwoSourceLSTM,
)


def poses(*shape, seed=0):
    rng = np.random.default_rng(seed)
    return unit(torch.from_numpy(rng.normal(size=(*shape, 4))).float())


def test_small_networks_have_the_paper_s_shape():
    model = TwoSourceLSTM(TwoSourceConfig(22, n_hidden=PAPER_WIDTH), seed=0)
    assert model.encoder.num_layers == 2
    assert model.encoder.hidden_size == 1000
    assert model.encoder.input_size == 2 * 88
    assert model.decoder[-1].out_features == 88


def test_fusion_starts_as_the_mean_of_the_two():
    a, b = poses(2, 6, 3), poses(2, 6, 3, seed=1)
    fused = TwoSourceLSTM(TwoSourceConfig(3, n_hidden=8), seed=0)(a, b, 0.01)
    nearer = torch.where((a * b).sum(-1, keepdim=True) < 0, -b, b)
    torch.testing.assert_close(fused, unit(a + nearer), atol=0.05, rtol=0)
    torch.testing.assert_close(fused.norm(dim=-1), torch.ones(2, 6, 3))


def test_the_sign_of_the_second_source_does_not_matter():
    a, b = poses(2, 6, 3), poses(2, 6, 3, seed=1)
    model = TwoSourceLSTM(TwoSourceConfig(3, n_hidden=8), seed=0)
    torch.testing.assert_close(model(a, b, 0.01), model(a, -b, 0.01))


def test_faithful_networks_say_raw_numbers():
    a = poses(2, 6, 3)
    fused = TwoSourceLSTM(TwoSourceConfig(3, n_hidden=8, faithful=True), seed=0)(a, a, 0.01)
    assert (fused.norm(dim=-1) - 1).abs().min() > 0.01
    model = PredictionLSTM(PredictionConfig(3, n_hidden=8, faithful=True), seed=0)
    assert (model(a, 2).norm(dim=-1) - 1).abs().min() > 0.01


def test_prediction_starts_by_standing_still():
    past = poses(2, 6, 3)
    future = PredictionLSTM(PredictionConfig(3, n_hidden=8), seed=0)(past, 4)
    assert future.shape == (2, 4, 3, 4)
    torch.testing.assert_close(future, past[:, -1:].expand(-1, 4, -1, -1), atol=0.1, rtol=0)


def test_what_is_predicted_is_fed_back():
    past = poses(1, 6, 3)
    model = PredictionLSTM(PredictionConfig(3, n_hidden=8), seed=0)
    by_itself = model(past, 3)
    again = model(torch.cat([past, by_itself[:, :1]], dim=1), 2)
    torch.testing.assert_close(by_itself[:, 1:], again)


def test_a_teacher_replaces_what_is_fed_back():
    past, truth = poses(1, 6, 3), poses(1, 3, 3, seed=5)
    model = PredictionLSTM(PredictionConfig(3, n_hidden=8), seed=0)
    taught = model(past, 3, truth)
    torch.testing.assert_close(taught[:, 0], model(past, 1)[:, 0])
    after = model(torch.cat([past, truth[:, :2]], dim=1), 1)
    torch.testing.assert_close(taught[:, 2:], after)


def test_the_seed_decides_the_weights():
    config = TwoSourceConfig(3, n_hidden=8)
    one, two, other = (TwoSourceLSTM(config, seed=seed) for seed in (1, 1, 2))
    assert torch.equal(one.decoder[0].weight, two.decoder[0].weight)
    assert not torch.equal(one.decoder[0].weight, other.decoder[0].weight)


def test_configurations_are_frozen_and_checked():
    with pytest.raises(FrozenInstanceError):
        TwoSourceConfig(3).n_joints = 4
    for config in (TwoSourceConfig, PredictionConfig):
        with pytest.raises(ValueError, match="n_hidden must be a whole number"):
            config(3, n_hidden=0)
