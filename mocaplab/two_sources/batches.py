"""What the networks of paper B learn from: windows of clean clips, and two noisy versions.

The noise is that of :mod:`mocaplab.two_sources.noise`, drawn for all windows of a batch at once.
Letters in shapes: B windows in a batch, T frames, J joints.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mocaplab.motion import FloatArray
from mocaplab.two_sources.noise import SourceNoise
from mocaplab.two_sources.segments import SegmentClip


@dataclass(frozen=True, eq=False)
class SourceBatch:
    """Two noisy versions of the same windows, and the clean one."""

    a: FloatArray  # (B, T, J, 4)
    b: FloatArray  # (B, T, J, 4)
    clean: FloatArray  # (B, T, J, 4)
    frame_time: float  # seconds


class ClipWindows:
    """Draws from all windows of consecutive frames, each as likely as any other.

    Parameters
    ----------
    clips : list of SegmentClip of one list of segments; those that are too short are left out
    n_frames : int, frames a window; 60 in paper B
    stride : int
        Take only every so many-th frame, as if the clips had been recorded at a lower rate.

    Raises
    ------
    ValueError
        If no clip is long enough.
    """

    def __init__(self, clips: Sequence[SegmentClip], n_frames: int = 60, stride: int = 1):
        span = stride * (n_frames - 1) + 1
        self.clips = [clip for clip in clips if clip.n_frames >= span]
        if not self.clips:
            longest = max((clip.n_frames for clip in clips), default=0)
            raise ValueError(
                f"expected a clip of at least {span} frames, the longest has {longest}"
            )
        self.frames = stride * np.arange(n_frames)
        self.frame_time = stride * self.clips[0].frame_time
        counts = [clip.n_frames - span + 1 for clip in self.clips]
        self.which = np.repeat(np.arange(len(counts)), counts)
        self.starts = np.concatenate([np.arange(count) for count in counts])

    def __len__(self) -> int:
        return len(self.which)

    def draw(self, n_windows: int, *, rng: np.random.Generator) -> FloatArray:
        """Draw windows, shape (B, T, J, 4)."""
        drawn = rng.integers(len(self), size=n_windows)
        pairs = zip(self.which[drawn], self.starts[drawn], strict=True)
        return np.stack([self.clips[i].quaternions[start + self.frames] for i, start in pairs])


def window_noise(
    clean: FloatArray,
    noise: SourceNoise,
    amount: FloatArray | float = 1.0,
    *,
    rng: np.random.Generator,
) -> FloatArray:
    """Add paper B's noise (Eq. 3-12) to windows, each with sizes and a bias of its own.

    Parameters
    ----------
    clean : array, shape (B, T, J, 4), signs that do not jump over time
    noise : SourceNoise
    amount : float or array, shape (B,): see :meth:`mocaplab.two_sources.noise.SourceNoise.scaled`
    rng : numpy.random.Generator

    Returns
    -------
    array, shape (B, T, J, 4), of length 1, in the hemisphere of the clean ones
    """
    n, _, joints, _ = clean.shape
    scale = np.broadcast_to(amount, n).reshape(n, 1, 1, 1)

    def size(mean: float, std: float) -> FloatArray:
        return rng.normal(mean, std, size=(n, 1, 1, 1))

    theta_bias = scale * size(noise.bias_mean, noise.bias_std)
    theta_imprecision = scale * size(noise.imprecision_mean, noise.imprecision_std)
    theta_lost = np.broadcast_to(size(noise.lost_mean, noise.lost_std), (*clean.shape[:3], 1))
    noisy = clean + theta_bias * rng.normal(size=(n, 1, joints, 4))
    noisy += theta_imprecision * rng.standard_normal(clean.shape, dtype=np.float32)
    lost = rng.random(clean.shape[:3]) < scale[..., 0] * noise.lost_probability
    noisy[lost] += theta_lost[lost] * rng.normal(size=(int(lost.sum()), 4))
    return _nearest_unit(noisy, clean)


def towards_pure_noise(
    clean: FloatArray, share: FloatArray | float, *, rng: np.random.Generator
) -> FloatArray:
    """Go from the clean rotations (share 0) to random ones in every joint and frame (share 1).

    Parameters
    ----------
    clean : array, shape (..., T, J, 4)
    share : float or array that broadcasts with (..., T, J, 1), from 0 to 1
    rng : numpy.random.Generator
    """
    random = rng.standard_normal(clean.shape, dtype=np.float32)
    return _nearest_unit((1 - share) * clean + share * random, clean)


def _nearest_unit(noisy: FloatArray, clean: FloatArray) -> FloatArray:
    noisy = noisy / np.linalg.norm(noisy, axis=-1, keepdims=True)
    opposite = np.sum(noisy * clean, axis=-1, keepdims=True) < 0
    return np.where(opposite, -noisy, noisy)


def paper_pair(
    clean: FloatArray, frame_time: float, noise: SourceNoise, *, rng: np.random.Generator
) -> SourceBatch:
    """Spoil windows twice, as in paper B: both sources are equally bad on average."""
    a, b = (window_noise(clean, noise, rng=rng) for _ in range(2))
    return SourceBatch(a, b, clean, frame_time)


def varied_pair(
    clean: FloatArray, frame_time: float, noise: SourceNoise, *, rng: np.random.Generator
) -> SourceBatch:
    """Spoil windows twice, so that one source may be much better than the other.

    Half of the windows are those of :func:`paper_pair`. In the others each source has the
    paper's noise, or between a tenth and ten times as much, or none; and in half of these, a
    share of one source is pure noise.
    """
    n = len(clean)
    varied = rng.random(n) < 0.5
    pure = np.where(varied & (rng.random(n) < 0.5), rng.integers(2, size=n), -1)  # which source
    sources = []
    for source in range(2):
        kind = rng.random(n)
        other = np.where(kind < 0.75, 10 ** rng.uniform(-1, 1, size=n), 0.0)
        amount = np.where(varied & (kind > 0.25), other, 1.0)
        share = np.where(pure == source, np.sqrt(rng.random(n)), 0.0)
        noisy = window_noise(clean, noise, amount, rng=rng)
        sources.append(towards_pure_noise(noisy, share.reshape(n, 1, 1, 1), rng=rng))
    return SourceBatch(sources[0], sources[1], clean, frame_time)
