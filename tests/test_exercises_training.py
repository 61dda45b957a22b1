"""The checks of notebook 05 accept right answers and meet each typical mistake with its hint."""

import numpy as np
import pytest
import torch

from mocaplab.datasets import clip_digest
from mocaplab.exercises.answers import NOT_YET
from mocaplab.exercises.training import (
    check_curves,
    check_leaks,
    check_loss,
    check_noise_range,
    mystery_curves,
)

ODD = ["text", 3.0, (), [1, "a"], {"a": 1}, 1j, float("nan"), True, b"x", object(), [None] * 4]
ERRORS = {
    0.1: {"one": 0.75, "range": 0.5},
    0.5: {"one": 0.9, "range": 0.903},
    0.9: {"one": 1.5, "range": 1.3},
}


@pytest.fixture(scope="module")
def clips(embedded):
    return [clip.slice_frames(0, 20) for clip in embedded.clips[:6]]


@pytest.fixture
def leaks(clips):
    return lambda answer: check_leaks(answer, clips)


def noise(answer):
    return check_noise_range(answer, ERRORS)


def test_no_answer_yet(leaks):
    assert check_loss(None) == check_curves(None) == leaks(None) == noise(None) == NOT_YET


@pytest.mark.parametrize("odd", ODD, ids=lambda odd: type(odd).__name__)
def test_odd_answers_get_a_sentence(odd, leaks):
    for answer in (odd, lambda *_: odd):
        for check in (check_loss, check_curves, leaks, noise):
            text = check(answer)
            assert len(text) > 10
            assert not text.startswith("Right")


def loss(cleaned, clean, std, weight, *, power=2, of=2):
    spread = (std**power).mean(dim=-1, keepdim=True)
    error = (cleaned - clean).abs() ** of * std**power / spread
    w = weight[..., None].expand(error.shape)
    return (error * w).sum() / w.sum()


def unweighted(cleaned, clean, std, weight):
    return loss(cleaned, clean, torch.ones_like(std), weight)


def in_numpy(cleaned, clean, std, weight):
    cleaned, clean, std, weight = (t.numpy() for t in (cleaned, clean, std, weight))
    error = (cleaned - clean) ** 2 * std**2 / (std**2).mean(axis=2, keepdims=True)
    return float(error[weight == 1].mean())


def per_piece(cleaned, clean, std, weight):
    ones = [loss(*(t[i : i + 1] for t in (cleaned, clean, std, weight))) for i in range(3)]
    return sum(ones) / 3


def degrees(cleaned, clean, std, weight):
    return unweighted(cleaned * std, clean * std, std, weight)


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (loss, "Right"),
        (in_numpy, "Right"),
        (lambda c, t, s, w: loss(c.clone().requires_grad_(), t, s, w), "Right"),
        (lambda c, t, s, w: loss(c, t, s, torch.ones_like(w)), "margins count"),
        (lambda c, t, s, w: loss(c, t, s, w) * w.mean(), "divide by all frames"),
        (lambda c, t, s, w: loss(c, t, s, w) * 4, "several channels"),
        (lambda c, t, s, w: loss(c, t, s, w) * w.sum() * 4, "That is the sum"),
        (lambda c, t, s, w: loss(c, t, s, 1 - w), "margins alone"),
        (unweighted, "count the same"),
        (lambda *a: loss(*a, power=1), "std must be squared"),
        (degrees, "degrees squared"),
        (lambda c, t, s, w: degrees(c, t, s, w) / (s**2).mean(), "one spread"),
        (lambda *a: loss(*a).sqrt(), "the root"),
        (per_piece, "each piece's mean"),
        (lambda *a: -loss(*a), "sign"),
        (lambda c, t, s, w: 0.5, "is not it"),
        (lambda c, t, s, w: (c - t) ** 2, "one number"),
        (lambda c, t, s, w: (c - t) * w, "stopped with RuntimeError"),
        (lambda *a: None, "returns nothing"),
        (0.5, "the function itself"),
    ],
)
def test_loss(answer, words):
    assert words in check_loss(answer)


