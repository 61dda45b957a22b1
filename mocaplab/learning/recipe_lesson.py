"""What a network is shown while it learns one recipe: clips that were corrupted beforehand.

:class:`mocaplab.learning.lessons.WindowLesson` draws angular noise for every piece anew, which is
the better lesson. Noise that belongs to a whole clip, such as spatial noise, is too slow for that.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import torch
from torch import Tensor

from mocaplab.corruption import corrupt
from mocaplab.gap_fillers.curves import lerp_gaps
from mocaplab.learning.batches import Batch
from mocaplab.learning.config import TrainConfig
from mocaplab.learning.lessons import batch_loss
from mocaplab.learning.parallel import rank_and_size
from mocaplab.measures.movement import root_angular_velocity
from mocaplab.motion import BoolArray, FloatArray, Motion, moving_channels

DRAWS = 3
"""Corrupted versions of each clip, made once."""


class RecipeLesson:
    """Pieces of clips that a recipe corrupted; gaps are closed by straight lines.

    Pieces are played at their own speed, as in paper A. Like
    :class:`mocaplab.learning.batches.Windows`, they have margins that do not count.

    Parameters
    ----------
    clips : list of Motion, clean, continuous
    recipe : str, see :func:`mocaplab.corruption.parse_recipe`
    config : TrainConfig; its k_low, k_high and speeds mean nothing here
    columns : array, shape (C,), bool: the channels that the network sees
    """

    def __init__(
        self, clips: Sequence[Motion], recipe: str, config: TrainConfig, columns: BoolArray
    ):
        self.config, self.columns = config, columns
        rng = np.random.default_rng([config.seed, len(clips)])
        self.clean, self.velocities, self.moves = [], [], []
        self.observed: list[list[FloatArray]] = []
        for clip in clips:
            # A clip shorter than a piece is played back and forth until it is long enough.
            missing = ((0, max(0, config.n_frames - clip.n_frames)), (0, 0))
            self.clean.append(np.pad(clip.channels, missing, mode="symmetric"))
            self.velocities.append(root_angular_velocity(clip.with_channels(self.clean[-1])))
            self.moves.append(moving_channels(clip))
            drawn = [lerp_gaps(corrupt(clip, recipe, rng=rng).observed) for _ in range(DRAWS)]
            self.observed.append([np.pad(d.channels, missing, mode="symmetric") for d in drawn])
        counted = config.n_frames - 2 * config.margin
        self.lengths = np.array([len(channels) for channels in self.clean])
        self.n_batches = max(1, round(self.lengths.sum() / (counted * config.batch_size)))

    def batches(self, rng: np.random.Generator) -> Iterator[Batch]:
        """See :class:`mocaplab.learning.lessons.Lesson`."""
        rank, n_processes = rank_and_size()
        for _ in range(self.n_batches):
            yield self._batch(rng).share(rank, n_processes)

    def _batch(self, rng: np.random.Generator) -> Batch:
        n, margin, n_frames = self.config.batch_size, self.config.margin, self.config.n_frames
        which = rng.choice(len(self.lengths), n, p=self.lengths / self.lengths.sum())
        draws = rng.integers(DRAWS, size=n)
        last = self.lengths[which] - n_frames
        starts = np.clip(rng.integers(-margin, last + margin + 1), 0, last)
        weight = np.ones((n, n_frames))
        weight[starts > 0, :margin] = 0
        weight[starts < last, -margin:] = 0
        whole = [self.observed[i][draw] for i, draw in zip(which, draws, strict=True)]
        moves = np.stack([self.moves[i] for i in which])

        def cut(arrays: Sequence[FloatArray]) -> FloatArray:
            pairs = zip(arrays, starts, strict=True)
            return np.stack([array[start : start + n_frames] for array, start in pairs])

        clean = cut([self.clean[i] for i in which])
        return Batch(
            observed=cut(whole),
            clean=clean,
            mean=np.stack([w.mean(axis=0) for w in whole])[:, None],
            std=(np.stack([w.std(axis=0) for w in whole]) * moves)[:, None],
            root_velocity=cut([self.velocities[i] for i in which]),
            weight=weight,
            counted=np.ones(clean.shape, dtype=bool),
        )

    def loss(self, network: torch.nn.Module, batch: Batch) -> Tensor:
        """See :class:`mocaplab.learning.lessons.Lesson`."""
        return batch_loss(network, batch, self.columns)
