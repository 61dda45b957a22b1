"""What no pose can tell is filled by straight lines."""

import numpy as np
import pytest

from mocaplab.gap_fillers.curves import lerp_gaps
from mocaplab.gap_fillers.lowrank import lowrank_gaps
from mocaplab.gap_fillers.network import NetworkFiller
from mocaplab.gap_fillers.pca import pca_gaps
from mocaplab.gap_fillers.pose_channels import WIDEST_DEG, pose_channels
from mocaplab.motion import moving_channels
from mocaplab.noise.angular import angular_noise


def spinning(walk, channel):
    """Let a channel turn round twice in the middle of the clip."""
    values = walk.channels.copy()
    values[:, channel] += 720 * np.clip(np.linspace(-0.5, 1.5, len(values)), 0, 1)
    return walk.with_channels(values)


@pytest.fixture
def hand(walk):
    return walk.skeleton.channel_index("RightHand.Xrotation")


def test_a_channel_that_turns_round_is_left_out(walk, hand):
    expected = moving_channels(walk)
    np.testing.assert_array_equal(pose_channels(walk), expected)
    expected[hand] = False
    np.testing.assert_array_equal(pose_channels(spinning(walk, hand)), expected)


def test_neither_spikes_nor_noise_are_turns(walk, hand):
    noisy = angular_noise(walk, 1.0, rng=np.random.default_rng(0))
    values = noisy.channels.copy()
    values[::30, hand] += 2 * WIDEST_DEG
    spiky = walk.with_channels(values)
    np.testing.assert_array_equal(pose_channels(spiky), moving_channels(spiky))


def test_gaps_in_all_channels_and_channels_never_observed(walk, hand):
    values = spinning(walk, hand).channels.copy()
    values[:, 30] = np.nan
    values[100:140] = np.nan
    chosen = pose_channels(walk.with_channels(values))
    assert not chosen[[hand, 30]].any()
    assert chosen.any()
    values[:] = np.nan
    assert not pose_channels(walk.with_channels(values)).any()


@pytest.mark.parametrize("fill", [pca_gaps, lowrank_gaps, NetworkFiller()])
def test_turns_are_filled_by_lines_and_the_rest_by_the_pose(walk, hand, fill):
    knee = walk.skeleton.channel_index("LeftLeg.Xrotation")
    values = spinning(walk, hand).channels.copy()
    values[200:260, [hand, knee]] = np.nan
    holed = walk.with_channels(values)
    filled, lines = fill(holed).channels, lerp_gaps(holed).channels
    np.testing.assert_array_equal(filled[:, hand], lines[:, hand])
    assert np.abs(filled - lines)[200:260, knee].max() > 1
