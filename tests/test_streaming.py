"""A stream gives the numbers of the whole clip, and refuses what it cannot clean."""

import math

import numpy as np
import pytest
import torch
from torch import nn

from mocaplab.checkpoints import Checkpoint, save_checkpoint, shipped_checkpoint
from mocaplab.corruption import corrupt
from mocaplab.euler import alternate_euler, make_continuous, motion_continuity, wrap_degrees
from mocaplab.filters import gaussian_filter
from mocaplab.layers import bidirectional_lstm, seeded
from mocaplab.live.angles import ContinuousAngles, RootVelocity
from mocaplab.live.ebf import LiveEBF
from mocaplab.live.filters import LiveGaussian, window_mean
from mocaplab.live.lstm import LiveLSTM
from mocaplab.live.statistics import RunningScale
from mocaplab.measures.movement import root_angular_velocity
from mocaplab.networks import EBFConfig, build_network
from mocaplab.normalization import standardize
from mocaplab.streaming import Stream, stream_motion

LOOK_AHEADS = (0, 3, 15)


@pytest.fixture(scope="module")
def noisy(embedded):
    """Pieces of three clips with noise."""
    rng = np.random.default_rng(0)
    pieces = [embedded["walk_01"].slice_frames(0, 70), embedded["kick_02"].slice_frames(40, 110)]
    pieces.append(embedded["run_03"].slice_frames(0, 40))
    return [corrupt(piece, "angular:0.5", rng=rng).observed for piece in pieces]


def one_direction(lstm, layer, reverse):
    """Take one direction of one layer out of a torch LSTM."""
    suffix = f"_l{layer}" + ("_reverse" if reverse else "")
    names = ("weight_ih", "weight_hh", "bias_ih", "bias_hh")
    weights = {f"{name}_l0": getattr(lstm, name + suffix) for name in names}
    single = nn.LSTM(weights["weight_ih_l0"].shape[1], lstm.hidden_size, batch_first=True)
    single.load_state_dict(weights)
    return single


def lstm_with_look_ahead(lstm, x, look_ahead):
    """Run torch's LSTM over a clip, (T, n_in); every backward pass begins look_ahead ahead."""
    frames = torch.arange(len(x))
    newest = (frames + look_ahead).clamp_max(len(x) - 1)
    ahead = newest - frames
    windows = (newest[:, None] - torch.arange(look_ahead + 1)).clamp_min(0)  # newest first
    first = one_direction(lstm, 0, False)(x[None])[0][0]
    back = one_direction(lstm, 0, True)(x[windows])[0]  # (T, window, h)
    second = torch.cat([first, back[frames, ahead]], dim=-1)
    second = one_direction(lstm, 1, False)(second[None])[0][0]
    back = one_direction(lstm, 1, True)(torch.cat([first[windows], back], dim=-1))[0]
    return torch.cat([second, back[frames, ahead]], dim=-1)


def clean_offline(motion, checkpoint, look_ahead):
    """Clean a continuous motion as a whole, by torch, with what a stream is allowed to see."""
    model, columns = checkpoint.model, checkpoint.columns(motion.skeleton)
    values = motion.channels
    mean = np.array([values[: t + 1].mean(axis=0) for t in range(len(values))])
    std = np.array([values[: t + 1].std(axis=0) for t in range(len(values))])
    pose = standardize(values, mean, std)[:, columns]
    root = np.concatenate([np.zeros((1, 3)), root_angular_velocity(motion)[:-1]])
    x = torch.from_numpy(np.concatenate([pose, root], axis=1)).float()
    newest = np.minimum(np.arange(len(values)) + look_ahead, len(values) - 1)
    with torch.no_grad():
        if model.config.encoder:
            x = torch.tanh(model.encoder(x))
        outputs = model.head(lstm_with_look_ahead(model.lstm, x, look_ahead)).double().numpy()
    n = columns.sum()
    sigma = np.full(values.shape, checkpoint.gaussian_s / motion.frame_time)
    sigma[:, columns] = np.exp(np.clip(outputs[:, :n], math.log(0.1), math.log(30)))
    smoothed = motion.skeleton.is_cleaned & (std[newest] >= 1e-3)
    radius, cleaned = model.config.radius, values.copy()
    for t in range(len(values)):
        there = np.arange(max(0, t - radius), newest[t] + 1)
        weights = np.exp(-0.5 * ((there - t)[:, None] / sigma[t]) ** 2)
        cleaned[t] = (weights * values[there]).sum(axis=0) / weights.sum(axis=0)
    if model.config.bias:
        cleaned[:, columns] -= outputs[:, n:] * std[newest][:, columns]
    return np.where(smoothed, cleaned, values)


