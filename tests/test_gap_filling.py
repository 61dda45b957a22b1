"""Filling gaps one channel at a time."""

import numpy as np
import pytest

from mocaplab.gap_filling import lerp_gaps


def test_lerp_draws_straight_lines_and_holds_at_the_ends(walk):
    channels = walk.channels.copy()
    column = walk.skeleton.channel_index("LeftLeg.Xrotation")
    channels[:3, column] = np.nan
    channels[10:14, column] = np.nan
    filled = lerp_gaps(walk.with_channels(channels)).channels[:, column]
    line = np.linspace(walk.channels[9, column], walk.channels[14, column], 6)
    np.testing.assert_allclose(filled[9:15], line)
    np.testing.assert_array_equal(filled[:3], walk.channels[3, column])


def test_lerp_names_a_channel_that_was_never_observed(walk):
    channels = walk.channels.copy()
    channels[:, walk.skeleton.channel_index("LeftLeg.Xrotation")] = np.nan
    with pytest.raises(ValueError, match=r"LeftLeg\.Xrotation was never observed"):
        lerp_gaps(walk.with_channels(channels))
