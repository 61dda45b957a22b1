"""Gaps."""

import numpy as np
import pytest

from mocaplab.files import FormatError
from mocaplab.motion import Motion, moving_channels
from mocaplab.noise.gaps import (
    draw_runs,
    gap_mask,
    hidden_share,
    hide,
    load_gaps,
    long_gap_mask,
    save_gaps,
)


def test_gaps_hide_the_share_that_theory_says(walk):
    # A sample is seen if no gap that started m frames before it is longer than m.
    p, mean = 0.002, 15.0
    mask = gap_mask(walk, p, mean * walk.frame_time, rng=np.random.default_rng(0))
    survival = (1 - 1 / mean) ** np.arange(walk.n_frames)
    per_frame = 1 - np.exp(np.cumsum(np.log1p(-p * survival)))
    expected = per_frame[1:-1].sum() / walk.n_frames
    hidden = 1 - mask[:, walk.skeleton.is_cleaned].mean()
    assert hidden == pytest.approx(expected, rel=0.25)
    assert mask[:, ~walk.skeleton.is_cleaned].all()
    assert mask[[0, -1]].all()


@pytest.mark.parametrize("fps", [30, 60, 120])
def test_the_hidden_share_does_not_depend_on_the_frame_rate(walk, fps):
    channels = np.zeros((fps * 200, walk.skeleton.n_channels))
    motion = Motion(walk.skeleton, 1 / fps, channels)
    mask = gap_mask(motion, 0.001, rng=np.random.default_rng(0))
    # Few gaps overlap: 0.12 start a second, each 0.125 s long.
    hidden = 1 - mask[:, walk.skeleton.is_cleaned].mean()
    assert hidden == pytest.approx(1 - np.exp(-0.12 * 0.125), rel=0.08)


def test_a_gap_that_starts_within_another_may_end_after_it():
    class Draws:
        """A random generator that was told what to draw."""

        def random(self, shape):
            starts = np.ones(shape)
            starts[[2, 3, 8]] = 0
            return starts

        def geometric(self, p, size):
            assert p == pytest.approx(1 / 3)
            lengths = np.full(size, 99)
            lengths[[2, 3, 8]] = [[3], [4], [1]]
            return lengths

    runs = draw_runs((10, 1), 1 / 120, 0.5, 3 / 120, Draws())
    assert np.flatnonzero(runs).tolist() == [2, 3, 4, 5, 6, 8]


def test_lengths_are_geometric_and_at_least_a_frame():
    runs = draw_runs((200_000,), 1 / 30, 0.0001, 0.2, np.random.default_rng(0))
    edges = np.diff(runs.astype(int), prepend=0, append=0)
    lengths = np.flatnonzero(edges == -1) - np.flatnonzero(edges == 1)
    assert lengths.mean() == pytest.approx(6, rel=0.1)
    assert lengths.min() == 1
    assert np.mean(lengths > 6) == pytest.approx((5 / 6) ** 6, abs=0.05)
    short = draw_runs((1000,), 1 / 30, 0.01, 0.001, np.random.default_rng(0))
    assert short.any()


def test_whole_joints_are_hidden_together(walk):
    mask = gap_mask(walk, 0.004, whole_joints=True, rng=np.random.default_rng(0))
    joint = walk.skeleton.channel_joint
    for j in range(1, walk.skeleton.n_joints):
        together = mask[:, joint == j]
        assert (together == together[:, :1]).all()
    assert mask[:, joint == 0].all()
    assert (~mask).any()


def test_a_long_gap_in_each_of_three_joints(walk):
    masks = [long_gap_mask(walk, 1.0, rng=np.random.default_rng(s)) for s in range(20)]
    for mask in masks:
        hidden = ~mask[:, moving_channels(walk)]
        joints = set(walk.skeleton.channel_joint[moving_channels(walk)][hidden.any(axis=0)])
        assert len(joints) == 3
        assert set(hidden.sum(axis=0)) == {0, 120}
        edges = np.abs(np.diff(hidden.astype(int), axis=0)).sum(axis=0)
        assert set(edges) == {0, 2}  # one piece
        assert mask[[0, -1]].all()
        assert mask[:, ~walk.skeleton.is_cleaned].all()
    assert len({mask.tobytes() for mask in masks}) == 20


