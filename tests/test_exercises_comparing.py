"""Notebook 03's checks on clips accept right answers and meet typical mistakes with hints."""

import numpy as np
import pytest

from mocaplab.corruption import corrupt
from mocaplab.exercises.answers import NOT_YET
from mocaplab.exercises.comparing import check_flattering_measures, check_tuning
from mocaplab.filters import GaussianDenoiser
from mocaplab.measures.by_name import MEASURES, rms_all_deg
from mocaplab.tuning import SIGMA_GRID_S, tune_gaussian

ODD = ["text", 3.0, (), [1, "a"], {"a": 1}, 1j, float("nan"), float("inf"), True, b"x", object()]


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
def clips(embedded):
    rng = np.random.default_rng(0)
    return [corrupt(embedded[n].slice_frames(0, 300), rng=rng) for n in ("walk_06", "kick_10")]


def test_no_answer_yet(lists, clips):
    assert check_tuning(None, *lists) == check_flattering_measures(None, clips) == NOT_YET


@pytest.mark.parametrize("odd", ODD)
def test_odd_answers_get_a_sentence(odd, lists, clips):
    for answer in (odd, lambda *_: odd):
        for text in (check_tuning(answer, *lists), check_flattering_measures(answer, clips)):
            assert len(text) > 10
            assert not text.startswith("Right")


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


def flattering(weak, fair, clips, *, by_aim=True):
    """Find the measures clip by clip, in plain loops."""
    names = []
    cleaned = [[d.denoise(c.observed, c.mask) for c in clips] for d in (weak, fair)]
    for name, measure in MEASURES.items():
        off = []
        for motions in cleaned:
            scores, best = [], []
            for motion, clip in zip(motions, clips, strict=True):
                scores.append(measure.score(motion, clip))
                best.append(0 if measure.lower_is_better else measure.score(clip.clean, clip))
            mean = sum(scores) / len(scores)
            off.append(abs(mean - sum(best) / len(best)) if by_aim else mean)
        if off[0] < off[1]:
            names.append(name)
    return names


def not_worse(weak, fair, clips):
    worse = flattering(fair, weak, clips)
    return [name for name in MEASURES if name not in worse]


FIRST_PAIR = ["acceleration_error_cm_s2", "jitter_cm_s3", "foot_skate_cm_s"]


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (flattering, "Right: by 3 measures 125 ms looks better than 32 ms, and by 4 better"),
        (lambda *a: set(flattering(*a)), "Right"),
        (lambda *a: np.array(flattering(*a)), "Right"),
        (lambda *a: flattering(*a, by_aim=False), "the smaller mean everywhere"),
        (not_worse, "Leave it out"),
        (lambda weak, fair, clips: flattering(fair, weak, clips), "Turn it round"),
        (lambda *a: FIRST_PAIR, "gives the same list for both pairs"),
        (lambda *a: FIRST_PAIR[:1], "2 more should be in the list"),
        (lambda *a: "jitter_cm_s3", "Return a list of names"),
        (lambda *a: ["jitter"], "no measure 'jitter'"),
        (lambda *a: [*flattering(*a), "rms_all_deg"], "By rms_all_deg the fair filter"),
        (lambda weak, fair: [], "stopped with TypeError"),
        (lambda *a: None, "returns nothing"),
        ("jitter_cm_s3", "the function itself"),
    ],
)
def test_flattering_measures(answer, words, clips):
    assert words in check_flattering_measures(answer, clips)
