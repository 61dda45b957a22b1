"""The checks of notebook 02 on gaps accept right answers and meet typical mistakes with hints."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from mocaplab.exercises.answers import NOT_YET
from mocaplab.exercises.gap_statistics import (
    check_gap_lengths,
    check_start_probability,
    hidden_share_expected,
)
from mocaplab.noise.gaps import gap_mask, hidden_share, hide

RIGHT = "Right:"
ODD = ("0.3", "text", [1, 2], [], {}, object(), float("nan"), True, 1j, [[1], [2, 3]], b"x")


def first(value, *_):
    return value


@pytest.mark.parametrize("check", [check_gap_lengths, check_start_probability])
def test_nothing_and_odd_answers(check):
    assert check(None) == NOT_YET
    functions = [partial(first, value) for value in ODD] + [lambda: 1, lambda *_: 1 / 0]
    for answer in [*ODD, *functions, lambda *_: None]:
        sentence = check(answer)
        assert len(sentence) > 10
        assert not sentence.startswith(RIGHT)


# ------------------------------------------------------------------ lengths of gaps


def lengths_by_steps(observed, frame_time):
    steps = np.diff(np.concatenate([[0], ~np.asarray(observed), [0]]).astype(int))
    return (np.flatnonzero(steps == -1) - np.flatnonzero(steps == 1)) * frame_time


def lengths_by_loop(observed, frame_time):
    lengths, run = [], 0
    for seen in observed:
        if not seen:
            run += 1
        elif run:
            lengths.append(run * frame_time)
            run = 0
    return tuple(lengths)


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (lengths_by_steps, RIGHT),
        (lengths_by_loop, RIGHT),
        (lambda o, ft: sorted(lengths_by_loop(o, ft), reverse=True), RIGHT),
        (lambda o, ft: lengths_by_steps(~o, ft), "where the mask is False"),
        (lambda o, ft: lengths_by_steps(o, 1), "Multiply by the frame time"),
        (lambda o, ft: lengths_by_steps(~o, 1), "in frames. A gap is where"),
        (lambda o, ft: lengths_by_steps(o, 1 / ft), "You divided"),
        (lambda o, ft: lengths_by_steps(o, ft) - ft, "one frame short"),
        (lambda o, ft: lengths_by_steps(o, ft) + ft, "one frame too long"),
        (lambda o, ft: (~o).sum() * ft, "all gaps together"),
        (lambda o, ft: lengths_by_steps(o, ft)[:-1], "last gap is missing"),
        (lambda o, ft: lengths_by_steps(o, ft).max(), "longest gap alone"),
        (lambda o, ft: len(lengths_by_steps(o, ft)), "how many gaps"),
        (lambda o, ft: np.ones(3), "your function returns"),
        (lambda o, ft: list(lengths_by_loop(o, ft)) or [0.0], "has no lengths"),
        (lambda o, ft: lengths_by_steps(o, ft) if not o.all() else 1 / 0, "ZeroDivisionError"),
        (lambda o, ft: "long", "Return a list"),
        ([0.03], "the function itself"),
    ],
)
def test_gap_lengths(answer, words):
    assert words in check_gap_lengths(answer)


# ------------------------------------------------------------------ start probability


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (-np.log(0.95) / 30, RIGHT),
        (0.05 / 30, RIGHT),
        (0.0017, RIGHT),
        (0.05, "the share itself"),
        (5 / 30, "5 for 5 %"),
        (0.2, "divided by seconds"),
        (0.205, "in a second"),
        (0.05 / 15, "the default"),
        (1.5, "You multiplied"),
        (0.95 / 30, "swap seen and hidden"),
        (-np.log(0.05) / 30, "swap seen and hidden"),
        (-1, "between 0 and 1"),
        (0.002, "less often"),
        (0.001, "more often"),
    ],
)
def test_start_probability(answer, words):
    assert words in check_start_probability(answer)


def test_expected_share_is_that_of_many_clips(embedded):
    rng = np.random.default_rng(1)
    long = max(embedded.clips, key=lambda clip: clip.n_frames)
    masks = [gap_mask(long, 0.01, rng=rng) for _ in range(20)]
    share = np.mean([hidden_share(hide(long, mask)) for mask in masks])
    assert share == pytest.approx(hidden_share_expected(0.01, 15), rel=0.05)
    assert hidden_share_expected(1e-6, 15) == pytest.approx(15e-6, rel=1e-3)
