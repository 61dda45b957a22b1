"""LiveBlend: its estimates against other ways to compute them, and stream against whole clip."""

import copy

import numpy as np
import pytest
import torch

from data_tools.stream_model import train_mixer
from mocaplab.checkpoints import Checkpoint, load_checkpoint, save_checkpoint, shipped_checkpoint
from mocaplab.corruption import corrupt
from mocaplab.live.bank import (
    LEVELS,
    LINES,
    MEANS,
    N_CLUES,
    N_ESTIMATES,
    N_PAST,
    PAIRS,
    Estimates,
    kernels,
    linear_gains,
    window_basis,
)
from mocaplab.live.blend import LiveBlend, NumpyMixer
from mocaplab.live.filters import window_mean
from mocaplab.live.mixer import LIMIT, LiveMixer, LiveMixerConfig
from mocaplab.live.statistics import RunningNoise
from mocaplab.networks import build_network
from mocaplab.streaming import Stream, stream_motion


@pytest.fixture(scope="module")
def noisy(embedded):
    motion = embedded["kick_02"].slice_frames(40, 130)
    return corrupt(motion, "angular:0.5", rng=np.random.default_rng(0)).observed


def small_checkpoint(motion):
    """Make an untrained network for the skeleton of a motion."""
    constant = ~motion.skeleton.is_cleaned
    constant[np.flatnonzero(motion.skeleton.is_cleaned)[:2]] = True
    n_channels = int((~constant).sum())
    network = LiveMixer(LiveMixerConfig(n_channels, N_ESTIMATES, N_CLUES, n_cosines=3), seed=0)
    with torch.no_grad():
        for values in network.parameters():
            values.add_(torch.linspace(-0.3, 0.3, values.numel()).reshape(values.shape))
        factor = torch.linspace(-1, 1, (3 * n_channels) ** 2).reshape(3 * n_channels, -1).cos()
        network.covariance.copy_(factor @ factor.T / n_channels)
    widths, labels = np.full(len(constant), 0.03), motion.skeleton.channel_labels
    info = {"train": {"clips": {}}}
    return Checkpoint(network.eval(), constant, labels, motion.frame_time, 0.03, widths, info)


# The estimates.


@pytest.mark.parametrize("look_ahead", [0, 4, 15])
def test_kernels_are_means_and_lines(look_ahead):
    rng = np.random.default_rng(0)
    window = rng.normal(size=(N_PAST + 1 + look_ahead, 1))
    estimates = (kernels(look_ahead) @ window)[:, 0]
    assert estimates[0] == window[N_PAST, 0]
    for sigma, estimate in zip(MEANS, estimates[1:], strict=False):
        assert estimate == pytest.approx(window_mean(window, N_PAST, sigma)[0])
    distance = np.arange(-N_PAST, look_ahead + 1)
    for sigma, estimate in zip(LINES, estimates[1 + len(MEANS) :], strict=True):
        # numpy.polyfit squares its weights
        line = np.polyfit(distance, window[:, 0], 1, w=np.exp(-0.25 * (distance / sigma) ** 2))
        assert estimate == pytest.approx(line[1])


def test_linear_gains_give_the_conditional_mean():
    rng = np.random.default_rng(0)
    n_channels, n_cosines, radius, look_ahead = 2, 3, 4, 1
    factor = rng.normal(size=(6, 6))
    covariance = factor @ factor.T
    gains = linear_gains(covariance, look_ahead, radius, n_cosines)
    basis = window_basis(n_cosines, radius)
    np.testing.assert_allclose(basis.T @ basis, np.eye(n_cosines), atol=1e-12)
    seen = np.kron(np.eye(n_channels), basis[: radius + 1 + look_ahead])
    middle = np.kron(np.eye(n_channels), basis[radius])
    prior = covariance + 1e-4 * np.eye(6)
    window = rng.normal(size=len(seen))
    for gain, level in zip(gains, LEVELS, strict=True):
        of_seen = seen @ prior @ seen.T + level**2 * np.eye(len(seen))
        expected = middle @ prior @ seen.T @ np.linalg.solve(of_seen, window)
        np.testing.assert_allclose((seen.T @ window) @ gain, expected, atol=1e-9)


def test_running_noise():
    rng = np.random.default_rng(0)
    time = np.arange(3000)
    channels = np.stack([30 * np.sin(time / 40), 5 + 0.1 * time, 0.0 * time], axis=1)
    channels[:, 0] += rng.normal(0, 2, 3000)
    channels[1500:, 0] += 175  # one jump hardly counts
    noise = RunningNoise(3)
    for frame in channels:
        noise.add(frame)
    assert noise.std[0] == pytest.approx(2, rel=0.05)
    np.testing.assert_allclose(noise.std[1:], 1e-3)


