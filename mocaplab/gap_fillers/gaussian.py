"""Fill gaps from the other joints and from both ends, and say how far off each sample may be.

Two things are known about a hidden angle: what the other joints do in the same moment, and what
the angle itself did before and does after the gap. The first helps in gaps of any length, the
second only near their ends. Both are Gaussian models, put together in two steps:

1. *Other joints.* The conditional Gaussian (:mod:`mocaplab.gap_fillers.conditional_gaussian`)
guesses the
   angle in the gap, and also around it, as if it were hidden there too.
2. *Ends.* Around the gap we see by how much the guess is wrong. This error is carried into the
   gap by kriging (:mod:`mocaplab.gap_fillers.kriging`), so that the fill meets both ends.

Kriging alone, without the other joints, is another way, and the best one for gaps of a few
frames; a straight line is the safest beside a jump, where kriging would overshoot. All three know
their variance, and the fill is their weighted mean (:func:`_mix`).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from mocaplab.gap_fillers.conditional_gaussian import PoseWindows, Scaled
from mocaplab.gap_fillers.curves import lerp_gaps
from mocaplab.gap_fillers.filled import Filled, check_observed, lines_std, lines_variance
from mocaplab.gap_fillers.kriging import Smoothness, krige, relative_increments, runs, variances
from mocaplab.gap_fillers.seams import meet_ends, seam_lengths, turns_round
from mocaplab.motion import FloatArray, Motion

REACH_S = 0.25
"""Samples up to this far from a gap are kriged from, seconds."""
OWN_SHARE = 0.5
"""How much the smoothness of the clip itself counts, against that of the training clips."""
TREMBLING = 0.2
"""With more noise than this share of the movement, the clip's own smoothness cannot be seen."""


@dataclass(frozen=True, eq=False)
class GaussianFiller:
    """Fill gaps; made by :func:`mocaplab.gap_fillers.gaussian_fit.fit_gaussian_filler`.

    Channels that do not move, those that turn round, and the root are filled by straight lines, and
    so are clips in which less than two channels move.

    Parameters
    ----------
    channel_labels : tuple of C str, such as ``"LeftLeg.Xrotation"``
    covariance : array, shape (C + 3, K, C + 3, K)
        Of windows of training clips; see :mod:`mocaplab.gap_fillers.conditional_gaussian`.
    of_errors, of_angles : Smoothness
        Of what the other joints cannot guess, and of the angles themselves.
    caution : float
        Realised over expected error in training clips.
    trained_on : dict of clip name -> digest
    """

    channel_labels: tuple[str, ...]
    covariance: FloatArray
    of_errors: Smoothness
    of_angles: Smoothness
    caution: float = 1.0
    trained_on: dict[str, str] = field(default_factory=dict)

    def fill(self, motion: Motion) -> Filled:
        """Fill the gaps of a motion with continuous angles.

        Raises
        ------
        ValueError
            If no angle was observed, or the training clips have other channels.

        Warns
        -----
        mocaplab.gap_fillers.curves.GapWarning
            If a channel was never observed; it is left at rest.
        """
        check_observed(motion)
        self._check_channels(motion)
        lines = Filled(lerp_gaps(motion), lines_std(motion))
        scaled = Scaled.of(motion)
        hidden = np.isnan(scaled.values)
        if len(scaled.columns) < 2 or not hidden.any():
            return lines
        clip = self._look(scaled, lines, motion.frame_time)
        channels, std = lines.motion.channels.copy(), lines.std_deg.copy()
        turning = turns_round(motion.channels[:, scaled.columns])
        values = motion.channels[:, scaled.columns[turning]]
        channels[:, scaled.columns[turning]] = meet_ends(
            values,
            np.zeros_like(values),
            seam_lengths(values, motion.frame_time),
            motion.frame_time,
        )
        for i, column in enumerate(scaled.columns):
            if turning[i]:
                continue
            for start, stop in runs(hidden[:, i]):
                value, variance = clip.fill_gap(i, start, stop)
                channels[start:stop, column] = value * scaled.std[i] + scaled.mean[i]
                std[start:stop, column] = self.caution * np.sqrt(variance) * scaled.std[i]
        return Filled(motion.with_channels(channels), std)

    def __call__(self, motion: Motion) -> Motion:
        """Fill the gaps of a motion, for :class:`mocaplab.filters.GapFiller`."""
        return self.fill(motion).motion

    def _look(self, scaled: Scaled, lines: Filled, frame_time: float) -> _Clip:
        """Gather what is known about a clip and its gaps."""
        windows = PoseWindows(scaled, frame_time, self.covariance)
        guess, variance = windows.guess()
        left_out, usual = windows.leave_out(scaled.joint)
        missed = scaled.values - left_out
        # In this clip guesses may be worse than the covariance says, and in some frames more
        # channels than those of one joint are hidden.
        power = np.maximum(variances(missed, scaled.noise), 0.1 * usual)
        return _Clip(
            seen=scaled.values,
            noise=scaled.noise,
            guess=guess,
            size=np.sqrt(variance / usual * power),
            of_errors=_adapted(self.of_errors, missed, scaled.noise, frame_time),
            of_angles=_adapted(self.of_angles, scaled.values, scaled.noise, frame_time),
            lines=(lines.motion.channels[:, scaled.columns] - scaled.mean) / scaled.std,
            v_lines=(lines.std_deg[:, scaled.columns] / scaled.std) ** 2,
            frame_time=frame_time,
        )

    def _check_channels(self, motion: Motion) -> None:
        labels = motion.skeleton.channel_labels
        if labels != self.channel_labels:
            other = sorted(set(labels) ^ set(self.channel_labels))
            raise ValueError(
                f"motion {motion.name!r}: the gap filler was fitted to another skeleton "
                f"({len(self.channel_labels)} channels; this motion has {len(labels)}); only one "
                f"of them has {', '.join(other[:4]) or 'the channels in this order'}"
            )


