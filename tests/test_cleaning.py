"""The cleaner with the shipped weights."""

import numpy as np
import pytest

from mocaplab.cleaner.summary import report_changes
from mocaplab.cleaning import Cleaner
from mocaplab.corruption import corrupt
from mocaplab.euler import make_continuous
from mocaplab.filters import GaussianDenoiser
from mocaplab.measures.by_name import rms_all_deg
from mocaplab.motion import moving_channels
from mocaplab.noise.angular import angular_noise


@pytest.fixture(scope="module")
def cleaner():
    return Cleaner("ebf")


@pytest.fixture(scope="module")
def noisy(walk):
    return corrupt(walk, "angular:0.5", rng=np.random.default_rng(0))


def test_cleaning_removes_most_of_the_noise(cleaner, noisy):
    before = rms_all_deg(noisy.observed, noisy.clean)
    after = rms_all_deg(cleaner.clean(noisy.observed), noisy.clean)
    assert after < 0.5 * before


def test_root_and_still_channels_come_out_exactly(cleaner, noisy):
    cleaned = cleaner.clean(noisy.observed)
    still = ~moving_channels(noisy.observed)
    assert still[:6].all()
    np.testing.assert_array_equal(cleaned.channels[:, still], noisy.observed.channels[:, still])
    assert cleaned.frame_time == noisy.observed.frame_time
    assert cleaned.skeleton is noisy.observed.skeleton


def test_gaps_are_filled(cleaner, walk):
    holed = corrupt(walk, "angular:0.5+gaps:0.002", rng=np.random.default_rng(1))
    cleaned = cleaner.clean(holed.observed)
    assert np.isfinite(cleaned.channels).all()
    report = report_changes(holed.observed, cleaned)
    assert report.n_filled == (~holed.mask).sum()
    assert f"filled    {report.n_filled} samples inside" in str(report)


def test_wraps_do_not_disturb_and_come_back(cleaner, noisy):
    column = noisy.clean.skeleton.channel_index("LeftArm.Zrotation")
    jumpy = noisy.observed.channels.copy()
    jumpy[100:, column] += 360
    plain = cleaner.clean(noisy.observed).channels
    wrapped = cleaner.clean(noisy.observed.with_channels(jumpy)).channels
    np.testing.assert_allclose(wrapped[:100], plain[:100], atol=1e-9)
    np.testing.assert_allclose(wrapped[100:, column] - 360, plain[100:, column], atol=1e-9)


def test_widths_are_in_seconds_and_0_where_nothing_is_smoothed(cleaner, noisy):
    sigma = cleaner.predict_sigma_s(make_continuous(noisy.observed))
    moving = moving_channels(noisy.observed)
    assert (sigma[:, ~moving] == 0).all()
    assert ((sigma[:, moving] > 0.1 / 121) & (sigma[:, moving] < 31 / 120)).all()


def test_a_channel_unknown_to_the_network_gets_the_tuned_width(cleaner, noisy):
    label = "LHipJoint.Xrotation"
    column = noisy.clean.skeleton.channel_index(label)
    assert cleaner.checkpoint.constant[column]
    channels = noisy.observed.channels.copy()
    channels[:, column] += 10 * np.sin(noisy.clean.time_s * 5)
    moved = noisy.observed.with_channels(channels)
    sigma = cleaner.predict_sigma_s(make_continuous(moved))
    np.testing.assert_allclose(sigma[:, column], cleaner.checkpoint.gaussian_s)
    assert (cleaner.clean(moved).channel(label) != moved.channel(label)).any()


def test_the_turning_of_the_root_matters(cleaner, noisy):
    turning = noisy.observed.channels.copy()
    turning[:, 4] += 60 * np.sin(3 * noisy.clean.time_s)
    a = cleaner.predict_sigma_s(noisy.observed)
    b = cleaner.predict_sigma_s(noisy.observed.with_channels(turning))
    assert np.abs(a - b).max() > 1e-4


def test_a_rise_of_jitter_is_told(walk):
    rough = angular_noise(walk, 0.1, rng=np.random.default_rng(0))
    assert "jitter rose" in str(report_changes(walk, rough))


def test_report_finds_the_largest_change(walk):
    channels = walk.channels.copy()
    column = walk.skeleton.channel_index("LeftLeg.Xrotation")
    channels[40, column] += 25.0
    report = report_changes(walk, walk.with_channels(channels))
    assert (report.largest_channel, report.largest_frame) == ("LeftLeg.Xrotation", 40)
    assert report.largest_change_deg == pytest.approx(25.0)
    assert (report.n_changed, report.n_channels) == (1, 96)
    assert report.rms_change_deg == pytest.approx(25.0 / np.sqrt(walk.n_frames))
    assert report.jitter_after > report.jitter_before
    assert str(report_changes(walk, walk)) == "nothing was changed"


def test_a_clip_of_one_frame_comes_back(cleaner, walk):
    one = walk.slice_frames(0, 1)
    np.testing.assert_array_equal(cleaner.clean(one).channels, one.channels)


def test_ebf_beats_the_tuned_gaussian_on_real_clips_it_never_saw(cleaner, data_dir):
    from mocaplab.datasets import clip_digest, load_dataset

    trained_on = set(cleaner.checkpoint.trained_on.values())
    clips = load_dataset("cmu", data_dir / "cmu").clips
    unseen = [clip for clip in clips if clip_digest(clip) not in trained_on]
    assert 8 <= len(unseen) <= 16
    gaussians = [
        GaussianDenoiser(cleaner.checkpoint.gaussian_s),
        GaussianDenoiser(cleaner.checkpoint.gaussian_per_channel_s),
    ]
    errors = []
    for i, clip in enumerate(unseen):
        pair = corrupt(clip, "angular:0.5", rng=np.random.default_rng([0, i]))
        methods = [cleaner, *gaussians]
        errors.append(
            [rms_all_deg(m.denoise(pair.observed, pair.mask), pair.clean) for m in methods]
        )
    ebf, single, per_channel = np.mean(errors, axis=0)
    assert ebf < single
    assert ebf < per_channel