def small_checkpoint(motion, **changes):
    """Make an untrained network for the skeleton of a motion."""
    skeleton = motion.skeleton
    constant = ~skeleton.is_cleaned
    constant[np.flatnonzero(skeleton.is_cleaned)[:2]] = True
    config = EBFConfig(int((~constant).sum()), n_code=6, n_hidden=5, n_layers=2, **changes)
    network = build_network(config, seed=1)
    with torch.no_grad():
        for values in network.parameters():
            values.mul_(3)  # else all widths are the same
    widths = np.full(skeleton.n_channels, 0.03)
    info = {"train": {"clips": {}}}
    labels = skeleton.channel_labels
    return Checkpoint(network.eval(), constant, labels, motion.frame_time, 0.03, widths, info)


# What a stream answers is what the whole clip gives, under the same look-ahead.


@pytest.mark.parametrize("look_ahead", LOOK_AHEADS)
def test_ebf_stream_equals_offline(noisy, look_ahead):
    checkpoint = shipped_checkpoint("ebf")
    live = LiveEBF(checkpoint, look_ahead / 120)
    for motion in noisy:
        streamed = stream_motion(motion, live)
        offline = clean_offline(motion, checkpoint, look_ahead)
        np.testing.assert_allclose(streamed.channels, offline, atol=1e-5)
        assert not np.allclose(streamed.channels, motion.channels, atol=1)


@pytest.mark.parametrize("case", range(8))
def test_any_ebf_equals_offline(embedded, case):
    rng = np.random.default_rng(case)
    look_ahead, n_frames, first = rng.integers((0, 1, 0), (16, 40, 99)).tolist()
    encoder, bias = case % 2 == 0, case % 4 < 2
    motion = embedded["walk_02"].slice_frames(first, first + n_frames)
    motion = corrupt(motion, "angular:0.5", rng=rng).observed
    checkpoint = small_checkpoint(motion, encoder=encoder, bias=bias)
    streamed = stream_motion(motion, LiveEBF(checkpoint, look_ahead / 120))
    offline = clean_offline(make_continuous(motion), checkpoint, look_ahead)
    np.testing.assert_allclose(make_continuous(streamed).channels, offline, atol=1e-5)


def test_with_all_frames_ahead_it_is_torchs_own_lstm():
    with seeded(0):
        lstm = bidirectional_lstm(4, 7, 0.0)
        x = torch.randn(9, 4)
    live, outputs = LiveLSTM(lstm, 8), []
    for frame in x.numpy():
        live.observe(frame)
    outputs = [live.oldest() for _ in x]
    with torch.no_grad():
        np.testing.assert_allclose(outputs, lstm(x[None])[0][0], atol=1e-6)


@pytest.mark.parametrize("look_ahead_s", [0, 0.025, 0.125, 0.5])
def test_gaussian_stream_equals_offline(noisy, look_ahead_s):
    live = LiveGaussian(0.032, look_ahead_s)
    for motion in noisy:
        streamed, joints = stream_motion(motion, live).channels, motion.skeleton.is_cleaned
        offline = live.smooth(
            motion.channels, np.ones_like(motion.channels, bool), motion.frame_time
        )
        np.testing.assert_allclose(streamed[:, joints], offline[:, joints], atol=1e-10)
        assert np.array_equal(streamed[:, ~joints], motion.channels[:, ~joints])


def test_gaussian_that_sees_far_enough_is_the_ordinary_one(noisy):
    values = noisy[0].channels
    whole = gaussian_filter(values, 0.025, 1 / 120)  # 3 frames, so it reaches 12 to each side
    live = LiveGaussian(0.025, 0.1).smooth(values, np.ones_like(values, bool), 1 / 120)
    np.testing.assert_allclose(live[12:-12], whole[12:-12], atol=1e-10)


