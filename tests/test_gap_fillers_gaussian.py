"""The conditional Gaussian as a gap filler: continuous, better than lines, honest about errors."""

import numpy as np
import pytest

from mocaplab.euler import make_continuous
from mocaplab.gap_fillers.curves import GapWarning, lerp_gaps
from mocaplab.gap_fillers.gaussian_fit import fit_gaussian_filler
from mocaplab.measures.gaps import gap_rms_deg
from mocaplab.motion import Corrupted, moving_channels
from mocaplab.noise.angular import angular_noise
from mocaplab.noise.gaps import hide, long_gap_mask


def as_training(clips):
    return [Corrupted(clip, clip, np.ones(clip.channels.shape, dtype=bool)) for clip in clips]


@pytest.fixture(scope="module")
def filler(embedded):
    return fit_gaussian_filler(as_training(embedded.clips[1:100:6]))


def without(motion, frames, channels):
    values = motion.channels.copy()
    values[frames, channels] = np.nan
    return motion.with_channels(values)


@pytest.fixture(scope="module")
def knee(embedded):
    return embedded.skeleton.channel_index("LeftLeg.Xrotation")


@pytest.mark.parametrize("seconds", [0.25, 1.0])
def test_better_than_lines_and_honest(embedded, filler, seconds):
    rng = np.random.default_rng(0)
    ours, lines, ratios = [], [], []
    for clip in embedded.clips[::12]:
        if clip.duration_s < seconds + 0.3:
            continue
        mask = long_gap_mask(clip, seconds, n_joints=5, rng=rng)
        holed = hide(angular_noise(clip, 0.1, rng=rng), mask)
        filled = filler.fill(holed)
        ours.append(gap_rms_deg(filled.motion, clip, mask))
        lines.append(gap_rms_deg(lerp_gaps(holed), clip, mask))
        counted = ~mask & moving_channels(clip)
        error = np.abs(filled.motion.channels - clip.channels)[counted]
        ratios.append(error / filled.std_deg[counted])
    assert np.mean(ours) < 0.8 * np.mean(lines)
    ratios = np.concatenate(ratios)
    assert 0.6 < np.mean(ratios < 1) < 0.97
    assert np.mean(ratios < 2) > 0.85


def test_observed_samples_stay_and_only_gaps_are_unsure(walk, filler, knee):
    holed = without(walk, slice(200, 260), slice(knee - 1, knee + 2))
    filled = filler.fill(holed)
    seen = ~np.isnan(holed.channels)
    np.testing.assert_array_equal(filled.motion.channels[seen], walk.channels[seen])
    np.testing.assert_array_equal(filled.std_deg > 0, ~seen)
    np.testing.assert_array_equal(filler(holed).channels, filled.motion.channels)


@pytest.mark.parametrize("length", [1, 10, 40, 200])
def test_no_jump_at_the_ends_of_a_gap(walk, filler, knee, length):
    filled = filler.fill(without(walk, slice(150, 150 + length), knee)).motion
    steps = np.abs(np.diff(filled.channels[:, knee]))
    fastest = np.abs(np.diff(walk.channels[:, knee])).max()
    assert steps[149] < 1.2 * fastest
    assert steps[149 + length] < 1.2 * fastest


@pytest.mark.parametrize("frames", [slice(0, 60), slice(-60, None)])
def test_a_gap_at_an_end_of_the_clip(walk, filler, knee, frames):
    filled = filler.fill(without(walk, frames, knee))
    truth = walk.channels[frames, knee]
    held = lerp_gaps(without(walk, frames, knee)).channels[frames, knee]
    error = filled.motion.channels[frames, knee] - truth
    assert np.sqrt(np.mean(error**2)) < np.sqrt(np.mean((held - truth) ** 2))
    unsure = filled.std_deg[frames, knee]
    assert unsure[30] > unsure[-1 if frames.start == 0 else 0]


def test_all_channels_hidden_at_once(walk, filler):
    holed = without(walk, slice(100, 110), walk.skeleton.is_cleaned)
    filled = filler.fill(holed)
    error = (filled.motion.channels - walk.channels)[100:110]
    assert np.sqrt(np.mean(error**2)) < 2.0
    everywhere = filler.fill(without(walk, slice(100, 220), walk.skeleton.is_cleaned))
    assert everywhere.std_deg[160].mean() > 2 * filled.std_deg[105].mean()


def test_never_observed_and_nothing_observed(walk, filler, knee):
    with pytest.warns(GapWarning, match=r"LeftLeg.Xrotation"):
        filled = filler.fill(without(walk, slice(None), knee))
    assert not filled.motion.channels[:, knee].any()
    assert np.isinf(filled.std_deg[:, knee]).all()
    with pytest.raises(ValueError, match="no angle was observed in any of its 488 frames"):
        filler.fill(without(walk, slice(None), slice(None)))


@pytest.mark.parametrize("n", [2, 5, 30])
def test_clips_shorter_than_a_window(walk, filler, knee, n):
    short = walk.slice_frames(40, 40 + n)
    filled = filler.fill(without(short, slice(1, n), knee))
    assert np.isfinite(filled.motion.channels).all()
    assert np.abs(filled.motion.channels - short.channels).max() < 40


def test_a_whole_clip_without_gaps_is_returned_as_it_is(walk, filler):
    filled = filler.fill(walk)
    np.testing.assert_array_equal(filled.motion.channels, walk.channels)
    assert not filled.std_deg.any()


def test_another_frame_rate(walk, filler, knee):
    slow = make_continuous(walk.with_channels(walk.channels))
    slow = type(walk)(walk.skeleton, walk.frame_time * 4, walk.channels[::4], "30 fps")
    filled = filler.fill(without(slow, slice(40, 70), knee))
    error = filled.motion.channels[40:70, knee] - slow.channels[40:70, knee]
    assert np.sqrt(np.mean(error**2)) < 0.5 * slow.channels[:, knee].std()


def test_another_skeleton_is_refused(small_motion, filler):
    with pytest.raises(ValueError, match=r"96 channels; this motion has 16.*only one of them"):
        filler.fill(without(small_motion, 3, 7))


def test_nothing_to_learn_from():
    with pytest.raises(ValueError, match="at least one training clip"):
        fit_gaussian_filler([])
