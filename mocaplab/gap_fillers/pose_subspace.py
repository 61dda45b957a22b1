"""A pose as a few principal components: what gap filling knows of how joints move together.

The constants were chosen on training clips of CMU: gaps of 15, 60 and 200 frames, with and
without noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mocaplab.euler import make_continuous
from mocaplab.gap_fillers.curves import lerp_columns
from mocaplab.gap_fillers.seams import meet_ends, near_gaps, seam_lengths
from mocaplab.motion import (
    BoolArray,
    Corrupted,
    FloatArray,
    IntArray,
    Motion,
    Skeleton,
    moving_channels,
)

N_COMPONENTS = 20
"""Principal components; more of them learn the noise of a clip, fewer lose its movement."""
PRIOR_S = 0.25
"""Training clips weigh as much as this many seconds of the clip itself."""
CAUTION = 8.0
"""Frames that PCA has not seen fit its components worse: this many times the variance."""
MIN_STD_DEG = 1e-3
"""No channel is taken for more exact than this."""
MAX_ROUNDS = 20
"""Rounds of filling and fitting in a clip that has too few frames without gaps."""


@dataclass(frozen=True, eq=False)
class PoseSubspace:
    """A pose as a mean and a few components: ``pose = mean + loadings @ scores + residual``.

    Parameters
    ----------
    columns : array, shape (N,): the channels that are described
    mean : array, shape (N,), degrees
    loadings : array, shape (N, K), degrees; the scores have variance 1
    variance : array, shape (N,), degrees squared: of what the components leave unexplained
    """

    columns: IntArray
    mean: FloatArray
    loadings: FloatArray
    variance: FloatArray

    def evidence(self, values: FloatArray, visible: BoolArray) -> tuple[FloatArray, FloatArray]:
        """Sum up what the visible channels of each frame say about its scores.

        Parameters
        ----------
        values : array, shape (T, N), degrees; what is not visible may be NaN
        visible : array, shape (T, N), bool

        Returns
        -------
        vector : array, shape (T, K)
        precision : array, shape (T, K, K)
            The least squares fit solves ``precision @ scores = vector``.
        """
        n, k = self.loadings.shape
        weight = visible / self.variance
        pairs = self.loadings[:, :, None] * self.loadings[:, None, :]  # (N, K, K)
        vector = (weight * np.where(visible, values - self.mean, 0.0)) @ self.loadings
        return vector, (weight @ pairs.reshape(n, k * k)).reshape(-1, k, k)

    def poses(self, scores: FloatArray) -> FloatArray:
        """Turn scores, shape (T, K), into channels, shape (T, N), degrees."""
        return self.mean + scores @ self.loadings.T


@dataclass(frozen=True, eq=False)
class TrainingPoses:
    """How channels move together in training clips.

    Parameters
    ----------
    skeleton : Skeleton
    covariance : array, shape (C, C), degrees squared
        Of the clean channels, each clip around its own mean: people stand differently.
    """

    skeleton: Skeleton
    covariance: FloatArray

    @classmethod
    def of(cls, clips: Sequence[Corrupted]) -> TrainingPoses:
        """Learn from clean training clips; see :func:`fit_pca_gaps`."""
        if not clips:
            raise ValueError("gap filling needs at least one training clip, got none")
        skeleton = clips[0].clean.skeleton
        for clip in clips:
            if not clip.clean.skeleton.same_as(skeleton):
                raise ValueError(
                    f"training clips must have one skeleton, but {clip.clean.name!r} has other "
                    f"joints or channels than {clips[0].clean.name!r}"
                )
        poses = [make_continuous(clip.clean).channels for clip in clips]
        centred = np.concatenate([pose - pose.mean(axis=0) for pose in poses])
        return cls(skeleton, centred.T @ centred / len(centred))


def described_columns(motion: Motion) -> IntArray:
    """List the channels that the components describe: those that are seen to move."""
    return np.flatnonzero(moving_channels(motion)).astype(np.int64)


def fit_subspace(
    motion: Motion, columns: IntArray, training: TrainingPoses | None = None
) -> PoseSubspace:
    """Find the components of a clip that may have gaps.

    Frames without gaps alone are used, if there are at least twice as many as channels, or
    training clips to help. Otherwise gaps are filled by straight lines, then components are
    fitted and gaps filled from them in turns, until the gaps change no more. With training
    clips the mean is still that of the clip: of its frames without gaps, or, if these are few,
    of every channel where it was seen.

    Parameters
    ----------
    motion : Motion
    columns : array, shape (N,): the channels to describe, all of them observed somewhere
    training : TrainingPoses or None

    Raises
    ------
    ValueError
        If the training clips have another skeleton.
    """
    values = motion.channels[:, columns]
    complete = ~np.isnan(values).any(axis=1)
    enough = complete.sum() >= 2 * len(columns)
    mean = values[complete].mean(axis=0) if enough else np.nanmean(values, axis=0)
    if training is not None:
        if not training.skeleton.same_as(motion.skeleton):
            raise ValueError(
                f"motion {motion.name!r} has other joints or channels than the training clips"
            )
        prior = training.covariance[np.ix_(columns, columns)], PRIOR_S * motion.fps
        return _components(values[complete], columns, mean, prior)
    if enough:
        return _components(values[complete], columns, mean)
    filled = lerp_columns(values)
    for _ in range(MAX_ROUNDS):
        before = filled
        subspace = _components(filled, columns, filled.mean(axis=0))
        filled = fill_by_pose(values, subspace, motion.frame_time)
        if np.abs(filled - before).max() < MIN_STD_DEG:
            break
    return subspace


def _components(
    poses: FloatArray,
    columns: IntArray,
    mean: FloatArray,
    prior: tuple[FloatArray, float] | None = None,
) -> PoseSubspace:
    """Fit components to poses, shape (T, N), and to a covariance worth so many frames."""
    centred = poses - poses.mean(axis=0) if len(poses) else poses
    scatter, weight = centred.T @ centred, float(len(poses))
    if prior is not None:
        scatter, weight = scatter + prior[1] * prior[0], weight + prior[1]
    covariance = scatter / weight
    # Every channel counts alike, however far it swings: PCA of the correlations.
    std = np.sqrt(np.maximum(np.diag(covariance), MIN_STD_DEG**2))
    power, vectors = np.linalg.eigh(covariance / std / std[:, None])
    power, vectors = power[: -N_COMPONENTS - 1 : -1], vectors[:, : -N_COMPONENTS - 1 : -1]
    loadings = std[:, None] * vectors * np.sqrt(np.maximum(power, 0.0))
    unexplained = np.maximum(np.diag(covariance) - np.sum(loadings**2, axis=1), 0.0)
    return PoseSubspace(columns, mean, loadings, CAUTION * unexplained + MIN_STD_DEG**2)


def fill_by_pose(values: FloatArray, subspace: PoseSubspace, frame_time: float) -> FloatArray:
    """Fill the NaN of the columns, shape (T, N), and shift each gap to meet its ends.

    The samples near the ends of a gap are predicted too, as if they were hidden: what the
    prediction misses there, it is likely to miss inside (:mod:`mocaplab.gap_fillers.seams`).
    """
    lengths = seam_lengths(values, frame_time)
    predicted = near_gaps(np.isnan(values), lengths)
    rows = predicted.any(axis=1)
    poses = np.zeros_like(values)
    poses[rows] = subspace.poses(solve_scores(*subspace.evidence(values[rows], ~predicted[rows])))
    return meet_ends(values, poses, lengths, frame_time)


def solve_scores(vector: FloatArray, precision: FloatArray) -> FloatArray:
    """Solve for the scores of every frame, (T, K); their variance of 1 is the prior."""
    prior = np.eye(vector.shape[1])
    return np.asarray(np.linalg.solve(precision + prior, vector[:, :, None])[:, :, 0])
