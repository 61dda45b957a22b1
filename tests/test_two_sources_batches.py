import numpy as np
import pytest

from mocaplab.two_sources.batches import (
    ClipWindows,
    paper_pair,
    towards_pure_noise,
    varied_pair,
    window_noise,
)
from mocaplab.two_sources.noise import SourceNoise, source_noise
from mocaplab.two_sources.segments import SegmentClip

STILL = SourceNoise(0, 0, 0, 0, 0, 0, 0)


def numbered(n_frames, first, name):
    """A clip whose frames can be told from each other: turns about x that grow."""
    angles = 1e-3 * (first + np.arange(n_frames))
    q = np.stack([np.cos(angles), np.sin(angles), 0 * angles, 0 * angles], axis=-1)
    return SegmentClip(q[:, None], 0.01, ("a",), name)


def frames_of(windows):
    return np.round(1e3 * np.arctan2(windows[..., 0, 1], windows[..., 0, 0])).astype(int)


def resting(n, frames=40, joints=5):
    q = np.zeros((n, frames, joints, 4))
    q[..., 0] = 1
    return q


@pytest.fixture
def rng():
    return np.random.default_rng(0)


def test_all_windows_can_be_drawn_and_none_crosses_two_clips(rng):
    windows = ClipWindows([numbered(8, 0, "a"), numbered(6, 100, "b"), numbered(4, 500, "c")], 5)
    assert len(windows) == 4 + 2
    drawn = frames_of(windows.draw(300, rng=rng))
    assert set(drawn[:, 0]) == {0, 1, 2, 3, 100, 101}
    assert (np.diff(drawn, axis=1) == 1).all()


def test_a_stride_is_a_lower_frame_rate(rng):
    windows = ClipWindows([numbered(20, 0, "a")], 5, stride=3)
    assert windows.frame_time == pytest.approx(0.03)
    assert (np.diff(frames_of(windows.draw(20, rng=rng)), axis=1) == 3).all()


def test_too_short_clips_are_refused():
    with pytest.raises(ValueError, match="at least 60 frames, the longest has 20"):
        ClipWindows([numbered(20, 0, "a")], 60)


def test_window_noise_has_the_statistics_of_source_noise(rng):
    noise = SourceNoise(lost_probability=0.05)
    clean = resting(400)
    together = window_noise(clean, noise, rng=rng)
    alone = np.stack([source_noise(each, noise, rng=rng) for each in clean])
    for noisy in (together, alone):
        np.testing.assert_allclose(np.linalg.norm(noisy, axis=-1), 1)
    lost = [np.mean(noisy[..., 0] < 0.99) for noisy in (together, alone)]
    assert lost[0] == pytest.approx(lost[1], rel=0.05)
    # The median over time is the bias, what is left is imprecision.
    bias = [np.median(noisy[..., 1:], axis=1) for noisy in (together, alone)]
    assert bias[0].std() == pytest.approx(bias[1].std(), rel=0.1)
    rest = [
        np.median(np.abs(noisy[..., 1:] - b[:, None]))
        for noisy, b in zip((together, alone), bias, strict=True)
    ]
    assert rest[0] == pytest.approx(rest[1], rel=0.1)


def test_sizes_are_drawn_once_a_window(rng):
    """With a deviation that varies much from window to window, few windows are alike."""
    noise = SourceNoise(0, 0, imprecision_mean=0, imprecision_std=0.01, lost_probability=0)
    spread = window_noise(resting(300), noise, rng=rng)[..., 1:].std(axis=(1, 2, 3))
    assert np.abs(spread).mean() == pytest.approx(0.01 * np.sqrt(2 / np.pi), rel=0.15)
    assert spread.std() > 0.004


def test_the_amount_of_each_window_counts(rng):
    amount = np.array([0.0, 1.0, 4.0])
    noise = SourceNoise(bias_std=0, imprecision_std=0, lost_probability=0)
    noisy = window_noise(resting(3, 400), noise, amount, rng=rng)
    spread = noisy[..., 1:].std(axis=(1, 2, 3))
    np.testing.assert_allclose(spread, 0.005 * np.sqrt(2) * amount, rtol=0.25)
    np.testing.assert_array_equal(noisy[0], resting(1, 400)[0])


def test_pure_noise_knows_nothing_of_the_pose(rng):
    clean = resting(50)
    np.testing.assert_array_equal(towards_pure_noise(clean, 0.0, rng=rng), clean)
    w = towards_pure_noise(clean, 1.0, rng=rng)[..., 0]
    # |w| of random rotations has the mean 4 / (3 pi).
    assert w.mean() == pytest.approx(4 / (3 * np.pi), rel=0.02)


def test_both_sources_are_spoilt_and_differ(rng):
    for pair in (paper_pair, varied_pair):
        batch = pair(resting(64), 0.01, SourceNoise(), rng=rng)
        assert batch.a.shape == batch.b.shape == (64, 40, 5, 4)
        assert not np.array_equal(batch.a, batch.b)
        assert batch.frame_time == 0.01
    errors = [np.abs(x - batch.clean).sum(axis=(1, 2, 3)) for x in (batch.a, batch.b)]
    ratio = np.log((errors[0] + 0.01) / (errors[1] + 0.01))
    assert (np.abs(ratio) > 2).any()  # in some windows one source is much better


def test_without_noise_nothing_changes(rng):
    clean = resting(2)
    np.testing.assert_array_equal(window_noise(clean, STILL, rng=rng), clean)
