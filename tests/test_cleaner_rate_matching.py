"""Other frame rates: to the model's and back."""

import numpy as np
import pytest

from mocaplab.cleaner.rate_matching import match_rates


@pytest.mark.parametrize(
    ("frame_time", "same"), [(0.0083333, True), (1 / 119.88, True), (1 / 60, False)]
)
def test_rates_that_hardly_differ_are_the_same(frame_time, same):
    rates = match_rates(frame_time, 1 / 120)
    assert rates.is_same == same
    assert rates.ratio == pytest.approx(1.0 if same else 2.0)


@pytest.mark.parametrize("fps", [24, 25, 29.97, 30, 48, 50, 60, 90, 100, 144, 150, 240, 1000])
@pytest.mark.parametrize("n_frames", [1, 2, 3, 50, 121])
def test_there_and_back_is_the_same_number_of_frames(fps, n_frames, walk):
    rates = match_rates(1 / fps, 1 / 120)
    none = np.zeros(96)
    channels = walk.channels[:n_frames]
    dense = rates.up(channels, walk.skeleton, none, 0)
    back = rates.down(dense, walk.skeleton, n_frames)
    assert back.shape == channels.shape
    if fps in (24, 30, 60):  # their frames are frames of 120
        np.testing.assert_array_equal(back, channels)
    elif fps < 120:
        assert np.abs(back - channels).max() < 2.0  # by lines, the corners are cut


def test_the_added_noise_is_fast_and_as_strong_as_needed(walk):
    """Frames of 30 fps with noise of 1 become frames of 120 with noise of nearly 2 in all."""
    rng = np.random.default_rng(0)
    rates = match_rates(1 / 30, 1 / 120)
    channels = rng.normal(size=(4000, 96))
    dense = rates.up(channels, walk.skeleton, np.ones(96), 0)
    power = np.abs(np.fft.rfft(dense, axis=0)) ** 2 / len(dense)
    hertz = np.fft.rfftfreq(len(dense), 1 / 120)
    slow, fast = (power[(hertz > a) & (hertz < b)].mean() for a, b in ((1, 5), (40, 60)))
    assert slow == pytest.approx(4.0, rel=0.25)  # four times the power at a frequency
    assert fast == pytest.approx(4.0 * 2 / 3, rel=0.1)
    assert rates.noise_factor == pytest.approx(np.sqrt(8 / 3))


def test_the_noise_of_a_frame_does_not_depend_on_where_a_piece_begins(walk):
    rates = match_rates(1 / 30, 1 / 120)
    still = np.zeros((900, 96))
    whole = rates.up(still, walk.skeleton, np.ones(96), 0)
    piece = rates.up(still[300:], walk.skeleton, np.ones(96), 300)
    np.testing.assert_allclose(piece[50:], whole[1250:], atol=1e-12)


def test_no_noise_is_added_to_what_has_none_or_goes_down(walk):
    channels = walk.channels[:40]
    up = match_rates(1 / 60, 1 / 120).up(channels, walk.skeleton, np.zeros(96), 0)
    np.testing.assert_array_equal(up[::2], channels)
    down = match_rates(1 / 240, 1 / 120).up(channels, walk.skeleton, np.zeros(96), 0)
    np.testing.assert_array_equal(down[:20], channels[::2])


def test_what_is_too_fast_is_smoothed_on_the_way_down(walk):
    rates = match_rates(1 / 480, 1 / 120)
    noise = np.random.default_rng(0).normal(size=(8000, 96))
    slow = rates.up(noise, walk.skeleton, np.ones(96), 0)
    assert slow.std() == pytest.approx(rates.noise_factor, rel=0.05)
    assert rates.noise_factor == pytest.approx(np.sqrt(1 / (2 * np.sqrt(np.pi) * 1.5)))


def test_a_gap_is_one_for_the_frames_beside_it(walk):
    rates = match_rates(1 / 30, 1 / 120)
    hidden = np.zeros((4, 1), dtype=bool)
    hidden[1] = True
    marked = rates.up_mask(hidden, 13)[:, 0]
    np.testing.assert_array_equal(np.flatnonzero(marked), range(1, 8))


@pytest.mark.parametrize(
    ("fps", "period"), [(120, 1), (30, 1), (100, 5), (50, 5), (240, 2), (90, 3)]
)
def test_the_grids_meet_again_after_some_frames(fps, period):
    assert match_rates(1 / fps, 1 / 120).period == period
