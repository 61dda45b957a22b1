"""Training pieces: the right frames, noise, speeds and margins."""

import numpy as np
import pytest

from mocaplab.learning.batches import Windows
from mocaplab.measures.movement import root_angular_velocity
from mocaplab.motion import moving_channels
from mocaplab.noise.angular import angular_noise


def test_pieces_are_where_they_say(walk):
    windows = Windows([walk], n_frames=50, margin=10)
    moving = moving_channels(walk)
    for batch in windows.batches(8, (0.0, 0.0), rng=np.random.default_rng(0)):
        np.testing.assert_array_equal(batch.observed, batch.clean)
        np.testing.assert_allclose(batch.std[0, 0], walk.channels.std(axis=0) * moving)
        np.testing.assert_allclose(batch.mean[0, 0], walk.channels.mean(axis=0))
        for piece, weight in zip(batch.clean, batch.weight, strict=True):
            start = np.flatnonzero((walk.channels == piece[0]).all(axis=1))[0]
            np.testing.assert_array_equal(piece, walk.channels[start : start + 50])
            assert weight[:10].any() == (start == 0)
            assert weight[-10:].any() == (start + 50 == walk.n_frames)
            assert weight[10:-10].all()


def test_a_piece_at_another_speed_is_the_clip_played_so(walk):
    windows = Windows([walk], n_frames=60, margin=10)
    batch = next(windows.batches(4, (0.3, 0.3), (1.5, 1.5), rng=np.random.default_rng(0)))
    velocity = root_angular_velocity(walk)
    # Where the piece starts is not told: it is where its first frame fits best.
    for piece, turning in zip(batch.clean, batch.root_velocity, strict=True):
        starts = np.linspace(0, walk.n_frames - 1 - 59 * 1.5, 4000)
        column = walk.skeleton.channel_index("LeftLeg.Xrotation")
        frames = np.arange(walk.n_frames)
        times = starts[:, None] + 1.5 * np.arange(60)
        played = np.interp(times, frames, walk.channels[:, column])
        best = np.argmin(np.abs(played - piece[:, column]).sum(axis=1))
        np.testing.assert_allclose(played[best], piece[:, column], atol=0.3)
        for axis in range(3):
            expected = 1.5 * np.interp(times[best], frames, velocity[:, axis])
            np.testing.assert_allclose(turning[:, axis], expected, atol=0.05)


def test_pieces_are_measured_as_the_cleaner_measures_a_clip(walk):
    """The deviation that training assumes is that of the noisy clip."""
    windows = Windows([walk], n_frames=60, margin=10)
    batch = next(windows.batches(1, (0.7, 0.7), rng=np.random.default_rng(0)))
    noisy = angular_noise(walk, 0.7, rng=np.random.default_rng(1)).channels
    moving = moving_channels(walk)
    np.testing.assert_allclose(batch.std[0, 0, moving], noisy.std(axis=0)[moving], rtol=0.1)


def test_noise_of_pieces_lies_in_the_range(walk):
    windows = Windows([walk], n_frames=100, margin=10)
    batch = next(windows.batches(64, (0.4, 0.6), rng=np.random.default_rng(0)))
    scale = windows.scales[0]
    relative = (batch.observed - batch.clean)[..., scale > 0] / scale[scale > 0]
    per_piece = relative.std(axis=(1, 2))
    assert 0.38 < per_piece.min() < 0.43
    assert 0.57 < per_piece.max() < 0.62


def test_short_clips_are_played_back_and_forth(walk):
    windows = Windows([walk.slice_frames(0, 30)], n_frames=50, margin=10)
    batch = next(windows.batches(2, (0.0, 0.0), rng=np.random.default_rng(0)))
    np.testing.assert_array_equal(batch.clean[0, 30:], walk.channels[29:9:-1])
    with pytest.raises(ValueError, match="all margin"):
        Windows([walk], n_frames=20, margin=10)


def test_gaps_are_closed_by_straight_lines(walk):
    windows = Windows([walk], 120, 15)
    rng = np.random.default_rng(0)
    batch = next(windows.batches(2, (0.0, 0.0), gaps=(0.01, 0.1), rng=rng))
    assert not batch.counted[:, [0, -1]].any()
    assert not np.isnan(batch.observed).any()
    outside = ~batch.counted
    np.testing.assert_array_equal(batch.observed[outside], batch.clean[outside])
    piece, column = 1, int(np.argmax(batch.counted[1].sum(axis=0)))
    hidden = batch.counted[piece, :, column]
    frames = np.arange(120)
    expected = np.interp(frames[hidden], frames[~hidden], batch.clean[piece, ~hidden, column])
    np.testing.assert_allclose(batch.observed[piece, hidden, column], expected, atol=1e-12)