def test_window_mean_by_hand():
    window = np.array([[1.0, 1.0], [2.0, 5.0], [4.0, 7.0]])
    w = math.exp(-0.5)
    smooth = window_mean(window, 1, np.array([1.0, 0.0]))
    np.testing.assert_allclose(smooth, [(w * 1 + 2 + w * 4) / (1 + 2 * w), 5.0])
    assert window_mean(window, 2, 1.0)[0] == pytest.approx((4 + w * 2 + w**4) / (1 + w + w**4))


def test_answers_depend_on_the_look_ahead_only(noisy):
    motion, look_ahead, t = noisy[0], 5, 30
    changed = motion.channels.copy()
    changed[t + look_ahead + 1 :] += 20
    live = LiveEBF(look_ahead_s=look_ahead / 120)
    before, after = (stream_motion(m, live) for m in (motion, motion.with_channels(changed)))
    assert np.array_equal(before.channels[: t + 1], after.channels[: t + 1])
    assert not np.array_equal(before.channels[t + 1], after.channels[t + 1])


# The delay.


@pytest.mark.parametrize("look_ahead", LOOK_AHEADS)
def test_the_stated_latency_is_kept(noisy, look_ahead):
    motion = noisy[0]
    live = LiveGaussian(0.0, look_ahead / 120)  # changes nothing: each frame comes back
    stream = Stream(motion.skeleton, motion.frame_time, live)
    assert stream.latency_s == pytest.approx(look_ahead * motion.frame_time)
    for t, frame in enumerate(motion.channels):
        answer = stream.push(frame)
        if t < look_ahead:
            assert answer is None
        else:
            assert np.array_equal(answer, motion.channels[t - look_ahead])
    rest = stream.flush()
    assert np.array_equal(rest, motion.channels[motion.n_frames - look_ahead :])


def test_look_ahead_is_rounded_to_frames(walk):
    stream = Stream(walk.skeleton, walk.frame_time, LiveGaussian(0.03, 0.051))
    assert stream.latency_s == pytest.approx(6 * walk.frame_time)


def test_default_look_ahead_is_that_of_the_paper(walk):
    for live in (LiveEBF(), LiveGaussian(0.03)):
        stream = Stream(walk.skeleton, walk.frame_time, live)
        assert stream.latency_s == pytest.approx(15 * walk.frame_time)


def test_a_stream_shorter_than_the_look_ahead(noisy):
    stream = Stream(noisy[0].skeleton, 1 / 120, LiveEBF())
    assert stream.push(noisy[0].channels[0]) is None
    assert stream.flush().shape == (1, 96)
    assert Stream(noisy[0].skeleton, 1 / 120, LiveEBF()).flush().shape == (0, 96)


# Angles.


def spoil(motion, rng):
    """Wrap all angles, and move some frames to the other Euler triple."""
    channels = motion.channels.copy()
    for joint in range(1, motion.skeleton.n_joints):
        columns = np.flatnonzero(motion.skeleton.channel_joint == joint)
        if len(columns) == 3:
            order = "".join(motion.skeleton.channel_kind[c][0] for c in columns)
            frames = rng.random(motion.n_frames) < 0.08
            frames[:10] = False  # a stream must see first that the joint does not tremble
            other = alternate_euler(channels[:, columns], order)
            channels[:, columns] = np.where(frames[:, None], other, channels[:, columns])
    angles = motion.skeleton.is_rotation
    channels[:, angles] = wrap_degrees(channels[:, angles])
    return motion.with_channels(channels)


@pytest.mark.parametrize("with_gaps", [False, True])
@pytest.mark.parametrize("name", ["walk_01", "kick_02", "run_03", "small"])
def test_continuity_is_that_of_the_whole_clip(embedded, small_motion, name, with_gaps):
    rng = np.random.default_rng(3)
    motion = small_motion if name == "small" else embedded[name].slice_frames(0, 80)
    spoiled = spoil(motion, rng)
    if with_gaps:
        channels = np.where(rng.random(spoiled.channels.shape) < 0.05, np.nan, spoiled.channels)
        channels[0] = spoiled.channels[0]
        spoiled = spoiled.with_channels(channels)
    follow = ContinuousAngles(motion.skeleton)
    continuous, sign, offset = (
        np.array(x) for x in zip(*map(follow.push, spoiled.channels), strict=True)
    )
    expected = make_continuous(spoiled).channels
    seen = ~np.isnan(expected)
    np.testing.assert_allclose(continuous[seen], expected[seen], atol=1e-9)
    np.testing.assert_allclose((sign * (continuous - offset))[seen], spoiled.channels[seen])
    expected_sign, expected_offset = motion_continuity(spoiled)
    np.testing.assert_allclose(sign[seen], expected_sign[seen])
    np.testing.assert_allclose(offset[seen], expected_offset[seen])
    held = ~seen[1:]
    np.testing.assert_allclose(continuous[1:][held], continuous[:-1][held])


