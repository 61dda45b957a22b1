"""What all other joints say about a hidden one: the conditional Gaussian.

Describe half a second of motion around a frame by a few cosine coefficients a channel: a vector
x. Over many clips x has a covariance C. If x is Gaussian and some of its entries H are hidden,
the best guess at them from the visible ones V, and the covariance of its error, are

    x_H = C_HV C_VV^-1 x_V    and    C_HH - C_HV C_VV^-1 C_VH.

This is the Wiener filter (:mod:`mocaplab.wiener`) with endless noise on what is hidden. C_VV is
large and another one in every frame. With the precision matrix P = C^-1 the same two are

    x_H = -P_HH^-1 P_HV x_V   and    P_HH^-1,

and P_HH is small, since little is hidden at once: one large inverse serves the whole clip.

As in the Wiener filter, each channel is centred on the mean of its clip and divided by its own
deviation there; noise adds to the diagonal; and the clip's own windows are added to those of the
training clips. The root's angular velocity belongs to x too, and is always seen.

Letters in shapes: T frames, N channels that move, K cosines, C channels of the skeleton.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mocaplab.cosine_windows import estimate_noise_std
from mocaplab.gap_fillers.curves import lerp_columns
from mocaplab.measures.movement import root_angular_velocity
from mocaplab.motion import BoolArray, FloatArray, IntArray, Motion, moving_channels

WINDOW_S = 0.5
"""Length of a window, seconds."""
N_COSINES = 8
"""Cosines a channel and window."""
PRIOR_S = 30.0
"""Training clips weigh as much as this many seconds of the clip itself."""
LEAST_VARIANCE = 1e-5
"""Nothing is known more exactly than this share of a channel's variance."""
ROOT = 3
"""Signals that are no channels: the root's angular velocity about its three axes."""


@dataclass(frozen=True, eq=False)
class Scaled:
    """The moving channels of a clip, each with mean 0 and deviation 1."""

    columns: IntArray  # (N,): the channels that move
    joint: IntArray  # (N,): the joint of each
    values: FloatArray  # (T, N); NaN inside gaps
    root: FloatArray  # (T, 3): the root's angular velocity, scaled likewise
    mean: FloatArray  # (N,), degrees
    std: FloatArray  # (N,), degrees, without noise
    noise: FloatArray  # (N,): deviation of the noise, scaled

    @classmethod
    def of(cls, motion: Motion) -> Scaled:
        """Scale a motion with continuous angles; NaN inside gaps."""
        columns = np.flatnonzero(moving_channels(motion)).astype(np.int64)
        channels = motion.channels[:, columns]
        seen = ~np.isnan(channels)
        noise = estimate_noise_std(np.where(seen, channels, 0.0), seen)
        mean, variance = np.nanmean(channels, axis=0), np.nanvar(channels, axis=0)
        # Never less than a tenth of the noise: a channel may be nothing but noise.
        std = np.sqrt(np.maximum(variance - noise**2, 0.01 * noise**2 + 1e-6))
        root = root_angular_velocity(motion)
        root = (root - root.mean(axis=0)) / (root.std(axis=0) + 1e-6)
        joint = motion.skeleton.channel_joint[columns]
        return cls(columns, joint, (channels - mean) / std, root, mean, std, noise / std)


def cosine_coefficients(
    values: FloatArray, frame_time: float
) -> tuple[FloatArray, FloatArray, int]:
    """Describe the window around every frame; beyond its ends a clip is mirrored.

    Parameters
    ----------
    values : array, shape (T, N)
    frame_time : float, seconds

    Returns
    -------
    coefficients : array, shape (T, N, K)
    middle : array, shape (K,): their sum with these weights is the value in the frame itself
    radius : int, frames that a window reaches to each side
    """
    radius = max(1, round(WINDOW_S / frame_time / 2))
    length = 2 * radius + 1
    order = np.arange(min(N_COSINES, length))
    phase = (np.arange(length)[:, None] + 0.5) / length
    # Mean square 1 each, so that coefficients mean the same at every frame rate.
    basis = np.sqrt(np.where(order > 0, 2.0, 1.0)) * np.cos(np.pi * phase * order)
    padded = np.pad(values, ((radius, radius), (0, 0)), mode="symmetric")
    views = np.lib.stride_tricks.sliding_window_view(padded, length, axis=0)
    return views @ basis / length, basis[radius], radius


def near_gaps(hidden: BoolArray, radius: int) -> BoolArray:
    """Tell which windows have a hidden sample in them, shape (T, N)."""
    edge = ((radius + 1, radius), (0, 0))
    count = np.cumsum(np.pad(hidden, edge).astype(np.int64), axis=0)
    return np.asarray(count[2 * radius + 1 :] > count[: -2 * radius - 1])


