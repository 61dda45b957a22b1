"""What the lab shows, against the library's own functions called one by one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mocaplab.cleaning import Cleaner
from mocaplab.corruption import corrupt
from mocaplab.filters import gaussian_filter
from mocaplab.lab.gaussian import LOOK_AHEADS_S, WIDTHS_S
from mocaplab.lab.model import (
    MAX_GAP_S,
    NOISES,
    Laboratory,
    LabSettings,
    max_amount,
    widest_channel,
)
from mocaplab.live.filters import LiveGaussian
from mocaplab.measures.by_name import rms_all_deg
from mocaplab.motion import moving_channels
from mocaplab.tuning import tune, tune_gaussian

KNEE = "LeftLeg.Xrotation"


@pytest.fixture(scope="module")
def few(embedded):
    """Three short clips; all three serve for tuning, the shown one left out."""
    some = embedded.select([0, 45, 70], "few")
    clips = tuple(clip.slice_frames(0, 70) for clip in some.clips)
    return replace(some, clips=clips)


@pytest.fixture(scope="module")
def laboratory(few):
    return Laboratory(few)


@pytest.fixture(scope="module")
def scene(laboratory, few):
    return laboratory.scene(LabSettings(few.clips[0].name, gap_s=0.2))


def test_the_clip_is_spoilt_as_the_recipe_says(scene, few):
    assert scene.settings.recipe == "angular:0.5+long_gaps:0.2"
    again = corrupt(few.clips[0], scene.settings.recipe, rng=np.random.default_rng(1))
    np.testing.assert_array_equal(scene.corrupted.observed.channels, again.observed.channels)
    assert np.isnan(again.observed.channels).any()
    assert not np.isnan(scene.filled.channels).any()


def test_the_networks_are_those_of_the_library(scene):
    observed, mask = scene.corrupted.observed, scene.corrupted.mask
    for label, name in (("EBF", "ebf"), ("Blend", "blend")):
        right = Cleaner(name).denoise(observed, mask).channels
        np.testing.assert_array_equal(scene.cleaned[label].channels, right)
    right = Cleaner("ebf").predict_sigma_s(scene.filled)
    np.testing.assert_array_equal(scene.sigma_s, right)


def test_the_gaussian_touches_only_what_moves(scene):
    smooth, filled = scene.gaussian(0.05).channels, scene.filled.channels
    moving = moving_channels(scene.corrupted.clean)
    right = gaussian_filter(filled[:, moving], 0.05, scene.filled.frame_time)
    np.testing.assert_allclose(smooth[:, moving], right)
    np.testing.assert_array_equal(smooth[:, ~moving], filled[:, ~moving])


@pytest.mark.parametrize(("row", "look_ahead_s"), [(0, 0.0), (3, 1 / 30), (-1, None)])
def test_the_table_holds_the_error_over_all_joint_angles(scene, row, look_ahead_s):
    for column in (0, 20, len(WIDTHS_S) - 1):
        motion = scene.gaussian(float(WIDTHS_S[column]), look_ahead_s)
        right = rms_all_deg(motion, scene.corrupted.clean)
        assert scene.gaussian_rms[row, column] == pytest.approx(right)


def test_the_width_is_tuned_on_the_other_clips(scene, few):
    others = [corrupt(c, scene.settings.recipe, rng=np.random.default_rng(1)) for c in few.clips]
    right, _ = tune_gaussian(others[1:])
    assert scene.tuned_sigma_s == right
    assert scene.tuned.shape == (len(LOOK_AHEADS_S),)
    live = tune([LiveGaussian(width, 1 / 30) for width in WIDTHS_S], others[1:])
    assert WIDTHS_S[scene.tuned[3]] == live.sigma_s
    assert tune_gaussian(others[:1])[0] != right  # or the test could not tell


def test_errors_of_all_methods(scene):
    errors = scene.errors_deg(0.1)
    assert next(iter(errors)) == "observed"
    assert list(errors)[-2:] == ["EBF", "Blend"]
    assert errors["Blend"] == rms_all_deg(scene.cleaned["Blend"], scene.corrupted.clean)
    one = scene.errors_deg(0.1, channel=KNEE)
    column = scene.filled.skeleton.channel_index(KNEE)
    error = (scene.filled.channels - scene.corrupted.clean.channels)[:, column]
    assert one["observed"] == pytest.approx(np.sqrt(np.mean(error**2)))


def test_a_scene_is_the_same_when_asked_twice(laboratory, scene):
    again = laboratory.scene(scene.settings)
    np.testing.assert_array_equal(again.filled.channels, scene.filled.channels)
    np.testing.assert_array_equal(again.gaussian_rms, scene.gaussian_rms)


def test_a_long_clip_is_cut(embedded):
    longest = max(embedded.clips, key=lambda clip: clip.n_frames)
    twice = longest.with_channels(np.concatenate([longest.channels] * 2))
    some = replace(
        embedded.select([0, 1], "two"),
        clips=(replace(twice, name="long"), embedded.clips[45].slice_frames(0, 60)),
    )
    scene = Laboratory(some).scene(LabSettings("long"))
    assert scene.filled.n_frames == 600


def test_the_widest_channel(walk):
    channels = np.flatnonzero(moving_channels(walk))
    label = widest_channel(walk, channels)
    assert walk.channel(label).std() == walk.channels[:, channels].std(axis=0).max()


@pytest.mark.parametrize("noise", NOISES)
def test_every_noise_is_finite_from_none_to_most(laboratory, few, noise):
    name = min(few.clips, key=lambda clip: clip.n_frames).name
    errors = []
    usual = [max_amount(noise) / 2] if noise != "spatial" else []  # it takes seconds
    for amount in (0, *usual, max_amount(noise)):
        scene = laboratory.scene(LabSettings(name, noise, amount))
        found = list(scene.errors_deg(scene.tuned_sigma_s).values())
        assert np.isfinite(found).all()
        assert np.isfinite(scene.sigma_s).all()
        errors.append(found[0])
    assert errors[0] == 0
    assert errors[-1] > 0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"noise": "gaps"}, "expected a noise among angular, uniform"),
        ({"amount": 1.5}, "amount must lie between 0 and 1, got 1.5"),
        ({"amount": float("nan")}, "amount must lie"),
        ({"gap_s": -1}, f"gap_s must lie between 0 and {MAX_GAP_S:g}, got -1"),
    ],
)
def test_settings_outside_the_lab_are_refused(changes, message):
    with pytest.raises(ValueError, match=message):
        LabSettings("walk", **changes)


def test_unknown_clips_and_too_little_data_are_refused(laboratory, few):
    with pytest.raises(ValueError, match="no clip 'walk'; there are"):
        laboratory.scene(LabSettings("walk"))
    with pytest.raises(ValueError, match=r"two clips or more.*got 1"):
        Laboratory(few.select([0], "one"))
