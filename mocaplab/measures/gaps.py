"""How far what was filled into gaps is from what was hidden there.

Without any gap the error is NaN, not 0: to have no gap is not to have filled one well.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from mocaplab.measures.angles import check_pair
from mocaplab.motion import BoolArray, Motion

GAP_EDGES_S = (0.0, 0.05, 0.125, 0.25, 0.5, 1.0, 2.0, np.inf)
"""Between these lengths, in seconds, gaps are counted together."""


class GapBin(NamedTuple):
    """The error inside all gaps of about one length."""

    shortest_s: float  # gaps of this length and more
    longest_s: float  # and shorter than this
    rms_deg: float  # NaN if there is no such gap
    gaps: int
    samples: int


def gap_rms_deg(filled: Motion, clean: Motion, mask: ArrayLike) -> float:
    """Root mean square angle error over the hidden samples alone.

    Parameters
    ----------
    filled, clean : Motion
        In the same Euler branch, as for :func:`mocaplab.measures.angles.rms_all_deg`.
    mask : array, shape (T, C), bool
        True where a sample was observed, False inside a gap. Positions are not counted.

    Returns
    -------
    float, degrees; NaN if no angle was hidden
    """
    hidden = _hidden_angles(filled, clean, mask)
    if not hidden.any():
        return np.nan
    return float(np.sqrt(np.mean((filled.channels - clean.channels)[hidden] ** 2)))


def shares_within(error_deg: ArrayLike, std_deg: ArrayLike) -> tuple[float, float]:
    """How many errors are smaller than expected, and smaller than twice that.

    If they are normally distributed and the expectation is right, it is 0.683 and 0.954 of them.

    Parameters
    ----------
    error_deg, std_deg : arrays of one shape
        Filled minus clean, and the deviation that was expected of each sample.

    Returns
    -------
    two floats in [0, 1]; NaN without any sample
    """
    size, std = np.abs(np.asarray(error_deg, dtype=np.float64)), np.asarray(std_deg)
    if size.shape != std.shape:
        raise ValueError(
            f"expected a deviation for each error, got shapes {size.shape} and {std.shape}"
        )
    if not size.size:
        return np.nan, np.nan
    return float(np.mean(size <= std)), float(np.mean(size <= 2 * std))


def gap_rms_by_length(
    filled: Motion, clean: Motion, mask: ArrayLike, edges_s: Sequence[float] = GAP_EDGES_S
) -> list[GapBin]:
    """Error inside gaps, short and long ones apart.

    A gap is a run of hidden samples of one channel; its length is the number of them times
    the frame time.

    Parameters
    ----------
    filled, clean, mask
        As for :func:`gap_rms_deg`.
    edges_s : increasing lengths, seconds
        The limits of the bins, one more than there are bins.

    Returns
    -------
    list of GapBin, one between each two edges; gaps outside all edges are not counted
    """
    edges = np.asarray(edges_s, dtype=np.float64)
    if edges.ndim != 1 or len(edges) < 2 or not np.all(np.diff(edges) > 0):
        raise ValueError(f"expected two or more increasing gap lengths, got {edges_s!r}")
    hidden = _hidden_angles(filled, clean, mask).T  # channel after channel, (C, T)
    border = np.zeros((len(hidden), 1), dtype=bool)
    steps = np.diff(np.hstack([border, hidden, border]).astype(np.int8), axis=1)
    frames = np.argwhere(steps == -1)[:, 1] - np.argwhere(steps == 1)[:, 1]
    gap = np.repeat(np.arange(len(frames)), frames)  # of every hidden sample
    squares = np.bincount(gap, (filled.channels - clean.channels).T[hidden] ** 2, len(frames))
    # Files round the frame time: a hundredth of a frame more brings what belongs on an edge
    # above it.
    of_bin = np.digitize((frames + 0.01) * clean.frame_time, edges) - 1
    table = []
    for i, (low, high) in enumerate(pairwise(edges)):
        here = of_bin == i
        samples = int(frames[here].sum())
        rms = float(np.sqrt(squares[here].sum() / samples)) if samples else np.nan
        table.append(GapBin(float(low), float(high), rms, int(here.sum()), samples))
    return table


def _hidden_angles(filled: Motion, clean: Motion, mask: ArrayLike) -> BoolArray:
    check_pair(filled, clean)
    observed = np.asarray(mask, dtype=bool)
    if observed.shape != clean.channels.shape:
        raise ValueError(f"expected a mask of shape {clean.channels.shape}, got {observed.shape}")
    hidden: BoolArray = ~observed & clean.skeleton.is_rotation
    return hidden
