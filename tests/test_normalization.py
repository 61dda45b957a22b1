"""Every clip is measured by itself, and constant channels become 0."""

import numpy as np
import pytest

from mocaplab.normalization import constant_channels, standardize


def test_standardized_channels_have_mean_0_and_deviation_1(walk):
    mean, std = walk.channels.mean(axis=0), walk.channels.std(axis=0)
    result = standardize(walk.channels, mean, std)
    moving = ~constant_channels([walk])
    np.testing.assert_allclose(result[:, moving].mean(axis=0), 0, atol=1e-9)
    np.testing.assert_allclose(result[:, moving].std(axis=0), 1)
    assert (result[:, ~moving] == 0).all()


def test_the_trembling_of_a_constant_channel_is_not_blown_up():
    channels = 1e-7 * np.random.default_rng(0).normal(size=(50, 1))
    assert (standardize(channels, channels.mean(axis=0), channels.std(axis=0)) == 0).all()


def test_a_channel_that_moves_in_one_clip_is_not_constant(walk):
    still = walk.with_channels(np.zeros_like(walk.channels))
    assert constant_channels([still]).all()
    np.testing.assert_array_equal(constant_channels([still, walk]), constant_channels([walk]))
    with pytest.raises(ValueError, match="got none"):
        constant_channels([])