def window_covariance(clips: Sequence[Motion]) -> FloatArray:
    """Measure how channels move together in clean clips of one skeleton.

    Parameters
    ----------
    clips : list of Motion, continuous, without NaN

    Returns
    -------
    array, shape (C + 3, K, C + 3, K), of scaled coefficients; the last 3 are the root's velocity

    Raises
    ------
    ValueError
        If nothing moves.
    """
    n_channels = clips[0].skeleton.n_channels
    moment = np.zeros((n_channels + ROOT, N_COSINES) * 2)
    frames = np.zeros(n_channels + ROOT)
    for clip in clips:
        scaled = Scaled.of(clip)
        signals = np.hstack([scaled.values, scaled.root])
        windows = cosine_coefficients(signals, clip.frame_time)[0]
        n, k = windows.shape[1:]
        flat = windows.reshape(-1, n * k)
        who = np.append(scaled.columns, n_channels + np.arange(ROOT))
        product = (flat.T @ flat).reshape(n, k, n, k)
        moment[_block(who, k)] += product
        frames[who] += len(windows)
    if not frames[:n_channels].any():
        raise ValueError("gap filling learns from clips in which something moves, got none")
    scale = 1 / np.sqrt(np.maximum(frames, 1))
    covariance = moment * scale[:, None, None, None] * scale[:, None]
    own = np.einsum("aiaj->aij", covariance)
    # A channel that never moved in training is assumed to move like an average one.
    average = own[:n_channels][frames[:n_channels] > 0].mean(axis=0)
    for channel in np.flatnonzero(frames == 0):
        covariance[channel, :, channel, :] = average
    return covariance


def _block(who: IntArray, k: int) -> tuple[IntArray, IntArray, IntArray, IntArray]:
    """Index the rows and columns of some signals and the first k cosines."""
    cosine = np.arange(k)
    return who[:, None, None, None], cosine[:, None, None], who[:, None], cosine


class PoseWindows:
    """The windows of a clip and their precision matrix, with which hidden channels are guessed.

    Parameters
    ----------
    scaled : Scaled
    frame_time : float, seconds
    covariance : array, shape (C + 3, K, C + 3, K), of training clips
    """

    def __init__(self, scaled: Scaled, frame_time: float, covariance: FloatArray):
        hidden = np.isnan(scaled.values)
        signals = np.hstack([lerp_columns(scaled.values), scaled.root])
        windows, self.middle, radius = cosine_coefficients(signals, frame_time)
        self.n_frames, n, self.k = windows.shape
        self.blind = near_gaps(hidden, radius)  # (T, N): windows that a gap reaches into
        self.flat = windows.reshape(self.n_frames, n * self.k)
        who = np.append(scaled.columns, len(covariance) - ROOT + np.arange(ROOT))
        prior = covariance[_block(who, self.k)].reshape(n * self.k, n * self.k)
        noise = np.append(scaled.noise**2, np.zeros(ROOT)) / (2 * radius + 1)
        prior = prior + np.diag(np.repeat(noise, self.k) + LEAST_VARIANCE)
        own = self.flat[~self.blind.any(axis=1)]
        weight = PRIOR_S / frame_time
        self.precision = np.linalg.inv((weight * prior + own.T @ own) / (weight + len(own)))

    def guess(self) -> tuple[FloatArray, FloatArray]:
        """Guess every channel in the frames whose windows a gap of it reaches into.

        Returns
        -------
        values, variance : arrays, shape (T, N), scaled; 0 and 1 in all other frames
        """
        values, variance = np.zeros(self.blind.shape), np.ones(self.blind.shape)
        root = np.zeros((self.n_frames, ROOT), dtype=bool)
        unseen = np.repeat(np.hstack([self.blind, root]), self.k, axis=1)
        evidence = np.where(unseen, 0.0, self.flat) @ self.precision  # P_HV x_V, in columns H
        patterns, which = np.unique(self.blind, axis=0, return_inverse=True)
        for i, pattern in enumerate(patterns):
            hidden = np.flatnonzero(pattern)
            frames = np.flatnonzero(which.ravel() == i)
            if len(hidden):
                place = np.ix_(frames, hidden)
                error, variance[place] = self._error(hidden)
                guessed = -evidence[np.ix_(frames, self._entries(hidden))] @ error
                values[place] = guessed.reshape(len(frames), len(hidden), self.k) @ self.middle
        return values, variance

    def leave_out(self, joint: IntArray) -> tuple[FloatArray, FloatArray]:
        """Guess each channel from the joints that it does not belong to, in all frames.

        Parameters
        ----------
        joint : array, shape (N,): the joint of each channel

        Returns
        -------
        values : array, shape (T, N), scaled
        variance : array, shape (N,)
        """
        values, variance = np.zeros(self.blind.shape), np.ones(self.blind.shape[1])
        evidence = self.flat @ self.precision
        for number in np.unique(joint):
            hidden = np.flatnonzero(joint == number)
            entries = self._entries(hidden)
            error, variance[hidden] = self._error(hidden)
            # P_HV x_V is P x without the part that P_HH x_H adds.
            guessed = self.flat[:, entries] - evidence[:, entries] @ error
            values[:, hidden] = guessed.reshape(-1, len(hidden), self.k) @ self.middle
        return values, variance

    def _entries(self, channels: IntArray) -> IntArray:
        """List the entries of x that belong to some channels."""
        return np.asarray((channels[:, None] * self.k + np.arange(self.k)).ravel())

    def _error(self, hidden: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return the error covariance of hidden channels, and their variance in the frame."""
        entries = self._entries(hidden)
        error = np.linalg.inv(self.precision[np.ix_(entries, entries)])
        cube = error.reshape(len(hidden), self.k, len(hidden), self.k)
        variance = np.einsum("akal,k,l->a", cube, self.middle, self.middle)
        return error, variance