def test_mean_absolute_error_is_recognised():
    def absolute(c, t, s, w):
        spread = (s**2).mean(dim=-1, keepdim=True)
        error = ((c - t).abs() * s / spread.sqrt()) * w[..., None]
        return error.sum() / w[..., None].expand(error.shape).sum()

    assert "absolute" in check_loss(absolute)


def test_the_curves_show_what_they_are_called():
    curves = mystery_curves()
    last = {letter: (a[-5:].mean(), v[-5:].mean()) for letter, (a, v) in curves.items()}
    assert last["A"][1] > 1.5 * last["A"][0]
    assert curves["A"][1][8:14].mean() < last["A"][1]
    assert last["B"][0] > last["C"][0]
    assert abs(last["C"][1] - last["C"][0]) < 0.002
    assert last["D"][0] > 0.8 * curves["D"][0][:5].mean()


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        ({"A": "overfit", "B": "too fast", "C": "fine", "D": "underfit"}, "Right"),
        (["overfit", "Too fast", "fine", "underfit "], "Right"),
        (["underfit", "too fast", "fine", "overfit"], "swapped"),
        (["overfit", "too fast", "underfit", "fine"], "2 of 4 are right. C: "),
        (["fine", "too fast", "fine", "underfit"], "dashed line"),
        (["overfit", "underfit", "fine", "underfit"], "become lower at all"),
        (["overfit", "too fast", "fine", "fine"], "Would you stop here"),
        (["overfit", "too fast", "good", "underfit"], "no reading 'good'"),
        (["overfit"], "a word for each letter"),
        ({"A": "overfit"}, "a word for each letter"),
    ],
)
def test_curves(answer, words):
    assert words in check_curves(answer)


def by_digest(train, validation, test):
    seen = {clip_digest(clip) for clip in train + validation}
    return [clip.name for clip in test if clip_digest(clip) in seen]


def by_numbers(train, validation, test):
    return {
        t.name
        for t in test
        for s in train + validation
        if t.channels.shape == s.channels.shape and np.array_equal(t.channels, s.channels)
    }


def by_name(train, validation, test):
    names = {clip.name for clip in train + validation}
    return [clip.name for clip in test if clip.name in names]


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (by_digest, "Right"),
        (by_numbers, "Right"),
        (lambda a, v, t: [c for c in t if c.name in by_digest(a, v, t)], "Right"),
        (by_name, "compare the numbers"),
        (lambda a, v, t: by_digest(a, [], t), "validation clips"),
        (lambda a, v, t: by_digest([], v, t), "compare the numbers"),
        (lambda a, v, t: by_name(a, [], t), "only with the training clips"),
        (lambda a, v, t: by_digest(t, [], a + v), "have in training"),
        (lambda a, v, t: {*by_digest(a, v, t), *by_name(a, v, t)}, "its numbers are new"),
        (lambda a, v, t: {c.name for c in t} - set(by_digest(a, v, t)), "the honest ones"),
        (lambda a, v, t: [c.name for c in t], "Not all"),
        (lambda a, v, t: [], "found none"),
        (lambda a, v, t: ["new_take", "a"], "1 wrongly accused"),
        (lambda a, v, t: [0, 1], "the names"),
        (lambda a, v, t: "new_take", "the names"),
        (lambda a, v, t: a + 1, "TypeError"),
        (["new_take"], "the function itself"),
    ],
)
def test_leaks(answer, words, leaks):
    assert words in leaks(answer)


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        ({0.1: "range", 0.5: "one", 0.9: "range"}, "Right"),
        ({"0.1": "range", "0.5": "range", "0.9": "range"}, "Right"),  # at 0.5 they are equal
        (["range", "one", "range"], "Right"),
        (["one", "one", "one"], "not the best one everywhere"),
        (["one", "one", "range"], "Not at 0.1"),
        (["range", "one", "one"], "Not at 0.9"),
        (["range", "one"], "for each amount"),
        (["range", "one", "both"], "for each amount"),
    ],
)
def test_noise_range(answer, words):
    assert words in noise(answer)