def test_the_shares_of_a_batch_are_the_batch(walk):
    batch = next(Windows([walk], 60, 15).batches(5, (0.5, 0.5), rng=np.random.default_rng(0)))
    parts = [batch.share(i, 2) for i in range(2)]
    assert [len(part.clean) for part in parts] == [3, 2]
    np.testing.assert_array_equal(parts[1].observed, batch.observed[1::2])


def test_gaps_of_every_second_piece_are_those_of_whole_joints(walk):
    windows = Windows([walk], 120, 15)
    batch = next(windows.batches(4, (0.0, 0.0), gaps=(0.01, 0.1), rng=np.random.default_rng(0)))
    moving = moving_channels(walk)
    joint = walk.skeleton.channel_joint
    together = []
    for number in np.unique(joint[moving]):
        of_joint = batch.counted[..., moving & (joint == number)]
        together.append((of_joint.all(axis=-1) == of_joint.any(axis=-1)).all(axis=1))
    assert np.all(together, axis=0).tolist() == [True, False, True, False]


def test_joints_jump_for_a_while(walk):
    windows = Windows([walk], 100, 10)
    windows.jump_share[:] = 0.1
    still, jumping = (
        next(windows.batches(64, (0.0, 0.0), jump_rate=rate, rng=np.random.default_rng(0)))
        for rate in (0.0, 2.0)
    )
    moving = moving_channels(walk)
    jump = jumping.clean - still.clean  # (B, T, C)
    np.testing.assert_array_equal(jump[..., ~moving], 0)
    scale = still.std[0, 0]
    size = np.abs(jump).max(axis=1)  # (B, C)
    happened = size > 0
    assert 0.1 < happened[:, moving].mean() < 0.3
    times = (size / np.where(moving, scale, 1))[happened]
    assert times.min() >= 1 - 1e-9
    assert times.max() <= 20 + 1e-9
    # It lasts for one run of frames, the same for all that jump in a piece.
    for of_piece, channels in zip(jump, happened, strict=True):
        inside = np.abs(of_piece[:, channels]) > 0
        assert (inside == inside[:, :1]).all()
        assert (np.diff(inside[:, :1].astype(int), axis=0) != 0).sum() <= 2
        level = np.abs(of_piece[:, channels]).max(axis=0, initial=0.0)
        np.testing.assert_allclose(np.abs(of_piece[:, channels]), inside * level, rtol=1e-9)


def test_joints_jump_as_often_as_in_the_clips(walk):
    """One of four clips has a joint that turns round within a frame; so does the root."""
    skeleton = walk.skeleton
    wild = int(np.flatnonzero(skeleton.is_cleaned & moving_channels(walk))[0])
    of_joint = skeleton.channel_joint == skeleton.channel_joint[wild]
    turned = walk.channels.copy()
    turned[50:, wild] += 91.0
    turned[50:, ~skeleton.is_cleaned] += 1000.0
    windows = Windows([walk, walk, walk, walk.with_channels(turned)], 100, 10)
    np.testing.assert_array_equal(windows.jump_share, 0.25 * of_joint)
    still, jumping = (
        next(windows.batches(400, (0.0, 0.0), jump_rate=rate, rng=np.random.default_rng(0)))
        for rate in (0.0, 2.0)
    )
    happened = (jumping.std != still.std)[:, 0]  # (B, C)
    assert not happened[:, ~of_joint].any()
    assert 0.4 < happened[:, wild].mean() < 0.6


def test_after_a_jump_mean_and_deviation_are_those_of_the_clip_with_it(walk):
    """Of a clip that spends a share s of its time a step A away, and the rest as before."""
    windows = Windows([walk], 100, 10)
    windows.jump_share[:] = 0.1
    still, jumping = (
        next(windows.batches(64, (0.5, 0.5), jump_rate=rate, rng=np.random.default_rng(0)))
        for rate in (0.0, 2.0)
    )
    step = (jumping.clean - still.clean).sum(axis=1) / np.maximum(
        (jumping.clean != still.clean).sum(axis=1), 1
    )
    happened = step != 0
    shift = (jumping.mean - still.mean)[:, 0]
    share = shift[happened] / step[happened]
    assert share.min() >= 0.01 - 1e-9
    assert share.max() <= 0.5 + 1e-9
    noisy = 1 + 0.5**2
    variance = (still.std[:, 0] ** 2 / noisy)[happened]
    # The variance within the two levels, and that between them.
    levels = np.stack([np.zeros_like(share), step[happened]])
    weights = np.stack([1 - share, share])
    between = (weights * (levels - (weights * levels).sum(axis=0)) ** 2).sum(axis=0)
    np.testing.assert_allclose((jumping.std[:, 0] ** 2)[happened] / noisy, variance + between)
    # The noise grows with the deviation.
    noise = (jumping.observed - jumping.clean).std(axis=1)[happened]
    expected = 0.5 * np.sqrt(variance + between)
    assert abs(np.mean(noise / expected) - 1) < 0.01
