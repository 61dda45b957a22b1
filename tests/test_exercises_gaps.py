"""The checks of notebook 06: right answers pass, typical wrong ones draw their own hint."""

import numpy as np
import pytest

from mocaplab.exercises.answers import NOT_YET
from mocaplab.exercises.gaps import (
    check_calibration,
    check_conditional_mean,
    check_gap_rms,
    check_line,
)
from mocaplab.gap_fillers.curves import lerp_gaps
from mocaplab.noise.gaps import hide, long_gap_mask

ODD = [object(), "text", [], {}, float("nan"), np.zeros((2, 3)), lambda: None, lambda *a: "x"]


@pytest.fixture(scope="module")
def case(embedded):
    clean = embedded["walk_01"]
    mask = long_gap_mask(clean, 0.5, rng=np.random.default_rng(0))
    return lerp_gaps(hide(clean, mask)), clean, mask


@pytest.mark.parametrize("answer", [22, 22.0, np.array([22.0]), [22]])
def test_line_right(answer):
    assert check_line(answer).startswith("Right")


@pytest.mark.parametrize(
    ("answer", "hint"),
    [(34, "far end"), (28, "middle"), (10, "holds"), (46, "after the gap"), (12, "way gone")],
)
def test_line_wrong(answer, hint):
    assert hint in check_line(answer)


def test_gap_rms_right(case):
    def vectorised(filled, clean, mask):
        return np.sqrt(np.mean((filled - clean)[~mask] ** 2))

    def by_loops(filled, clean, mask):
        total = count = 0.0
        for t, c in zip(*np.nonzero(~mask), strict=True):
            total += (filled[t, c] - clean[t, c]) ** 2
            count += 1
        return (total / count) ** 0.5

    for answer in (vectorised, by_loops):
        assert check_gap_rms(answer, *case).startswith("Right")


@pytest.mark.parametrize(
    ("answer", "hint"),
    [
        (lambda f, c, m: np.sqrt(np.mean((f - c)[m] ** 2)), "turn it round"),
        (lambda f, c, m: np.sqrt(np.mean((f - c) ** 2)), "all samples"),
        (lambda f, c, m: np.mean((f - c)[~m] ** 2), "square root"),
        (lambda f, c, m: np.mean(abs(f - c)[~m]), "absolute"),
        (lambda f, c, m: np.sqrt(np.sum((f - c)[~m] ** 2)), "Take the mean"),
        (lambda f, c, m: np.radians(np.sqrt(np.mean((f - c)[~m] ** 2))), "radians"),
        (lambda f, c, m: (f - c)[~m], "one number"),
        (lambda f, c, m: 1 / 0, "ZeroDivisionError"),
        (lambda f, c, m: 77.0, "Not yet"),
        (3.0, "the function itself"),
    ],
)
def test_gap_rms_wrong(case, answer, hint):
    assert hint in check_gap_rms(answer, *case)


def by_blocks(c, hidden, x):
    v = ~hidden
    return c[np.ix_(hidden, v)] @ np.linalg.solve(c[np.ix_(v, v)], x[v])


def by_precision(c, hidden, x):
    p = np.linalg.inv(c)
    v = ~hidden
    return -np.linalg.solve(p[np.ix_(hidden, hidden)], p[np.ix_(hidden, v)] @ x[v])


def whole_vector(c, hidden, x):
    result = x.copy()
    result[hidden] = by_blocks(c, hidden, x)
    return result.tolist()


@pytest.mark.parametrize("answer", [by_blocks, by_precision, whole_vector])
def test_conditional_mean_right(answer):
    assert check_conditional_mean(answer).startswith("Right")


