"""Recipes: how corruptions are named, joined and refused."""

import numpy as np
import pytest

from mocaplab.corruption import CORRUPTIONS, corrupt, parse_recipe, snr_db
from mocaplab.gaps import gap_mask
from mocaplab.motion import Corrupted, moving_channels
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


@pytest.mark.parametrize("name", CORRUPTIONS)
def test_every_corruption_by_its_default(walk, name):
    corrupted, again = (corrupt(walk, name, rng=np.random.default_rng(5)) for _ in range(2))
    observed = corrupted.observed.channels
    np.testing.assert_array_equal(observed, again.observed.channels)
    still = ~walk.skeleton.is_cleaned
    np.testing.assert_array_equal(observed[:, still], corrupted.clean.channels[:, still])
    constant = ~moving_channels(walk)
    same = (observed == corrupted.clean.channels) | np.isnan(observed)
    assert same[:, constant].all()
    assert not np.array_equal(observed, walk.channels)
    assert CORRUPTIONS[name].name == name
    with pytest.raises(ValueError, match=r"must lie|must last"):
        corrupt(walk, f"{name}:-1", rng=np.random.default_rng(0))
    with pytest.raises(ValueError, match=r"must lie|must last"):
        corrupt(walk, f"{name}:nan", rng=np.random.default_rng(0))


@pytest.mark.parametrize("name", CORRUPTIONS)
def test_every_corruption_takes_a_motion_with_gaps(walk, name):
    alone = corrupt(walk, "gaps:0.01", rng=np.random.default_rng(0))
    after = corrupt(walk, f"gaps:0.01+{name}", rng=np.random.default_rng(0))
    assert not alone.mask.all()
    assert after.mask.mean() < 0.9
    assert after.mask.mean() > 0.5


@pytest.mark.parametrize(("k", "decibels"), [(0.1, 20.0), (0.5, 6.02), (0.9, 0.915)])
def test_signal_to_noise_ratio_of_k_noise(walk, k, decibels):
    corrupted = corrupt(walk, f"angular:{k}", rng=np.random.default_rng(0))
    assert snr_db(corrupted) == pytest.approx(decibels, abs=0.15)
    with_gaps = corrupt(walk, f"angular:{k}+gaps:0.01", rng=np.random.default_rng(0))
    assert snr_db(with_gaps) == pytest.approx(decibels, abs=0.3)


def test_signal_to_noise_ratio_at_its_ends(walk):
    assert snr_db(corrupt(walk, "gaps", rng=np.random.default_rng(0))) == np.inf
    hidden = np.where(walk.skeleton.is_cleaned, np.nan, walk.channels)
    nothing = Corrupted(walk, walk.with_channels(hidden), ~np.isnan(hidden))
    assert np.isnan(snr_db(nothing))
