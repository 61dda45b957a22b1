"""The checks of notebook 10 accept right answers and meet each typical mistake with its hint."""

import numpy as np
import pytest

from mocaplab.exercises.answers import NOT_YET
from mocaplab.exercises.reproduction import (
    COMPARISONS,
    REASONS,
    check_ratio,
    check_unfair,
    check_verdict,
)

ODD = [3.0, [1, "a"], 1j, float("nan"), float("inf"), True, b"x", object(), (), {"a": 1}]


def test_no_answer_yet():
    assert check_verdict(None, 0.6, (0.8, 0.7, 0.9)) == NOT_YET
    assert check_ratio(None) == check_unfair(None) == NOT_YET


@pytest.mark.parametrize("odd", ODD)
def test_odd_answers_get_a_sentence(odd):
    for text in (
        check_verdict(odd, 0.6, (0.8, 0.7, 0.9)),
        check_ratio(odd),
        check_ratio(lambda *_: odd),
        check_ratio(lambda: odd),
        check_unfair(odd),
    ):
        assert isinstance(text, str)
        assert not text.startswith("Right")


CASES = {  # the right word: an interval, and what each wrong word is answered
    "holds": ((0.6, 0.5, 0.7), {"weaker": "Does the interval reach", "fails": "below 1"}),
    "weaker": ((0.8, 0.7, 0.9), {"holds": "Does the interval reach", "open": "can be said"}),
    "fails": ((1.2, 1.1, 1.3), {"holds": "which side of 1", "open": "Something can be said"}),
    "open": ((0.8, 0.5, 1.1), {"holds": "1 is inside", "fails": "1 is inside"}),
}


@pytest.mark.parametrize("word", CASES)
def test_verdicts(word):
    ours, hints = CASES[word]
    assert check_verdict(word, 0.6, ours).startswith("Right")
    assert check_verdict(f" {word.upper()} ", 0.6, ours).startswith("Right")
    for wrong, hint in hints.items():
        assert hint in check_verdict(wrong, 0.6, ours)
    assert "one of holds, weaker, fails, open" in check_verdict("good", 0.6, ours)


def test_an_interval_around_1_that_rules_the_papers_out():
    assert check_verdict("fails", 0.6, (1.0, 0.9, 1.1)).startswith("Right")
    assert "Something can be said" in check_verdict("open", 0.6, (1.0, 0.9, 1.1))


def common(ours, theirs):
    return [clip for clip in ours if clip in theirs]


def right(ours, theirs):
    clips = common(ours, theirs)
    return np.mean([ours[c] for c in clips]) / np.mean([theirs[c] for c in clips])


def test_ratios():
    assert check_ratio(right).startswith("Right")
    assert check_ratio(lambda a, b: [right(a, b)]).startswith("Right")
    wrong = {
        "You took all clips": lambda a, b: np.mean([*a.values()]) / np.mean([*b.values()]),
        "mean of the clips' ratios": lambda a, b: np.mean([a[c] / b[c] for c in common(a, b)]),
        "theirs by ours": lambda a, b: right(b, a),
        "difference of the means": lambda a, b: (
            np.mean([a[c] for c in common(a, b)]) - np.mean([b[c] for c in common(a, b)])
        ),
        "Not every clip is in both": lambda a, b: sum(a[c] / b[c] for c in a),
        "you get 0.1": lambda a, b: 0.1,
        "returns nothing": lambda a, b: None,
        "by their names": lambda a, b: (
            sum(a[c] for c in a if c in b) / sum(list(b.values())[:2])
            if "walk" in a
            else sum(a.values()) / (2 * sum(b.values()))
        ),
        "Give the function itself": 0.71,
    }
    for hint, answer in wrong.items():
        assert hint in check_ratio(answer)


def test_unfair_comparisons():
    for answer in ({"A", "C", "E"}, ["e", "c", "a"], "ACE", "A, C, E", ("A", "C", "E", "A")):
        assert check_unfair(answer).startswith("Right")
    assert "D is fair: tuning on training clips" in check_unfair("ACED")
    assert "B is fair" in check_unfair("AB")
    assert "F is fair: fairness is about what" in check_unfair(["F"])
    assert "2 more are" in check_unfair({"A"})
    assert "1 more is" in check_unfair({"A", "E"})
    assert "no comparison 'Z'" in check_unfair("AZ")
    assert "3 more are" in check_unfair("")
    assert set(REASONS) == set(COMPARISONS)