def test_running_noise_knows_nothing_in_three_frames():
    noise = RunningNoise(1)
    for value in (0.0, 50.0, -20.0):
        noise.add(np.array([value]))
    assert noise.std.tolist() == [1e-3]


def test_numpy_mixer_is_the_network():
    rng = np.random.default_rng(0)
    network = LiveMixer(LiveMixerConfig(7, N_ESTIMATES, N_CLUES), seed=3)
    with torch.no_grad():
        for values in network.parameters():
            values.add_(torch.linspace(-0.5, 0.5, values.numel()).reshape(values.shape))
    estimates = rng.normal(0, 5, (7, N_ESTIMATES))
    known = Estimates(estimates, rng.normal(size=(7, N_CLUES)), rng.uniform(0.1, 3, 7))
    tensors = [torch.from_numpy(x) for x in (estimates - estimates[:, :1], *known[1:])]
    with torch.no_grad():
        expected = network.double().mix(*tensors).numpy()
    network.float()
    change = NumpyMixer(network)(known)
    np.testing.assert_allclose(change, expected, atol=1e-5)
    assert (np.abs(change) <= LIMIT * known.noise + 1e-9).all()


# Stream and whole clip.


def clean_offline(motion, checkpoint, look_ahead):
    """Clean a whole clip with what a stream may see, all frames of an estimate at once."""
    columns, network = checkpoint.columns(motion.skeleton), checkpoint.model
    values = motion.channels[:, columns]
    n_frames, n_channels = values.shape
    newest = np.minimum(np.arange(n_frames) + look_ahead, n_frames - 1)
    mean, std = (np.array([f(values[: t + 1], axis=0) for t in newest]) for f in (np.mean, np.std))
    running, noise = RunningNoise(n_channels), []
    for frame in values:
        running.add(frame)
        noise.append(running.std)
    noise = np.array(noise)[newest]
    padded = np.pad(values, ((N_PAST, look_ahead), (0, 0)), mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, N_PAST + 1 + look_ahead, axis=0)
    fixed = windows @ kernels(look_ahead).T  # (T, C, M - 1)

    radius, n_cosines = network.config.radius, network.config.n_cosines
    seen = window_basis(n_cosines, radius)[: radius + 1 + look_ahead]
    scale = np.maximum(std, 1e-3)
    pose = (np.moveaxis(windows[..., N_PAST - radius :], -1, 0) - mean) / scale
    projected = np.einsum("wtc,wk->tck", pose, seen).reshape(n_frames, -1)
    gains = linear_gains(network.covariance.double().numpy(), look_ahead, radius, n_cosines)
    for_levels = np.stack([projected @ gain for gain in gains])
    linear = np.empty_like(values)
    level = np.log(noise / scale)
    for t in range(n_frames):
        for c in range(n_channels):
            linear[t, c] = np.interp(level[t, c], np.log(LEVELS), for_levels[:, t, c])
    linear = mean + scale * linear
    estimates = np.concatenate([fixed, linear[..., None]], axis=-1)

    rows = np.vstack([kernels(look_ahead), np.zeros(N_PAST + 1 + look_ahead)])
    clues, averages = [], []
    for a, b in PAIRS:
        expected = np.linalg.norm(rows[a] - rows[b])
        clues.append((estimates[..., a] - estimates[..., b]) / noise / expected)
    squares = np.minimum(np.square(clues), 100)
    for memory in (8, 30):
        average = squares[:, 0]
        kept = []
        for t in range(n_frames):
            average = average + (squares[:, t] - average) / memory
            kept.append(0.5 * np.log(np.maximum(average, 0.05)))
        averages += list(np.moveaxis(kept, 1, 0))
    known = np.broadcast_to(np.log(np.minimum(newest + 1, 600) / 60)[:, None], values.shape)
    ahead = np.full(values.shape, look_ahead / 15)
    clues = np.stack([*np.arcsinh(clues), *averages, level, ahead, known], axis=-1)
    difference = estimates - values[..., None]
    with torch.no_grad():
        tensors = [torch.from_numpy(x) for x in (difference, clues, noise)]
        change = copy.deepcopy(network).double().mix(*tensors).numpy()
    result = motion.channels.copy()
    result[:, columns] += np.where(std >= 1e-3, change, 0)
    return result


@pytest.mark.parametrize("look_ahead", [0, 3, 15])
def test_stream_equals_offline(noisy, look_ahead):
    checkpoint = small_checkpoint(noisy)
    columns = checkpoint.columns(noisy.skeleton)
    for frames in (slice(0, 90), slice(10, 22)):
        motion = noisy.slice_frames(frames.start, frames.stop)
        streamed = stream_motion(motion, LiveBlend(checkpoint, look_ahead / 120)).channels
        offline = clean_offline(motion, checkpoint, look_ahead)
        np.testing.assert_allclose(streamed[:, columns], offline[:, columns], atol=1e-5)
        assert not np.allclose(streamed[:, columns], motion.channels[:, columns], atol=1)