def test_trembling_joints_are_left_as_they_come(embedded):
    rng = np.random.default_rng(0)
    motion = embedded["walk_01"].slice_frames(0, 60)
    channels = motion.channels.copy()
    arm = motion.skeleton.channel_index("LeftArm.Zrotation")
    channels[:, arm] = rng.uniform(-300, 300, 60)
    follow = ContinuousAngles(motion.skeleton)
    continuous = np.array([follow.push(frame)[0] for frame in channels])
    expected = make_continuous(motion.with_channels(channels)).channels
    np.testing.assert_allclose(continuous[8:], expected[8:], atol=1e-9)
    assert np.array_equal(continuous[8:, arm], channels[8:, arm])


def test_the_file_keeps_its_own_branch(noisy):
    motion = noisy[0]
    spoiled = spoil(motion, np.random.default_rng(5))
    live = LiveGaussian(0.02)
    sign, offset = motion_continuity(spoiled)
    continuous = stream_motion(spoiled.with_channels(sign * spoiled.channels + offset), live)
    expected = sign * (continuous.channels - offset)
    np.testing.assert_allclose(stream_motion(spoiled, live).channels, expected, atol=1e-9)
    assert np.abs(offset).max() >= 180


def test_root_velocity_is_that_of_the_clip_one_frame_later(walk, small_motion):
    for motion in (walk.slice_frames(0, 50), small_motion):
        velocity = RootVelocity(motion.skeleton, motion.frame_time)
        streamed = np.array([velocity.push(frame) for frame in motion.channels])
        expected = root_angular_velocity(motion)
        np.testing.assert_allclose(streamed[1:], expected[:-1], atol=1e-9)
        np.testing.assert_allclose(streamed[0], np.zeros(3), atol=1e-9)


def test_running_scale_is_numpys():
    values = np.random.default_rng(0).normal(1e4, 3, (50, 4))
    scale = RunningScale(4)
    for n, frame in enumerate(values, start=1):
        scale.add(frame)
        np.testing.assert_allclose(scale.mean, values[:n].mean(axis=0))
        np.testing.assert_allclose(scale.std, values[:n].std(axis=0), atol=1e-9)


def test_root_and_still_channels_come_back_exactly(noisy):
    motion = noisy[0]
    channels = motion.channels.copy()
    still = motion.skeleton.channel_index("RightForeArm.Yrotation")
    channels[:, still] = 1 / 3
    streamed = stream_motion(motion.with_channels(channels), LiveEBF()).channels
    assert np.array_equal(streamed[:, still], channels[:, still])
    root = ~motion.skeleton.is_cleaned
    assert np.array_equal(streamed[:, root], channels[:, root])


# Bad input.


@pytest.fixture
def stream(walk):
    return Stream(walk.skeleton, walk.frame_time, LiveGaussian(0.03, 0.0))


@pytest.mark.parametrize(
    ("spoil_frame", "words"),
    [
        (lambda f: f[:-1], r"frame 1: expected 96 channels .*got shape \(95,\)"),
        (lambda f: f[None], r"got shape \(1, 96\)"),
        (lambda f: np.where(np.arange(96) == 7, np.inf, f), r"frame 1: infinite in \S+rotation$"),
        (lambda f: np.where(np.arange(96) == 7, np.nan, f), r"frame 1: not observed.*hold_gaps"),
        (lambda f: np.where(np.arange(96) > 3, np.nan, f), "and 88 more"),
        (lambda f: ["a"] * 96, "could not convert"),
    ],
)
def test_a_bad_frame_is_refused_and_changes_nothing(stream, walk, spoil_frame, words):
    twin = Stream(walk.skeleton, walk.frame_time, LiveGaussian(0.03, 0.0))
    for each in (stream, twin):
        each.push(walk.channels[0])
    with pytest.raises(ValueError, match=words):
        stream.push(spoil_frame(walk.channels[1]))
    assert np.array_equal(stream.push(walk.channels[1]), twin.push(walk.channels[1]))


