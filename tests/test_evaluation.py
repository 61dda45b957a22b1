"""Scores and tables, against numbers worked out by hand."""

import numpy as np
import pytest

from mocaplab.corruption import corrupt
from mocaplab.evaluation import (
    Score,
    compare_methods,
    format_table,
    score_clip,
    table_by_action,
)
from mocaplab.filters import Untouched
from mocaplab.measures.by_name import mpjpe_cm, rms_all_deg
from mocaplab.skeletons.units import cm_per_unit


def test_comparison_scores_every_clip_and_method(walk):
    clip = corrupt(walk, "angular:0.5", rng=np.random.default_rng(0))
    scores = compare_methods([clip], {"noisy": Untouched()}, corruption="0.5 noise", seed=7)
    assert [(s.method, s.metric, s.unit, s.seed) for s in scores] == [
        ("noisy", "rms_all_deg", "deg", 7),
        ("noisy", "rms_moving_deg", "deg", 7),
    ]
    assert scores[0].per_clip == {walk.name: rms_all_deg(clip.observed, clip.clean)}


def test_comparison_takes_its_units_from_the_measures(walk):
    clip = corrupt(walk, "angular:0.5", rng=np.random.default_rng(0))
    names = ("mpjpe_cm", "gap_rms_deg", "quaternion_l1")
    position, gap, quaternion = compare_methods(
        [clip], {"noisy": Untouched()}, corruption="0.5 noise", seed=7, measures=names
    )
    assert [s.metric for s in (position, gap, quaternion)] == list(names)
    assert [s.unit for s in (position, gap, quaternion)] == ["cm", "deg", ""]
    unit = cm_per_unit(walk.skeleton)
    assert position.mean == mpjpe_cm(clip.observed, clip.clean, cm_per_unit=unit)
    assert np.isnan(gap.mean)  # nothing was hidden
    assert table_by_action([gap], "gap_rms_deg", {walk.name: "walk"})[1] == ["noisy", "-", "-"]


def test_comparisons_score_as_one_clip_is_scored(walk):
    clip = corrupt(walk, "angular:0.5", rng=np.random.default_rng(0))
    alone = score_clip(clip.observed, clip, ["mpjpe_cm", "rms_all_deg"])
    assert list(alone) == ["mpjpe_cm", "rms_all_deg"]
    scores = compare_methods([clip], {"noisy": Untouched()}, corruption="", seed=0, measures=alone)
    assert {s.metric: s.mean for s in scores} == alone


def test_comparison_refuses_an_unknown_measure():
    with pytest.raises(ValueError, match=r"no measure 'rms'; there are rms_all_deg, rms_moving"):
        compare_methods([], {}, corruption="", seed=0, measures=["rms"])


def test_clips_without_a_value_are_left_out_of_means():
    score = Score("a", "n", "m", "cm", 0, {"w1": 2.0, "w2": np.nan, "k1": np.nan, "j1": 12345.6})
    assert score.mean == pytest.approx((2.0 + 12345.6) / 2)
    actions = {"w1": "walk", "w2": "walk", "k1": "kick", "j1": "jump"}
    assert table_by_action([score], "m", actions)[1] == ["a", "12,346", "-", "2.000", "6,174"]


def test_table_averages_over_clips_and_repetitions():
    scores = [
        Score("a", "n", "m", "deg", 0, {"w1": 1.0, "w2": 2.0, "k1": 6.0}),
        Score("a", "n", "m", "deg", 1, {"w1": 3.0, "w2": 2.0, "k1": 4.0}),
        Score("a", "n", "other", "deg", 1, {"w1": 99.0, "w2": 99.0, "k1": 99.0}),
    ]
    assert scores[0].mean == 3.0
    actions = {"w1": "walk", "w2": "walk", "k1": "kick"}
    assert table_by_action(scores, "m", actions) == [
        ["method", "kick (1)", "walk (2)", "all"],
        ["a", "5.000", "2.000", "3.000"],
    ]


def test_table_is_markdown():
    assert format_table([["method", "x"], ["a", "1.25"]]).splitlines() == [
        "| method |    x |",
        "|--------|-----:|",
        "| a      | 1.25 |",
    ]
