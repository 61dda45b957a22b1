"""The checks of notebook 08 accept right answers and meet typical mistakes with their hints."""

import numpy as np
import pytest

from mocaplab.exercises.answers import NOT_YET
from mocaplab.exercises.streaming import (
    check_late_frames,
    check_live_average,
    check_look_ahead_choice,
    check_look_ahead_frames,
)

ODD = ["text", (), [1, "a"], {"a": 1}, 1j, float("nan"), float("inf"), True, b"x", object()]
AHEAD_S = (0.0, 0.025, 0.05, 0.1)
ERRORS = (2.0, 1.3, 1.05, 1.0)


def frames(answer):
    return check_look_ahead_frames(answer, delay_s=0.08, fps=(120, 30))


def late(answer):
    return check_late_frames(answer, share=0.01, fps=120, minutes=10)


def choose(answer):
    return check_look_ahead_choice(answer, AHEAD_S, ERRORS, within=0.1)


@pytest.mark.parametrize("check", [frames, late, choose, check_live_average])
def test_no_answer_yet(check):
    assert check(None) == NOT_YET


@pytest.mark.parametrize("odd", ODD)
def test_odd_answers_get_a_sentence(odd):
    for answer in (odd, lambda *_: odd):
        for check in (frames, late, choose, check_live_average):
            text = check(answer)
            assert len(text) > 10
            assert not text.startswith("Right")


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        ((9, 2), "Right"),
        ([9.0, 2.0], "Right"),
        (np.array([9, 2]), "Right"),
        ((2, 9), "wrong order"),
        ((9.6, 2.4), "whole ones"),
        ((10, 2), "Round down"),
        ((9, 3), "Round down"),
        ((9, 9), "other rate"),
        ((80, 80), "milliseconds"),
        ((9600, 2400), "You multiplied"),
        ((1500, 375), "You divided"),
        ((7, 2), "last 58.33 ms"),
        ((9, 2, 1), "two whole numbers"),
    ],
)
def test_look_ahead_frames(answer, words):
    assert words in frames(answer)


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (720, "Right"),
        (np.float64(720), "Right"),
        (1.2, "one second"),
        (72, "one minute"),
        (72000, "all frames"),
        (71280, "in time"),
        (36000, "Above the median"),
        (6, "You counted seconds"),
        (5, "First count"),
    ],
)
def test_late_frames(answer, words):
    assert words in late(answer)


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (0.05, "Right: 50 ms, 5 %"),
        ([0.05], "Right"),
        (0.1, "a shorter look-ahead"),
        (0.025, "30 % above"),
        (0, "100 % above"),
        (50, "milliseconds"),
        (2, "place in the list"),
        (0.07, "none of the look-aheads"),
    ],
)
def test_look_ahead_choice(answer, words):
    assert words in choose(answer)


def average(values, n_past, n_ahead):
    return [np.mean(values[max(0, t - n_past) : t + n_ahead + 1]) for t in range(len(values))]


def vectorised(values, n_past, n_ahead):
    window = np.ones(n_past + 1 + n_ahead)
    padded = np.pad(values, (n_past, n_ahead))
    counts = np.convolve(np.pad(np.ones_like(values), (n_past, n_ahead)), window, "valid")
    return np.convolve(padded, window, "valid") / counts


def divided_by_all(values, n_past, n_ahead):
    n = n_past + 1 + n_ahead
    return [sum(values[max(0, t - n_past) : t + n_ahead + 1]) / n for t in range(len(values))]


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (average, "Right"),
        (vectorised, "Right"),
        (divided_by_all, "divide by the number that you have"),
        (lambda v, p, a: np.array(average(v, p, a)) * (p + 1 + a), "the sum"),
        (lambda v, p, a: average(v, p, 0), "does not look ahead"),
        (lambda v, p, a: average(v, a, p), "mixed up"),
        (lambda v, p, a: average(v, p, a - 1) if a else average(v, p, a), "One frame is missing"),
        (lambda v, p, a: average(v, p + 1, a), "too early"),
        (lambda v, p, a: average(v, p, a + 1), "too late"),
        (lambda v, p, a: average(v, p, a)[: len(v) - a], "flushed"),
        (lambda v, p, a: [v[0]] * a + average(v, p, a)[: len(v) - a], "come late"),
        (lambda v, p, a: average(v, p, a)[:5], "came out"),
        (lambda v, p, a: v * 0, "should be the mean of frames 0 to 6"),
        (lambda v, p, a: None, "returns nothing"),
        (lambda v, p, a: v[99], "IndexError"),
        (3, "Give the function itself"),
    ],
)
def test_live_average(answer, words):
    assert words in check_live_average(answer)


def test_checks_never_print_the_answer():
    assert "720" not in late(5)
    assert "50 ms" not in choose(0.025)
