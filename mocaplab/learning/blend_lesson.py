"""What a Blend is shown while it learns.

It needs whole clips for its estimates, so these are made first and cut into pieces afterwards.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import torch
from torch import Tensor

from mocaplab.blend import Blend
from mocaplab.estimate_bank import cosine_windows, estimates_and_clues, noise_std
from mocaplab.learning.config import TrainConfig
from mocaplab.learning.parallel import rank_and_size
from mocaplab.measures.movement import root_angular_velocity
from mocaplab.motion import BoolArray, FloatArray, Motion, moving_channels
from mocaplab.normalization import standardize
from mocaplab.skeletons.mirroring import mirror


@dataclass(frozen=True)
class _Clip:
    """A clip to learn from, as it is or mirrored."""

    channels: FloatArray  # (T, C), degrees, cleaned channels only
    root_velocity: FloatArray  # (T, 3)
    std: FloatArray  # (C,), degrees, 0 for channels that do not move


@dataclass(frozen=True)
class Spread:
    """A noisy clip spread out into its estimates; everything of one clip or of B pieces."""

    estimates: Tensor  # (B, T, C, M)
    clues: Tensor  # (B, T, C, F)
    noise: Tensor  # (B, C)
    root_velocity: Tensor  # (B, T, 3)
    clean: Tensor  # (B, T, C), standardized
    importance: Tensor  # (B, C): how much a squared error counts
    weight: Tensor  # (B, T): 1 for frames that count

    @property
    def n_frames(self) -> int:
        """Frames T."""
        return self.clean.shape[1]

    def piece(self, start: int, n_frames: int, margin: int) -> Spread:
        """Cut out some frames; at cut ends a margin does not count."""
        frames = slice(start, start + n_frames)
        weight = self.weight[:, frames].clone()
        if start > 0:
            weight[:, :margin] = 0
        if start + n_frames < self.n_frames:
            weight[:, -margin:] = 0
        return Spread(
            self.estimates[:, frames],
            self.clues[:, frames],
            self.noise,
            self.root_velocity[:, frames],
            self.clean[:, frames],
            self.importance,
            weight,
        )


class BlendLesson:
    """Whole clips for a :class:`mocaplab.blend.Blend`.

    With ``measure``, they also give it its covariance.

    A clip that was measured for the covariance would get a better linear estimate in training
    than any new clip ever will, and the network would trust it too much. So the clips are
    dealt into ``N_FOLDS`` parts, and the estimate of each clip uses the other parts only. If
    there are fewer clips than parts, they are cut into stretches first.
    """

    N_FOLDS = 4
    GROUP = 16  # clips that are spread out at one time; each takes some 10 kB a frame
    LONGEST = 2000  # frames; of longer clips another stretch is taken every time
    CUTS = 2  # times that a noisy clip is cut into pieces

    def __init__(
        self,
        clips: Sequence[Motion],
        config: TrainConfig,
        columns: BoolArray,
        network: Blend,
        *,
        measure: bool,
    ):
        self.config, self.radius = config, network.config.radius
        if measure and len(clips) < self.N_FOLDS:
            clips = _stretches(clips, 2 * self.N_FOLDS, config.n_frames)
        self.versions = [[_clip(m, columns) for m in with_mirror(clip)] for clip in clips]
        self.covariances = [network.covariance.cpu()] * len(clips)
        if measure:
            self._measure(network)
        step = config.n_frames - 2 * config.margin
        n_pieces = self.CUTS * sum(len(v[0].channels) for v in self.versions) / step
        self.n_batches = max(1, round(n_pieces / config.batch_size))

    def _measure(self, network: Blend) -> None:
        """Give the network the covariance of all clips, and each clip that of the others."""
        n_clips = len(self.versions)
        folds = np.random.default_rng([self.config.seed, 0]).permutation(n_clips) % self.N_FOLDS
        moments = torch.stack([_moment(v, network) for v in self.versions])
        network.covariance.copy_(moments.mean(dim=0))
        if n_clips > 1:
            self.covariances = [moments[torch.from_numpy(folds != f)].mean(0) for f in folds]
        else:
            self.covariances = [network.covariance.cpu()]

    def batches(self, rng: np.random.Generator) -> Iterator[Spread]:
        """See :class:`Lesson`."""
        order = rng.permutation(len(self.versions))
        rank, n_processes = rank_and_size()
        for start in range(0, len(order), self.GROUP):
            spreads = [self._spread(i, rng) for i in order[start : start + self.GROUP]]
            pieces = [p for s in spreads for _ in range(self.CUTS) for p in self._cut(s, rng)]
            pieces = [pieces[i] for i in rng.permutation(len(pieces))]
            size = self.config.batch_size
            for first in range(0, len(pieces), size):
                yield _join(pieces[first : first + size][rank::n_processes] or pieces[:1])

    def loss(self, network: torch.nn.Module, batch: Spread) -> Tensor:
        """See :class:`Lesson`.

        The error is a share of what the best single Gaussian leaves in that clip, so that
        quiet clips and little noise count as much as wild clips and much noise. The root
        keeps single bad pieces from ruling the step.
        """
        device = next(network.parameters()).device
        batch = Spread(**{k: v.to(device) for k, v in vars(batch).items()})
        mixed = network(batch.estimates, batch.clues, batch.noise, batch.root_velocity)
        error = ((mixed - batch.clean) ** 2 * batch.importance[:, None]).sum(dim=-1)  # (B, T)
        share = (error * batch.weight).sum(dim=1) / batch.weight.sum(dim=1)
        loss: Tensor = (share + 1e-3).sqrt().mean()
        return loss

    def _spread(self, index: int, rng: np.random.Generator) -> Spread:
        """Play a clip at another speed or mirrored, add noise, and make all estimates."""
        config, versions = self.config, self.versions[index]
        clip = versions[rng.integers(len(versions))]
        clean, root = _play(clip, config, self.LONGEST, rng)
        k = rng.uniform(config.k_low, config.k_high)
        noisy = clean + rng.normal(size=clean.shape) * k * clip.std
        mean, std = noisy.mean(axis=0), noisy.std(axis=0) * (clip.std > 0)
        pose = _tensor(standardize(noisy, mean, std))
        target = _tensor(standardize(clean, mean, std))
        noise = noise_std(pose)
        with torch.no_grad():
            estimates, clues = estimates_and_clues(
                pose, noise, self.covariances[index], self.radius
            )
        variance = torch.from_numpy(std**2).float()
        errors = ((estimates[0, ..., :-1] - target[0, ..., None]) ** 2).mean(dim=0)  # (C, M - 1)
        best = (variance @ errors).min().clamp_min(1e-4 * variance.sum())
        return Spread(
            estimates=estimates,
            clues=clues,
            noise=noise,
            root_velocity=_tensor(root),
            clean=target,
            importance=(variance / best)[None],
            weight=torch.ones(1, len(clean)),
        )

    def _cut(self, spread: Spread, rng: np.random.Generator) -> Iterator[Spread]:
        """Cut a clip into pieces that overlap by their margins, from a random start on."""
        length, margin = self.config.n_frames, self.config.margin
        step = length - 2 * margin
        for start in range(int(rng.integers(-margin, step // 2)), spread.n_frames - margin, step):
            inside = min(max(start, 0), spread.n_frames - length)
            yield spread.piece(inside, length, margin)


def with_mirror(clip: Motion) -> list[Motion]:
    """Return a clip and its mirror image, if its joints are named as left and right."""
    try:
        return [clip, mirror(clip)]
    except ValueError:
        return [clip]


def _clip(motion: Motion, columns: BoolArray) -> _Clip:
    std = motion.channels.std(axis=0) * moving_channels(motion)
    return _Clip(motion.channels[:, columns], root_angular_velocity(motion), std[columns])


def _moment(versions: Sequence[_Clip], network: Blend) -> Tensor:
    """Mean product of all pairs of window coefficients of a clean clip, (C * K, C * K)."""
    total = torch.zeros(network.covariance.shape)
    for clip in versions:
        pose = _tensor(standardize(clip.channels, clip.channels.mean(axis=0), clip.std))
        windows = cosine_windows(pose, network.config.radius, network.config.n_cosines)[0]
        total += windows.T @ windows / len(windows) / len(versions)
    return total


def _play(
    clip: _Clip, config: TrainConfig, longest: int, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """Play a clip, or a stretch of a long one, faster or slower."""
    n_frames = len(clip.channels)
    start = int(rng.integers(0, max(n_frames - longest, 0) + 1))
    last = min(n_frames, start + longest) - 1
    speed = float(np.exp(rng.uniform(np.log(config.speed_low), np.log(config.speed_high))))
    # Never shorter than a piece: then a short clip is played slower, or back and forth.
    speed = min(speed, max(last - start, 1) / (config.n_frames - 1))
    frames = np.arange(start, last + 1e-9, speed)
    before = np.minimum(frames.astype(int), last)
    after = np.minimum(before + 1, last)
    part = (frames - before)[:, None]
    channels = (1 - part) * clip.channels[before] + part * clip.channels[after]
    root = (1 - part) * clip.root_velocity[before] + part * clip.root_velocity[after]
    missing = ((0, max(0, config.n_frames - len(frames))), (0, 0))
    return np.pad(channels, missing, mode="symmetric"), speed * np.pad(
        root, missing, mode="symmetric"
    )


def _stretches(clips: Sequence[Motion], n: int, least: int) -> list[Motion]:
    """Cut each clip into n stretches, or into fewer so that none is shorter than least frames."""
    cut = []
    for clip in clips:
        ends = np.linspace(0, clip.n_frames, max(1, min(n, clip.n_frames // least)) + 1).astype(int)
        cut += [clip.slice_frames(int(a), int(b)) for a, b in pairwise(ends)]
    return cut


def _join(pieces: Sequence[Spread]) -> Spread:
    columns = zip(*[vars(piece).values() for piece in pieces], strict=True)
    return Spread(*[torch.cat(column) for column in columns])


def _tensor(array: FloatArray) -> Tensor:
    """Return an array as a batch of one, in float32."""
    return torch.from_numpy(np.ascontiguousarray(array, dtype=np.float32))[None]
