"""Fill gaps with a network: EBD (paper A, section 3).

Gaps are closed by straight lines, the network sees the whole pose, and what it answers inside
the gaps is taken; everything else stays. Each fill is shifted to meet both ends of its gap
(:mod:`mocaplab.gap_fillers.seams`).

What the paper does not have: an expected error. A network says nothing of the kind, so it is
looked up: how far the network was off in training clips, by the distance to the nearest end.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import torch

from mocaplab.checkpoints import Checkpoint, load_checkpoint, shipped_checkpoint
from mocaplab.gap_fillers.curves import gap_ends, lerp_gaps
from mocaplab.gap_fillers.filled import Filled, check_observed, lines_std
from mocaplab.gap_fillers.seams import meet_ends, seam_lengths, turns_round
from mocaplab.measures.movement import root_angular_velocity
from mocaplab.motion import FloatArray, Motion, moving_channels
from mocaplab.networks import EBD
from mocaplab.noise.angular import angular_noise
from mocaplab.noise.gaps import hide, long_gap_mask
from mocaplab.normalization import standardize

DISTANCES_S = (0.0, 0.03, 0.1, 0.25, 0.5, 1.0, 2.0)
"""Distances to the nearest end of a gap at which the error is kept; between them it is a line."""
MEASURED_GAPS_S = (0.1, 0.25, 0.5, 1.0, 2.0, 5.0)
"""Gaps on which it is measured."""


class NetworkFiller:
    """Fill gaps with an EBD.

    Channels that the network does not know, those that do not move, and those that turn round
    (:func:`mocaplab.gap_fillers.seams.turns_round`) are filled by straight lines.

    Parameters
    ----------
    model : Checkpoint, path of a model file, or "ebd" for the one in the package

    Raises
    ------
    ValueError
        If the model is no EBD, or its errors were not measured (:func:`with_gap_errors`).
    """

    def __init__(self, model: Checkpoint | str | os.PathLike[str] = "ebd"):
        if model == "ebd":
            model = shipped_checkpoint("ebd")
        elif not isinstance(model, Checkpoint):
            model = load_checkpoint(model)
        if not isinstance(model.model, EBD):
            raise ValueError(f"gaps are filled by an EBD, this is a {type(model.model).__name__}")
        errors = np.asarray(model.info.get("gap_errors", ()), dtype=np.float64)
        if errors.shape != (len(DISTANCES_S),) or not (errors > 0).all():
            raise ValueError(
                f"the model's info needs {len(DISTANCES_S)} gap_errors above 0, measured by "
                "mocaplab.gap_fillers.network.with_gap_errors"
            )
        self.checkpoint, self.errors = model, errors

    def fill(self, motion: Motion) -> Filled:
        """Fill the gaps of a motion with continuous angles.

        Raises
        ------
        ValueError
            If no angle was observed, or the model was trained for another skeleton or rate.

        Warns
        -----
        mocaplab.gap_fillers.curves.GapWarning
            If a channel was never observed; it is left at rest.
        """
        check_observed(motion)
        self.checkpoint.require(motion.skeleton, motion.frame_time, motion.name)
        channels, std = lerp_gaps(motion).channels.copy(), lines_std(motion).copy()
        columns = self.checkpoint.columns(motion.skeleton) & moving_channels(motion)
        values = motion.channels[:, columns]
        hidden = np.isnan(values)
        if not hidden.any():
            return Filled(motion.with_channels(channels), std)
        poses = self._recover(motion, channels)[:, columns]
        lengths = seam_lengths(values, motion.frame_time)
        channels[:, columns] = meet_ends(values, poses, lengths, motion.frame_time)
        left, right = gap_ends(values)
        frames = np.arange(motion.n_frames)[:, None]
        back = np.where(left == right, np.inf, np.abs(frames - left))
        nearest = np.minimum(np.abs(frames - right), back) * motion.frame_time
        share = np.interp(nearest, DISTANCES_S, self.errors)
        by_pose = hidden & ~turns_round(values)
        std[:, columns] = np.where(by_pose, share * np.nanstd(values, axis=0), std[:, columns])
        return Filled(motion.with_channels(channels), std)

    def __call__(self, motion: Motion) -> Motion:
        """Fill the gaps of a motion, for :class:`mocaplab.filters.GapFiller`."""
        return self.fill(motion).motion

    def _recover(self, motion: Motion, closed: FloatArray) -> FloatArray:
        """Return what the network makes of a motion whose gaps are closed by lines, (T, C)."""
        columns = self.checkpoint.columns(motion.skeleton)
        seen = np.isfinite(motion.channels).any(axis=0)
        # Of a gap of many seconds the line has neither the mean nor the deviation of the clip.
        mean, std = np.zeros(closed.shape[1]), np.zeros(closed.shape[1])
        mean[seen] = np.nanmean(motion.channels[:, seen], axis=0)
        std[seen] = np.nanstd(motion.channels[:, seen], axis=0)
        pose = standardize(closed, mean, std)[:, columns]
        root = root_angular_velocity(motion.with_channels(closed))
        with torch.no_grad():
            inputs = [torch.from_numpy(x).float()[None] for x in (pose, root)]
            recovered = self.checkpoint.model(*inputs)[0].numpy()
        result = closed.copy()
        result[:, columns] = recovered * std[columns] + mean[columns]
        return result


def with_gap_errors(
    checkpoint: Checkpoint, clips: Sequence[Motion], *, rng: np.random.Generator
) -> Checkpoint:
    """Measure how far an EBD is off inside gaps, and note it in the model.

    The error is a share of the deviation of the channel, the root of summed squares over
    summed squares, over gaps of all angles of a joint without noise and with 0.5 noise.

    Parameters
    ----------
    checkpoint : Checkpoint of an EBD
    clips : list of Motion, clean, continuous; never test clips
    rng : numpy.random.Generator
    """
    placeholder = {**checkpoint.info, "gap_errors": [1.0] * len(DISTANCES_S)}
    filler = NetworkFiller(replace(checkpoint, info=placeholder))
    middle = np.sqrt(np.array(DISTANCES_S[1:-1]) * np.array(DISTANCES_S[2:]))
    edges = np.concatenate([[DISTANCES_S[1] / 2], middle])
    n = len(DISTANCES_S)
    squares, powers = np.zeros(n), np.zeros(n)
    for clip in clips:
        for seconds in MEASURED_GAPS_S:
            if clip.duration_s < 1.2 * seconds:
                continue
            mask = long_gap_mask(clip, seconds, rng=rng)
            noisy = angular_noise(clip, float(rng.choice([0.0, 0.5])), rng=rng)
            filled = filler.fill(hide(noisy, mask)).motion
            predicted = moving_channels(clip)
            predicted[predicted] = ~turns_round(clip.channels[:, predicted])
            counted = ~mask & predicted
            error = filled.channels - clip.channels
            power = np.broadcast_to(clip.channels.var(axis=0), error.shape)
            left, right = gap_ends(np.where(mask, 0.0, np.nan))
            frames = np.arange(clip.n_frames)[:, None]
            nearest = np.minimum(frames - left, right - frames) * clip.frame_time
            which = np.digitize(nearest[counted], edges)
            squares += np.bincount(which, error[counted] ** 2, n)
            powers += np.bincount(which, power[counted], n)
    if not powers.any():
        raise ValueError("the errors inside gaps are measured on clips of more than 0.12 seconds")
    known = np.flatnonzero(powers)  # short clips have no long gaps; then the longest known
    shares = np.interp(np.arange(n), known, np.sqrt(squares[known] / powers[known]))
    errors = np.maximum(shares, 1e-6).tolist()
    return replace(checkpoint, info={**checkpoint.info, "gap_errors": errors})
