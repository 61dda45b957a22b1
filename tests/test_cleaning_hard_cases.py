"""The cleaner on files that are not what it was trained on: rates, lengths, joints, gaps."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

from mocaplab.cleaner import pieces
from mocaplab.cleaning import Cleaner
from mocaplab.corruption import corrupt
from mocaplab.filters import GaussianDenoiser
from mocaplab.gap_fillers.curves import GapWarning
from mocaplab.gap_fillers.filled import fill_by_lines
from mocaplab.measures.by_name import rms_all_deg
from mocaplab.motion import Motion, moving_channels
from mocaplab.noise.angular import angular_noise
from mocaplab.resampling import resample
from mocaplab.skeletons.retargeting import retarget


@pytest.fixture(scope="module")
def cleaner():
    return Cleaner("blend")


@pytest.fixture(scope="module")
def noisy(walk):
    return corrupt(walk, "angular:0.5", rng=np.random.default_rng(0))


def with_gap(motion, frames, columns=slice(None)):
    channels = motion.channels.copy()
    channels[frames, columns] = np.nan
    return motion.with_channels(channels)


@pytest.mark.parametrize(("model", "most", "rms"), [("blend", 0.1, 0.002), ("ebf", 1.5, 0.06)])
def test_pieces_give_nearly_what_the_whole_gives(model, most, rms, noisy, monkeypatch):
    """The LSTM of EBF remembers for longer than that of Blend."""
    cleaner = Cleaner(model)
    long = np.concatenate([noisy.observed.channels, noisy.observed.channels[::-1]] * 2)
    motion = noisy.observed.with_channels(long)  # 16 s
    whole = cleaner.clean(motion).channels
    monkeypatch.setattr(pieces, "PIECE_S", 3.0)
    change = np.abs(cleaner.clean(motion).channels - whole)
    assert change.any()  # it was cut
    assert change.max() < most  # degrees; the noise has 3.4 RMS
    assert np.sqrt(np.mean(change**2)) < rms


@pytest.mark.parametrize(("filler", "most"), [(fill_by_lines, 0.1), (None, 2.0)])
def test_a_gap_across_pieces_is_filled_like_in_the_whole(filler, most, noisy, monkeypatch):
    """The usual filler measures how smooth the piece is, and so differs a little."""
    cleaner = Cleaner("blend", filler=filler)
    long = np.concatenate([noisy.observed.channels, noisy.observed.channels[::-1]] * 2)
    holed = with_gap(noisy.observed.with_channels(long), slice(300, 700), [20, 21, 22])
    whole = cleaner.clean(holed).channels
    monkeypatch.setattr(pieces, "PIECE_S", 3.0)
    assert np.abs(cleaner.clean(holed).channels - whole).max() < most


@pytest.mark.parametrize("fps", [24, 30, 50, 60, 100, 240])
def test_any_frame_rate_is_cleaned_and_kept(fps, cleaner, walk):
    clean = resample(walk, fps)
    clean = replace(clean, frame_time=round(clean.frame_time, 6))  # as a file has it
    low = angular_noise(clean, 0.5, rng=np.random.default_rng(0))
    cleaned = cleaner.clean(low)
    assert cleaned.frame_time == low.frame_time
    assert cleaned.n_frames == low.n_frames
    still = ~moving_channels(low)
    np.testing.assert_array_equal(cleaned.channels[:, still], low.channels[:, still])
    widths_s = (0.02, 0.03, 0.045, 0.065)
    best = min(rms_all_deg(GaussianDenoiser(s).denoise(low, None), clean) for s in widths_s)
    assert rms_all_deg(cleaned, clean) < best


def test_clean_files_of_other_rates_stay_nearly_as_they_are(cleaner, walk):
    low = resample(walk, 60)
    assert rms_all_deg(cleaner.clean(low), low) < 0.3


def test_other_channel_orders_give_the_same_motion(cleaner, noisy):
    """Up to the conversion: the same poses go in, the same poses come out."""
    skeleton = noisy.observed.skeleton
    names = tuple(
        tuple(sorted(kinds, key=lambda k: (k.endswith("rotation"), k)))
        for kinds in skeleton.channel_names
    )
    swapped = retarget(noisy.observed, replace(skeleton, channel_names=names), scale=1.0)
    assert swapped.skeleton.channel_names[3] == ("Xrotation", "Yrotation", "Zrotation")
    cleaned = cleaner.clean_in_detail(swapped)
    back = retarget(cleaned.motion, skeleton, scale=1.0)
    expected = cleaner.clean(noisy.observed)
    assert rms_all_deg(back, expected) < 1e-3
    assert any("XYZ" in line for line in cleaned.match.describe())


def test_an_unknown_joint_is_smoothed_and_named(cleaner, noisy):
    skeleton = noisy.observed.skeleton
    bigger = replace(
        skeleton,
        joint_names=(*skeleton.joint_names, "Tail"),
        parents=np.append(skeleton.parents, 0),
        offsets=np.vstack([skeleton.offsets, [0.0, 0.0, -1.0]]),
        channel_names=(*skeleton.channel_names, ("Xrotation",)),
    )
    rng = np.random.default_rng(0)
    tail = 20 * np.sin(3 * noisy.clean.time_s) + rng.normal(size=noisy.clean.n_frames)
    channels = np.column_stack([noisy.observed.channels, tail])
    motion = Motion(bigger, noisy.clean.frame_time, channels, "tail")
    cleaned = cleaner.clean_in_detail(with_gap(motion, slice(50, 60), -1))
    assert cleaned.match.unknown_joints == ["Tail"]
    truth = 20 * np.sin(3 * noisy.clean.time_s)
    assert np.std(cleaned.motion.channels[:, -1] - truth) < 0.6
    assert (cleaned.std_deg[50:60, -1] > 0).all()
    expected = cleaner.clean(noisy.observed).channels
    np.testing.assert_allclose(cleaned.motion.channels[:, :-1], expected, atol=1e-9)


def test_filled_samples_have_an_expected_error(cleaner, noisy):
    holed = with_gap(noisy.observed, slice(100, 160), [9, 10, 11])
    cleaned = cleaner.clean_in_detail(holed)
    np.testing.assert_array_equal(cleaned.std_deg > 0, np.isnan(holed.channels))
    assert np.isfinite(cleaned.std_deg).all()
    assert not cleaned.left.any()


@pytest.mark.parametrize("fps", [30, 240])
def test_filled_samples_have_an_expected_error_at_other_rates(fps, cleaner, noisy):
    low = resample(noisy.observed, fps)
    holed = with_gap(with_gap(low, slice(40, 60), [9, 10, 11]), 81, 20)
    cleaned = cleaner.clean_in_detail(holed)
    np.testing.assert_array_equal(cleaned.std_deg > 0, np.isnan(holed.channels))


def test_the_filler_can_be_chosen(noisy):
    def half_way(motion):
        lines = fill_by_lines(motion)
        hidden = np.isnan(motion.channels)
        filled = np.where(hidden, 0.0, lines.motion.channels)
        return replace(lines, motion=motion.with_channels(filled))

    holed = with_gap(noisy.observed, slice(100, 220), [9, 10, 11])
    cleaned = Cleaner("blend", filler=half_way).clean(holed)
    assert np.abs(cleaned.channels[150:170, 11]).max() < 1.0
    assert np.abs(Cleaner("blend").clean(holed).channels[150:170, 11]).max() > 1.0


def test_long_gaps_are_left_open(noisy):
    holed = with_gap(with_gap(noisy.observed, slice(50, 80), 9), slice(100, 220), 9)
    cleaner = Cleaner("blend", max_gap_s=0.5)
    cleaned = cleaner.clean_in_detail(holed)
    assert cleaned.left[100:220, 9].all()
    assert cleaned.left.sum() == 120
    assert (cleaned.std_deg[50:80, 9] > 0).all()
    assert not cleaned.std_deg[100:220].any()
    line = cleaned.motion.channels[99:221, 9]
    np.testing.assert_allclose(np.diff(line, 2), 0, atol=1e-9)
    marked = cleaner.clean(holed)
    np.testing.assert_array_equal(np.isnan(marked.channels), cleaned.left)
    with pytest.raises(ValueError, match="0 seconds or more, got -1"):
        Cleaner("blend", max_gap_s=-1)


def test_gaps_at_the_ends_hold_the_nearest_sample_smoothed(cleaner, noisy):
    holed = with_gap(with_gap(noisy.observed, slice(0, 10), 9), slice(-5, None), 9)
    cleaned = cleaner.clean_in_detail(holed)
    assert np.isfinite(cleaned.motion.channels).all()
    assert (cleaned.std_deg[:10, 9] > 0).all()
    assert (cleaned.std_deg[-5:, 9] > 0).all()
    assert np.ptp(cleaned.motion.channels[:5, 9]) < 1.0


def test_a_whole_frame_may_be_missing(cleaner, noisy):
    holed = with_gap(noisy.observed, 200)
    cleaned = cleaner.clean(holed)
    assert np.isfinite(cleaned.channels).all()
    root = noisy.observed.channels[[199, 201], :6].mean(axis=0)
    np.testing.assert_allclose(cleaned.channels[200, :6], root, atol=1e-6)


def test_a_channel_never_observed_is_at_rest_and_named(cleaner, noisy):
    holed = with_gap(noisy.observed, slice(None), 20)
    label = holed.skeleton.channel_labels[20]
    with pytest.warns(GapWarning, match=label) as caught:
        cleaned = cleaner.clean_in_detail(holed)
    assert len(caught) == 1
    assert not cleaned.motion.channels[:, 20].any()
    assert np.isinf(cleaned.std_deg[:, 20]).all()


def test_nothing_observed_is_refused(cleaner, noisy):
    with pytest.raises(ValueError, match="no angle was observed"):
        cleaner.clean(with_gap(noisy.observed, slice(None)))


@pytest.mark.parametrize("n_frames", [1, 2, 3, 4, 10])
@pytest.mark.parametrize("fps", [30, 120])
def test_clips_of_a_few_frames_come_back(n_frames, fps, cleaner, walk):
    low = resample(walk, fps)
    short = low.slice_frames(0, n_frames)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        cleaned = cleaner.clean_in_detail(short, widths=True)
    assert cleaned.motion.channels.shape == short.channels.shape
    assert np.abs(cleaned.motion.channels - short.channels).max() < 3.0


def test_what_does_not_move_comes_back(cleaner, walk):
    still = walk.with_channels(np.tile(walk.channels[:1], (100, 1)))
    cleaned = cleaner.clean_in_detail(still, widths=True)
    np.testing.assert_array_equal(cleaned.motion.channels, still.channels)
    assert not cleaned.width_s.any()


@pytest.mark.parametrize("model", ["blend", "ebf"])
def test_widths_tell_noise_from_none(model, walk, noisy):
    cleaner = Cleaner(model)
    much, little = (
        cleaner.clean_in_detail(motion, widths=True).width_s for motion in (noisy.observed, walk)
    )
    moving = moving_channels(walk)
    assert not much[:, ~moving].any()
    assert (much[:, moving] >= 0).all()
    assert much[:, moving].mean() > 2 * little[:, moving].mean()
    assert much.max() <= 30 / 120


def test_widths_of_ebf_are_those_that_it_predicts(noisy):
    cleaner = Cleaner("ebf")
    width = cleaner.clean_in_detail(noisy.observed, widths=True).width_s
    np.testing.assert_array_equal(width, cleaner.predict_sigma_s(noisy.observed))
