"""The checks of notebook 11: right answers pass, typical wrong ones get their own hint."""

import math

import numpy as np
import pytest

from mocaplab.corruption import corrupt
from mocaplab.exercises.answers import NOT_YET
from mocaplab.exercises.beyond import (
    check_mixing_weight,
    check_where_it_loses,
    check_white_noise_left,
)
from mocaplab.filters import GaussianDenoiser, Untouched


@pytest.mark.parametrize(
    "rule",
    [
        lambda a, b: b / (a + b),
        lambda a, b: (1 / a) / (1 / a + 1 / b),
        lambda a, b: np.array([b / (a + b)]),
    ],
)
def test_right_mixing_weights(rule):
    assert check_mixing_weight(rule).startswith("Right")


@pytest.mark.parametrize(
    ("rule", "hint"),
    [
        (lambda a, b: a / (a + b), "larger weight to the worse"),
        (lambda a, b: math.sqrt(b) / (math.sqrt(a) + math.sqrt(b)), "standard deviations"),
        (lambda a, b: 0.5, "Equal weights"),
        (lambda a, b: float(a < b), "throws away"),
        (lambda a, b: b / a, "from 0 to 1"),
        (lambda a, b: 0.123, "slope"),
        (lambda a, b: None, "returns nothing"),
        (lambda a, b: "much", "one number"),
        (lambda a: a, "TypeError"),
        (3, "function itself"),
    ],
)
def test_wrong_mixing_weights(rule, hint):
    assert hint in check_mixing_weight(rule)


def test_noise_left_agrees_with_noise_that_was_drawn():
    noise = np.random.default_rng(0).normal(size=200_000)
    taps = np.arange(-16, 17)
    weights = np.exp(-0.5 * (taps / 4) ** 2)
    left = np.convolve(noise, weights / weights.sum(), "valid").std()
    assert check_white_noise_left(left, sigma=4).startswith("Right")


@pytest.mark.parametrize(
    ("answer", "hint"),
    [
        (0.0705, "variance"),
        (1.0, "squares"),
        (0.25, "wider than sigma"),
        (0.5, "wider than sigma"),
        (0.174, "equal weights"),
        (2.66, "sum first"),
        (0.734, "taken away"),
        (0.9, "sum of w^2"),
        ("a lot", "one number"),
        (np.nan, "one number"),
    ],
)
def test_wrong_noise_left(answer, hint):
    assert hint in check_white_noise_left(answer, sigma=4)


@pytest.fixture(scope="module")
def clips(embedded):
    return [
        corrupt(c.slice_frames(0, 150), "angular:0.5", rng=np.random.default_rng(i))
        for i, c in enumerate(embedded.clips[:4])
    ]


def test_where_it_loses(clips):
    train, test = clips[:2], clips[2:]
    assert check_where_it_loses("spikes", Untouched(), train, test).startswith("Right")
    wide = GaussianDenoiser(0.03)
    assert "no clear win" in check_where_it_loses("biased", wide, train, test)
    assert "CORRUPTIONS" in check_where_it_loses("spike", Untouched(), train, test)
    assert "CORRUPTIONS" in check_where_it_loses(7, Untouched(), train, test)


def test_where_the_network_wins(clips):
    class Truth:
        def denoise(self, observed, mask):
            return next(c.clean for c in clips if c.clean.name == observed.name)

    text = check_where_it_loses("angular", Truth(), clips[:2], clips[2:])
    assert "the network wins" in text


def test_not_yet(clips):
    assert check_mixing_weight(None) == NOT_YET
    assert check_white_noise_left(None, sigma=4) == NOT_YET
    assert check_where_it_loses(None, Untouched(), clips, clips) == NOT_YET
