"""Choosing a filter's parameters on training clips, for all channels or for each one.

What a table reports is the RMS error of each clip, averaged over clips. So this is what tuning
makes small. The sum of all squared errors would be another thing: a few violent clips, such
as one with a joint that spins, make up most of it, and the others would hardly count.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from mocaplab.filters import Denoiser, GaussianDenoiser, Smoother
from mocaplab.gap_fillers.curves import lerp_gaps
from mocaplab.motion import (
    CONSTANT_STD_DEG,
    BoolArray,
    Corrupted,
    FloatArray,
    Motion,
    moving_channels,
)

SIGMA_GRID_S = np.append(0.0, np.geomspace(0.001, 0.25, 49).round(4))
"""The widths that tuning of a Gaussian tries, in seconds. 0 is no smoothing at all."""

AnySmoother = TypeVar("AnySmoother", bound=Smoother)


def lowest_fps(clips: Sequence[Corrupted]) -> float:
    """Return the lowest frame rate of the clips, which limits what a filter can be.

    Raises
    ------
    ValueError
        If there is no clip.
    """
    if not clips:
        raise ValueError("tuning needs at least one training clip")
    return min(clip.observed.fps for clip in clips)


def squared_errors(candidates: Sequence[Smoother], clip: Corrupted) -> FloatArray:
    """Score smoothers on a clip whose truth is known.

    Returns
    -------
    array, shape (number of candidates, C), squared degrees, the mean over frames; 0 where the
    clean channel does not move, as for the root: there cleaning changes nothing
    """
    filled, clean = lerp_gaps(clip.observed), clip.clean.channels
    smoothed = (s.smooth(filled.channels, clip.mask, filled.frame_time) for s in candidates)
    errors = [np.mean((values - clean) ** 2, axis=0) for values in smoothed]
    return np.where(moving_channels(clip.clean), errors, 0.0)


def error_table(candidates: Sequence[Smoother], clips: Sequence[Corrupted]) -> FloatArray:
    """Score smoothers on all clips; see :func:`squared_errors`.

    Returns
    -------
    array, shape (clips, candidates, C), squared degrees

    Raises
    ------
    ValueError
        If there is no candidate or no clip, or if the clips have different channels.
    """
    lowest_fps(clips)
    if not candidates:
        raise ValueError("tuning needs at least one candidate")
    labels = clips[0].clean.skeleton.channel_labels
    for clip in clips:
        if clip.clean.skeleton.channel_labels != labels:
            raise ValueError(
                f"training clips need the same channels, got {len(labels)} in "
                f"{clips[0].clean.name!r} and other ones in {clip.clean.name!r}"
            )
    return np.array([squared_errors(candidates, clip) for clip in clips])


def best_for_all(errors: FloatArray) -> int:
    """Choose the candidate with the smallest RMS error, averaged over clips.

    Parameters
    ----------
    errors : array, shape (clips, candidates, C), see :func:`error_table`

    Returns
    -------
    int, the place of the candidate; the first one of several equals
    """
    rms = np.sqrt(errors.sum(axis=2))  # times a constant: every clip has the same channels
    return int(np.argmin(rms.mean(axis=0)))


def best_for_each(errors: FloatArray) -> np.ndarray:
    """Choose a candidate for each channel, again for a small mean RMS over clips.

    The root of a sum is no sum over channels, so the channels cannot be chosen one by one. But
    near a value s0 the root is almost its tangent, sqrt(s) = sqrt(s0) + (s - s0) / (2 sqrt(s0)),
    and that is a sum. So the squared errors of a clip are divided by its RMS with the best
    single candidate and then added up over clips. The root lies below its tangent: the
    choice is never worse than the single candidate, on these clips.

    Parameters
    ----------
    errors : array, shape (clips, candidates, C), see :func:`error_table`

    Returns
    -------
    array, shape (C,), int
        The place of the candidate of each channel; that of :func:`best_for_all` where the
        channel never moves.
    """
    single = best_for_all(errors)
    rms = np.sqrt(errors[:, single].sum(axis=1))
    weights = 1 / np.maximum(rms, CONSTANT_STD_DEG)  # a clip without any error has no say
    total = np.tensordot(weights, errors, axes=1)  # (candidates, C)
    return np.where(np.ptp(total, axis=0) > 0, np.argmin(total, axis=0), single)


def tune(candidates: Sequence[AnySmoother], clips: Sequence[Corrupted]) -> AnySmoother:
    """Return the candidate with the smallest mean RMS error over training clips.

    Parameters
    ----------
    candidates : list of smoothers
    clips : Corrupted clips of one skeleton; never test clips
    """
    return candidates[best_for_all(error_table(candidates, clips))]


def mean_rms(denoiser: Denoiser, clips: Sequence[Corrupted]) -> float:
    """Return what tuning makes small for any denoiser: its RMS error, averaged over clips.

    It is over all channels of the file, so only good for comparing denoisers with each other.
    """
    cleaned = [denoiser.denoise(clip.observed, clip.mask).channels for clip in clips]
    errors = [x - clip.clean.channels for x, clip in zip(cleaned, clips, strict=True)]
    return float(np.mean([np.sqrt(np.mean(error**2)) for error in errors]))


@dataclass(frozen=True, eq=False)
class PerChannel(Smoother):
    """A smoother of its own for each channel.

    Parameters
    ----------
    smoothers : tuple of Smoother
    choice : tuple of int, length C
        Which of the smoothers each channel gets.
    """

    smoothers: tuple[Smoother, ...]
    choice: tuple[int, ...]

    def smooth(self, values: FloatArray, mask: BoolArray, frame_time: float) -> FloatArray:
        """Return the smoothed channels; ValueError for another number of channels."""
        choice = np.array(self.choice)
        if values.shape[1] != len(choice):
            raise ValueError(f"tuned for {len(choice)} channels, got {values.shape[1]}")
        smoothed = np.empty_like(values)
        for index in np.unique(choice):
            mine = choice == index
            smoother = self.smoothers[index]
            smoothed[:, mine] = smoother.smooth(values[:, mine], mask[:, mine], frame_time)
        return smoothed


def tune_per_channel(candidates: Sequence[Smoother], clips: Sequence[Corrupted]) -> PerChannel:
    """Give each channel a candidate, tuned on training clips; see :func:`best_for_each`.

    Parameters
    ----------
    candidates : list of smoothers with one value for all channels
    clips : Corrupted clips of one skeleton; never test clips
    """
    choice = best_for_each(error_table(candidates, clips))
    return PerChannel(tuple(candidates), tuple(choice.tolist()))


def tune_gaussian(clips: Sequence[Corrupted]) -> tuple[float, FloatArray]:
    """Find Gaussian widths on training clips.

    Parameters
    ----------
    clips : Corrupted clips of one skeleton; never test clips

    Returns
    -------
    sigma_s : float, seconds
        The single width with the smallest mean RMS error over clips.
    sigma_per_channel_s : array, shape (C,), seconds
        One width a channel (:func:`best_for_each`).
    """
    errors = error_table([GaussianDenoiser(sigma_s) for sigma_s in SIGMA_GRID_S], clips)
    return float(SIGMA_GRID_S[best_for_all(errors)]), SIGMA_GRID_S[best_for_each(errors)]


def oracle_gaussian(clip: Corrupted) -> Motion:
    """Smooth each channel with the width that is best for this very clip.

    This is a bound, not a method: it looks at the clean signal. No Gaussian of fixed width
    (one of ``SIGMA_GRID_S``) can do better, however its width was found.
    """
    _, sigma_per_channel_s = tune_gaussian([clip])
    return GaussianDenoiser(sigma_per_channel_s).denoise(clip.observed, clip.mask)
