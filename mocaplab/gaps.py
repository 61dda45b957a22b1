"""Gaps: samples that a capture did not record.

A mask is a bool array of shape (T, C): True = observed, False = hidden. Only the channels
in ``Skeleton.is_cleaned`` are ever hidden. The first and the last frame stay observed, so
every gap has two ends to fill between, and no channel is hidden from end to end.
"""

from __future__ import annotations

import numpy as np

from mocaplab.motion import BoolArray, Motion
from mocaplab.noise import check_amount

PAPER_FPS = 120.0
"""Frames per second of all clips in paper A, which gives its probability per frame."""
GAP_MEAN_S = 0.125
"""Mean length of a gap: 15 frames at 120 frames per second (paper A names no length)."""


def draw_runs(
    shape: tuple[int, ...],
    frame_time: float,
    start_probability: float,
    mean_s: float,
    rng: np.random.Generator,
) -> BoolArray:
    """Draw runs of frames: when each starts is random, and so is how long it lasts.

    Parameters
    ----------
    shape : (T, ...), one independent course of events for each entry after T
    frame_time : float, seconds
    start_probability : float in [0, 1]
        That a run starts within 1/120 s. It is converted to the frame rate, so the same
        number gives as many runs a second at 30 as at 120 frames per second.
    mean_s : float, seconds
        Mean length. Lengths are geometric, the discrete form of an exponential decay, and
        at least one frame.

    Returns
    -------
    array of the given shape, bool: True inside a run
    """
    per_frame = 1.0 - (1.0 - start_probability) ** (PAPER_FPS * frame_time)
    mean_frames = max(mean_s / frame_time, 1.0)
    starts = rng.random(shape) < per_frame
    lengths = rng.geometric(1.0 / mean_frames, size=shape)
    frames = np.arange(shape[0]).reshape(-1, *[1] * (len(shape) - 1))
    # A frame is inside if any run that started before it, or in it, ends after it.
    ends = np.maximum.accumulate(np.where(starts, frames + lengths, 0), axis=0)
    inside: BoolArray = ends > frames
    return inside


def gap_mask(
    motion: Motion,
    start_probability: float,
    mean_s: float = GAP_MEAN_S,
    *,
    whole_joints: bool = False,
    rng: np.random.Generator,
) -> BoolArray:
    """Choose which samples of a motion are hidden by short gaps (paper A, section 4).

    Parameters
    ----------
    motion : Motion
    start_probability : float in [0, 1]
        That a gap starts in a channel within 1/120 s, which is a frame of the paper. The
        paper's own 0.1 would hide most of a clip; 0.001 hides about 1.5 % at the
        default length. See :func:`draw_runs` for other frame rates.
    mean_s : float, seconds, mean length of a gap
    whole_joints : bool
        Hide all angles of a joint together, as a lost marker does, in place of single
        channels as in the paper.
    rng : numpy.random.Generator

    Returns
    -------
    array, shape (T, C), bool: True = observed, False = hidden
    """
    check_amount(start_probability, 1, "the gap probability")
    if not 0 < mean_s < np.inf:
        raise ValueError(f"the mean gap length must be over 0 seconds, got {mean_s}")
    skeleton = motion.skeleton
    width = skeleton.n_joints if whole_joints else skeleton.n_channels
    shape = (motion.n_frames, width)
    hidden = draw_runs(shape, motion.frame_time, start_probability, mean_s, rng)
    if whole_joints:
        hidden = hidden[:, skeleton.channel_joint]
    mask = ~(hidden & skeleton.is_cleaned)
    mask[[0, -1]] = True
    return mask


def hide(motion: Motion, mask: BoolArray) -> Motion:
    """Put NaN where the mask is False."""
    return motion.with_channels(np.where(mask, motion.channels, np.nan))


def hidden_share(motion: Motion) -> float:
    """Return the share of the joint angles, the root's left out, that is NaN: 0 to 1."""
    cleaned = motion.channels[:, motion.skeleton.is_cleaned]
    return float(np.isnan(cleaned).mean()) if cleaned.size else 0.0
