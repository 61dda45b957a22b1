"""Clean a motion while it is captured: one frame in, one frame out.

    stream = Stream(skeleton, 1 / 120, LiveBlend(look_ahead_s=0.1))
    for frame in source:
        cleaned = stream.push(frame)  # None at first, then the frame from 0.1 s ago
    rest = stream.flush()  # the last 12 frames

A look-ahead is a delay: a frame is answered when the frames that the filter wants to see after
it have come. So whatever a stream answers depends on the past and that look-ahead only.
"""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import ArrayLike

from mocaplab.live.angles import ContinuousAngles
from mocaplab.live.filters import LiveFilter
from mocaplab.motion import BoolArray, FloatArray, Motion, Skeleton

SHOWN_LABELS = 4
"""How many channels an error names before it only counts."""


class Stream:
    """One live recording that is cleaned frame by frame.

    Angles are made continuous as they come in, and come out in the file's own branch. The root,
    and channels that have not moved so far, come out exactly as they went in.

    Parameters
    ----------
    skeleton : Skeleton
    frame_time : float, seconds
    live_filter : LiveFilter
        Such as :class:`mocaplab.live.blend.LiveBlend`, the best one,
        :class:`mocaplab.live.ebf.LiveEBF`, paper A's, or
        :class:`mocaplab.live.filters.LiveGaussian`. It also sets the look-ahead.
    hold_gaps : bool
        What to do with NaN, a sample that was not observed. False: refuse the frame. True: hold
        the last value that was (the rest pose before the first), and count it in ``n_held``.

    Raises
    ------
    ValueError
        If the filter is not made for this skeleton, frame rate or look-ahead.
    """

    def __init__(
        self,
        skeleton: Skeleton,
        frame_time: float,
        live_filter: LiveFilter,
        *,
        hold_gaps: bool = False,
    ):
        if not 0 < frame_time < np.inf:
            raise ValueError(f"frame_time must be above 0 seconds, got {frame_time!r}")
        self.skeleton, self.frame_time, self.hold_gaps = skeleton, frame_time, hold_gaps
        self.n_pushed = 0
        self.n_held = np.zeros(skeleton.n_channels, dtype=np.int64)
        """Samples of each channel that were missing, shape (C,)."""
        self._filter = live_filter.start(skeleton, frame_time)
        self._angles = ContinuousAngles(skeleton)
        n_window = self._filter.n_past + 1 + self._filter.look_ahead
        self._window = np.zeros((n_window, skeleton.n_channels))  # continuous, the newest last
        self._waiting: deque[tuple[FloatArray, FloatArray, FloatArray]] = deque()
        self._ended = False

    @property
    def latency_s(self) -> float:
        """Seconds between a frame and its answer, the time to compute it left out."""
        return self._filter.look_ahead * self.frame_time

    def push(self, frame: ArrayLike) -> FloatArray | None:
        """Take the next frame, and return the cleaned frame from ``latency_s`` ago.

        Parameters
        ----------
        frame : array, shape (C,)
            Degrees and file length units, in the skeleton's channel order.

        Returns
        -------
        array, shape (C,), or None as long as that time has not passed

        Raises
        ------
        ValueError
            If the frame has another width, is infinite, or is NaN in a stream that refuses gaps,
            or the stream has ended. A refused frame changes nothing: push the next one.
        """
        if self._ended:
            raise ValueError("this stream has ended (flush was called); make a new one")
        values = self._checked(frame)
        missing = np.isnan(values)
        self.n_held += missing
        continuous, sign, offset = self._angles.push(values)
        self._window[:-1] = self._window[1:]
        self._window[-1] = continuous
        held = np.where(missing, sign * (continuous - offset), values)
        self._waiting.append((held, sign, offset))
        self._filter.observe(continuous)
        self.n_pushed += 1
        return self._clean_oldest() if len(self._waiting) > self._filter.look_ahead else None

    def flush(self) -> FloatArray:
        """End the stream and return the frames that are left, shape (n, C).

        They see no further than the end, so the last ones are cleaned less well.

        Raises
        ------
        ValueError
            If the stream has ended already.
        """
        if self._ended:
            raise ValueError("this stream has ended already; make a new one")
        self._ended = True
        rest = [self._clean_oldest() for _ in range(len(self._waiting))]
        return np.array(rest).reshape(-1, self.skeleton.n_channels)

    def _clean_oldest(self) -> FloatArray:
        n_ahead = len(self._waiting) - 1
        frame, sign, offset = self._waiting.popleft()
        n_past = min(self.n_pushed - 1 - n_ahead, self._filter.n_past)
        window = self._window[len(self._window) - (n_past + 1 + n_ahead) :]
        cleaned = self._filter.clean(window, n_past)
        changed = cleaned != window[n_past]  # where not: no rounding, the very same number
        return np.where(changed, sign * (cleaned - offset), frame)

    def _checked(self, frame: ArrayLike) -> FloatArray:
        """Return a frame as an array, or say what is wrong with it."""
        values = np.asarray(frame, dtype=np.float64)
        if values.shape != (self.skeleton.n_channels,):
            raise ValueError(
                f"frame {self.n_pushed}: expected {self.skeleton.n_channels} channels (shape "
                f"({self.skeleton.n_channels},)), got shape {values.shape}"
            )
        if np.isfinite(values).all():
            return values
        infinite = np.isinf(values)
        if infinite.any():
            raise ValueError(f"frame {self.n_pushed}: infinite in {self._labels(infinite)}")
        if not self.hold_gaps:
            raise ValueError(
                f"frame {self.n_pushed}: not observed (NaN) in {self._labels(np.isnan(values))}; "
                f"make the stream with hold_gaps=True to hold the last value there"
            )
        return values

    def _labels(self, which: BoolArray) -> str:
        labels = [self.skeleton.channel_labels[c] for c in np.flatnonzero(which)]
        more = len(labels) - SHOWN_LABELS
        return ", ".join(labels[:SHOWN_LABELS]) + (f" and {more} more" if more > 0 else "")


def stream_motion(motion: Motion, live_filter: LiveFilter) -> Motion:
    """Push a whole motion through a stream, frame by frame; gaps (NaN) are held.

    Returns
    -------
    Motion, of as many frames: frame t is what the stream answered for frame t, so the delay is
    taken out
    """
    stream = Stream(motion.skeleton, motion.frame_time, live_filter, hold_gaps=True)
    answers = [stream.push(frame) for frame in motion.channels]
    cleaned = [frame for frame in answers if frame is not None]
    return motion.with_channels(np.array([*cleaned, *stream.flush()]))
