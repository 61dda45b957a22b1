"""Training: it learns, it resumes, it repeats."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from safetensors import safe_open
from safetensors.torch import load_file, save_file

from mocaplab.checkpoints import CheckpointError
from mocaplab.learning.batches import Windows
from mocaplab.learning.config import TrainConfig
from mocaplab.learning.lessons import batch_loss
from mocaplab.learning.state import TrainingState
from mocaplab.networks import EBD, EBF, EBDConfig, EBFConfig
from mocaplab.training import train

QUICK = TrainConfig(epochs=3, batch_size=4, n_frames=60)


@pytest.fixture(scope="module")
def clips(embedded):
    return embedded.clips[:3]


def weights(checkpoint):
    return checkpoint.model.state_dict()


def assert_same(a, b):
    for name, value in weights(a).items():
        assert torch.equal(value, weights(b)[name]), name


@pytest.fixture(scope="module")
def uninterrupted(clips):
    return train(clips, QUICK, progress=False)


def test_one_clip_can_be_learnt_by_heart(clips):
    """Noise and speed stay the same all the time, so the loss must fall below its start."""
    fixed = {"k_low": 0.5, "k_high": 0.5, "speed_low": 1.0, "speed_high": 1.0}
    config = replace(QUICK, epochs=30, **fixed)
    losses = train(clips[:1], config, progress=False).info["losses"]
    assert np.mean(losses[-5:]) < 0.9 * np.mean(losses[:2])


def test_the_same_seed_gives_the_same_model(clips, uninterrupted):
    torch.rand(3)  # whatever else used torch's generator
    assert_same(train(clips, QUICK, progress=False), uninterrupted)
    other = train(clips, replace(QUICK, seed=1), progress=False)
    assert not torch.equal(
        weights(other)["lstm.weight_hh_l0"], weights(uninterrupted)["lstm.weight_hh_l0"]
    )


def test_an_interrupted_training_goes_on_as_if_nothing_had_been(
    clips, uninterrupted, tmp_path, monkeypatch
):
    state = tmp_path / "model.part"
    save_state = TrainingState.save

    def save_then_stop(*arguments):
        save_state(*arguments)
        raise KeyboardInterrupt

    monkeypatch.setattr(TrainingState, "save", save_then_stop)
    with pytest.raises(KeyboardInterrupt):
        train(clips, QUICK, state_path=state, progress=False)
    monkeypatch.undo()
    assert state.exists()
    resumed = train(clips, QUICK, state_path=state, progress=False)
    assert_same(resumed, uninterrupted)
    assert resumed.info["losses"] == uninterrupted.info["losses"]


def test_the_state_of_another_training_is_refused(clips, tmp_path):
    state = tmp_path / "model.part"
    train(clips, replace(QUICK, epochs=1), state_path=state, progress=False)
    with pytest.raises(CheckpointError, match="not the state of this training"):
        train(clips, QUICK, state_path=state, progress=False)


def test_a_damaged_state_is_refused(clips, tmp_path):
    state = tmp_path / "model.part"
    train(clips, QUICK, state_path=state, progress=False)
    with safe_open(state, framework="pt") as file:
        metadata = file.metadata()
    tensors = load_file(state)
    del tensors["model.encoder.0.weight"]
    save_file(tensors, state, metadata)
    with pytest.raises(CheckpointError, match="damaged"):
        train(clips, QUICK, state_path=state, progress=False)
    save_file(tensors, state, {"mocaplab": "{}"})
    with pytest.raises(CheckpointError, match="not the state of this training"):
        train(clips, QUICK, state_path=state, progress=False)


def test_the_margins_of_a_piece_do_not_count(clips):
    """Noise that is only in the margins changes the loss only through its neighbours."""
    windows = Windows(clips[:1], 90, 15)
    batch = next(windows.batches(4, (0.5, 0.5), rng=np.random.default_rng(0)))
    far = replace(batch, weight=np.ones_like(batch.weight))
    spoiled = batch.clean.copy()
    spoiled[batch.weight == 0] += 50.0
    for case, same in ((batch, True), (far, False)):
        losses = []
        for clean in (case.clean, spoiled):
            model = EBF(EBFConfig(90, dropout=0.0), seed=0)
            moved = replace(case, clean=clean)
            losses.append(batch_loss(model, moved, clips[0].skeleton.is_cleaned).item())
        assert (losses[0] == losses[1]) == same


def test_a_loss_that_is_not_finite_stops_with_advice(clips):
    with pytest.raises(FloatingPointError, match="smaller learning_rate"):
        train(clips, replace(QUICK, learning_rate=float("inf")), progress=False)


def test_a_still_clip_among_others_does_no_harm(clips):
    still = clips[1].with_channels(np.zeros_like(clips[1].channels))
    losses = train([clips[0], still], QUICK, progress=False).info["losses"]
    assert np.isfinite(losses).all()


@pytest.mark.parametrize("wrong", [{"epochs": 0}, {"learning_rate": -1.0}, {"k_low": 2.0}])
def test_settings_without_sense_are_refused(wrong):
    with pytest.raises(ValueError, match="must"):
        TrainConfig(**wrong)


def test_clips_that_do_not_move_are_refused(clips):
    still = [clip.with_channels(np.zeros_like(clip.channels)) for clip in clips]
    with pytest.raises(ValueError, match="nothing to learn"):
        train(still, QUICK, progress=False)


def test_the_checkpoint_tells_how_it_was_made(clips, uninterrupted):
    told = uninterrupted.info["train"]
    assert told["seed"] == 0
    assert set(told["clips"]) == {clip.name for clip in clips}
    assert 0.004 <= uninterrupted.gaussian_s <= 0.25
    assert uninterrupted.gaussian_per_channel_s.shape == (96,)


def test_training_stops_when_the_validation_loss_falls_no_more(clips, tmp_path):
    """And the weights are those of the best epoch, whether it was interrupted or not."""
    config = replace(QUICK, epochs=12, patience=2, learning_rate=0.3)  # too fast to get better
    seen = []
    checkpoint = train(
        clips[:1],
        config,
        lambda n: EBFConfig(n, n_hidden=8),
        validation=clips[1:2],
        progress=False,
        on_epoch=lambda state: seen.append(
            {k: v.clone() for k, v in state.network.state_dict().items()}
        ),
    )
    losses = checkpoint.info["validation_losses"]
    assert len(losses) == len(seen) < 12
    best = int(np.argmin(losses))
    assert len(losses) - 1 - best == 2
    for name, value in weights(checkpoint).items():
        assert torch.equal(value, seen[best][name])


def test_validation_uses_the_same_noise_every_epoch(clips):
    config = replace(QUICK, epochs=2, learning_rate=1e-12)
    checkpoint = train(clips[:1], config, validation=clips[1:2], progress=False)
    first, second = checkpoint.info["validation_losses"]
    assert first == pytest.approx(second, rel=1e-5)


def test_the_gap_filler_learns_only_inside_gaps(clips):
    windows = Windows(clips[:1], 120, 15)
    draw = np.random.default_rng(0)
    batch = next(windows.batches(4, (0.0, 0.0), gaps=(0.01, 0.2), rng=draw))
    assert 0.02 < batch.counted.mean() < 0.9
    columns = clips[0].skeleton.is_cleaned
    network = EBD(EBDConfig(90, dropout=0.0), seed=0)
    losses = []
    for spoilt in (~batch.counted, batch.counted):
        clean = np.where(spoilt, batch.clean + 5.0, batch.clean)
        losses.append(batch_loss(network, replace(batch, clean=clean), columns).item())
    assert losses[0] == batch_loss(network, batch, columns).item() != losses[1]


def test_a_gap_filler_can_be_trained(clips):
    config = replace(QUICK, epochs=25, gap_probability=0.01, gap_mean_s=0.2)
    checkpoint = train(clips[:1], config, lambda n: EBDConfig(n, dropout=0.0), progress=False)
    losses = checkpoint.info["losses"]
    assert losses[-1] < 0.5 * losses[0]


@pytest.mark.parametrize("name", ["gap_probability", "jump_rate"])
@pytest.mark.parametrize("value", [-0.1, float("inf"), float("nan")])
def test_a_probability_or_a_rate_that_is_none_is_refused(name, value):
    with pytest.raises(ValueError, match=f"{name} must (lie in|be 0 or more)"):
        replace(QUICK, **{name: value})
