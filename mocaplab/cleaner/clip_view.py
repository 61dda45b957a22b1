"""A motion as cleaners want it, continuous and without NaN, and the way back to the file."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mocaplab.euler import motion_continuity
from mocaplab.gap_fillers.curves import lerp_columns, never_observed, rest_never_observed
from mocaplab.motion import BoolArray, FloatArray, Motion, moving_channels


@dataclass(frozen=True, eq=False)
class ClipView:
    """A motion made continuous, with lines across its gaps; see :func:`view_clip`.

    Parameters
    ----------
    motion : Motion, as the file has it
    channels : array, shape (T, C), continuous; lines inside gaps
    hidden : array, shape (T, C), bool: True inside gaps
    unseen : array, shape (C,), bool: channels that were never observed, which are at rest
    moving : array, shape (C,), bool: see :func:`mocaplab.motion.moving_channels`
    sign, offset : arrays, shape (T, C)
        The way back; see :func:`mocaplab.euler.motion_continuity`.
    """

    motion: Motion
    channels: FloatArray
    hidden: BoolArray
    unseen: BoolArray
    moving: BoolArray
    sign: NDArray[np.int8]
    offset: NDArray[np.float32]  # multiples of 180, so exact

    def restore(self, cleaned: FloatArray, frames: slice) -> FloatArray:
        """Put continuous channels back into the file's own Euler convention.

        Parameters
        ----------
        cleaned : array, shape (n, C), continuous
        frames : slice, which frames these are

        Returns
        -------
        array, shape (n, C)
            An observed sample that was not changed is the file's, bit for bit.
        """
        same = (cleaned == self.channels[frames]) & ~self.hidden[frames]
        restored = self.sign[frames] * (cleaned - self.offset[frames])
        return np.where(same, self.motion.channels[frames], restored)

    def draw_lines(self, channels: FloatArray, where: BoolArray) -> FloatArray:
        """Draw lines across runs of samples, from end to end, in the file's own convention.

        Parameters
        ----------
        channels : array, shape (T, C), as :meth:`restore` returns them
        where : array, shape (T, C), bool
        """
        result = channels.copy()
        some = where.any(axis=0) & ~self.unseen
        sign, offset = self.sign[:, some], self.offset[:, some]
        lines = lerp_columns(np.where(where[:, some], np.nan, sign * result[:, some] + offset))
        result[:, some] = np.where(where[:, some], sign * (lines - offset), result[:, some])
        return result


def view_clip(motion: Motion) -> ClipView:
    """Make a motion continuous and draw lines across its gaps.

    Warns
    -----
    mocaplab.gap_fillers.curves.GapWarning
        If a channel was never observed; it is left at rest.
    """
    hidden, unseen = np.isnan(motion.channels), never_observed(motion)
    sign, offset = motion_continuity(motion)
    sign[:, unseen], offset[:, unseen] = 1.0, 0.0  # its rest value is the file's, not ours
    compact_sign, compact_offset = sign.astype(np.int8), offset.astype(np.float32)
    sign *= motion.channels
    sign += offset
    channels = sign
    if hidden.any():
        known = rest_never_observed(motion.with_channels(channels))
        channels = known.channels.copy()
        gappy = np.isnan(channels).any(axis=0)
        channels[:, gappy] = lerp_columns(channels[:, gappy])
    moving = moving_channels(motion)
    return ClipView(motion, channels, hidden, unseen, moving, compact_sign, compact_offset)


def long_runs(hidden: BoolArray, longest_s: float | None, frame_time: float) -> BoolArray:
    """Mark the runs of True in each column that last longer than a time, shape (T, C).

    Parameters
    ----------
    hidden : array, shape (T, C), bool
    longest_s : float, seconds; None marks nothing
    frame_time : float, seconds
    """
    if longest_s is None or not hidden.any():
        return np.broadcast_to(False, hidden.shape)
    frames = np.arange(len(hidden))[:, None]
    before = np.maximum.accumulate(np.where(hidden, -1, frames), axis=0)
    after = np.minimum.accumulate(np.where(hidden, len(hidden), frames)[::-1], axis=0)[::-1]
    long = (after - before - 1) * frame_time > longest_s * (1 + 1e-9)
    marked: BoolArray = hidden & long
    return marked
