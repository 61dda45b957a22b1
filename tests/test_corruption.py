"""Recipes: how corruptions are named, joined and refused."""

import numpy as np
import pytest

from mocaplab.corruption import CORRUPTIONS, corrupt, parse_recipe
from mocaplab.gaps import gap_mask
from mocaplab.noise import angular_noise


def test_steps_are_applied_in_order_and_draw_from_one_generator(walk):
    corrupted = corrupt(walk, "angular:0.5+gaps:0.002", rng=np.random.default_rng(0))
    rng = np.random.default_rng(0)
    noisy = angular_noise(walk, 0.5, rng=rng)
    mask = gap_mask(noisy, 0.002, rng=rng)
    np.testing.assert_array_equal(corrupted.mask, mask)
    np.testing.assert_array_equal(corrupted.observed.channels[mask], noisy.channels[mask])
    assert np.isnan(corrupted.observed.channels[~mask]).all()
    assert not corrupted.mask.all()


@pytest.mark.parametrize(
    ("recipe", "steps"),
    [
        ("angular:0.5", [("angular", 0.5)]),
        ("0.3", [("angular", 0.3)]),
        ("gaps", [("gaps", 0.001)]),
        (" angular:1e-2 + gaps:0.01", [("angular", 0.01), ("gaps", 0.01)]),
    ],
)
def test_recipes(recipe, steps):
    assert parse_recipe(recipe) == [(CORRUPTIONS[name], amount) for name, amount in steps]


@pytest.mark.parametrize(
    ("recipe", "message"),
    [
        ("anguler:0.5", "got 'anguler:0.5'; the nearest names are angular"),
        ("", "got ''; the nearest names are"),
        ("angular:0.5+", "got ''; the nearest names are"),
        ("angular:much", "expected a number after 'angular', got 'much'"),
        ("angular:", "expected a number after 'angular', got ''"),
        ("angular:-0.1", r"k must lie in \[0, 100\], got -0.1"),
        ("nan", r"k must lie in \[0, 100\], got nan"),
        ("angular:1000", r"k must lie in \[0, 100\], got 1000"),
        ("gaps:1.5", r"gap probability must lie in \[0, 1\], got 1.5"),
    ],
)
def test_nonsense_is_refused(walk, recipe, message):
    with pytest.raises(ValueError, match=message):
        corrupt(walk, recipe, rng=np.random.default_rng(0))


def test_a_clip_with_gaps_is_not_clean(walk):
    channels = walk.channels.copy()
    channels[5, walk.skeleton.channel_index("LeftLeg.Xrotation")] = np.nan
    with pytest.raises(ValueError, match=r"got a gap in LeftLeg\.Xrotation in frame 5"):
        corrupt(walk.with_channels(channels), rng=np.random.default_rng(0))
