"""Gap filling from the rest of the pose: principal components (Gloersen and Federolf 2016).

Joints move together: in a walk, the left knee tells much about the right hip. Principal
component analysis (PCA) finds these relations in frames where nothing is hidden. In a frame
with gaps, the channels that are seen give the weights of the components, and these give the
channels that are hidden. Straight lines need no such thing, but they lose the movement inside
a long gap; PCA keeps it.

What differs from the paper ("Predicting Missing Marker Trajectories in Human Motion Data Using
Marker Intercorrelations", PLOS ONE 11(3): e0152616):

- Joint angles in degrees instead of marker positions. They need no removal of the body's path.
- The paper trusts a marker more, the nearer it is to the hidden one. Angles have no distance.
  Here a channel is trusted more, the better the components explain it.
- The paper maps the scores of one PCA, without the hidden markers, to those of another. Here
  the scores are the weighted least squares fit to what is seen, with their own variance as a
  prior (ridge regression), so that few visible channels cannot throw the pose far off.
- Training clips may be added to the frames of the clip itself.
- Every filled gap is shifted to meet its ends (:mod:`mocaplab.gap_fillers.seams`).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mocaplab.gap_fillers.curves import lerp_gaps
from mocaplab.gap_fillers.pose_subspace import (
    TrainingPoses,
    described_columns,
    fill_by_pose,
    fit_subspace,
)
from mocaplab.motion import Corrupted, Motion


class PcaGaps:
    """Fill gaps from the other channels of the same frame; a ``fill(motion) -> Motion``.

    The components come from the clip's own frames without gaps, and from training clips if
    it was fitted to some (:func:`fit_pca_gaps`). Channels that do not move, those that turn round
    (:func:`mocaplab.gap_fillers.seams.turns_round`), and the root are filled by straight lines; so
    is everything in a clip where less than two channels move.

    The mean pose is that of the clip, not of the training clips: people stand differently.

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
        if len(columns) < 2 or not np.isnan(motion.channels[:, columns]).any():
            return lines
        subspace = fit_subspace(motion, columns, self.training)
        filled = lines.channels.copy()
        filled[:, columns] = fill_by_pose(motion.channels[:, columns], subspace, motion.frame_time)
        return motion.with_channels(filled)


def pca_gaps(motion: Motion) -> Motion:
    """Fill gaps with what the clip itself tells about its joints; see :class:`PcaGaps`."""
    return PcaGaps()(motion)


def fit_pca_gaps(clips: Sequence[Corrupted]) -> PcaGaps:
    """Learn from clean training clips how joints move together.

    Parameters
    ----------
    clips : Corrupted clips of one skeleton; never test clips

    Raises
    ------
    ValueError
        If there is no clip, or their skeletons differ.
    """
    return PcaGaps(TrainingPoses.of(clips))