def test_infinity_is_refused_even_where_gaps_are_held(walk):
    stream = Stream(walk.skeleton, walk.frame_time, LiveGaussian(0.03), hold_gaps=True)
    with pytest.raises(ValueError, match="infinite"):
        stream.push(np.full(96, np.inf))


def test_gaps_hold_the_last_value_and_are_counted(walk):
    stream = Stream(walk.skeleton, walk.frame_time, LiveGaussian(0.0, 0.0), hold_gaps=True)
    arm = walk.skeleton.channel_index("LeftArm.Zrotation")
    root = walk.skeleton.channel_index("Hips.Yposition")
    frames = walk.channels[:4].copy()
    frames[0, arm] = np.nan  # never seen yet: at rest
    frames[2:, [arm, root]] = np.nan
    answers = np.array([stream.push(frame) for frame in frames])
    assert answers[:, arm].tolist() == [0.0, *[frames[1, arm]] * 3]
    assert answers[:, root].tolist() == [frames[0, root], *[frames[1, root]] * 3]
    assert stream.n_held[arm] == 3
    assert stream.n_held[root] == 2
    assert stream.n_held.sum() == 5


def test_an_ended_stream_takes_nothing_more(stream, walk):
    stream.push(walk.channels[0])
    stream.flush()
    with pytest.raises(ValueError, match="ended"):
        stream.push(walk.channels[1])
    with pytest.raises(ValueError, match="ended already"):
        stream.flush()


def test_another_skeleton_or_rate_is_refused(walk, small_motion):
    with pytest.raises(ValueError, match="stream: the model was trained for another skeleton"):
        Stream(small_motion.skeleton, 1 / 120, LiveEBF())
    with pytest.raises(ValueError, match="120 frames per second"):
        Stream(walk.skeleton, 1 / 60, LiveEBF())
    with pytest.raises(ValueError, match="one for each of the 96 channels"):
        Stream(walk.skeleton, 1 / 120, LiveGaussian(np.full(5, 0.03)))


@pytest.mark.parametrize("look_ahead_s", [-0.01, np.inf, np.nan])
def test_impossible_look_aheads_are_refused(walk, look_ahead_s):
    for live in (LiveEBF(look_ahead_s=look_ahead_s), LiveGaussian(0.03, look_ahead_s)):
        with pytest.raises(ValueError, match="0 or more seconds"):
            Stream(walk.skeleton, walk.frame_time, live)


def test_the_network_looks_no_further_than_its_filter(walk):
    with pytest.raises(ValueError, match=r"reaches 0.125 s ahead"):
        Stream(walk.skeleton, walk.frame_time, LiveEBF(look_ahead_s=16 / 120))


@pytest.mark.parametrize("frame_time", [0, -1, np.nan, np.inf])
def test_impossible_frame_times_are_refused(walk, frame_time):
    with pytest.raises(ValueError, match="frame_time must be above 0"):
        Stream(walk.skeleton, frame_time, LiveGaussian(0.03))


@pytest.mark.parametrize("sigma_s", [-0.1, np.nan, [0.1, np.inf]])
def test_impossible_widths_are_refused(sigma_s):
    with pytest.raises(ValueError, match="0 or more seconds"):
        LiveGaussian(sigma_s)


def test_other_networks_are_refused(walk, tmp_path):
    with pytest.raises(ValueError, match="got Blend"):
        LiveEBF(shipped_checkpoint("blend"))
    with pytest.raises(ValueError, match="Gaussian filters, got EBF"):
        LiveEBF(small_checkpoint(walk, kernel="free"))
    with pytest.raises(FileNotFoundError, match="no such model file"):
        LiveEBF(tmp_path / "none.safetensors")
    save_checkpoint(small_checkpoint(walk), tmp_path / "mine.safetensors")
    assert LiveEBF(tmp_path / "mine.safetensors").checkpoint.model.config.n_hidden == 5
