"""Filling gaps one channel at a time."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline, PchipInterpolator

from mocaplab.euler import make_continuous
from mocaplab.filters import filter_motion
from mocaplab.gap_fillers.curves import (
    GapWarning,
    lerp_gaps,
    never_observed,
    pchip_gaps,
    rest_values,
    spline_gaps,
)

FILLERS = [lerp_gaps, pchip_gaps, spline_gaps]


@pytest.fixture
def holes(walk):
    """A walk in which a tenth of the samples is hidden; every channel has its own gaps."""
    hidden = np.random.default_rng(0).random(walk.channels.shape) < 0.1
    return walk.with_channels(np.where(hidden, np.nan, walk.channels))


def hide(motion, label, *frames):
    channels = motion.channels.copy()
    channels[slice(*frames), motion.skeleton.channel_index(label)] = np.nan
    return motion.with_channels(channels)


def curves(kind):
    if kind is lerp_gaps:
        return lambda x, y: lambda t: np.interp(t, x, y)
    return {pchip_gaps: PchipInterpolator, spline_gaps: natural}[kind]


def natural(x, y):
    return CubicSpline(x, y, bc_type="natural")


@pytest.mark.parametrize("fill", FILLERS)
def test_fillers_equal_scipy_in_the_middle_and_hold_at_the_ends(fill, holes):
    filled = fill(holes).channels
    frames = np.arange(holes.n_frames)
    for column in range(holes.skeleton.n_channels):
        values = holes.channels[:, column]
        seen = frames[~np.isnan(values)]
        expected = curves(fill)(seen, values[seen])(frames.clip(seen[0], seen[-1]))
        np.testing.assert_allclose(filled[:, column], expected, atol=1e-9)


@pytest.mark.parametrize("fill", FILLERS)
def test_observed_samples_come_back_bit_for_bit(fill, holes):
    observed = ~np.isnan(holes.channels)
    np.testing.assert_array_equal(fill(holes).channels[observed], holes.channels[observed])


@pytest.mark.parametrize("fill", FILLERS)
def test_a_motion_without_gaps_is_unchanged(fill, walk):
    np.testing.assert_array_equal(fill(walk).channels, walk.channels)


def test_lerp_draws_straight_lines_and_holds_at_the_ends(walk):
    label = "LeftLeg.Xrotation"
    gappy = hide(hide(walk, label, 3), label, 10, 14)
    filled, clean = lerp_gaps(gappy).channel(label), walk.channel(label)
    np.testing.assert_allclose(filled[9:15], np.linspace(clean[9], clean[14], 6))
    np.testing.assert_array_equal(filled[:3], clean[3])


@pytest.mark.parametrize("fill", FILLERS)
def test_a_line_is_filled_by_itself(fill, walk):
    line = np.outer(np.arange(walk.n_frames), np.linspace(-1, 1, walk.skeleton.n_channels))
    gappy = hide(walk.with_channels(line), "LeftLeg.Xrotation", 20, 80)
    np.testing.assert_allclose(fill(gappy).channels, line, atol=1e-9)


@pytest.mark.parametrize("fill", FILLERS)
def test_a_channel_observed_once_takes_that_value(fill, walk):
    label = "LeftLeg.Xrotation"
    gappy = hide(hide(walk, label, 7), label, 8, None)
    np.testing.assert_array_equal(fill(gappy).channel(label), walk.channel(label)[7])


@pytest.mark.parametrize("fill", FILLERS)
def test_a_channel_observed_twice_is_a_line(fill, walk):
    label = "LeftLeg.Xrotation"
    gappy = hide(hide(hide(walk, label, 7), label, 8, 20), label, 21, None)
    filled, clean = fill(gappy).channel(label), walk.channel(label)
    if fill is not pchip_gaps:
        np.testing.assert_allclose(filled[7:21], np.linspace(clean[7], clean[20], 14))
    np.testing.assert_array_equal(filled[21:], clean[20])


@pytest.mark.parametrize("fill", FILLERS)
def test_a_channel_never_observed_stays_at_rest_and_is_named(fill, small_motion):
    gappy = hide(hide(small_motion, "Leg.Xrotation", None), "Hips.Yposition", None)
    with pytest.warns(GapWarning, match=r"'small': never .* rest: Hips\.Yposition, Leg\.Xrot"):
        filled = fill(gappy)
    assert np.all(filled.channel("Leg.Xrotation") == 0)
    assert np.all(filled.channel("Hips.Yposition") == 90)  # its OFFSET
    labels = np.array(gappy.skeleton.channel_labels)
    assert labels[never_observed(gappy)].tolist() == ["Hips.Yposition", "Leg.Xrotation"]


def test_a_long_warning_counts_instead_of_naming(walk):
    nothing = walk.with_channels(np.full(walk.channels.shape, np.nan))
    with pytest.warns(GapWarning, match=f"and {walk.skeleton.n_channels - 5} more"):
        filled = lerp_gaps(nothing)
    np.testing.assert_array_equal(filled.channels[0], rest_values(walk.skeleton))


@pytest.mark.parametrize("fill", FILLERS)
def test_one_frame(fill, walk):
    frame = walk.slice_frames(0, 1)
    np.testing.assert_array_equal(fill(frame).channels, frame.channels)
    with pytest.warns(GapWarning):
        assert np.isfinite(fill(hide(frame, "LeftLeg.Xrotation", None)).channels).all()


@pytest.mark.parametrize("fill", FILLERS)
def test_a_jump_of_a_full_turn_across_a_gap_is_no_movement(fill, walk):
    clean = make_continuous(walk)
    label = "LeftArm.Zrotation"
    jumpy = clean.channels.copy()
    column = clean.skeleton.channel_index(label)
    jumpy[70:, column] += 360
    plain = filter_motion(hide(clean, label, 50, 70), lambda m: m.channels, fill)
    jumped = filter_motion(
        hide(clean.with_channels(jumpy), label, 50, 70), lambda m: m.channels, fill
    )
    turns = (jumped.channels - plain.channels) / 360
    np.testing.assert_allclose(turns, turns.round(), atol=1e-9)
    np.testing.assert_array_equal(
        jumped.channel(label)[70:], jumpy[70:, clean.skeleton.channel_index(label)]
    )


def test_filter_motion_leaves_a_channel_never_observed_at_rest(walk):
    """Even where the rest of its joint switches to the other Euler branch."""
    channels = make_continuous(walk).channels.copy()
    joint = [walk.skeleton.channel_index(f"LeftArm.{axis}rotation") for axis in "ZYX"]
    z, y, x = channels[40:, joint].T
    channels[40:, joint] = np.stack([z + 180, 180 - y, x + 180], axis=-1)
    for label in ("LeftArm.Zrotation", "LeftArm.Yrotation"):
        gappy = hide(walk.with_channels(channels), label, None)
        with pytest.warns(GapWarning, match=label):
            result = filter_motion(gappy, lambda m: m.channels)
        assert np.all(result.channel(label) == 0)
