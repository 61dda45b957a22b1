"""Right answers pass, typical wrong ones get their own hint, odd ones a sentence."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mocaplab.exercises.answers import NOT_YET
from mocaplab.exercises.lab import (
    check_channel_sigma,
    check_gaussian_wins,
    check_least_smoothing,
    check_look_ahead,
)
from mocaplab.filters import gaussian_filter
from mocaplab.lab.model import Laboratory, LabSettings

THIGH, KNEE = "LeftUpLeg.Xrotation", "LeftLeg.Xrotation"
ODD = ["", "a", [], {}, object(), np.array([1, 2]), 1j, float("nan"), float("inf"), True, ()]


@pytest.fixture(scope="module")
def laboratory(embedded):
    names = [clip.name for clip in embedded.clips]
    some = embedded.select([names.index("walk_05"), 0, 45], "few")
    return Laboratory(replace(some, clips=tuple(c.slice_frames(0, 240) for c in some.clips)))


@pytest.fixture(scope="module")
def scene(laboratory):
    return laboratory.scene(LabSettings("walk_05"))


@pytest.fixture(scope="module")
def best_s(scene):
    """The best width of the thigh, found apart from the lab."""
    values, clean = (m.channel(THIGH)[:, None] for m in (scene.filled, scene.corrupted.clean))
    widths = np.geomspace(0.01, 0.2, 60)
    errors = [np.mean((gaussian_filter(values, s, 1 / 120) - clean) ** 2) for s in widths]
    return float(widths[np.argmin(errors)])


def test_the_best_width_is_right(scene, best_s):
    for answer in (best_s, np.float32(best_s), [best_s], np.array(best_s)):
        assert check_channel_sigma(answer, scene, THIGH).startswith("Right:")


def test_wrong_widths(scene, best_s):
    assert not np.isclose(best_s, scene.tuned_sigma_s, rtol=0.1)
    for answer, hint in (
        (1000 * best_s, "in milliseconds"),
        (120 * best_s, "in frames"),
        (0, "0 or less"),
        (0.005, "go up"),
        (0.2, "go down"),
        (scene.tuned_sigma_s, "tuned for all angles"),
        (0.7, "Which unit"),
    ):
        assert hint in check_channel_sigma(answer, scene, THIGH), answer


def test_where_the_gaussian_wins(laboratory):
    for answer in (("spikes", KNEE), ["spikes", KNEE]):
        assert check_gaussian_wins(answer, laboratory, "walk_05").startswith("Right:")


def test_noises_that_the_notebook_shows_do_not_count(laboratory):
    answer, shown = ("spikes", KNEE), ("angular", "spikes")
    assert "not in it" in check_gaussian_wins(answer, laboratory, "walk_05", shown)
    assert check_gaussian_wins(answer, laboratory, "walk_05", ("swaps",)).startswith("Right:")


@pytest.mark.parametrize(
    ("answer", "hint"),
    [
        ((KNEE, "spikes"), "The noise comes first"),
        (("hum", KNEE), "no noise 'hum'"),
        (("spikes", "LeftLeg"), "is a joint"),
        (("spikes", "Hips.Xrotation"), "not cleaned"),
        (("spikes", "Knee"), "no channel 'Knee'"),
        (("angular", KNEE), "better here"),
        (("drift", "LeftUpLeg.Yrotation"), "Nearly a tie"),
        ("spikes", "two names"),
        (("spikes",), "two names"),
    ],
)
def test_where_it_does_not(laboratory, answer, hint):
    assert hint in check_gaussian_wins(answer, laboratory, "walk_05")


def test_when_ebf_smooths_least(scene):
    widths = scene.sigma_s[:, scene.filled.skeleton.channel_index(KNEE)]
    frame = int(widths.argmin())
    assert check_least_smoothing(frame / 120, scene, KNEE).startswith("Right:")
    for answer, hint in (
        (frame, "That is a frame."),
        (float(widths.argmax()) / 120, "There it smooths most"),
        (-1, "lasts from 0"),
        (1000.5, "lasts from 0"),
        (float(np.argsort(widths)[3 * len(widths) // 4]) / 120, "narrower ones"),
    ):
        assert hint in check_least_smoothing(answer, scene, KNEE), answer


def good(rms, look_aheads_s):
    best = rms.min(axis=1)
    return look_aheads_s[int(np.argmax(best <= 1.05 * best[-1]))]


def loop(rms, look_aheads_s):
    for row, seconds in zip(rms, look_aheads_s, strict=True):
        if min(row) <= 1.05 * min(rms[-1]):
            return np.array([seconds])


def test_a_look_ahead_that_is_enough(scene):
    for answer in (good, loop):
        assert check_look_ahead(answer, scene).startswith("Right:")


def one_width(rms, aheads):
    column = rms[:, rms[-1].argmin()]
    return aheads[int(np.argmax(column <= 1.05 * column[-1]))]


@pytest.mark.parametrize(
    ("answer", "hint"),
    [
        (lambda rms, aheads: 1000 * good(rms, aheads), "in milliseconds"),
        (lambda rms, aheads: aheads.index(good(rms, aheads)), "the place of the look-ahead"),
        (lambda rms, aheads: rms[aheads.index(good(rms, aheads))].min(), "That is the error"),
        (lambda rms, aheads: 0.25, "works, but a shorter"),
        (lambda rms, aheads: 0.0, "more than 5 % above"),
        (lambda rms, aheads: None, "returns nothing"),
        (lambda rms, aheads: rms, "one look-ahead in seconds"),
        (lambda rms: 0.1, "stopped with TypeError"),
        (0.1, "without brackets"),
    ],
)
def test_wrong_look_aheads(scene, answer, hint):
    assert hint in check_look_ahead(answer, scene)


def test_a_rule_that_takes_the_best_row_is_found_out(scene):
    def smallest(rms, aheads):
        best = rms.min(axis=1)
        return aheads[int(np.argmin(best[:-1]))]

    assert "smallest error" in check_look_ahead(smallest, scene)
    assert "kept one width" in check_look_ahead(one_width, scene)


def test_nothing_and_odd_answers(scene, laboratory):
    checks = (
        lambda answer: check_channel_sigma(answer, scene, THIGH),
        lambda answer: check_gaussian_wins(answer, laboratory, "walk_05"),
        lambda answer: check_least_smoothing(answer, scene, KNEE),
        lambda answer: check_look_ahead(answer, scene),
    )
    for check in checks:
        assert check(None) == NOT_YET
        for odd in ODD:
            assert not check(odd).startswith("Right")
