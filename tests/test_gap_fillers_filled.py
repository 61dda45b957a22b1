"""Filled motions: validation, and the expected error of straight lines."""

import numpy as np
import pytest

from mocaplab.gap_fillers.curves import GapWarning, lerp_gaps
from mocaplab.gap_fillers.filled import Filled, fill_by_lines, lines_std, mean_squared_increments
from mocaplab.motion import moving_channels
from mocaplab.noise.gaps import hide, long_gap_mask


def with_gap(motion, frames, channels):
    values = motion.channels.copy()
    values[frames, channels] = np.nan
    return motion.with_channels(values)


def test_refuses_what_does_not_fit(small_motion):
    std = np.zeros(small_motion.channels.shape)
    with pytest.raises(ValueError, match=r"expected errors of shape \(40, 16\), got \(39, 16\)"):
        Filled(small_motion, std[1:])
    with pytest.raises(ValueError, match=r"Spine.Yrotation is NaN in frame 3"):
        Filled(with_gap(small_motion, 3, 7), std)
    for bad in (np.nan, -1.0):
        wrong = std.copy()
        wrong[5, 6] = bad
        with pytest.raises(ValueError, match=r"0 or more, got .* for Spine.Xrotation in frame 5"):
            Filled(small_motion, wrong)
    filled = Filled(small_motion, std)
    assert not filled.std_deg.flags.writeable
    assert std.flags.writeable


def test_increments_are_those_of_the_definition():
    rng = np.random.default_rng(0)
    values = rng.normal(size=(30, 3)).cumsum(axis=0) + np.array([0, 500, -3])
    values[rng.random(values.shape) < 0.3] = np.nan
    found = mean_squared_increments(values)
    for lag in range(1, 25):
        expected = np.nanmean((values[lag:] - values[:-lag]) ** 2, axis=0)
        np.testing.assert_allclose(found[lag], expected, rtol=1e-9)
    assert not found[0].any()


def test_increments_where_no_pair_was_observed():
    values = np.array([[1.0], [3.0], [np.nan], [np.nan]])
    np.testing.assert_allclose(mean_squared_increments(values)[:, 0], [0, 4, 4, 4])


def test_lines_are_the_lines_and_observed_samples_are_sure(walk):
    holed = with_gap(walk, slice(50, 80), 20)
    filled = fill_by_lines(holed)
    np.testing.assert_array_equal(filled.motion.channels, lerp_gaps(holed).channels)
    np.testing.assert_array_equal(filled.was_filled, np.isnan(holed.channels))
    np.testing.assert_array_equal(filled.std_deg > 0, np.isnan(holed.channels))


def test_brownian_motion_gives_the_brownian_bridge(embedded):
    rng = np.random.default_rng(1)
    skeleton = embedded.clips[0].skeleton
    walks = rng.normal(size=(20_000, skeleton.n_channels)).cumsum(axis=0)
    motion = embedded.clips[0].with_channels(walks)
    std = lines_std(with_gap(motion, slice(1000, 1099), slice(None)))
    steps = np.arange(1, 100)
    bridge = np.sqrt(steps * (100 - steps) / 100)
    found = np.median(std[1000:1099], axis=1)
    noise = 1.0 / 20  # white noise seems to be in a random walk: 1 degree a step is little smooth
    np.testing.assert_allclose(found[5:-5] ** 2, 1.1**2 * bridge[5:-5] ** 2, rtol=0.12, atol=noise)


def test_grows_towards_the_middle_and_beyond_the_ends(walk):
    column = walk.skeleton.channel_index("LeftLeg.Xrotation")
    std = fill_by_lines(with_gap(walk, slice(60, 90), column)).std_deg[60:90, column]
    assert (np.diff(std[:12]) > 0).all()
    assert (np.diff(std[-12:]) < 0).all()
    at_start = fill_by_lines(with_gap(walk, slice(0, 20), column)).std_deg[:20, column]
    assert (np.diff(at_start) < 0).all()


@pytest.mark.parametrize("seconds", [0.1, 0.4, 1.0])
def test_is_calibrated_on_embedded_clips(embedded, seconds):
    rng = np.random.default_rng(2)
    ratios = []
    for clip in embedded.clips[::9]:
        if clip.duration_s < 2 * seconds:
            continue
        mask = long_gap_mask(clip, seconds, n_joints=8, rng=rng)
        filled = fill_by_lines(hide(clip, mask))
        counted = ~mask & moving_channels(clip)
        error = (filled.motion.channels - clip.channels)[counted]
        ratios.append(error / filled.std_deg[counted])
    ratios = np.abs(np.concatenate(ratios))
    assert 0.6 < np.mean(ratios < 1) < 0.85
    assert 0.9 < np.mean(ratios < 2) < 0.99


def test_never_observed_is_reported_and_infinitely_unsure(walk):
    with pytest.warns(GapWarning, match="never observed"):
        filled = fill_by_lines(with_gap(walk, slice(None), 30))
    assert np.isinf(filled.std_deg[:, 30]).all()
    assert not filled.motion.channels[:, 30].any()
    assert not filled.std_deg[:, :30].any()


def test_a_motion_without_any_angle_is_refused(walk):
    with pytest.raises(ValueError, match="no angle was observed"):
        fill_by_lines(with_gap(walk, slice(None), slice(None)))


@pytest.mark.parametrize("frames", [1, 2, 3, 5])
def test_short_clips(walk, frames):
    short = walk.slice_frames(0, frames)
    filled = fill_by_lines(with_gap(short, slice(1, frames), 20))
    assert np.isfinite(filled.std_deg).all()
    assert (filled.std_deg[1:, 20] > 0).all()
