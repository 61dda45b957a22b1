"""Cut a long clip into pieces that overlap, so that memory stays bounded.

Each piece is cleaned with some context on both sides, which is then thrown away: what a frame
becomes depends on its surroundings, and hardly on anything further off than that.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mocaplab.motion import BoolArray

PIECE_S = 20.0
"""Length of a piece without its context, seconds."""
CONTEXT_S = 3.0
"""Context on each side, seconds: Blend's widest filter reaches 0.73 s, and is used twice; the LSTM
of EBF remembers for longer."""
GAP_CONTEXT_S = 10.0
"""How much further the context may reach, to where nothing is hidden."""


class Piece(NamedTuple):
    """Frames ``start`` to ``stop``, of which ``first`` to ``last`` are kept (ends excluded)."""

    start: int
    first: int
    last: int
    stop: int

    @property
    def kept(self) -> slice:
        """The kept frames, counted from ``start``."""
        return slice(self.first - self.start, self.last - self.start)


def cut(hidden: BoolArray, fps: float, period: int = 1) -> list[Piece]:
    """Cut a clip into pieces; one that is little longer than a piece stays whole.

    Parameters
    ----------
    hidden : array, shape (T,), bool
        Frames in which something is missing: a gap should not be cut where that can be avoided.
    fps : float, frames per second
    period : int
        A piece starts at a multiple of this many frames.

    Returns
    -------
    list of Piece, whose kept frames are all frames, in order
    """
    n_frames = len(hidden)
    length, context, reach = (
        max(1, round(seconds * fps)) for seconds in (PIECE_S, CONTEXT_S, GAP_CONTEXT_S)
    )
    if n_frames <= length + 2 * context:
        return [Piece(0, 0, n_frames, n_frames)]
    pieces = []
    for first in range(0, n_frames, length):
        last = min(first + length, n_frames)
        start = max(0, first - context)
        stop = min(n_frames, last + context)
        start -= _frames_to_seen(hidden[max(0, start - reach) : start + 1][::-1])
        stop += _frames_to_seen(hidden[stop - 1 : stop + reach])
        pieces.append(Piece(start // period * period, first, last, stop))
    return pieces


def _frames_to_seen(hidden: BoolArray) -> int:
    """Count the hidden frames before the first that is not; all but one if there is none."""
    seen = np.flatnonzero(~hidden)
    return int(seen[0]) if len(seen) else len(hidden) - 1
