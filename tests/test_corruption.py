"""Recipes: how corruptions are named, joined and refused."""

import numpy as np
import pytest

from mocaplab.bvh import load_bvh, save_bvh
from mocaplab.cli import main
from mocaplab.corruption import CORRUPTIONS, corrupt, parse_recipe, snr_db
from mocaplab.motion import Corrupted, moving_channels
from mocaplab.noise.angular import angular_noise
from mocaplab.noise.gaps import gap_mask, hidden_share, load_gaps

SLOW = ("spatial", "spatial_ends")
"""These solve for the angles, frame by frame, and take no motion with gaps."""


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
    if name in SLOW:
        walk = walk.slice_frames(0, 40)
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


@pytest.mark.parametrize("name", [name for name in CORRUPTIONS if name not in SLOW])
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


@pytest.fixture
def walk_file(walk, tmp_path):
    """A walk whose left arm turns over 180 degrees on the way, as many files have it."""
    channels = walk.channels.round(6)
    channels[50:, walk.skeleton.channel_index("LeftArm.Zrotation")] += 360
    save_bvh(walk.with_channels(channels), tmp_path / "walk.bvh")
    return tmp_path / "walk.bvh"


def test_command_writes_held_values_and_the_list_of_gaps(walk_file, tmp_path, capsys):
    out = tmp_path / "holed.bvh"
    arguments = ["corrupt", str(walk_file), "--noise", "angular:0.2+gaps:0.005", "-o", str(out)]
    assert main([*arguments, "--seed", "3"]) == 0
    clean, written = load_bvh(walk_file), load_bvh(out)
    expected = corrupt(clean, "angular:0.2+gaps:0.005", rng=np.random.default_rng(3))
    mask = load_gaps(tmp_path / "holed.gaps.csv", written)
    np.testing.assert_array_equal(mask, expected.mask)
    arm = clean.skeleton.channel_index("LeftArm.Zrotation")
    turned = expected.observed.channels.copy()
    turned[50:, arm] += 360  # the file's own turn comes back
    np.testing.assert_allclose(written.channels[mask], turned[mask], atol=1e-6)
    frame, channel = np.argwhere(~mask & (np.arange(mask.shape[1]) != arm))[0]
    assert written.channels[frame, channel] == written.channels[frame - 1, channel]
    printed = capsys.readouterr().out
    assert f"hidden    {hidden_share(expected.observed):.2%} of the joint angles" in printed
    assert f"SNR       {snr_db(expected):.1f} dB" in printed
    assert f"wrote     {tmp_path / 'holed.gaps.csv'}" in printed


def test_command_without_gaps_leaves_no_list_that_is_wrong(walk_file, tmp_path):
    out, gaps = tmp_path / "noisy.bvh", tmp_path / "noisy.gaps.csv"
    assert main(["corrupt", str(walk_file), "-o", str(out)]) == 0
    assert not gaps.exists()
    gaps.write_text("an older list")
    assert main(["corrupt", str(walk_file), "-o", str(out)]) == 0
    assert gaps.read_text() == "channel,first_frame,last_frame\n"


def test_command_leaves_what_it_does_not_touch(walk_file, tmp_path):
    assert main(["corrupt", str(walk_file), "--noise", "0", "-o", str(tmp_path / "o.bvh")]) == 0
    assert (tmp_path / "o.bvh").read_bytes() == walk_file.read_bytes()


def test_command_refuses_what_it_does_not_know(walk_file, tmp_path, capsys):
    out = tmp_path / "out.bvh"
    assert main(["corrupt", str(walk_file), "--noise", "anglar:1", "-o", str(out)]) == 2
    assert "the nearest names are angular" in capsys.readouterr().err
    assert not out.exists()


def test_command_lists_all_corruptions(capsys):
    with pytest.raises(SystemExit):
        main(["corrupt", "--help"])
    printed = capsys.readouterr().out
    for corruption in CORRUPTIONS.values():
        line = next(text for text in printed.splitlines() if text.split()[:1] == [corruption.name])
        assert f" {corruption.amount:g} {corruption.unit} " in line
