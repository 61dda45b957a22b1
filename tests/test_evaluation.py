"""Metrics and tables, against numbers worked out by hand."""

import numpy as np
import pytest

from mocaplab.corruption import corrupt
from mocaplab.evaluation import (
    Score,
    Untouched,
    compare_methods,
    format_table,
    rms_all_deg,
    rms_moving_deg,
    table_by_action,
)
from mocaplab.motion import moving_channels


def test_rms_counts_still_channels_or_not(walk):
    moving = moving_channels(walk)
    off = walk.with_channels(walk.channels + 2.0 * moving)
    assert rms_moving_deg(off, walk) == pytest.approx(2.0)
    share = moving.sum() / walk.skeleton.is_cleaned.sum()
    assert rms_all_deg(off, walk) == pytest.approx(2.0 * np.sqrt(share))


def test_rms_leaves_the_root_out(walk):
    channels = walk.channels.copy()
    channels[:, :6] += 100.0
    assert rms_all_deg(walk.with_channels(channels), walk) == 0.0
    still = walk.with_channels(np.zeros_like(walk.channels))
    assert rms_moving_deg(still, still) == 0.0


def test_comparison_scores_every_clip_and_method(walk):
    clip = corrupt(walk, "angular:0.5", rng=np.random.default_rng(0))
    scores = compare_methods([clip], {"noisy": Untouched()}, corruption="0.5 noise", seed=7)
    assert [(s.method, s.metric, s.unit, s.seed) for s in scores] == [
        ("noisy", "rms_all_deg", "deg", 7),
        ("noisy", "rms_moving_deg", "deg", 7),
    ]
    assert scores[0].per_clip == {walk.name: rms_all_deg(clip.observed, clip.clean)}


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
