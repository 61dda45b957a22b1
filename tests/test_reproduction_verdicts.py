"""The rules of verdicts, on cases that were decided by hand."""

import numpy as np
import pytest

from mocaplab.comparison.bootstrap import Interval
from mocaplab.reproduction.verdicts import (
    FAILS,
    HOLDS,
    OPEN,
    WEAKER,
    judge_above,
    judge_alike,
    judge_at_least,
    judge_below,
    judge_every,
    judge_ratio,
    judge_size,
)

NAN = Interval(np.nan, np.nan, np.nan)


@pytest.mark.parametrize(
    ("paper", "ours", "word"),
    [
        (0.65, (0.60, 0.55, 0.70), HOLDS),  # reaches 0.65
        (0.65, (0.50, 0.45, 0.55), HOLDS),  # goes beyond it
        (0.65, (0.80, 0.75, 0.90), WEAKER),
        (0.65, (1.20, 1.10, 1.30), FAILS),  # the other way round
        (0.65, (1.00, 0.90, 1.10), FAILS),  # none, and the paper's is ruled out
        (0.65, (0.80, 0.60, 1.05), OPEN),  # both none and the paper's
        (1.25, (1.30, 1.10, 1.50), HOLDS),  # a ratio above 1 is the same turned round
        (1.25, (1.10, 1.05, 1.15), WEAKER),
        (1.25, (0.90, 0.85, 0.95), FAILS),
        (1.25, (1.02, 0.95, 1.10), FAILS),
        (1.25, (1.10, 0.95, 1.30), OPEN),
    ],
)
def test_ratios(paper, ours, word):
    assert judge_ratio(paper, Interval(*ours)).word == word


def test_nothing_measured_is_open():
    assert judge_ratio(0.5, NAN).word == OPEN
    assert judge_below(1, NAN).word == OPEN
    assert judge_size(np.nan, 0.1, 0.2).word == OPEN
    assert judge_at_least(np.nan, 0.9, 0.5).word == OPEN
    assert judge_alike([]).word == OPEN
    assert judge_alike([Interval(1, 1, 1), NAN]).word == OPEN
    assert judge_every({"a": 1.0}, {})[0].word == OPEN
    assert judge_every({"a": 1.0}, {"rival": {"b": 2.0}})[1:] == (0, 0)


def test_limits():
    assert judge_below(1, Interval(0.5, 0.4, 0.9)).word == HOLDS
    assert judge_below(1, Interval(0.9, 0.7, 1.2)).word == OPEN
    assert judge_below(1, Interval(2.0, 1.7, 2.2)).word == FAILS
    assert judge_above(1, Interval(2.0, 1.7, 2.2)).word == HOLDS
    assert judge_above(1, Interval(0.5, 0.4, 0.9)).word == FAILS
    assert judge_above(1, Interval(0.9, 0.7, 1.2)).word == OPEN
    assert [judge_size(x, 0.1, 0.2).word for x in (0.1, 0.15, 0.3)] == [HOLDS, WEAKER, FAILS]
    assert [judge_at_least(x, 0.9, 0.5).word for x in (0.9, 0.6, 0.4)] == [HOLDS, WEAKER, FAILS]


def test_alike_is_about_all_intervals():
    near, nearly = Interval(1.02, 0.95, 1.08), Interval(1.1, 0.9, 1.2)
    far, wide = Interval(1.5, 1.2, 1.8), Interval(1.1, 0.7, 1.5)
    assert judge_alike([near, near]).word == HOLDS
    assert judge_alike([near, nearly]).word == WEAKER
    assert judge_alike([near, far]).word == FAILS
    assert judge_alike([near, Interval(0.7, 0.6, 0.8)]).word == FAILS
    assert judge_alike([near, wide]).word == OPEN


def test_every_motion_counts_and_names_who_won():
    ours = {"a": 1.0, "b": 1.0, "c": 1.0, "d": 1.0, "e": 9.0}
    weak = dict.fromkeys(ours, 2.0)
    verdict, won, n = judge_every(dict(list(ours.items())[:4]), {"weak": weak})
    assert (verdict.word, won, n) == (HOLDS, 4, 4)
    verdict, won, n = judge_every(ours, {"weak": weak})
    assert (verdict.word, won, n) == (WEAKER, 4, 5)
    assert verdict.why == "lost on 1 of 5: 1 to weak"
    strong = {"a": 0.5, "b": 0.5, "c": 3.0, "d": 3.0}
    verdict, won, n = judge_every(ours, {"weak": weak, "strong": strong})
    assert (verdict.word, won, n) == (FAILS, 2, 4)  # e was not tested by all
    assert verdict.why == "lost on 2 of 4: 2 to strong"
    assert judge_every({"a": 1.0}, {"same": {"a": 1.0}})[0].word == FAILS  # no better is no win
