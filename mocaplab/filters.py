"""Classical cleaning: linear interpolation over gaps and Gaussian smoothing.

Widths are in seconds, never in frames, so that 30 and 120 frames per second agree.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from mocaplab.euler import motion_continuity
from mocaplab.gap_fillers.curves import lerp_gaps, never_observed
from mocaplab.motion import BoolArray, FloatArray, Motion, moving_channels


class Denoiser(Protocol):
    """Whatever cleans a motion. It never receives the clean one."""

    def denoise(self, observed: Motion, mask: BoolArray) -> Motion:
        """Return the cleaned motion.

        Parameters
        ----------
        observed : Motion
            NaN inside gaps.
        mask : array, shape (T, C), bool
            True where a sample was observed.
        """
        ...


def gaussian_filter(values: ArrayLike, sigma_s: ArrayLike, frame_time: float) -> FloatArray:
    """Smooth each channel with a Gaussian window.

    The window reaches 4 sigma to each side. At the ends of the clip the signal is
    continued by its mirror image, which scored best of five ways on real clips.

    Parameters
    ----------
    values : array, shape (T, C)
    sigma_s : float or array, shape (C,), seconds; 0 leaves a channel as it is
    frame_time : float, seconds

    Returns
    -------
    array, shape (T, C)
    """
    values = np.asarray(values, dtype=np.float64)
    sigma = np.broadcast_to(np.asarray(sigma_s, dtype=np.float64), values.shape[1:]) / frame_time
    if not (np.isfinite(sigma).all() and (sigma >= 0).all()):
        raise ValueError(f"sigma must be 0 or more seconds, got {sigma_s!r}")
    radius = int(np.ceil(4 * sigma.max(initial=0)))
    taps = np.arange(-radius, radius + 1)
    with np.errstate(divide="ignore", invalid="ignore"):
        weights = np.exp(-0.5 * (taps[:, None] / sigma) ** 2)  # (taps, C)
    weights[radius] = 1.0  # 0 / 0 where sigma is 0
    weights /= weights.sum(axis=0)
    padded = np.pad(values, ((radius, radius), (0, 0)), mode="symmetric")
    result = np.zeros_like(values)
    for tap in range(len(taps)):
        result += weights[tap] * padded[tap : tap + len(values)]
    return result


def filter_motion(
    observed: Motion,
    smooth: Callable[[Motion], FloatArray],
    fill: Callable[[Motion], Motion] = lerp_gaps,
) -> Motion:
    """Do what every cleaner does around its filter.

    The angles are made continuous, gaps are filled, the filter is applied, and the result
    is put back into the file's own Euler convention. The root and channels that do not
    move are returned exactly as they came; a channel that was never observed, at rest.

    Parameters
    ----------
    observed : Motion
        NaN inside gaps.
    smooth : function
        Takes the continuous, filled motion and returns its channels, shape (T, C).
    fill : function
        Takes the continuous motion and returns it without NaN, straight lines by default.
    """
    sign, offset = motion_continuity(observed)
    unseen = never_observed(observed)
    sign[:, unseen], offset[:, unseen] = 1.0, 0.0  # its rest value is the file's, not ours
    filled = fill(observed.with_channels(sign * observed.channels + offset))
    cleaned = np.where(moving_channels(observed), smooth(filled), filled.channels)
    restored = sign * (cleaned - offset)
    changed = cleaned != filled.channels
    keep = ~changed & ~np.isnan(observed.channels)
    return observed.with_channels(np.where(keep, observed.channels, restored))


class Smoother(ABC):
    """A Denoiser that filters every channel by itself: gaps filled, then :meth:`smooth`."""

    @abstractmethod
    def smooth(self, values: FloatArray, mask: BoolArray, frame_time: float) -> FloatArray:
        """Return smooth channels, shape (T, C).

        Parameters
        ----------
        values : array, shape (T, C)
            Continuous angles; gaps are filled already.
        mask : array, shape (T, C), bool
            False where a gap was filled, for filters that measure the noise.
        frame_time : float, seconds
        """

    def denoise(self, observed: Motion, mask: BoolArray) -> Motion:
        """Return the smoothed motion; see :class:`Denoiser`."""
        seen = ~np.isnan(observed.channels)
        return filter_motion(observed, lambda m: self.smooth(m.channels, seen, m.frame_time))


class GapFiller:
    """The Denoiser that fills gaps and smooths nothing.

    Parameters
    ----------
    fill : function
        Takes a motion with continuous angles and returns it without NaN, such as
        :func:`mocaplab.gap_fillers.curves.pchip_gaps`.
    """

    def __init__(self, fill: Callable[[Motion], Motion]):
        self.fill = fill

    def denoise(self, observed: Motion, mask: BoolArray) -> Motion:
        """Return the filled motion; see :class:`Denoiser`."""
        return filter_motion(observed, lambda motion: motion.channels, self.fill)


class Untouched(Smoother):
    """The denoiser that does nothing but fill gaps by lerp: the score to start from."""

    def smooth(self, values: FloatArray, mask: BoolArray, frame_time: float) -> FloatArray:
        """Return the values as they are."""
        return values


class GaussianDenoiser(Smoother):
    """Lerp over gaps, then one Gaussian for all channels or one a channel.

    Parameters
    ----------
    sigma_s : float or array, shape (C,), seconds
    """

    def __init__(self, sigma_s: ArrayLike):
        self.sigma_s = np.asarray(sigma_s, dtype=np.float64)

    def smooth(self, values: FloatArray, mask: BoolArray, frame_time: float) -> FloatArray:
        """Return the smoothed channels; see :func:`gaussian_filter`."""
        return gaussian_filter(values, self.sigma_s, frame_time)
