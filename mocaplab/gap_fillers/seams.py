"""Make what a filler predicts meet the observed samples at both ends of each gap.

A prediction from the rest of the pose is off at the ends of a gap, where it can be checked, so it
is likely to be off inside too. What it misses at the ends is carried into the gap, the less, the
further inside. With noise the last sample before a gap is itself off, so the miss is averaged over
some frames.

A channel that turns round, as the thumb of many a capture does, is not predicted at all: its angle
climbs by 360 degrees and more, and no pose tells how many turns it has made. A straight line from
end to end knows more.

The constants were chosen on training clips of CMU: gaps of 15 to 600 frames in single channels
and whole joints, without noise and with 0.5 noise, filled by EBD, PCA and low rank.
"""

from __future__ import annotations

import numpy as np

from mocaplab.cosine_windows import estimate_noise_std
from mocaplab.gap_fillers.curves import gap_ends
from mocaplab.motion import BoolArray, FloatArray, IntArray

FADE_S = 0.15
"""Misses so many seconds apart have a correlation of 1 / e, but for the share that lasts."""
LASTING = 0.25
"""This share of a miss does not fade, since the level of a channel may drift within a clip."""
DRIFT = 1.5
"""A miss changes so much in a second, as a share of its channel's deviation."""
LONGEST_S = 0.1
"""A miss is averaged over this time at most."""
WIDEST_DEG = 270.0
"""No joint of a body turns so far. An angle that does has been counted in whole turns."""


def turns_round(values: FloatArray) -> BoolArray:
    """Tell which channels turn all the way round, so that the pose does not tell where they are.

    Parameters
    ----------
    values : array, shape (T, N), degrees, continuous; NaN inside gaps, no column without any sample
    """
    # Without the outer tenth of the samples, so that noise and spikes do not count as turns.
    ranges = [np.ptp(np.nanpercentile(column, [5, 95])) for column in values.T]
    return np.array(ranges) > WIDEST_DEG


def seam_lengths(values: FloatArray, frame_time: float) -> IntArray:
    """Choose over how many frames the miss at an end is averaged, for each channel.

    If the miss is a random walk with steps of variance q, seen with noise of variance n, then the
    mean over the last m frames is off by about n / m + q m / 3. That is least at sqrt(3 n / q).

    Parameters
    ----------
    values : array, shape (T, N), degrees; NaN inside gaps, no column without any sample
    frame_time : float, seconds

    Returns
    -------
    array, shape (N,), frames, at least 1
    """
    hidden = np.isnan(values)
    noise = estimate_noise_std(np.where(hidden, 0.0, values), ~hidden)
    step = DRIFT * np.nanstd(values, axis=0) * np.sqrt(frame_time)
    lengths = np.sqrt(3.0) * noise / np.maximum(step, 1e-9)
    longest = max(1, round(LONGEST_S / frame_time))
    return np.asarray(np.clip(np.rint(lengths), 1, longest), dtype=np.int64)


def near_gaps(hidden: BoolArray, lengths: IntArray) -> BoolArray:
    """Add to every gap the samples that are averaged at its ends, shape (T, N)."""
    wider = hidden.copy()
    for i in range(1, int(lengths.max(initial=1)) + 1):
        wider[i:] |= hidden[:-i] & (lengths >= i)
        wider[:-i] |= hidden[i:] & (lengths >= i)
    return wider


def meet_ends(
    values: FloatArray, predicted: FloatArray, lengths: IntArray, frame_time: float
) -> FloatArray:
    """Fill the NaN of the columns with a prediction, shifted to meet the ends of gaps.

    Channels that turn round are filled by straight lines between the ends, averaged alike.

    Parameters
    ----------
    values : array, shape (T, N), degrees; NaN inside gaps, no column without any sample
    predicted : array, shape (T, N), degrees; it counts where :func:`near_gaps` is True
    lengths : array, shape (N,), frames, see :func:`seam_lengths`
    frame_time : float, seconds
    """
    hidden = np.isnan(values)
    turning = turns_round(values)
    predicted = np.where(turning, 0.0, predicted)  # then the whole value is missed
    lasting = np.where(turning, 1.0, LASTING)
    missed = np.where(hidden, 0.0, values - predicted)
    left, right = gap_ends(values)
    frames = np.arange(len(values))[:, None]
    # A gap at the end of a clip has one end only; the other one is infinitely far.
    back = np.where(left < frames, frames - left, np.inf) * frame_time
    ahead = np.where(right > frames, right - frames, np.inf) * frame_time
    before = _means(missed, ~hidden, np.maximum(left - lengths + 1, 0), left + 1)
    after = _means(missed, ~hidden, right, np.minimum(right + lengths, len(values)))
    shift = end_weight(back, ahead, lasting) * before + end_weight(ahead, back, lasting) * after
    return np.where(hidden, predicted + shift, values)


def end_weight(
    near_s: FloatArray, far_s: FloatArray, lasting: FloatArray | float = LASTING
) -> FloatArray:
    """Return how much the miss at an end near_s away counts, when the other is far_s away.

    What fades has the weight sinh(far) / sinh(near + far) in units of ``FADE_S``: what kriging
    gives to two ends if misses are correlated as exp(-distance). What lasts has that of a straight
    line from end to end, far / (near + far), the same with a fade that is infinitely slow.
    """
    # In exponents that cannot overflow. An end that is infinitely far counts nothing.
    near, far = near_s / FADE_S, far_s / FADE_S
    fading = np.exp(-near) * np.expm1(-2 * far) / np.expm1(-2 * (near + far))
    line = 1.0 / (1.0 + near_s / np.minimum(far_s, 1e9))
    return np.asarray((1.0 - lasting) * fading + lasting * line)


def _means(x: FloatArray, seen: BoolArray, first: IntArray, last: IntArray) -> FloatArray:
    """Average what is seen of x from frame first to before frame last, all of shape (T, N)."""
    columns = np.arange(x.shape[1])

    def total(values: FloatArray) -> FloatArray:
        sums = np.pad(np.cumsum(values, axis=0), ((1, 0), (0, 0)))
        return np.asarray(sums[last, columns] - sums[first, columns])

    return total(x) / np.maximum(total(seen.astype(np.float64)), 1.0)
