"""Filters for a stream: at every frame they know the past, and a few frames of the future.

A :class:`LiveFilter` says what to do; :meth:`LiveFilter.start` makes the one that runs over one
stream and remembers what it has seen. :class:`mocaplab.streaming.Stream` does all the rest.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from mocaplab.filters import Smoother
from mocaplab.motion import BoolArray, FloatArray, Skeleton

LOOK_AHEAD_S = 0.125
"""The usual look-ahead: 15 frames at 120 frames per second, as in paper A."""


class Running(Protocol):
    """A filter at work in one stream. Letters in shapes: n frames in the window, C channels."""

    look_ahead: int  # frames
    n_past: int  # frames before the one to clean that it wants to see

    def observe(self, frame: FloatArray) -> None:
        """Take note of the newest frame, shape (C,): continuous angles, no NaN."""
        ...

    def clean(self, window: FloatArray, middle: int) -> FloatArray:
        """Clean one frame.

        Parameters
        ----------
        window : array, shape (n, C)
            The last frames, the newest at the end; fewer near the ends of the stream.
        middle : int
            Which of them to clean.

        Returns
        -------
        array, shape (C,)
        """
        ...


class LiveFilter(Protocol):
    """What can clean a stream."""

    def start(self, skeleton: Skeleton, frame_time: float) -> Running:
        """Begin a new stream; ValueError if this filter is not made for such frames."""
        ...


def whole_frames(look_ahead_s: float, frame_time: float) -> int:
    """Turn a look-ahead into the nearest whole number of frames.

    Raises
    ------
    ValueError
        If it is not a time of 0 or more seconds.
    """
    if not 0 <= look_ahead_s < np.inf:
        raise ValueError(f"look_ahead_s must be 0 or more seconds, got {look_ahead_s!r}")
    return round(look_ahead_s / frame_time)


def window_mean(window: FloatArray, middle: int, sigma: ArrayLike) -> FloatArray:
    """Smooth one frame of a window with a Gaussian a channel.

    What the window lacks on one side is left out, and the other weights are scaled up.

    Parameters
    ----------
    window : array, shape (n, C)
    middle : int, the frame to smooth
    sigma : array, shape (C,), or one number, frames; 0 leaves a channel exactly as it is

    Returns
    -------
    array, shape (C,)
    """
    distance = np.arange(-middle, len(window) - middle)[:, None]
    # So narrow that all other weights are exactly 0; a width of 0 would give 0 / 0.
    weights = np.exp(-0.5 * (distance / np.maximum(sigma, 0.01)) ** 2)
    smooth: FloatArray = (weights * window).sum(axis=0) / weights.sum(axis=0)
    return smooth


@dataclass(frozen=True, eq=False)
class LiveGaussian(Smoother):
    """A Gaussian filter whose future is cut off: it reaches back 4 sigma, and ahead a given time.

    The shorter the look-ahead, the more the result comes late: the mean of what is left of the
    window lies in the past. As a Smoother it cleans whole clips, with the same numbers as in a
    stream, so that :func:`mocaplab.tuning.tune` can choose its width.

    Parameters
    ----------
    sigma_s : float or array, shape (C,), seconds; 0 leaves a channel as it is
    look_ahead_s : float, seconds, rounded to whole frames
    """

    sigma_s: ArrayLike
    look_ahead_s: float = LOOK_AHEAD_S

    def __post_init__(self) -> None:
        sigma = np.asarray(self.sigma_s, dtype=np.float64)
        if not (np.isfinite(sigma).all() and (sigma >= 0).all()):
            raise ValueError(f"sigma_s must be 0 or more seconds, got {self.sigma_s!r}")

    def start(self, skeleton: Skeleton, frame_time: float) -> Running:
        """See :class:`LiveFilter`."""
        sigma = np.asarray(self.sigma_s, dtype=np.float64) / frame_time
        if sigma.shape not in ((), (skeleton.n_channels,)):
            raise ValueError(
                f"expected one width or one for each of the {skeleton.n_channels} channels, got "
                f"shape {sigma.shape}"
            )
        return _RunningGaussian(
            np.where(skeleton.is_cleaned, sigma, 0.0), whole_frames(self.look_ahead_s, frame_time)
        )

    def smooth(self, values: FloatArray, mask: BoolArray, frame_time: float) -> FloatArray:
        """Return the smoothed channels; see :meth:`mocaplab.filters.Smoother.smooth`."""
        sigma = np.maximum(np.asarray(self.sigma_s, dtype=np.float64) / frame_time, 0.01)
        look_ahead = whole_frames(self.look_ahead_s, frame_time)
        total, weights = np.zeros_like(values), np.zeros_like(values)
        for distance in range(-_reach(sigma), look_ahead + 1):
            weight = np.exp(-0.5 * (distance / sigma) ** 2)
            here, there = _overlap(len(values), distance)
            total[here] += weight * values[there]
            weights[here] += weight
        return total / weights


class _RunningGaussian:
    """See :class:`Running`; the widths are in frames."""

    def __init__(self, sigma: FloatArray, look_ahead: int):
        self.sigma, self.look_ahead = sigma, look_ahead
        self.n_past = _reach(sigma)

    def observe(self, frame: FloatArray) -> None:
        """Do nothing: a fixed filter learns nothing from a frame."""

    def clean(self, window: FloatArray, middle: int) -> FloatArray:
        return window_mean(window, middle, self.sigma)


def _reach(sigma: FloatArray) -> int:
    """Return how many frames back a Gaussian still counts."""
    return int(np.ceil(4 * np.max(sigma)))


def _overlap(n_frames: int, distance: int) -> tuple[slice, slice]:
    """Return the frames that have a neighbour at this distance, and these neighbours."""
    first, last = max(0, -distance), min(n_frames, n_frames - distance)
    last = max(last, first)
    return slice(first, last), slice(first + distance, last + distance)
