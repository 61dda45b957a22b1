"""Fit the gap filler of :mod:`mocaplab.gap_fillers.gaussian` to clean training clips."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mocaplab.cosine_windows import at_most, inner_split
from mocaplab.euler import make_continuous
from mocaplab.gap_fillers.conditional_gaussian import PoseWindows, Scaled, window_covariance
from mocaplab.gap_fillers.gaussian import GaussianFiller
from mocaplab.gap_fillers.kriging import Smoothness, relative_increments
from mocaplab.motion import Corrupted, FloatArray, Motion, moving_channels
from mocaplab.noise.angular import angular_noise
from mocaplab.noise.gaps import hide, long_gap_mask

SMOOTHNESS_CLIPS = 20
"""As many clips are enough to tell how smoothly joints move."""
CAUTION_GAPS_S = (0.1, 0.5, 2.0)
"""Gaps on which the expected error is compared with the realised one."""
WITHIN, DEVIATIONS = 0.9, 1.645
"""So many errors of a normal distribution lie within so many standard deviations."""


def fit_gaussian_filler(clips: Sequence[Corrupted]) -> GaussianFiller:
    """Learn from clean training clips how joints move together.

    How far the expected errors are to be trusted is measured on every fifth clip, with a filler
    fitted to the others; then all clips are learned from.

    Parameters
    ----------
    clips : Corrupted clips of one skeleton; never test clips

    Raises
    ------
    ValueError
        If there is no clip, their skeletons differ, or nothing moves in them.
    """
    learn_from, set_aside = inner_split(clips)
    caution = 1.0
    if set_aside:
        tests = [make_continuous(clip.clean) for clip in set_aside]
        caution = _caution(_learn(learn_from), tests)
    return replace(_learn(clips), caution=caution)


def _learn(clips: Sequence[Corrupted]) -> GaussianFiller:
    motions = [make_continuous(clip.clean) for clip in clips]
    covariance = window_covariance(motions)
    of_errors: list[tuple[FloatArray, FloatArray]] = []
    of_angles: list[tuple[FloatArray, FloatArray]] = []
    for clip in at_most(clips, SMOOTHNESS_CLIPS):
        motion = make_continuous(clip.clean)
        scaled = Scaled.of(motion)
        guess, _ = PoseWindows(scaled, motion.frame_time, covariance).leave_out(scaled.joint)
        for found, values in ((of_errors, scaled.values - guess), (of_angles, scaled.values)):
            found.append(relative_increments(values, scaled.noise, motion.frame_time))
    return GaussianFiller(
        channel_labels=motions[0].skeleton.channel_labels,
        covariance=covariance,
        of_errors=_typical(of_errors),
        of_angles=_typical(of_angles),
    )


def _typical(found: Sequence[tuple[FloatArray, FloatArray]]) -> Smoothness:
    """Make one smoothness out of those of many clips, some of which may be short."""
    longest = max(found, key=lambda pair: len(pair[1]))[1]
    if not len(longest):
        raise ValueError("gap filling learns from clips of more than one frame, got none")
    logs = [np.log(increments) for increments, lags_s in found if len(lags_s) == len(longest)]
    return Smoothness.fit(np.exp(np.mean(logs, axis=0)), longest)


def _caution(filler: GaussianFiller, clips: Sequence[Motion]) -> float:
    """Compare realised with expected errors in clips that the filler has not seen."""
    rng = np.random.default_rng(0)
    ratios = []
    for clip in clips:
        for seconds in CAUTION_GAPS_S:
            if clip.duration_s < seconds + 0.5:
                continue
            for k in (0.0, 0.5):
                mask = long_gap_mask(clip, seconds, rng=rng)
                filled = filler.fill(hide(angular_noise(clip, k, rng=rng), mask))
                hidden = ~mask & moving_channels(clip)
                error = np.abs(filled.motion.channels - clip.channels)[hidden]
                ratios.append(error / filled.std_deg[hidden])
    if not ratios:
        return 1.0
    return float(np.quantile(np.concatenate(ratios), WITHIN) / DEVIATIONS)
