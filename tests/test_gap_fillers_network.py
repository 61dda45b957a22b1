"""EBD as a gap filler: only gaps change, ends are met, errors are measured."""

from dataclasses import replace

import numpy as np
import pytest

from mocaplab.checkpoints import shipped_checkpoint
from mocaplab.gap_fillers.curves import GapWarning, lerp_gaps
from mocaplab.gap_fillers.network import DISTANCES_S, NetworkFiller, with_gap_errors
from mocaplab.noise.gaps import hide, long_gap_mask


@pytest.fixture(scope="module")
def filler():
    return NetworkFiller()


def without(motion, frames, channels):
    values = motion.channels.copy()
    values[frames, channels] = np.nan
    return motion.with_channels(values)


def test_only_gaps_change_and_ends_are_met(walk, filler):
    holed = hide(walk, long_gap_mask(walk, 0.5, rng=np.random.default_rng(0)))
    filled = filler.fill(holed)
    hidden = np.isnan(holed.channels)
    np.testing.assert_array_equal(filled.motion.channels[~hidden], walk.channels[~hidden])
    np.testing.assert_array_equal(filled.std_deg > 0, hidden)
    assert (filled.motion.channels != lerp_gaps(holed).channels)[hidden].any()
    steps = np.abs(np.diff(filled.motion.channels, axis=0))
    assert (steps.max(axis=0) < 3 * np.abs(np.diff(walk.channels, axis=0)).max(axis=0) + 3).all()
    np.testing.assert_array_equal(filler(holed).channels, filled.motion.channels)


def test_the_expected_error_grows_with_the_distance_to_the_ends(walk, filler):
    knee = walk.skeleton.channel_index("LeftLeg.Xrotation")
    std = filler.fill(without(walk, slice(100, 160), knee)).std_deg[100:160, knee]
    assert (np.diff(std[:29]) > 0).all()
    np.testing.assert_allclose(std, std[::-1])
    at_start = filler.fill(without(walk, slice(0, 60), knee)).std_deg[:60, knee]
    assert at_start[0] > at_start[-1]


def test_never_and_nothing_observed(walk, filler):
    with pytest.warns(GapWarning, match="never observed"):
        filled = filler.fill(without(walk, slice(None), 30))
    assert not filled.motion.channels[:, 30].any()
    with pytest.raises(ValueError, match="no angle was observed"):
        filler.fill(without(walk, slice(None), slice(None)))


def test_all_channels_hidden_for_a_while(walk, filler):
    filled = filler.fill(without(walk, slice(100, 120), walk.skeleton.is_cleaned))
    assert np.abs(filled.motion.channels - walk.channels).max() < 60


@pytest.mark.parametrize("frames", [2, 7])
def test_very_short_clips(walk, filler, frames):
    short = walk.slice_frames(0, frames)
    filled = filler.fill(without(short, slice(1, None), 30))
    assert np.isfinite(filled.std_deg).all()


def test_errors_are_measured(embedded):
    checkpoint = shipped_checkpoint("ebd")
    clips = embedded.clips[:2]
    measured = with_gap_errors(checkpoint, clips, rng=np.random.default_rng(0))
    errors = measured.info["gap_errors"]
    assert len(errors) == len(DISTANCES_S)
    assert 0 < errors[0] < errors[3]
    with pytest.raises(ValueError, match=r"more than 0.12 seconds"):
        with_gap_errors(checkpoint, [clips[0].slice_frames(0, 9)], rng=np.random.default_rng(0))


def test_other_models_are_refused(small_motion, filler):
    with pytest.raises(ValueError, match="filled by an EBD, this is a EBF"):
        NetworkFiller(shipped_checkpoint("ebf"))
    info = {**filler.checkpoint.info, "gap_errors": [1.0]}
    with pytest.raises(ValueError, match="needs 7 gap_errors above 0"):
        NetworkFiller(replace(filler.checkpoint, info=info))
    with pytest.raises(ValueError, match="another skeleton"):
        filler.fill(without(small_motion, 3, 7))


def test_it_has_not_seen_the_clips_held_out_from_the_cleaners(filler):
    assert filler.checkpoint.trained_on == shipped_checkpoint("ebf").trained_on
