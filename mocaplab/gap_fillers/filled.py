"""A motion whose gaps were filled, and how far each filled sample may be off.

What is inside a gap is a guess, and the guess in the middle of a long gap is worse than the one
beside an observed sample. Whoever uses a filled motion should know by how much.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mocaplab.cosine_windows import estimate_noise_std
from mocaplab.gap_fillers.curves import gap_ends, lerp_gaps, never_observed
from mocaplab.motion import BoolArray, FloatArray, Motion

LONGEST_LAG = 0.5
"""Increments are measured over at most this share of a clip: of longer ones it has too few."""
LINES_CAUTION = 1.1
"""Realised over expected error of lines, in training clips with gaps of 2 to 120 frames."""


@dataclass(frozen=True, eq=False)
class Filled:
    """A motion without gaps, and the expected error of what was filled.

    Parameters
    ----------
    motion : Motion, without NaN
    std_deg : array, shape (T, C), degrees (file length units for positions)
        The standard deviation that the error of a filled sample is expected to have; 0 where
        the sample was observed, infinite in a channel that was never observed.

    Raises
    ------
    ValueError
        If the motion has a NaN, shapes differ, or an expected error is NaN or negative.
    """

    motion: Motion
    std_deg: FloatArray

    def __post_init__(self) -> None:
        std_deg = np.array(self.std_deg, dtype=np.float64)
        std_deg.flags.writeable = False
        object.__setattr__(self, "std_deg", std_deg)
        channels, name = self.motion.channels, self.motion.name
        if self.std_deg.shape != channels.shape:
            raise ValueError(
                f"motion {name!r}: expected errors of shape {channels.shape}, got "
                f"{self.std_deg.shape}"
            )
        labels = self.motion.skeleton.channel_labels
        if np.isnan(channels).any():
            frame, channel = np.argwhere(np.isnan(channels))[0]
            raise ValueError(
                f"motion {name!r}: expected every gap to be filled, but {labels[channel]} is NaN "
                f"in frame {frame}"
            )
        if not (self.std_deg >= 0).all():
            frame, channel = np.argwhere(~(self.std_deg >= 0))[0]
            raise ValueError(
                f"motion {name!r}: an expected error must be 0 or more, got "
                f"{self.std_deg[frame, channel]} for {labels[channel]} in frame {frame}"
            )

    @property
    def was_filled(self) -> BoolArray:
        """True for the samples that were inside gaps, shape (T, C)."""
        return self.std_deg > 0


def check_observed(motion: Motion) -> None:
    """Refuse, with a ValueError, a motion in which no joint angle was observed at all."""
    angles = motion.channels[:, motion.skeleton.is_rotation]
    if angles.size and np.isnan(angles).all():
        raise ValueError(
            f"motion {motion.name!r}: no angle was observed in any of its {motion.n_frames} "
            "frames, so there is nothing to fill gaps from"
        )


def fill_by_lines(motion: Motion) -> Filled:
    """Fill gaps by straight lines, and say how far off they may be.

    Parameters
    ----------
    motion : Motion
        With continuous angles (:func:`mocaplab.euler.make_continuous`); NaN inside gaps.

    Raises
    ------
    ValueError
        If no angle was observed.

    Warns
    -----
    mocaplab.gap_fillers.curves.GapWarning
        If a channel was never observed; it is left at rest.
    """
    check_observed(motion)
    return Filled(lerp_gaps(motion), lines_std(motion))


def lines_std(motion: Motion) -> FloatArray:
    """Expect the error of straight lines from how the clip's own channels move.

    Let V(h) be the mean squared increment of a channel over h frames. A line from an observed
    sample, a frames back, to one b frames ahead gives them the weights v = b / (a + b) and
    w = a / (a + b). If increments are alike all over the clip, the mean squared error is

        v V(a) + w V(b) - v w V(a + b),

    which needs no other assumption: Brownian motion, V(h) = h, gives the Brownian bridge
    a b / (a + b). (The difference x - v x_a - w x_b has weights that add up to 0, and the
    variance of such a sum is a sum of increments; geostatistics calls V the variogram.) At an
    end of the clip the nearest sample is held, and the error is V(a).

    An observed sample has noise of variance n, which V(h) holds twice. What is filled is
    compared with the clean motion, which has none: n is subtracted once.

    Parameters
    ----------
    motion : Motion, with continuous angles; NaN inside gaps

    Returns
    -------
    array, shape (T, C), degrees; see :class:`Filled`
    """
    values = motion.channels
    hidden = np.isnan(values)
    increment = mean_squared_increments(values)
    longest = int(np.ceil(LONGEST_LAG * (len(values) - 1)))
    increment[longest + 1 :] = increment[longest]
    left, right = gap_ends(values)
    frames = np.arange(len(values))[:, None]
    lags = np.abs(frames - left), np.abs(right - frames), right - left
    v_back, v_ahead, v_whole = (np.take_along_axis(increment, lag, axis=0) for lag in lags)
    share = (frames - left) / np.maximum(right - left, 1)
    variance = lines_variance(v_back, v_ahead, v_whole, share)
    noise = estimate_noise_std(np.where(hidden, 0.0, values), ~hidden)
    # Never less than the noise of one end, and some hundredths of what a step of a frame is.
    least = 0.5 * noise**2 + 1e-4 * increment[:2].max(axis=0) + 1e-12
    std = LINES_CAUTION * np.sqrt(np.maximum(variance - noise**2, least))
    std[:, never_observed(motion)] = np.inf
    return np.where(hidden, std, 0.0)


def lines_variance(
    v_back: FloatArray, v_ahead: FloatArray, v_whole: FloatArray, share: FloatArray
) -> FloatArray:
    """Return the variance of a line's error; see :func:`lines_std`.

    Parameters
    ----------
    v_back, v_ahead, v_whole : arrays of one shape
        The mean squared increments from one end, to the other end, and between both ends; the
        last is 0 where there is one end only.
    share : array, of the same shape: how much of the way is behind, 0 to 1
    """
    inside = (1 - share) * v_back + share * v_ahead - share * (1 - share) * v_whole
    return np.where(v_whole > 0, inside, np.maximum(v_back, v_ahead))


def mean_squared_increments(values: FloatArray) -> FloatArray:
    """Measure how far each column moves within h frames, for all h at once.

    Parameters
    ----------
    values : array, shape (T, N); NaN where not observed

    Returns
    -------
    array, shape (T, N): the mean of (x(t + h) - x(t))^2 over all pairs that were observed, for
    h = 0, 1, ..., T - 1; where there is no pair, that of the next shorter h
    """
    frames = len(values)
    observed = ~np.isnan(values)
    count = np.maximum(observed.sum(axis=0), 1)
    mean = np.where(observed, values, 0.0).sum(axis=0) / count
    x = np.where(observed, values - mean, 0.0)
    # Sums over all pairs are correlations, and those are products of spectra.
    m, mx, mxx = (np.fft.rfft(y, 2 * frames, axis=0) for y in (observed * 1.0, x, x**2))
    spectrum = mxx.conj() * m + m.conj() * mxx - 2 * mx.conj() * mx
    total = np.fft.irfft(spectrum, 2 * frames, axis=0)[:frames]
    pairs = np.round(np.fft.irfft(m.conj() * m, 2 * frames, axis=0)[:frames])
    lag = np.arange(frames)[:, None]
    known = np.maximum.accumulate(np.where(pairs > 0, lag, 0), axis=0)
    mean_square = np.maximum(total, 0.0) / np.maximum(pairs, 1.0)
    mean_square[0] = 0.0
    return np.asarray(np.take_along_axis(mean_square, known, axis=0))
