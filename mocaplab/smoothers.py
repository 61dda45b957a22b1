"""Classical smoothers besides the Gaussian: Savitzky-Golay, Butterworth, median, One-Euro.

Every parameter is in seconds or hertz, so that 30 and 120 frames per second agree. Each
smoother has a ``fit_...`` that tries a grid of parameters on training clips.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import ArrayLike
from scipy.ndimage import median_filter
from scipy.signal import butter, lfilter, savgol_filter, sosfiltfilt

from mocaplab.filters import Smoother, Untouched, gaussian_filter
from mocaplab.motion import BoolArray, Corrupted, FloatArray
from mocaplab.tuning import lowest_fps, tune, tune_per_channel

SPEED_CUTOFF_HZ = 1.0
"""The One-Euro filter smooths its speed with this cutoff (the paper's default)."""


def odd_frames(window_s: float, frame_time: float) -> int:
    """Return the odd number of frames that is nearest to a time."""
    return 2 * round((window_s / frame_time - 1) / 2) + 1


def _require_positive(**values: float) -> None:
    for name, value in values.items():
        if not 0 < value < np.inf:
            raise ValueError(f"{name} must be a positive number, got {value}")


def _tune(filters: Sequence[Smoother], clips: Sequence[Corrupted], per_channel: bool) -> Smoother:
    """Tune on training clips; where there is next to no noise, no filter is the best one."""
    candidates = [Untouched(), *filters]
    return tune_per_channel(candidates, clips) if per_channel else tune(candidates, clips)


@dataclass(frozen=True)
class SavitzkyGolay(Smoother):
    """A polynomial fitted by least squares to a window around each frame.

    The window is the odd number of frames nearest to ``window_s``. Near the ends of the
    clip, the polynomial of the last whole window goes on to the end. A clip shorter than
    the window is fitted as a whole; one too short for the polynomial comes back as it is.

    Parameters
    ----------
    window_s : float, seconds
    order : int, 0 or more
        Of the polynomial. 2 and 3 differ only near the ends of the clip.

    Raises
    ------
    ValueError
        If the window is not positive, the order is negative, or (when it smooths) the
        window has too few frames for the order at the clip's frame rate.

    References
    ----------
    Savitzky and Golay 1964, "Smoothing and differentiation of data by simplified least
    squares procedures".
    """

    window_s: float
    order: int = 3

    def __post_init__(self) -> None:
        _require_positive(window_s=self.window_s)
        if self.order < 0:
            raise ValueError(f"order must be 0 or more, got {self.order}")

    def smooth(self, values: FloatArray, mask: BoolArray, frame_time: float) -> FloatArray:
        """Return the smoothed channels; see :meth:`Smoother.smooth`."""
        window = odd_frames(self.window_s, frame_time)
        if window <= self.order:
            raise ValueError(
                f"a polynomial of order {self.order} needs a window of more than {self.order} "
                f"frames, got {self.window_s} s = {window} at {1 / frame_time:g} fps"
            )
        window = min(window, len(values) - (len(values) + 1) % 2)
        if window <= self.order:
            return values
        return np.asarray(savgol_filter(values, window, self.order, axis=0, mode="interp"))


def fit_savgol(clips: Sequence[Corrupted], *, per_channel: bool = False) -> Smoother:
    """Tune a Savitzky-Golay filter on training clips."""
    fps = lowest_fps(clips)
    grid = product(np.geomspace(0.05, 1.0, 16).round(3).tolist(), (2, 4))
    usable = [SavitzkyGolay(w, order) for w, order in grid if odd_frames(w, 1 / fps) > order]
    return _tune(usable, clips, per_channel)


@dataclass(frozen=True)
class Butterworth(Smoother):
    """The zero-lag low-pass filter of biomechanics: second order, forwards and backwards.

    Two passes make a filter of fourth order without delay. They would also halve the power
    at the cutoff twice, so each pass gets a higher cutoff: at ``cutoff_hz`` the whole has
    a gain of 0.707 (Winter 2009, on the choice of cutoff with two passes).

    Before filtering, the clip is continued at both ends by its mirror image, for one period
    of the cutoff or as far as the clip reaches. The usual choice, a mirror image turned
    upside down, holds the curve fast at the first and last noisy sample: on real clips it
    scored worse.

    Parameters
    ----------
    cutoff_hz : float, hertz
        6 Hz is the usual choice for walking.

    Raises
    ------
    ValueError
        If the cutoff is not positive, or (when it smooths) not below the Nyquist
        frequency, half the clip's frame rate.

    References
    ----------
    Winter 2009, "Biomechanics and Motor Control of Human Movement", 4th edition.
    """

    cutoff_hz: float = 6.0

    def __post_init__(self) -> None:
        _require_positive(cutoff_hz=self.cutoff_hz)

    def smooth(self, values: FloatArray, mask: BoolArray, frame_time: float) -> FloatArray:
        """Return the smoothed channels; see :meth:`Smoother.smooth`."""
        fps = 1 / frame_time
        if self.cutoff_hz >= fps / 2:
            raise ValueError(
                f"the cutoff must be below the Nyquist frequency, {fps / 2:g} Hz at {fps:g} fps, "
                f"got {self.cutoff_hz} Hz"
            )
        two_passes = (np.sqrt(2) - 1) ** 0.25
        warped = np.tan(np.pi * self.cutoff_hz / fps) / two_passes
        sections = butter(2, 2 / np.pi * np.arctan(warped), output="sos")
        padding = min(int(np.ceil(fps / self.cutoff_hz)), len(values) - 1)
        return np.asarray(sosfiltfilt(sections, values, axis=0, padtype="even", padlen=padding))


def fit_butterworth(clips: Sequence[Corrupted], *, per_channel: bool = False) -> Smoother:
    """Tune a zero-lag Butterworth filter on training clips."""
    fps = lowest_fps(clips)
    grid = np.geomspace(1.0, 60.0, 36).round(2).tolist()
    usable = [Butterworth(cutoff) for cutoff in grid if cutoff < fps / 2]
    return _tune(usable, clips, per_channel)


@dataclass(frozen=True)
class MedianGaussian(Smoother):
    """A running median against spikes, then a Gaussian against noise.

    A median forgets any spike shorter than half its window, which a Gaussian would spread
    out. The window is the odd number of frames nearest to ``window_s``; both filters
    continue the clip by its mirror image.

    Parameters
    ----------
    window_s : float, seconds
    sigma_s : float, seconds; 0 for the median alone

    Raises
    ------
    ValueError
        If the window is not positive, sigma is negative, or (when it smooths) the window
        has fewer than 3 frames at the clip's frame rate.

    References
    ----------
    Tukey 1977, "Exploratory Data Analysis", chapter 7.
    """

    window_s: float
    sigma_s: float

    def __post_init__(self) -> None:
        _require_positive(window_s=self.window_s)
        if not 0 <= self.sigma_s < np.inf:
            raise ValueError(f"sigma_s must be 0 or more seconds, got {self.sigma_s}")

    def smooth(self, values: FloatArray, mask: BoolArray, frame_time: float) -> FloatArray:
        """Return the smoothed channels; see :meth:`Smoother.smooth`."""
        window = odd_frames(self.window_s, frame_time)
        if window < 3:
            raise ValueError(
                f"a median needs a window of 3 frames or more, got {self.window_s} s = "
                f"{window} at {1 / frame_time:g} fps"
            )
        medians = median_filter(values, size=(window, 1), mode="reflect")
        return gaussian_filter(medians, self.sigma_s, frame_time)


def fit_median_gaussian(clips: Sequence[Corrupted], *, per_channel: bool = False) -> Smoother:
    """Tune a median and Gaussian on training clips."""
    shortest_s = 3 / lowest_fps(clips)
    windows = sorted({max(window, shortest_s) for window in (0.025, 0.042, 0.075, 0.15)})
    sigmas = [0.0, *np.geomspace(0.004, 0.125, 11).round(4).tolist()]
    usable = [MedianGaussian(window, sigma) for window, sigma in product(windows, sigmas)]
    return _tune(usable, clips, per_channel)


@dataclass(frozen=True)
class OneEuro(Smoother):
    """The One-Euro filter: exponential smoothing that gives way when the signal is fast.

    It is causal, so it can clean a live stream, and pays with delay. Its cutoff is
    ``min_cutoff_hz + beta * |speed|``: little jitter at rest, little delay in movement. The
    paper takes the speed from the last *smoothed* sample, but then the same beta means
    something else at each frame rate; here it is the difference of two observed samples.

    Parameters
    ----------
    min_cutoff_hz : float, hertz
    beta : float, hertz per degree per second, 0 or more

    References
    ----------
    Casiez, Roussel and Vogel 2012, "1 € filter: a simple speed-based low-pass filter for
    noisy input in interactive systems", algorithm 1.
    """

    min_cutoff_hz: float = 1.0
    beta: float = 0.0

    def __post_init__(self) -> None:
        _require_positive(min_cutoff_hz=self.min_cutoff_hz)
        if not 0 <= self.beta < np.inf:
            raise ValueError(f"beta must be 0 or more, got {self.beta}")

    def smooth(self, values: FloatArray, mask: BoolArray, frame_time: float) -> FloatArray:
        """Return the smoothed channels; see :meth:`Smoother.smooth`."""
        observed_speed = np.diff(values, axis=0, prepend=values[:1]) / frame_time
        share = _new_share(SPEED_CUTOFF_HZ, frame_time)
        speed = lfilter([share], [1, share - 1], observed_speed, axis=0)
        share = _new_share(self.min_cutoff_hz + self.beta * np.abs(speed), frame_time)
        smoothed = values.copy()
        for t in range(1, len(values)):
            smoothed[t] = smoothed[t - 1] + share[t] * (values[t] - smoothed[t - 1])
        return smoothed


def _new_share(cutoff_hz: ArrayLike, frame_time: float) -> FloatArray:
    """Return how much of a new sample exponential smoothing of this cutoff takes."""
    return 1.0 / (1.0 + 1.0 / (2 * np.pi * np.asarray(cutoff_hz) * frame_time))


def fit_one_euro(clips: Sequence[Corrupted], *, per_channel: bool = False) -> Smoother:
    """Tune a One-Euro filter on training clips."""
    cutoffs = np.geomspace(0.5, 16.0, 11).round(2).tolist()
    betas = (0.0, 0.003, 0.01, 0.03, 0.1, 0.3)
    candidates = [OneEuro(cutoff, beta) for cutoff, beta in product(cutoffs, betas)]
    return _tune(candidates, clips, per_channel)