@pytest.mark.parametrize("look_ahead", [0, 15])
def test_shipped_network_equals_offline(noisy, look_ahead):
    checkpoint = shipped_checkpoint("stream")
    columns = checkpoint.columns(noisy.skeleton)
    streamed = stream_motion(noisy, LiveBlend(look_ahead_s=look_ahead / 120)).channels
    offline = clean_offline(noisy, checkpoint, look_ahead)
    np.testing.assert_allclose(streamed[:, columns], offline[:, columns], atol=1e-5)


def test_it_cleans(embedded):
    clip = corrupt(
        embedded["walk_05"].slice_frames(0, 200), "angular:0.5", rng=np.random.default_rng(1)
    )
    before = clip.observed.channels - clip.clean.channels
    for look_ahead_s, share in ((0.0, 0.5), (0.125, 0.3)):
        cleaned = stream_motion(clip.observed, LiveBlend(look_ahead_s=look_ahead_s))
        assert np.std(cleaned.channels - clip.clean.channels) < share * np.std(before)


def test_clean_input_stays_nearly_clean(walk):
    clean = walk.slice_frames(0, 150)
    cleaned = stream_motion(clean, LiveBlend())
    assert np.sqrt(np.mean((cleaned.channels - clean.channels) ** 2)) < 0.2


def test_root_and_still_channels_come_back_exactly(noisy):
    channels = noisy.channels.copy()
    still = noisy.skeleton.channel_index("RightForeArm.Yrotation")
    channels[:, still] = 1 / 3
    streamed = stream_motion(noisy.with_channels(channels), LiveBlend()).channels
    untouched = ~noisy.skeleton.is_cleaned
    untouched[still] = True
    assert np.array_equal(streamed[:, untouched], channels[:, untouched])


def test_channels_that_stood_still_in_training_are_smoothed(noisy):
    checkpoint = shipped_checkpoint("stream")
    unknown = np.flatnonzero(checkpoint.constant & noisy.skeleton.is_cleaned)[0]
    channels = noisy.channels.copy()
    channels[:, unknown] = np.random.default_rng(0).normal(size=len(channels))
    streamed = stream_motion(noisy.with_channels(channels), LiveBlend(checkpoint)).channels
    sigma = checkpoint.gaussian_s / noisy.frame_time
    window = channels[:, [unknown]]
    assert streamed[40, unknown] == pytest.approx(window_mean(window[:56], 40, sigma)[0])


# What is refused.


def test_other_networks_and_whole_clips_are_refused():
    with pytest.raises(ValueError, match="made for streams, LiveMixer, got EBF"):
        LiveBlend(shipped_checkpoint("ebf"))
    with pytest.raises(ValueError, match="this network cleans streams"):
        build_network(LiveMixerConfig(3, N_ESTIMATES, N_CLUES), seed=0)(torch.zeros(1), None)


def test_another_skeleton_rate_or_look_ahead_is_refused(walk, small_motion):
    live = LiveBlend()
    with pytest.raises(ValueError, match="another skeleton"):
        Stream(small_motion.skeleton, 1 / 120, live)
    with pytest.raises(ValueError, match="120 frames per second"):
        Stream(walk.skeleton, 1 / 30, live)
    with pytest.raises(ValueError, match=r"0.125 s ahead at most, got look_ahead_s = 0.2"):
        Stream(walk.skeleton, 1 / 120, LiveBlend(look_ahead_s=0.2))


# Training.


def test_training_learns_and_is_repeatable(small_motion, tmp_path):
    rng = np.random.default_rng(0)
    phases = rng.uniform(0, 6, (4, small_motion.skeleton.n_channels))
    time = np.arange(130)[:, None] / 60
    clips = [small_motion.with_channels(30 * np.sin(4 * time + phase)) for phase in phases]
    first, second = (train_mixer(clips, seed=1, epochs=2) for _ in range(2))
    assert first.info["losses"] == second.info["losses"]
    assert first.info["losses"][1] < first.info["losses"][0]
    save_checkpoint(first, tmp_path / "stream.safetensors")
    again = load_checkpoint(tmp_path / "stream.safetensors")
    noisy = corrupt(clips[0], "angular:0.5", rng=rng).observed
    one, other = (stream_motion(noisy, LiveBlend(x, 0.05)).channels for x in (first, again))
    assert np.array_equal(one, other)
