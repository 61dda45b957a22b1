"""Gap filling by a low-dimensional state and Kalman smoothing (Burke and Lasenby 2016).

PCA gap filling (:mod:`mocaplab.gap_fillers.pca`) looks at one frame at a time. Here the scores of
the principal components are a hidden state that moves smoothly, and every frame observes it through
those channels that are visible. A Kalman filter goes forwards through the clip, a Rauch-Tung-
Striebel smoother backwards. So frames before and after a gap help too: where all channels are
hidden, the state goes on from both sides.

What differs from the paper ("Estimating missing marker positions using low dimensional Kalman
smoothing", Journal of Biomechanics 49(9), 1854-1858): joint angles instead of markers; training
clips may be added to the frames of the clip; scores have a velocity that is disturbed by white
acceleration; and every filled gap is shifted to meet its ends, as in
:mod:`mocaplab.gap_fillers.pca`.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mocaplab.gap_fillers.curves import lerp_columns, lerp_gaps
from mocaplab.gap_fillers.pose_subspace import (
    PoseSubspace,
    TrainingPoses,
    described_columns,
    fit_subspace,
    solve_scores,
)
from mocaplab.gap_fillers.seams import meet_ends, near_gaps, seam_lengths
from mocaplab.motion import BoolArray, Corrupted, FloatArray, Motion

STEP_S = 0.1
"""Accelerations are measured over steps of this time: over a frame, they are mostly noise."""


class LowRankGaps:
    """Fill gaps by Kalman smoothing of the pose's scores; a ``fill(motion) -> Motion``.

    Channels that do not move, those that turn round
    (:func:`mocaplab.gap_fillers.seams.turns_round`), and the root are filled by straight lines; so
    is everything in a clip where less than two channels move. Memory is about 20 kB a frame.

    Parameters
    ----------
    training : TrainingPoses or None
        How channels move together in training clips; None for the clip's own frames alone.
    """

    def __init__(self, training: TrainingPoses | None = None):
        self.training = training

    def __call__(self, motion: Motion) -> Motion:
        """Fill the gaps of a motion with continuous angles.

        Raises
        ------
        ValueError
            If the training clips have another skeleton.

        Warns
        -----
        mocaplab.gap_fillers.curves.GapWarning
            If a channel was never observed; it is left at rest.
        """
        lines = lerp_gaps(motion)
        columns = described_columns(motion)
        values = motion.channels[:, columns]
        hidden = np.isnan(values)
        if len(columns) < 2 or not hidden.any():
            return lines
        subspace = fit_subspace(motion, columns, self.training)
        lengths = seam_lengths(values, motion.frame_time)
        visible = ~near_gaps(hidden, lengths)
        poses = smooth_poses(values, visible, subspace, motion.frame_time)
        filled = lines.channels.copy()
        filled[:, columns] = meet_ends(values, poses, lengths, motion.frame_time)
        return motion.with_channels(filled)


def lowrank_gaps(motion: Motion) -> Motion:
    """Fill gaps with what the clip itself tells about its joints; see :class:`LowRankGaps`."""
    return LowRankGaps()(motion)


def fit_lowrank_gaps(clips: Sequence[Corrupted]) -> LowRankGaps:
    """Learn from clean training clips how joints move together.

    Parameters
    ----------
    clips : Corrupted clips of one skeleton; never test clips

    Raises
    ------
    ValueError
        If there is no clip, or their skeletons differ.
    """
    return LowRankGaps(TrainingPoses.of(clips))


def smooth_poses(
    values: FloatArray, visible: BoolArray, subspace: PoseSubspace, frame_time: float
) -> FloatArray:
    """Estimate every pose from all visible samples of the clip, shape (T, N), degrees.

    Parameters
    ----------
    values : array, shape (T, N), degrees; NaN allowed where not visible
    visible : array, shape (T, N), bool
    subspace : PoseSubspace of N channels
    frame_time : float, seconds
    """
    # A frame that sees little has scores near 0, a jump that is no movement. Lines have none.
    whole = subspace.evidence(lerp_columns(values), np.ones_like(visible))
    acceleration = score_acceleration(solve_scores(*whole), frame_time)
    seen = subspace.evidence(values, visible)
    return subspace.poses(smooth_scores(*seen, acceleration, frame_time))


def score_acceleration(scores: FloatArray, frame_time: float) -> FloatArray:
    """Measure the power of the acceleration of each score, shape (K,), 1/s^3.

    White acceleration of power q gives a second difference over steps of h seconds the variance
    2/3 q h^3. A clip of less than three frames tells nothing: its scores stand still.
    """
    step = min(max(1, round(STEP_S / frame_time)), (len(scores) - 1) // 2)
    if step == 0:
        return np.zeros(scores.shape[1])
    second = scores[2 * step :] - 2 * scores[step:-step] + scores[: -2 * step]
    return np.asarray(1.5 * np.mean(second**2, axis=0) / (step * frame_time) ** 3)


def smooth_scores(
    vector: FloatArray, precision: FloatArray, acceleration: FloatArray, frame_time: float
) -> FloatArray:
    """Kalman filter forwards, Rauch-Tung-Striebel smoother backwards.

    The state is K scores and their K velocities. At the first frame the scores have variance 1
    and the velocities that of one second of acceleration. The filter takes in a frame as
    information (:meth:`PoseSubspace.evidence`), so that a frame may see any number of channels,
    none included.

    Parameters
    ----------
    vector, precision : arrays, shape (T, K) and (T, K, K)
    acceleration : array, shape (K,), 1/s^3
    frame_time : float, seconds

    Returns
    -------
    array, shape (T, K): the mean of the scores, given all frames
    """
    frames, k = vector.shape
    acceleration = acceleration + 1e-9  # the smoother divides by variances that come from it
    step, disturbance = _dynamics(acceleration, frame_time)
    mean = np.zeros(2 * k)
    covariance = np.diag(np.concatenate([np.ones(k), acceleration]))
    predicted, filtered = np.zeros((frames, 2 * k)), np.zeros((frames, 2 * k))
    gain = np.zeros((frames, 2 * k, 2 * k))
    for t in range(frames):
        if t > 0:
            mean, before = step @ mean, covariance
            covariance = step @ before @ step.T + disturbance
            gain[t - 1] = np.linalg.solve(covariance, step @ before).T
        predicted[t] = mean
        spread = covariance[:, :k]  # (2K, K), of the state with the scores
        # Solved as it stands: the precision may be singular, so it cannot be inverted.
        weight = np.linalg.solve(np.eye(k) + spread[:k] @ precision[t], spread.T).T
        mean = mean + weight @ (vector[t] - precision[t] @ mean[:k])
        covariance = covariance - weight @ precision[t] @ spread.T
        covariance = (covariance + covariance.T) / 2  # rounding would make it lopsided
        filtered[t] = mean
    for t in range(frames - 2, -1, -1):
        filtered[t] += gain[t] @ (filtered[t + 1] - predicted[t + 1])
    return filtered[:, :k]


def _dynamics(acceleration: FloatArray, frame_time: float) -> tuple[FloatArray, FloatArray]:
    """Return the matrix of a step, and the covariance that white acceleration adds in it."""
    k, dt = len(acceleration), frame_time
    step = np.kron([[1.0, dt], [0.0, 1.0]], np.eye(k))
    power = np.diag(acceleration)
    disturbance = np.kron([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]], power)
    return np.asarray(step), np.asarray(disturbance)
