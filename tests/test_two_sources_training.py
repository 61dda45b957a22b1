import dataclasses

import numpy as np
import pytest
import torch

from mocaplab.checkpoints import CheckpointError
from mocaplab.two_sources.learning import SourceTrainConfig
from mocaplab.two_sources.losses import l1_loss
from mocaplab.two_sources.networks import (
    PredictionConfig,
    PredictionLSTM,
    TwoSourceConfig,
    TwoSourceLSTM,
)
from mocaplab.two_sources.robust import RobustConfig, RobustFusion
from mocaplab.two_sources.segments import SegmentClip, all_windows, motion_to_segments
from mocaplab.two_sources.training import train_fusion, train_prediction

SMALL = SourceTrainConfig(epochs=3, steps=4, batch_size=4, n_frames=12, n_future=3)


@pytest.fixture(scope="module")
def clips():
    """Three clips of two joints that swing."""
    made = []
    for k in range(3):
        angle = 0.3 * np.sin(0.1 * np.arange(60) + k)[:, None] * [1, 0.5]
        zero = np.zeros_like(angle)
        q = np.stack([np.cos(angle), np.sin(angle), zero, zero], axis=-1)
        made.append(SegmentClip(q, 1 / 60, ("a", "b"), f"clip_{k}"))
    return made


def fuser(seed=0):
    return TwoSourceLSTM(TwoSourceConfig(2, n_hidden=8), seed=seed)


def train(network, clips, config=SMALL, **options):
    return train_fusion(network, clips[:2], config, progress=False, **options)


def same_weights(one, other):
    pairs = zip(one.state_dict().values(), other.state_dict().values(), strict=True)
    return all(torch.equal(a, b) for a, b in pairs)


def test_the_same_seed_gives_the_same_network(clips):
    one, two, other = fuser(), fuser(), fuser()
    losses = train(one, clips).losses
    assert train(two, clips).losses == losses
    assert train(other, clips, dataclasses.replace(SMALL, seed=1)).losses != losses
    assert same_weights(one, two)
    assert not same_weights(one, other)


def test_learning_lowers_the_loss(clips):
    config = dataclasses.replace(SMALL, epochs=4, steps=25, learning_rate=1e-2)
    losses = train(fuser(), clips, config, validation=clips[2:]).validation_losses
    assert min(losses) < losses[0]


def test_an_interrupted_training_goes_on_with_the_same_result(clips, tmp_path):
    whole, part = fuser(), fuser()
    train(whole, clips, validation=clips[2:])

    class Stopped(Exception):
        pass

    steps = 0

    def stop(*_):
        nonlocal steps
        steps += 1
        if steps > 6:
            raise Stopped

    state = tmp_path / "state"
    handle = part.register_forward_pre_hook(stop)
    with pytest.raises(Stopped):
        train(part, clips, validation=clips[2:], state_path=state)
    handle.remove()
    fresh = fuser()
    train(fresh, clips, validation=clips[2:], state_path=state)
    assert same_weights(fresh, whole)
    with pytest.raises(CheckpointError, match="not the state of this training"):
        train(fuser(), clips, dataclasses.replace(SMALL, seed=5), state_path=state)


def test_the_best_weights_on_validation_clips_are_kept(clips):
    config = dataclasses.replace(SMALL, epochs=5, learning_rate=0.3)  # far too large: it diverges
    network = fuser()
    state = train(network, clips, config, validation=clips[2:])
    assert same_weights(network, _loaded(state.best))


def _loaded(weights):
    network = fuser()
    network.load_state_dict(weights)
    return network


def test_all_networks_train(clips):
    robust = RobustFusion(RobustConfig(2, n_trust=4, radius=3), seed=0)
    config = dataclasses.replace(SMALL, varied=True, strides=(1, 2))
    assert np.isfinite(train(robust, clips, config).losses).all()
    faithful = TwoSourceLSTM(TwoSourceConfig(2, n_hidden=8, faithful=True), seed=0)
    plain = dataclasses.replace(SMALL, invariant=False)
    assert np.isfinite(train(faithful, clips, plain).losses).all()
    predictor = PredictionLSTM(PredictionConfig(2, n_hidden=8), seed=0)
    state = train_prediction(predictor, clips[:2], SMALL, validation=clips[2:], progress=False)
    assert len(state.validation_losses) == 3


def test_prediction_learns_a_swing(clips):
    predictor = PredictionLSTM(PredictionConfig(2, n_hidden=16), seed=0)
    config = dataclasses.replace(
        SMALL, epochs=5, steps=60, batch_size=16, learning_rate=1e-2, gradient_norm=1.0
    )
    train_prediction(predictor, clips[:2], config, progress=False)
    windows = torch.from_numpy(all_windows(clips[2].quaternions, 12).copy()).float()
    past, future = windows[:, :9], windows[:, 9:]
    with torch.no_grad():
        ours = l1_loss(predictor(past, 3), future)
    still = l1_loss(past[:, -1:].expand_as(future), future)
    assert ours < 0.7 * still


def test_kinematics_loss_is_an_option(walk):
    clips = [motion_to_segments(walk)]
    config = dataclasses.replace(SMALL, epochs=1, steps=1, kinematics_weight=0.1)
    network = TwoSourceLSTM(TwoSourceConfig(22, n_hidden=4), seed=0)
    with_it = train_fusion(network, clips, config, skeleton=walk.skeleton, progress=False)
    without = dataclasses.replace(config, kinematics_weight=0.0)
    network = TwoSourceLSTM(TwoSourceConfig(22, n_hidden=4), seed=0)
    assert with_it.losses[0] > train_fusion(network, clips, without, progress=False).losses[0]
    with pytest.raises(ValueError, match="needs a skeleton"):
        train_fusion(network, clips, config, progress=False)


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("epochs", 0, "epochs must be above 0"),
        ("n_future", 12, "n_future must lie between"),
        ("strides", (0,), "strides must be whole numbers"),
    ],
)
def test_settings_are_checked(field, value, message):
    with pytest.raises(ValueError, match=message):
        dataclasses.replace(SMALL, **{field: value})