def test_the_longest_gap_that_fits(walk):
    seconds = (walk.n_frames - 2) * walk.frame_time
    mask = long_gap_mask(walk, seconds, n_joints=99, rng=np.random.default_rng(0))
    assert not mask[1:-1, moving_channels(walk)].any()
    with pytest.raises(ValueError, match="'walk_01': expected a gap shorter than the clip, "):
        long_gap_mask(walk, seconds + walk.frame_time, rng=np.random.default_rng(0))
    assert long_gap_mask(walk, 0.0, rng=np.random.default_rng(0)).all()


@pytest.mark.parametrize(
    ("draw", "arguments", "message"),
    [
        (gap_mask, [1.5], r"gap probability must lie in \[0, 1\], got 1.5"),
        (gap_mask, [np.nan], "gap probability"),
        (gap_mask, [0.1, 0.0], "mean gap length must be over 0 seconds, got 0.0"),
        (gap_mask, [0.1, np.inf], "mean gap length"),
        (long_gap_mask, [-1.0], "0 seconds or more"),
        (long_gap_mask, [np.nan], "0 seconds or more"),
        (long_gap_mask, [1e308], "expected a gap shorter than the clip"),
    ],
)
def test_nonsense_is_refused(walk, draw, arguments, message):
    with pytest.raises(ValueError, match=message):
        draw(walk, *arguments, rng=np.random.default_rng(0))


def test_hidden_share_counts_joint_angles(small_motion):
    mask = np.ones(small_motion.channels.shape, dtype=bool)
    mask[10:20, small_motion.skeleton.channel_index("Leg.Xrotation")] = False
    # 10 of 40 frames in 1 of 10 angles
    assert hidden_share(hide(small_motion, mask)) == pytest.approx(0.025)
    assert hidden_share(small_motion) == 0


def test_the_file_of_gaps(small_motion, tmp_path):
    mask = np.ones(small_motion.channels.shape, dtype=bool)
    mask[[3, 5, 6], small_motion.skeleton.channel_index("Leg.Xrotation")] = False
    mask[0:40, small_motion.skeleton.channel_index("Left Arm.Zrotation")] = False
    save_gaps(mask, small_motion.skeleton, tmp_path / "gaps.csv")
    assert (tmp_path / "gaps.csv").read_text() == (
        "channel,first_frame,last_frame\n"
        "Left Arm.Zrotation,0,39\nLeg.Xrotation,3,3\nLeg.Xrotation,5,6\n"
    )
    np.testing.assert_array_equal(load_gaps(tmp_path / "gaps.csv", small_motion), mask)


def test_a_file_written_by_hand(small_motion, tmp_path):
    text = "\ufeffchannel, first_frame, last_frame\r\nLeft Arm, 3, 4\r\n\r\nSpine.Xrotation,0,0\r\n"
    (tmp_path / "gaps.csv").write_bytes(text.encode())
    hidden = ~load_gaps(tmp_path / "gaps.csv", small_motion)
    assert hidden.sum() == 7
    labels = small_motion.skeleton.channel_labels
    assert [labels[c] for c in np.flatnonzero(hidden[3])] == [
        "Left Arm.Yrotation",
        "Left Arm.Xrotation",
        "Left Arm.Zrotation",
    ]
    assert hidden[0, small_motion.skeleton.channel_index("Spine.Xrotation")]


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ([], "gaps.csv:1: expected the head channel,first_frame,last_frame, got ''"),
        (["Leg,3,4"], "gaps.csv:1: expected the head"),
        (["HEAD", "Leg,3"], "gaps.csv:2: expected a channel and two frames, got 'Leg,3'"),
        (["HEAD", "Leg,3,4", "Leg,-3,4"], "gaps.csv:3: expected a channel and two frames"),
        (["HEAD", "Lag,3,4"], "such as Leg, .* got 'Lag'"),
        (["HEAD", "Hips,3,4"], "a joint that is not the root"),
        (["HEAD", "Leg,5,4"], "first_frame <= last_frame <= 39, got 5 and 4"),
        (["HEAD", "Leg,5,40"], "first_frame <= last_frame <= 39, got 5 and 40"),
    ],
)
def test_a_wrong_file_of_gaps(small_motion, tmp_path, lines, message):
    text = "\n".join(lines).replace("HEAD", "channel,first_frame,last_frame")
    (tmp_path / "gaps.csv").write_text(text)
    with pytest.raises(FormatError, match=message):
        load_gaps(tmp_path / "gaps.csv", small_motion)


def test_bytes_that_are_no_text(small_motion, tmp_path):
    (tmp_path / "gaps.csv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(FormatError, match="bytes that are no text"):
        load_gaps(tmp_path / "gaps.csv", small_motion)
