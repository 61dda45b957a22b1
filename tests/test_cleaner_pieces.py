"""Long clips in pieces."""

import numpy as np
import pytest

from mocaplab.cleaner.pieces import Piece, cut


def test_a_clip_that_is_little_longer_than_a_piece_stays_whole():
    assert cut(np.zeros(3120, dtype=bool), 120.0) == [Piece(0, 0, 3120, 3120)]


@pytest.mark.parametrize(
    ("n_frames", "fps", "period"), [(3121, 120, 1), (60_000, 120, 1), (5000, 100, 5)]
)
def test_every_frame_is_kept_once_and_has_its_context(n_frames, fps, period):
    pieces = cut(np.zeros(n_frames, dtype=bool), fps, period)
    kept = [frame for piece in pieces for frame in range(piece.first, piece.last)]
    assert kept == list(range(n_frames))
    for piece in pieces:
        assert piece.start == 0 or piece.first - piece.start >= 3 * fps
        assert piece.stop == n_frames or piece.stop - piece.last == 3 * fps
        assert piece.start % period == 0
        assert piece.stop - piece.start <= 27 * fps


def test_a_gap_is_seen_to_its_end():
    hidden = np.zeros(10_000, dtype=bool)
    hidden[2000:2200] = True  # where the context of the second piece would begin, at 2040
    hidden[5100:5400] = True  # where that of the second would end, at 5160
    second = cut(hidden, 120.0)[1]
    assert (second.first, second.last) == (2400, 4800)
    assert second.start == 1999
    assert second.stop == 5401


def test_a_gap_without_end_is_cut():
    second = cut(np.ones(10_000, dtype=bool), 120.0)[1]
    assert second.first - second.start == 13 * 120
    assert second.stop - second.last == 13 * 120
