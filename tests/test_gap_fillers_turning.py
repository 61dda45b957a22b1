"""Channels that turn round are filled by straight lines: no pose tells how many turns they made."""

import numpy as np
import pytest

from mocaplab.gap_fillers.curves import lerp_gaps
from mocaplab.gap_fillers.files import shipped_filler
from mocaplab.gap_fillers.filled import lines_std
from mocaplab.gap_fillers.lowrank import lowrank_gaps
from mocaplab.gap_fillers.network import NetworkFiller
from mocaplab.gap_fillers.pca import pca_gaps
from mocaplab.gap_fillers.seams import WIDEST_DEG, turns_round
from mocaplab.noise.angular import angular_noise

FILLERS = {
    "PCA": pca_gaps,
    "low rank": lowrank_gaps,
    "EBD": NetworkFiller(),
    "conditional Gaussian": shipped_filler(),
}


@pytest.fixture
def hand(walk):
    return walk.skeleton.channel_index("RightHand.Xrotation")


@pytest.fixture
def spinning(walk, hand):
    """A walk in which one hand turns round twice in the middle of the clip."""
    values = walk.channels.copy()
    values[:, hand] += 720 * np.clip(np.linspace(-0.5, 1.5, len(values)), 0, 1)
    return walk.with_channels(values)


def test_which_channels_turn_round(walk, spinning, hand):
    assert not turns_round(walk.channels).any()
    np.testing.assert_array_equal(np.flatnonzero(turns_round(spinning.channels)), [hand])
    holed = spinning.channels.copy()
    holed[100:140] = np.nan
    np.testing.assert_array_equal(np.flatnonzero(turns_round(holed)), [hand])
    assert turns_round(holed[:, :0]).shape == (0,)


def test_neither_spikes_nor_noise_are_turns(walk, hand):
    values = angular_noise(walk, 1.0, rng=np.random.default_rng(0)).channels.copy()
    values[::30, hand] += 2 * WIDEST_DEG
    assert not turns_round(values).any()


@pytest.mark.parametrize("name", FILLERS)
def test_turns_are_filled_by_lines_and_the_rest_by_the_pose(spinning, hand, name):
    knee = spinning.skeleton.channel_index("LeftLeg.Xrotation")
    values = spinning.channels.copy()
    values[200:260, [hand, knee]] = np.nan
    holed = spinning.with_channels(values)
    filled, lines = FILLERS[name](holed).channels, lerp_gaps(holed).channels
    np.testing.assert_allclose(filled[:, hand], lines[:, hand], atol=1e-9)
    assert np.abs(filled - lines)[200:260, knee].max() > 1


@pytest.mark.parametrize("name", FILLERS)
def test_with_noise_the_line_is_between_means_of_the_ends(spinning, hand, name):
    """One noisy sample at each end decides over the straight line of the other fillers."""
    errors = {"here": [], "lerp": []}
    for seed in range(8):
        noisy = angular_noise(spinning, 0.5, rng=np.random.default_rng(seed))
        values = noisy.channels.copy()
        values[200:260, hand] = np.nan
        holed = noisy.with_channels(values)
        for way, fill in (("here", FILLERS[name]), ("lerp", lerp_gaps)):
            errors[way].append((fill(holed).channels - spinning.channels)[200:260, hand])
    here, lerp = (np.sqrt(np.mean(np.square(errors[way]))) for way in ("here", "lerp"))
    assert here < 0.5 * lerp


@pytest.mark.parametrize("name", ["EBD", "conditional Gaussian"])
def test_the_expected_error_is_that_of_lines(spinning, hand, name):
    values = spinning.channels.copy()
    values[200:260, hand] = np.nan
    holed = spinning.with_channels(values)
    std = FILLERS[name].fill(holed).std_deg
    np.testing.assert_array_equal(std, lines_std(holed))
