"""The checks of notebook 03 accept right answers and meet each typical mistake with its hint."""

import numpy as np
import pytest

from mocaplab.corruption import corrupt
from mocaplab.exercises.answers import NOT_YET
from mocaplab.exercises.smoothing import (
    check_flattering_measure,
    check_frames_to_seconds,
    check_lag,
    check_moving_average,
    check_tuning,
)
from mocaplab.filters import GaussianDenoiser
from mocaplab.measures.by_name import rms_all_deg
from mocaplab.tuning import SIGMA_GRID_S, tune_gaussian

ODD = ["text", 3.0, (), [1, "a"], {"a": 1}, 1j, float("nan"), float("inf"), True, b"x", object()]


def convert(answer):
    return check_frames_to_seconds(answer, frames=7, fps=120, other_fps=30)


@pytest.fixture(scope="module")
def lists(embedded):
    """Two lists of training clips that want different widths."""
    rng = np.random.default_rng(0)
    clips = [embedded[name].slice_frames(0, 170) for name in ("walk_01", "run_03", "kick_02")]
    first = [corrupt(clip, "angular:0.3", rng=rng) for clip in clips]
    mixed = [
        corrupt(clip, f"angular:{k}", rng=rng)
        for clip, k in zip(clips, (0.02, 0.02, 1.5), strict=True)
    ]
    return first, mixed


@pytest.fixture(scope="module")
def contest(embedded):
    rng = np.random.default_rng(0)
    clips = [corrupt(embedded[n].slice_frames(0, 300), rng=rng) for n in ("walk_06", "kick_10")]
    weak, fair = GaussianDenoiser(0.125), GaussianDenoiser(0.0316)
    return lambda answer: check_flattering_measure(answer, weak, fair, clips)


def test_no_answer_yet(lists, contest):
    assert convert(None) == contest(None) == check_tuning(None, *lists) == NOT_YET
    assert check_moving_average(None) == check_lag(None) == NOT_YET


@pytest.mark.parametrize("odd", ODD)
def test_odd_answers_get_a_sentence(odd, lists, contest):
    for answer in (odd, lambda *_: odd):
        for text in (
            convert(answer),
            contest(answer),
            check_moving_average(answer),
            check_tuning(answer, *lists),
            check_lag(answer),
        ):
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


def tune_by_hand(clips, error=rms_all_deg):
    def mean(sigma_s):
        cleaned = [GaussianDenoiser(sigma_s).denoise(c.observed, c.mask) for c in clips]
        return np.mean([error(m, c.clean) for m, c in zip(cleaned, clips, strict=True)])

    return min(SIGMA_GRID_S, key=mean)


def squared(motion, clean):
    return np.sum((motion.channels - clean.channels) ** 2)


def each(clips):
    return [tune_gaussian([clip])[0] for clip in clips]


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (lambda clips: tune_gaussian(clips)[0], "Right"),
        (lambda clips: np.array([tune_gaussian(clips)[0] * 1.02]), "Right"),
        (tune_by_hand, "Right"),
        (lambda clips: tune_by_hand(clips, squared), "nearly all the say"),
        (lambda clips: each(clips)[-1], "last clip alone"),
        (lambda clips: int(np.argmin(abs(SIGMA_GRID_S - tune_gaussian(clips)[0]))), "a place"),
        (lambda clips: 120 * tune_gaussian(clips)[0], "in frames"),
        (lambda clips: 1000 * tune_gaussian(clips)[0], "in milliseconds"),
        (lambda clips: 0.1, "same width for two different"),
        (lambda clips: 0.25, "the largest error"),
        (lambda clips: 0.1 + tune_gaussian(clips)[0], "not the best"),
        (lambda clips: 5.5, "same width for two different"),
        (lambda clips: -tune_gaussian(clips)[0], "Which unit"),
        (lambda clips: tune_gaussian(clips)[1], "one number"),
        (lambda clips: np.mean(each(clips)), "mean of each clip"),
        (lambda clips: each(clips)[0], "first clip alone"),
        (lambda clips: 1 / 0, "ZeroDivisionError"),
        (lambda clips: None, "returns nothing"),
        (0.03, "any list of clips"),
    ],
)
def test_tuning(answer, words, lists):
    assert words in check_tuning(answer, *lists)


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


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        ("jitter_cm_s3", "Right"),
        ("foot_skate_cm_s", "Right"),
        ("rms_all_deg", "loses"),
        ("mpjpe_cm", "loses"),
        ("peak_speed_loss_percent", "loses"),
        ("gap_rms_deg", "no value"),
        ("harm_deg", "no value"),
        ("jitter", "no measure"),
    ],
)
def test_flattering_measure(answer, words, contest):
    assert words in contest(answer)
