"""Gaps."""

import numpy as np
import pytest

from mocaplab.gaps import gap_mask


def test_gaps_hide_the_share_that_theory_says(walk):
    # A sample is seen if no gap that started m frames before it is longer than m.
    p, mean = 0.002, 15.0
    mask = gap_mask(walk, p, mean * walk.frame_time, rng=np.random.default_rng(0))
    survival = (1 - 1 / mean) ** np.arange(walk.n_frames)
    per_frame = 1 - np.exp(np.cumsum(np.log1p(-p * survival)))
    expected = per_frame[1:-1].sum() / walk.n_frames
    hidden = 1 - mask[:, walk.skeleton.is_cleaned].mean()
    assert hidden == pytest.approx(expected, rel=0.25)
    assert mask[:, ~walk.skeleton.is_cleaned].all()
    assert mask[[0, -1]].all()
