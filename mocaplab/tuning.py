"""Choosing a filter's parameters on training clips, for all channels or for each one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from mocaplab.filters import Smoother, squared_errors
from mocaplab.motion import BoolArray, Corrupted, FloatArray, moving_channels

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


def total_errors(candidates: Sequence[Smoother], clips: Sequence[Corrupted]) -> FloatArray:
    """Add up the squared errors of each candidate over clips, moving channels only.

    Returns
    -------
    array, shape (number of candidates, C), squared degrees; 0 where a channel never moves

    Raises
    ------
    ValueError
        If there is no candidate or no clip, or if the clips have different channels.
    """
    lowest_fps(clips)
    if not candidates:
        raise ValueError("tuning needs at least one candidate; the frame rate may be too low")
    labels = clips[0].clean.skeleton.channel_labels
    for clip in clips:
        if clip.clean.skeleton.channel_labels != labels:
            raise ValueError(
                f"training clips need the same channels, got {len(labels)} in "
                f"{clips[0].clean.name!r} and other ones in {clip.clean.name!r}"
            )
    total = np.zeros((len(candidates), len(labels)))
    for clip in clips:
        total += np.where(moving_channels(clip.clean), squared_errors(candidates, clip), 0.0)
    return total


def tune(candidates: Sequence[AnySmoother], clips: Sequence[Corrupted]) -> AnySmoother:
    """Return the candidate with the smallest squared error on training clips.

    Parameters
    ----------
    candidates : list of smoothers
    clips : Corrupted clips of one skeleton; never test clips
    """
    return candidates[int(np.argmin(total_errors(candidates, clips).sum(axis=1)))]


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
    """Give each channel the candidate with the smallest squared error on training clips.

    A channel that never moves there gets the candidate that is best for all channels.

    Parameters
    ----------
    candidates : list of smoothers with one value for all channels
    clips : Corrupted clips of one skeleton; never test clips
    """
    error = total_errors(candidates, clips)
    single = np.argmin(error.sum(axis=1))
    choice = np.where(np.ptp(error, axis=0) > 0, np.argmin(error, axis=0), single)
    return PerChannel(tuple(candidates), tuple(choice.tolist()))
