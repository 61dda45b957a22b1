"""Bootstrap intervals: as scipy computes them, and how often they hold the truth."""

import numpy as np
import pytest
from scipy import stats

from mocaplab.comparison.bootstrap import (
    Interval,
    mean_intervals,
    paired_interval,
    percentile_interval,
    resampled_means,
)


def rng(seed=0):
    return np.random.default_rng(seed)


@pytest.mark.parametrize("clips", [15, 50])
def test_intervals_of_the_mean_equal_scipys(clips):
    values = rng(1).lognormal(size=(3, clips))
    ours = mean_intervals(values, rng=rng(2), resamples=40_000)
    for row, interval in zip(values, ours, strict=True):
        theirs = stats.bootstrap(
            (row,), np.mean, n_resamples=40_000, method="percentile", random_state=rng(3)
        ).confidence_interval
        assert interval.value == pytest.approx(row.mean())
        width = theirs.high - theirs.low  # both are random: a hundredth or so of the width
        assert interval.low == pytest.approx(theirs.low, abs=0.02 * width)
        assert interval.high == pytest.approx(theirs.high, abs=0.02 * width)


def ratio_of_means(a, b, axis=-1):
    return np.mean(a, axis=axis) / np.mean(b, axis=axis)


def difference_of_means(a, b, axis=-1):
    return np.mean(a, axis=axis) - np.mean(b, axis=axis)


@pytest.mark.parametrize(
    ("how", "statistic"), [("ratio", ratio_of_means), ("difference", difference_of_means)]
)
def test_paired_intervals_equal_scipys(how, statistic):
    hard = rng(1).lognormal(size=30)  # what both methods find hard
    a, b = hard * rng(2).uniform(0.7, 1.0, 30), hard * rng(3).uniform(0.8, 1.1, 30)
    ours = paired_interval(a, b, how=how, rng=rng(4), resamples=40_000)
    theirs = stats.bootstrap(
        (a, b), statistic, paired=True, n_resamples=40_000, method="percentile", random_state=rng(5)
    ).confidence_interval
    width = theirs.high - theirs.low
    assert ours.value == pytest.approx(statistic(a, b))
    np.testing.assert_allclose(ours[1:], theirs, atol=0.02 * width)


def covered(draw, truth, trials, clips, confidence):
    held = 0
    for trial in range(trials):
        interval = mean_intervals(
            draw(rng(trial), clips)[None],
            rng=rng(10_000 + trial),
            confidence=confidence,
            resamples=500,
        )[0]
        held += interval.low <= truth <= interval.high
    return held / trials


def test_intervals_hold_the_true_mean_as_often_as_they_say():
    # 500 trials: the share itself is known to about 1 percent point, 1.8 in the last line.
    assert 0.91 < covered(lambda r, n: r.normal(3, 1, n), 3, 500, 50, 0.95) < 0.98
    assert 0.86 < covered(lambda r, n: r.normal(3, 1, n), 3, 500, 10, 0.95) < 0.95
    assert 0.73 < covered(lambda r, n: r.gamma(4, 1, n), 4, 500, 50, 0.80) < 0.85


def test_pairing_holds_the_true_difference_and_sees_what_single_intervals_do_not():
    held = seen = overlap = 0
    for trial in range(300):
        r = rng(trial)
        hard = r.lognormal(size=40)
        a, b = hard + r.normal(0, 0.1, 40), hard + 0.1 + r.normal(0, 0.1, 40)
        interval = paired_interval(a, b, how="difference", rng=rng(trial), resamples=500)
        held += not interval.excludes(-0.1)
        seen += interval.excludes(0)
        first, second = mean_intervals([a, b], rng=rng(trial), resamples=500)
        overlap += first.high > second.low
    assert 0.90 < held / 300 < 0.98
    assert seen / 300 > 0.97
    assert overlap == 300


def test_methods_share_their_draws():
    values = rng().normal(size=20)
    first, same, shifted = resampled_means([values, values, values + 1], rng=rng())
    np.testing.assert_array_equal(first, same)
    np.testing.assert_allclose(shifted, first + 1)
    exact = paired_interval(2 * values + 9, values + 4.5, how="ratio", rng=rng())
    np.testing.assert_allclose(exact, 2)


def test_one_seed_one_interval():
    values = rng().normal(size=(2, 20))
    assert mean_intervals(values, rng=rng(1)) == mean_intervals(values, rng=rng(1))
    assert mean_intervals(values, rng=rng(1)) != mean_intervals(values, rng=rng(2))


def test_one_clip_has_an_interval_without_width():
    assert mean_intervals([[2.5]], rng=rng()) == [Interval(2.5, 2.5, 2.5)]


def test_excludes():
    assert Interval(1, 0.5, 2).excludes(0)
    assert Interval(-1, -2, -0.5).excludes(0)
    assert not Interval(1, 0, 2).excludes(0)
    assert not Interval(np.nan, np.nan, np.nan).excludes(0)


def test_nonsense_is_refused():
    with pytest.raises(ValueError, match=r"shape \(methods, clips\), got \(3,\)"):
        resampled_means([1, 2, 3], rng=rng())
    with pytest.raises(ValueError, match=r"got \(2, 0\)"):
        resampled_means(np.zeros((2, 0)), rng=rng())
    with pytest.raises(ValueError, match="NaN for method 1, clip 0"):
        resampled_means([[1.0], [np.nan]], rng=rng())
    with pytest.raises(ValueError, match="between 0 and 1, got 95"):
        percentile_interval(0, np.zeros(3), 95)
    with pytest.raises(ValueError, match="'difference' or 'ratio', got 'quotient'"):
        paired_interval([1], [1], how="quotient", rng=rng())
    with pytest.raises(ValueError, match=r"got shapes \(1,\) and \(2,\)"):
        paired_interval([1], [1, 2], how="ratio", rng=rng())
    assert np.isnan(paired_interval([1, 2], [0, 0], how="ratio", rng=rng()).value)