@pytest.mark.parametrize(
    ("answer", "hint"),
    [
        (lambda c, h, x: c[np.ix_(h, ~h)] @ x[~h], "left out the inverse"),
        (lambda c, h, x: c[np.ix_(h, ~h)] @ c[np.ix_(~h, ~h)] @ x[~h], "you multiplied"),
        (lambda c, h, x: c[np.ix_(h, ~h)] @ (x[~h] / np.diag(c)[~h]), "variances alone"),
        (lambda c, h, x: -by_blocks(c, h, x), "sign is wrong"),
        (lambda c, h, x: c[np.ix_(h, ~h)] @ np.full((~h).sum(), np.nan), "NaN"),
        (lambda c, h, x: by_blocks(c, ~h, np.nan_to_num(x)), "channels are hidden"),
        (lambda c, h, x: np.zeros(h.sum()), "Not yet"),
        (1.0, "the function itself"),
    ],
)
def test_conditional_mean_wrong(answer, hint):
    assert hint.lower() in check_conditional_mean(answer).lower()


def word_for(share):
    return (
        "calibrated" if abs(share - 0.68) <= 0.03 else "too sure" if share < 0.68 else "too careful"
    )


def judged(one, two):
    return one, two, word_for(one)


def shares(error, std):
    return judged(np.mean(abs(error) < std), np.mean(abs(error) < 2 * std))


def shares_by_loops(error, std):
    ratios = [abs(e) / s for e, s in zip(error, std, strict=True)]
    one, two = (sum(r <= n for r in ratios) / len(ratios) for n in (1, 2))
    return [np.float32(one), two, word_for(one)]


@pytest.mark.parametrize("answer", [shares, shares_by_loops])
def test_calibration_right(answer):
    assert check_calibration(answer).startswith("Right")


@pytest.mark.parametrize(
    ("answer", "hint"),
    [
        (lambda e, s: judged(np.mean(e < s), np.mean(e < 2 * s)), "np.abs"),
        (lambda e, s: judged(np.mean(abs(e) > s), np.mean(abs(e) > 2 * s)), "outside"),
        (lambda e, s: [100 * v for v in shares(e, s)[:2]] + ["too sure"], "percent"),
        (lambda e, s: [1000 * v for v in shares(e, s)[:2]] + ["too sure"], "counted"),
        (lambda e, s: (shares(e, s)[1], shares(e, s)[0], "too sure"), "wrong order"),
        (lambda e, s: judged(np.mean(abs(e) < s), np.mean(abs(e) < s)), "twice"),
        (lambda e, s: judged(np.mean(e**2 < s), np.mean(e**2 < 2 * s)), "squared the errors"),
        (lambda e, s: shares(e, s**2), "squared the deviation"),
        (lambda e, s: shares(e, np.full(len(s), s.mean())), "one deviation for all"),
        (lambda e, s: shares(e, np.full(len(s), e.std())), "was expected"),
        (lambda e, s: (*shares(e, s)[:2], "too careful"), "wrong way round"),
        (lambda e, s: (*shares(e, s)[:2], "calibrated"), "on both sides"),
        (lambda e, s: (*shares(e, s)[:2], "good"), "no word"),
        (lambda e, s: shares(e, s)[:2], "three things"),
        (lambda e, s: ("a", "b", "too sure"), "should be numbers"),
        (lambda e, s: (0.1, 0.2, "too sure"), "Not yet"),
        (lambda e, s: None, "return"),
        (lambda e, s: 1 / 0, "ZeroDivisionError"),
        ((0.68, 0.95), "the function itself"),
    ],
)
def test_calibration_wrong(answer, hint):
    assert hint in check_calibration(answer)


def test_not_answered_yet(case):
    assert check_line(None) == NOT_YET
    assert check_gap_rms(None, *case) == NOT_YET
    assert check_conditional_mean(None) == NOT_YET
    assert check_calibration(None) == NOT_YET


@pytest.mark.parametrize("answer", ODD, ids=range(len(ODD)))
def test_odd_answers_get_a_sentence(case, answer):
    for sentence in (
        check_line(answer),
        check_gap_rms(answer, *case),
        check_conditional_mean(answer),
        check_calibration(answer),
    ):
        assert len(sentence) > 10
        assert not sentence.startswith("Right")
