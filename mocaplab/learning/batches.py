"""The pieces of clips that training draws: noisy, at many speeds, with jumps and margins."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields

import numpy as np

from mocaplab.euler import JUMP_DEG
from mocaplab.gap_fillers.curves import lerp_columns
from mocaplab.measures.movement import root_angular_velocity
from mocaplab.motion import BoolArray, FloatArray, IntArray, Motion, moving_channels
from mocaplab.noise.gaps import draw_runs

LARGEST_JUMP = 20.0
"""How far a joint jumps at most in a piece, in standard deviations of the channel without it."""


@dataclass(frozen=True, eq=False)
class Batch:
    """Equally long pieces of several clips. B pieces, T frames, C channels."""

    observed: FloatArray  # (B, T, C), degrees, with noise
    clean: FloatArray  # (B, T, C), degrees
    mean: FloatArray  # (B, 1, C), degrees, of the whole clip that each piece is from
    std: FloatArray  # (B, 1, C), degrees, of that whole clip with its noise
    root_velocity: FloatArray  # (B, T, 3), radians per second
    weight: FloatArray  # (B, T): 1 for frames that the loss counts, 0 in margins
    counted: BoolArray  # (B, T, C): the gaps, closed in observed by straight lines; or all

    def share(self, part: int, n_parts: int) -> Batch:
        """Return every n_parts-th piece, from number part on."""
        arrays = {f.name: getattr(self, f.name)[part::n_parts] for f in fields(self)}
        return Batch(**arrays)


class Windows:
    """Draws training batches: noisy pieces of clean clips.

    A piece has a margin on each side in which the loss does not count, because there the
    filter and the LSTM see less than they would in a whole clip. Margins at a real end of
    a clip do count.

    Parameters
    ----------
    clips : list of Motion, continuous, without NaN
    n_frames : int, frames a piece, margins included
    margin : int, frames
    """

    def __init__(self, clips: Sequence[Motion], n_frames: int, margin: int):
        if n_frames <= 2 * margin:
            raise ValueError(f"a piece of {n_frames} frames is all margin ({margin} a side)")
        self.n_frames, self.margin = n_frames, margin
        self.frame_time = clips[0].frame_time
        joint = clips[0].skeleton.channel_joint
        self.first_of_joint = np.searchsorted(joint, joint)  # of every channel, shape (C,)
        self.channels, self.velocities, self.lengths = [], [], []
        for clip in clips:
            # A clip shorter than a piece is played back and forth until it is long enough.
            missing = ((0, max(0, n_frames - clip.n_frames)), (0, 0))
            self.channels.append(np.pad(clip.channels, missing, mode="symmetric"))
            played = clip.with_channels(self.channels[-1])
            self.velocities.append(root_angular_velocity(played))
            self.lengths.append(len(self.channels[-1]))
        self.means = [clip.channels.mean(axis=0) for clip in clips]
        self.scales = [clip.channels.std(axis=0) * moving_channels(clip) for clip in clips]
        self.jump_share = _jump_share(clips)

    def batches(
        self,
        n_pieces: int,
        k_range: tuple[float, float],
        speed_range: tuple[float, float] = (1.0, 1.0),
        gaps: tuple[float, float] = (0.0, 0.5),
        jump_rate: float = 0.0,
        *,
        rng: np.random.Generator,
    ) -> Iterator[Batch]:
        """Yield one epoch: as many pieces as it takes to see every frame once on average.

        Parameters
        ----------
        n_pieces : int, pieces a batch
        k_range : (low, high); the noise amount of each piece is uniform between them
        speed_range : (low, high); each piece is played faster or slower by a factor between
            them, so that the network meets speeds that nobody recorded
        gaps : (start probability, mean seconds), see :func:`mocaplab.noise.gaps.draw_runs`
        jump_rate : float, that each joint jumps in this many times as large a share of the
            pieces as of the clips
        rng : numpy.random.Generator
        """
        share = np.array(self.lengths) / sum(self.lengths)
        for _ in range(self.n_batches(n_pieces)):
            which = rng.choice(len(share), n_pieces, p=share)
            speeds = np.exp(rng.uniform(np.log(speed_range[0]), np.log(speed_range[1]), n_pieces))
            yield self._batch(which, speeds, k_range, gaps, jump_rate, rng)

    def n_batches(self, n_pieces: int) -> int:
        """Return how many batches of so many pieces an epoch has."""
        n_counted = self.n_frames - 2 * self.margin
        return max(1, round(sum(self.lengths) / (n_counted * n_pieces)))

    def _batch(
        self,
        which: IntArray,
        speeds: FloatArray,
        k_range: tuple[float, float],
        gaps: tuple[float, float],
        jump_rate: float,
        rng: np.random.Generator,
    ) -> Batch:
        steps = self.n_frames - 1
        final = np.array([self.lengths[i] - 1 for i in which])
        speeds = np.minimum(speeds, final / steps)  # no faster than the clip is long
        last = final - speeds * steps
        # Reaching beyond the ends by a margin, so that the ends come up often enough.
        starts = np.clip(rng.uniform(-self.margin, last + self.margin), 0, last)
        starts = np.where(speeds == 1, starts.round(), starts)  # then no interpolation
        pieces = [
            self._piece(i, start + speed * np.arange(self.n_frames), speed)
            for i, start, speed in zip(which, starts, speeds, strict=True)
        ]
        clean = np.stack([channels for channels, _ in pieces])
        mean = np.stack([self.means[i] for i in which])[:, None]
        scale = np.stack([self.scales[i] for i in which])[:, None]
        if jump_rate > 0:
            clean, mean, scale = self._let_jump(clean, mean, scale, jump_rate, rng)
        k = rng.uniform(*k_range, size=(len(which), 1, 1))
        weight = np.ones((len(which), self.n_frames))
        weight[starts > 0, : self.margin] = 0
        weight[starts < last, -self.margin :] = 0
        observed = rng.normal(size=clean.shape)
        observed *= k * scale  # in place, for speed
        observed += clean
        counted = np.ones(clean.shape, dtype=bool)
        if gaps[0] > 0:
            observed, counted = self._hide(observed, scale > 0, gaps, rng)
        return Batch(
            observed=observed,
            clean=clean,
            mean=mean,
            std=scale * np.sqrt(1 + k**2),
            root_velocity=np.stack([velocity for _, velocity in pieces]),
            weight=weight,
            counted=counted,
        )

    def _let_jump(
        self,
        clean: FloatArray,
        mean: FloatArray,
        scale: FloatArray,
        rate: float,
        rng: np.random.Generator,
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Let joints jump from one frame to the next, for a while, as thumbs do in captures.

        What a jump does to the mean and the deviation of the whole clip depends on the share of
        the clip that lies behind it, which is drawn, too.

        Returns
        -------
        clean, mean, scale : arrays of the same shapes, the jumps included
        """
        n_pieces, n_frames, n_channels = clean.shape
        jumps = rng.random((n_pieces, n_channels)) < rate * self.jump_share
        jumps = jumps[:, self.first_of_joint]  # all angles of a joint together
        # The size of a jump is in standard deviations of its channel, until the last lines.
        size = np.exp(rng.uniform(0, np.log(LARGEST_JUMP), jumps.shape))
        size = np.where(jumps, size * rng.choice([-1, 1], jumps.shape), 0.0)[:, None]
        start = rng.integers(n_frames, size=(n_pieces, 1, 1))
        length = np.exp(rng.uniform(0, np.log(n_frames), (n_pieces, 1, 1)))  # frames
        frame = np.arange(n_frames)[:, None]
        inside = (frame >= start) & (frame < start + length)
        share = rng.uniform(0.01, 0.5, (n_pieces, 1, 1))
        piece, channel = np.nonzero(jumps)
        jumped = clean.copy()
        jumped[piece, :, channel] += inside[piece, :, 0] * (size * scale)[piece, :, channel]
        return (
            jumped,
            mean + share * size * scale,
            scale * np.sqrt(1 + size**2 * share * (1 - share)),
        )

    def _hide(
        self,
        observed: FloatArray,
        moves: BoolArray,
        gaps: tuple[float, float],
        rng: np.random.Generator,
    ) -> tuple[FloatArray, BoolArray]:
        """Put gaps into the channels that move, close them by lines, and say where they are.

        In every second piece all angles of a joint are hidden together, as by a lost marker;
        in the others single channels, as in paper A.
        """
        by_frame = np.moveaxis(observed, 1, 0)  # (T, B, C)
        inside = draw_runs(by_frame.shape, self.frame_time, *gaps, rng)
        inside[:, ::2] = inside[:, ::2][..., self.first_of_joint]
        inside &= moves[:, 0]
        inside[[0, -1]] = False
        holed = np.where(inside, np.nan, by_frame).reshape(self.n_frames, -1)
        closed = lerp_columns(holed).reshape(by_frame.shape)
        return np.moveaxis(closed, 0, 1), np.moveaxis(inside, 0, 1)

    def _piece(self, clip: int, frames: FloatArray, speed: float) -> tuple[FloatArray, FloatArray]:
        """Read a clip at frames that may lie between its own."""
        before = np.minimum(frames.astype(int), self.lengths[clip] - 1)
        after = np.minimum(before + 1, self.lengths[clip] - 1)
        part = (frames - before)[:, None]
        channels, velocity = self.channels[clip], self.velocities[clip]
        return (
            (1 - part) * channels[before] + part * channels[after],
            speed * ((1 - part) * velocity[before] + part * velocity[after]),
        )


def _jump_share(clips: Sequence[Motion]) -> FloatArray:
    """Return for every channel, shape (C,), the share of clips in which its joint jumps."""
    skeleton = clips[0].skeleton
    jumps = [(np.abs(np.diff(clip.channels, axis=0)) > JUMP_DEG).any(axis=0) for clip in clips]
    of_same_joint = skeleton.channel_joint[:, None] == skeleton.channel_joint  # (C, C)
    share: FloatArray = (np.array(jumps) @ of_same_joint).mean(axis=0) * skeleton.is_cleaned
    return share