def _adapted(
    trained: Smoothness, values: FloatArray, noise: FloatArray, frame_time: float
) -> Smoothness:
    """Mix the smoothness of the training clips with that of the clip itself."""
    own, lags_s = relative_increments(values, noise, frame_time)
    if not len(own) or noise.mean() > TREMBLING:
        return trained
    before = np.maximum(1.0 - trained.correlation(lags_s), 1e-9)
    return Smoothness.fit(own**OWN_SHARE * before ** (1 - OWN_SHARE), lags_s)


@dataclass(frozen=True, eq=False)
class _Clip:
    """What is known about a clip and its gaps; all arrays but the noise (T, N), scaled."""

    seen: FloatArray  # NaN inside gaps
    noise: FloatArray  # (N,)
    guess: FloatArray  # from the other joints
    size: FloatArray  # deviation of the guess's errors
    of_errors: Smoothness
    of_angles: Smoothness
    lines: FloatArray
    v_lines: FloatArray  # variance of the lines' errors
    frame_time: float

    def fill_gap(self, channel: int, start: int, stop: int) -> FloatArray:
        """Fill one gap, frames start to stop; return values and variances, (2, stop - start)."""
        reach = round(REACH_S / self.frame_time)
        low = max(0, start - reach)
        seen = self.seen[low : stop + reach, channel]
        near = low + np.flatnonzero(~np.isnan(seen))
        gap = np.arange(start, stop)
        seen, noise = self.seen[near, channel], float(self.noise[channel])
        times_s = np.float64(self.frame_time) * near, np.float64(self.frame_time) * gap
        sizes = self.size[near, channel], self.size[gap, channel]
        missed = seen - self.guess[near, channel]
        carried, v_others = krige(missed, *times_s, self.of_errors, noise, sizes)
        ones = np.ones(len(near)), np.ones(len(gap))
        alone, v_alone = krige(seen, *times_s, self.of_angles, noise, ones)
        variances = np.stack([v_others, v_alone, self._v_lines(channel, start, stop)])
        known = 1.0 / variances
        # Far from the ends kriging alone says the mean of the clip. That is no knowledge: a gap
        # in which more happens than elsewhere is not rare.
        known[1] = np.maximum(known[1] - 1.0, 0.0)
        others = self.guess[gap, channel] + carried
        return _mix(np.stack([others, alone, self.lines[gap, channel]]), variances, known)

    def _v_lines(self, channel: int, start: int, stop: int) -> FloatArray:
        """Return the variance of a line's errors, (stop - start,).

        It is the mean of what the channel itself tells, and what all channels do: a channel may
        stand still wherever it was seen, and move inside the gap.
        """
        n = stop - start
        back = self.frame_time * np.arange(1.0, n + 1)
        ahead, whole = back[::-1], np.full(n, self.frame_time * (n + 1))
        if start == 0 or stop == len(self.seen):  # the one end that there is is held
            back = ahead = ahead if start == 0 else back
            whole = np.zeros(n)
        share = back / (back + ahead)
        v_back, v_ahead, v_whole = (
            2 - 2 * self.of_angles.correlation(lag_s) for lag_s in (back, ahead, whole)
        )
        alike = lines_variance(v_back, v_ahead, v_whole, share)
        return np.asarray(0.5 * (self.v_lines[start:stop, channel] + alike))


def _mix(estimates: FloatArray, variances: FloatArray, known: FloatArray) -> FloatArray:
    """Mix estimates and their variances by the squares of what they know, 1 / variance.

    The squares let the best one decide, since the errors of all are much the same error.

    Parameters
    ----------
    estimates, variances, known : arrays, shape (M, Q)

    Returns
    -------
    array, shape (2, Q): the estimate and its variance
    """
    share = known**2 / np.sum(known**2, axis=0)
    return np.stack([np.sum(share * estimates, axis=0), np.sum(share * variances, axis=0)])
