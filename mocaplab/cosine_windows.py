"""What learned filters share: cosine windows, the strength of the noise, an inner split."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from mocaplab.motion import Corrupted, FloatArray, IntArray, Motion, Skeleton

WINDOW_S = 4 / 15
"""Length of a window, seconds."""
N_COEFFICIENTS = 12
"""Cosines a channel and window; those that a low frame rate cannot show are left out."""
STEPS_A_WINDOW = 8
"""Windows overlap: so many start within the length of one."""
BLOCK = 2048
"""Windows at a time, so that memory stays small."""


def estimate_noise_std(values: ArrayLike, observed: ArrayLike | None = None) -> FloatArray:
    """Estimate how strong the white noise of each channel is.

    A third difference of noise has 20 times its variance (1 + 9 + 9 + 1), one of a smooth
    movement is almost 0. The median ignores the moments where it is not, and spikes.

    Parameters
    ----------
    values : array, shape (T, C)
    observed : array, shape (T, C), bool, optional
        False where a sample was filled in; third differences across it are left out.

    Returns
    -------
    array, shape (C,), unit of the values; 0 where fewer than 4 frames in a row were observed
    """
    values = np.asarray(values, dtype=np.float64)
    seen = np.ones(values.shape, bool) if observed is None else np.asarray(observed, bool)
    if len(values) < 4:
        return np.zeros(values.shape[1])
    usable = seen[3:] & seen[2:-1] & seen[1:-2] & seen[:-3]
    steps = np.where(usable, np.abs(np.diff(values, 3, axis=0)), np.nan)
    steps[:, ~usable.any(axis=0)] = 0.0
    std: FloatArray = np.nanmedian(steps, axis=0) / 0.6745 / np.sqrt(20.0)  # 0.6745: normal median
    return std


class CosineWindows:
    """The overlapping windows of a clip, and their cosine coefficients.

    Parameters
    ----------
    n_frames : int
        T; a clip shorter than one window is one window.
    frame_time : float, seconds
    """

    def __init__(self, n_frames: int, frame_time: float):
        self.n_frames = n_frames
        self.length = min(max(round(WINDOW_S / frame_time), 1), n_frames)
        last = n_frames - self.length
        step = max(self.length // STEPS_A_WINDOW, 1)
        self.starts: IntArray = np.unique(np.append(np.arange(0, last, step), last))
        phase = (np.arange(self.length) + 0.5) / self.length
        order = np.arange(min(N_COEFFICIENTS, self.length))
        # Mean square 1 each, so that coefficients mean the same at every frame rate.
        self.basis: FloatArray = np.sqrt(np.where(order > 0, 2.0, 1.0)) * np.cos(
            np.pi * phase[:, None] * order
        )
        self.fade: FloatArray = np.sin(np.pi * phase) ** 2  # the middle of a window is surest

    def analyse(self, values: FloatArray) -> FloatArray:
        """Turn a signal (T, C) into coefficients (windows, C * K), channel by channel."""
        views = np.lib.stride_tricks.sliding_window_view(values, self.length, axis=0)
        coefficients = np.empty((len(self.starts), values.shape[1], self.basis.shape[1]))
        for start in range(0, len(self.starts), BLOCK):
            rows = slice(start, start + BLOCK)
            coefficients[rows] = views[self.starts[rows]] @ self.basis / self.length
        return coefficients.reshape(len(self.starts), -1)

    def synthesise(self, coefficients: FloatArray) -> FloatArray:
        """Turn coefficients back into a signal (T, C): the mean of all overlapping windows."""
        cube = coefficients.reshape(len(self.starts), -1, self.basis.shape[1])
        total = np.zeros((self.n_frames, cube.shape[1]))
        weight = np.zeros((self.n_frames, 1))
        for t in range(self.length):
            total[self.starts + t] += self.fade[t] * (cube @ self.basis[t])
            weight[self.starts + t] += self.fade[t]
        return total / weight


def check_skeleton(skeleton: Skeleton, motion: Motion) -> None:
    """Refuse, with a ValueError, a motion whose joints or channels are not those of training."""
    if not skeleton.same_as(motion.skeleton):
        raise ValueError(
            f"expected a motion with the {skeleton.n_joints} joints and {skeleton.n_channels} "
            f"channels of the training clips, got {motion.name!r} with "
            f"{motion.skeleton.n_joints} joints and {motion.skeleton.n_channels} channels, or "
            "the same number with other names"
        )


def inner_split(clips: Sequence[Corrupted]) -> tuple[list[Corrupted], list[Corrupted]]:
    """Set every fifth training clip aside, so that parameters are not chosen on what was learned.

    Returns
    -------
    learn_from, set_aside : lists of clips; the second is empty with fewer than 5 clips

    Raises
    ------
    ValueError
        If there is no clip, or skeletons differ.
    """
    if not clips:
        raise ValueError("fitting needs at least one training clip")
    for clip in clips:
        check_skeleton(clips[0].clean.skeleton, clip.clean)
    if len(clips) < 5:
        return list(clips), []
    return [clip for i, clip in enumerate(clips) if i % 5 != 2], list(clips[2::5])


def at_most(clips: Sequence[Corrupted], n: int) -> list[Corrupted]:
    """Pick n clips at most, spread over the list, which is often sorted by action."""
    return [clips[i * len(clips) // n] for i in range(n)] if len(clips) > n else list(clips)
