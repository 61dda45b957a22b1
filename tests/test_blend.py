"""Blend: it stays between its estimates, does no harm, and learns."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from mocaplab.blend import LIMIT, Blend, BlendConfig
from mocaplab.checkpoints import load_checkpoint, save_checkpoint
from mocaplab.cleaning import Cleaner
from mocaplab.corruption import corrupt
from mocaplab.estimate_bank import estimates_and_clues, noise_std
from mocaplab.layers import seeded
from mocaplab.learning.blend_lesson import BlendLesson
from mocaplab.learning.config import BLEND_TRAINING
from mocaplab.measures.by_name import rms_all_deg
from mocaplab.networks import build_network
from mocaplab.normalization import constant_channels
from mocaplab.training import train

QUICK = replace(BLEND_TRAINING, epochs=2, batch_size=8)


def small(n):
    return BlendConfig(n, n_code=16, n_hidden=16)


@pytest.fixture(scope="module")
def clips(embedded):
    return embedded.clips[:3]


@pytest.fixture(scope="module")
def columns(clips):
    return clips[0].skeleton.is_cleaned & ~constant_channels(clips)


@pytest.fixture(scope="module")
def lesson(clips, columns):
    network = Blend(small(int(columns.sum())), seed=0)
    return BlendLesson(clips, QUICK, columns, network, measure=True), network


@pytest.mark.parametrize("n_frames", [1, 3, 50])
def test_the_answer_lies_between_the_estimates_and_near_the_pose(n_frames):
    network = build_network(small(4), seed=0).eval()
    with seeded(0), torch.no_grad():
        pose, velocity = torch.randn(2, n_frames, 4), torch.randn(2, n_frames, 3)
        noise = noise_std(pose)
        estimates, _ = estimates_and_clues(pose, noise, network.covariance, 15)
        cleaned = network(pose, velocity)
    assert cleaned.shape == pose.shape
    assert (cleaned <= estimates.amax(-1) + 1e-5).all()
    assert (cleaned >= estimates.amin(-1) - 1e-5).all()
    assert ((cleaned - pose).abs() <= LIMIT * noise[:, None] + 1e-5).all()


def test_weights_are_shares():
    network = build_network(small(4), seed=0).eval()
    with seeded(0), torch.no_grad():
        pose, velocity = torch.randn(1, 50, 4), torch.randn(1, 50, 3)
        noise = noise_std(pose)
        estimates, clues = estimates_and_clues(pose, noise, network.covariance, 15)
        weights = network.mixer.weights(estimates, clues, noise, velocity)
    torch.testing.assert_close(weights.sum(-1), torch.ones(1, 50, 4))
    assert (weights > 0).all()


def test_the_covariance_is_that_of_clean_windows(lesson):
    learned, network = lesson
    covariance = network.covariance
    torch.testing.assert_close(covariance, covariance.T)
    k = network.config.n_cosines
    power = torch.diagonal(covariance).reshape(-1, k).sum(1)
    # A window of 31 samples of deviation 1 has a power of 31; the slow cosines hold most of it.
    assert ((power > 20) & (power < 40)).float().mean() > 0.8
    assert len(learned.covariances) == len(learned.versions)
    assert not any(torch.equal(own, covariance) for own in learned.covariances)


def test_a_single_clip_is_cut_into_stretches(embedded):
    clip = embedded.clips[0].slice_frames(0, 400)
    columns = clip.skeleton.is_cleaned
    network = build_network(BlendConfig(int(columns.sum())), seed=0)
    learned = BlendLesson([clip], BLEND_TRAINING, columns, network, measure=True)
    assert len(learned.versions) == 4  # 400 frames hold four pieces of 96
    assert sum(len(versions[0].channels) for versions in learned.versions) == 400
    assert not any(torch.equal(own, network.covariance) for own in learned.covariances)


def test_a_lesson_shows_pieces_of_noisy_clips(lesson):
    learned, _ = lesson
    batches = list(learned.batches(np.random.default_rng(0)))
    assert len(batches) == pytest.approx(learned.n_batches, abs=3)
    first = batches[0]
    assert first.clean.shape == (8, 96, learned.versions[0][0].channels.shape[1])
    assert set(first.weight.unique().tolist()) == {0.0, 1.0}
    error = (first.estimates[..., 0] - first.clean).square().mean((1, 2))
    assert len(error.unique()) > 1  # each clip has its own amount of noise
    again = next(learned.batches(np.random.default_rng(0)))
    assert torch.equal(again.clean, first.clean)


def test_loss_of_the_best_gaussian_is_near_one(lesson):
    """The unit of the loss is what the best single Gaussian leaves."""
    learned, network = lesson
    losses = []
    for batch in learned.batches(np.random.default_rng(1)):
        best = min(learned.loss(_Choose(network, i), batch).item() for i in range(8))
        losses.append(best)
    assert 0.8 < np.mean(losses) < 2.0


class _Choose(torch.nn.Module):
    def __init__(self, network, which):
        super().__init__()
        self.unused = torch.nn.Parameter(torch.zeros(1))
        self.which = which

    def forward(self, estimates, clues, noise, root_velocity):
        return estimates[..., self.which]


def test_training_repeats_and_goes_on_after_a_stop(clips, tmp_path):
    whole = train(clips, QUICK, small, progress=False)
    state = tmp_path / "state"

    def stop(state):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        train(clips, QUICK, small, state_path=state, progress=False, on_epoch=stop)
    resumed = train(clips, QUICK, small, state_path=state, progress=False)
    assert resumed.info["losses"] == whole.info["losses"]
    for name, value in whole.model.state_dict().items():
        assert torch.equal(resumed.model.state_dict()[name], value), name


def test_it_learns_and_a_saved_one_cleans_the_same(clips, embedded, tmp_path):
    checkpoint = train(clips, replace(QUICK, epochs=6), small, progress=False)
    losses = checkpoint.info["losses"]
    assert losses[-1] < losses[0]
    save_checkpoint(checkpoint, tmp_path / "blend.safetensors")
    clip = corrupt(embedded["walk_30"], "angular:0.5", rng=np.random.default_rng(0))
    cleaned = Cleaner(checkpoint).denoise(clip.observed, clip.mask)
    loaded = Cleaner(load_checkpoint(tmp_path / "blend.safetensors"))
    again = loaded.denoise(clip.observed, clip.mask)
    np.testing.assert_array_equal(cleaned.channels, again.channels)
    assert rms_all_deg(cleaned, clip.clean) < 0.5 * rms_all_deg(clip.observed, clip.clean)


def test_a_long_clip_and_one_without_sides_can_be_learned_from(small_motion, clips):
    long = clips[0].with_channels(np.tile(clips[0].channels, (10, 1)))
    train([long], replace(QUICK, epochs=1), small, progress=False)
    rng = np.random.default_rng(0)
    plain = small_motion.with_channels(rng.normal(size=(40, small_motion.skeleton.n_channels)))
    losses = train([plain], replace(QUICK, epochs=1), small, progress=False).info["losses"]
    assert np.isfinite(losses).all()


def test_validation_leaves_the_covariance_alone(clips, columns):
    network = Blend(small(int(columns.sum())), seed=0)
    BlendLesson(clips[:2], QUICK, columns, network, measure=True)
    before = network.covariance.clone()
    other = BlendLesson(clips[2:], QUICK, columns, network, measure=False)
    assert torch.equal(network.covariance, before)
    assert torch.equal(other.covariances[0], before)
