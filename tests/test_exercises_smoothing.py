"""Notebook 03's checks on curves accept right answers and meet typical mistakes with hints."""

import numpy as np
import pytest

from mocaplab.exercises.answers import NOT_YET
from mocaplab.exercises.smoothing import (
    check_frames_to_seconds,
    check_lag,
    check_moving_average,
)

ODD = ["text", 3.0, (), [1, "a"], {"a": 1}, 1j, float("nan"), float("inf"), True, b"x", object()]


def convert(answer):
    return check_frames_to_seconds(answer, frames=7, fps=120, other_fps=30)


def test_no_answer_yet():
    assert convert(None) == check_moving_average(None) == check_lag(None) == NOT_YET


@pytest.mark.parametrize("odd", ODD)
def test_odd_answers_get_a_sentence(odd):
    for answer in (odd, lambda *_: odd):
        for text in (convert(answer), check_moving_average(answer), check_lag(answer)):
            assert len(text) > 10
            assert not text.startswith("Right")


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        ((7 / 120, 1.75), "Right"),
        ([0.058, 1.75], "Right"),
        (np.array([0.0583, 1.75]), "Right"),
        ((1.75, 0.0583), "wrong order"),
        ((58.3, 1.75), "milliseconds"),
        ((120 / 7, 1.75), "upside down"),
        ((840, 1.75), "You multiplied"),
        ((7, 1.75), "still in frames"),
        ((7 / 30, 1.75), "wrong frame rate"),
        ((0.0583, 7), "same number of frames"),
        ((0.0583, 28), "wrong way"),
        ((0.0583, 2), "do not round"),
        ((0.0583, 3), "times which rate"),
        ((0.5, 1.75), "how long does one frame last"),
        (0.0583, "two numbers"),
    ],
)
def test_frames_to_seconds(answer, words):
    assert words in convert(answer)


def average(values, window_s, frame_time, mode="symmetric", shift=0, weight=None):
    n = round(window_s / frame_time)
    padded = np.pad(values, (n // 2 + shift, n // 2 - shift), mode=mode)
    return np.convolve(padded, np.ones(n) * (1 / n if weight is None else weight), "valid")


def average_in_a_loop(values, window_s, frame_time):
    half = round(window_s / frame_time) // 2
    padded = np.pad(values, half, mode="reflect")
    return [float(padded[t : t + 2 * half + 1].mean()) for t in range(len(values))]


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (average, "Right"),
        (average_in_a_loop, "Right"),
        (lambda *a: average(*a)[:, None], "Right"),
        (lambda *a: average(*a, weight=1), "Divide by the number"),
        (lambda *a: average(*a, mode="constant"), "sink towards 0"),
        (lambda *a: average(*a, mode="edge"), "not at the ends"),
        (lambda *a: average(*a, shift=round(a[1] / a[2]) // 2), "past only"),
        (lambda *a: average(*a, shift=-(round(a[1] / a[2]) // 2)), "future only"),
        (lambda v, w, dt: average(v, w, w), "You need frames"),
        (lambda v, w, dt: np.convolve(v, np.ones(9) / 9, "valid"), "52 came out"),
        (lambda v, w, dt: average(v, 9, 1), "3 on each side|1 on each side"),
        (lambda v, w, dt: None, "returns nothing"),
        (lambda v: v, "stopped with TypeError"),
        (average(np.ones(60), 0.075, 1 / 120), "the function itself"),
    ],
)
def test_moving_average(answer, words):
    assert any(part in check_moving_average(answer) for part in words.split("|"))


def lag(smooth, clean, frame_time):
    errors = [np.mean((smooth[s:] - clean[: len(clean) - s]) ** 2) for s in range(60)]
    return 1000 * int(np.argmin(errors)) * frame_time


def lag_by_correlation(smooth, clean, frame_time):
    full = np.correlate(smooth, clean, "full")
    return 1000 * (np.argmax(full) - len(clean) + 1) * frame_time


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (lag, "Right"),
        (lag_by_correlation, "Right"),
        (lambda *a: np.array([lag(*a)]), "Right"),
        (lambda *a: round(lag(*a) / 1000 / a[2]), "in frames"),
        (lambda *a: lag(*a) / 1000, "in seconds"),
        (lambda *a: -lag(*a), "sign"),
        (lambda *a: 0, "no lag"),
        (lambda smooth, clean, dt: lag(smooth, clean, 1 / 120), "At 30 frames"),
        (lambda *a: 300, "Shift the smooth curve"),
        (lambda *a: "late", "one number"),
        (lambda *a: None, "returns nothing"),
        (41.7, "the function itself"),
    ],
)
def test_lag(answer, words):
    assert words in check_lag(answer)
