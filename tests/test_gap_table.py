"""The comparison by gap length: where gaps are drawn, and what is counted."""

import numpy as np

from data_tools.gap_table import (
    FRAMES,
    GAPS_A_CLIP,
    KINDS,
    OURS,
    _score,
    draw,
    draw_gaps,
    print_table,
)
from mocaplab.gap_fillers.filled import fill_by_lines
from mocaplab.motion import moving_channels
from mocaplab.noise.gaps import hide


def test_gaps_of_one_length_in_moving_channels(walk):
    joint = walk.skeleton.channel_joint
    for kind in KINDS:
        mask = draw_gaps(walk, 60, kind, rng=np.random.default_rng(0))
        hidden = ~mask
        assert not hidden[:, ~moving_channels(walk)].any()
        assert set(hidden.sum(axis=0)) == {0, 60}
        assert mask[[0, -1]].all()
        groups = np.unique(joint[hidden.any(axis=0)])
        if kind == KINDS[0]:
            assert hidden.any(axis=0).sum() == GAPS_A_CLIP
        else:
            assert len(groups) == GAPS_A_CLIP
            for group in groups:
                together = hidden[:, (joint == group) & moving_channels(walk)]
                assert (together.all(axis=1) == together.any(axis=1)).all()


def test_too_short_clips_are_left_out(walk):
    assert draw_gaps(walk.slice_frames(0, 65), 60, KINDS[0], rng=np.random.default_rng(0)) is None


def test_only_gaps_are_scored(walk):
    mask = draw_gaps(walk, 30, KINDS[0], rng=np.random.default_rng(1))
    filled = fill_by_lines(hide(walk, mask))
    score = _score(filled, walk, mask)
    error = (filled.motion.channels - walk.channels)[~mask]
    assert np.isclose(score["rms_deg"], np.sqrt(np.mean(error**2)))
    assert score["within_1"] <= score["within_2"] <= 1
    assert _score(filled.motion, walk, mask)["within_1"] == ""


def test_table_and_picture(capsys, tmp_path):
    rows = []
    for kind in KINDS:
        for k in (0.0, 0.5):
            for name, error in (("lines", 2.0), ("EBD", 1.5), (OURS, 1.0)):
                case = {"gaps": kind, "noise": k, "pipeline": name, "frames": 4}
                for clip, more in (("a", -0.5), ("a", 0.5), ("b", 1.0)):
                    row = {**case, "clip": clip, "rms_deg": error + more}
                    rows.append({**row, "within_1": 0.7, "within_2": 0.9})
    print_table(rows, FRAMES[:3], 0)
    printed = capsys.readouterr().out
    assert "2.50 (2.00-3.00)" in printed
    assert "0.70 0.90" in printed
    draw(rows, FRAMES[:3], tmp_path / "gaps.png")
    assert (tmp_path / "gaps.png").stat().st_size > 1000
