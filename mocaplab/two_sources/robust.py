"""Fusion that learns which source to trust, for each joint and frame.

Paper B's network turns two sources into one with the same weights everywhere, and it says itself
where that fails: with one clean source and one of pure noise its result jitters (section
"Limitations"). This network never says a pose. It looks at how each source trembles and how far
the two are apart, and answers with a trust in each of them, with the width of a Gaussian, and with
how wrong the smoothed mean may still be. The pose is what follows from these:

1. the weighted mean of both sources and the frames around (:meth:`RobustFusion.blend`);
2. of this, what is likely for a body (:meth:`RobustFusion.correct`). It finds what no filter
   can see, an error that stays: a knee does not bend sideways.

Letters in shapes: B clips in a batch, T frames, J joints.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor, nn

from mocaplab.adaptive_filter import adaptive_gaussian
from mocaplab.layers import check_sizes, seeded
from mocaplab.motion import FloatArray
from mocaplab.two_sources.losses import multiply, same_side, unit

PAIRS = torch.triu_indices(4, 4)
"""The 10 entries of a symmetric 4 x 4 matrix that tell all 16."""
IMPLAUSIBLE = 4.0
"""A correction of more than so many times the expected error is not made: this body moves
otherwise than those that the poses were learned from."""


@dataclass(frozen=True)
class RobustConfig:
    """The shape of a RobustFusion."""

    n_joints: int  # J whose poses it knows; it judges any number
    n_trust: int = 16  # LSTM units in each direction that judge a joint
    radius: int = 15  # frames that the filter reaches to each side
    first_sigma_s: float = 0.012  # every width starts near this
    first_error_rad: float = 0.007  # and every expected error near this: 0.4 degrees

    def __post_init__(self) -> None:
        check_sizes(self, "n_joints", "n_trust", "radius")


class RobustFusion(nn.Module):
    """Weighted, smoothed mean of two sources, corrected by what poses are likely.

    The judge is one small network for all joints: it sees a joint at a time, and so serves any
    skeleton. The likely poses are those of one skeleton, as a normal distribution.

    Parameters
    ----------
    config : RobustConfig
    seed : int, of the first weights
    """

    def __init__(self, config: RobustConfig, *, seed: int):
        super().__init__()
        self.config = config
        n, h = config.n_joints, config.n_trust
        with seeded(seed):
            self.judge = nn.LSTM(12, h, batch_first=True, bidirectional=True)
            self.trust = nn.Linear(2 * h, 1)
            self.width_and_error = nn.Linear(2 * h, 2)
        first = torch.tensor([config.first_sigma_s, config.first_error_rad]).log()
        with torch.no_grad():
            self.width_and_error.bias.copy_(first)
        # Until learn_poses, every pose is as likely as any other.
        self.register_buffer("rest", torch.eye(4)[0].repeat(n, 1))  # (J, 4)
        self.register_buffer("mean", torch.zeros(3 * (n - 1)))
        self.register_buffer("covariance", torch.eye(3 * (n - 1)))
        self.rest: Tensor
        self.mean: Tensor
        self.covariance: Tensor

    def learn_poses(self, rest: FloatArray, poses: FloatArray) -> None:
        """Take over mean and covariance of the poses of training clips.

        Parameters
        ----------
        rest : array, shape (J, 4)
            A usual pose (:func:`mocaplab.two_sources.segments.mean_pose`), from which turns are
            counted.
        poses : array, shape (T, J, 4), all frames of all clips
        """
        self.rest.copy_(torch.from_numpy(rest))
        turns = self._turns(torch.from_numpy(poses)).numpy()
        self.mean.copy_(torch.from_numpy(turns.mean(axis=0)))
        self.covariance.copy_(torch.from_numpy(np.cov(turns.T)))

    def forward(self, a: Tensor, b: Tensor, frame_time: float) -> Tensor:
        """Fuse two sources, shape (B, T, J, 4), into one of that shape and length 1."""
        trust, sigma_s, error_rad = self.judge_sources(a, b)
        return self.correct(self.blend(a, b, trust, sigma_s / frame_time), error_rad)

    def judge_sources(self, a: Tensor, b: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Say how far each source is trusted, and how much is to be smoothed and corrected.

        Returns
        -------
        trust : tensor, shape (B, T, J, 2), above 0; only ratios count, between the two sources
            and between frames
        sigma_s : tensor, shape (B, T, J), seconds
        error_rad : tensor, shape (B, T, J), radians, expected of the smoothed mean
        """
        n_clips, n_frames, n_joints, _ = a.shape
        of_a, of_b = _evidence(a, b), _evidence(b, a)  # (B, T, J, 6)
        both = torch.stack([torch.cat([of_a, of_b], -1), torch.cat([of_b, of_a], -1)])
        both = both.permute(0, 1, 3, 2, 4).reshape(-1, n_frames, 12)  # (2 B J, T, 12)
        x, _ = self.judge(both)  # (2 B J, T, 2h)
        x = x.view(2, n_clips, n_joints, n_frames, -1).transpose(2, 3)  # (2, B, T, J, 2h)
        trust = torch.exp(12 * torch.tanh(self.trust(x)[..., 0] / 12))
        # The mean over both orders: the same answer whichever source comes first.
        said = self.width_and_error(x.mean(dim=0)).clamp(math.log(1e-3), 0.0)
        sigma_s, error_rad = said.exp().unbind(dim=-1)
        return trust.movedim(0, -1), sigma_s, error_rad

    def blend(self, a: Tensor, b: Tensor, trust: Tensor, sigma: Tensor) -> Tensor:
        """Take the mean of rotations over both sources and the frames around.

        The mean of unit quaternions with weights w is the eigenvector of the sum of w q q' with
        the largest eigenvalue (Markley et al. 2007, "Averaging quaternions"). In it q and -q
        are the same, so no sign has to be chosen, which no rule could where one source is noise.

        Parameters
        ----------
        a, b : tensors, shape (B, T, J, 4)
        trust : tensor, shape (B, T, J, 2)
        sigma : tensor, shape (B, T, J), frames
        """
        i, j = PAIRS
        products = trust[..., :1] * a[..., i] * a[..., j] + trust[..., 1:] * b[..., i] * b[..., j]
        widths = sigma[..., None].expand_as(products)  # (B, T, J, 10)
        smooth = adaptive_gaussian(products.flatten(2), widths.flatten(2), self.config.radius)
        return principal_axis(smooth.view_as(products))

    def correct(self, fused: Tensor, error_rad: Tensor) -> Tensor:
        """Move poses towards likely ones, as far as they may be wrong.

        Turns from the usual pose are taken as normally distributed, x with covariance S, and
        observed with errors of covariance N. The most likely x is then the observed one less
        N (S + N)^-1 (observed - mean): the Wiener filter, over joints instead of time.

        Parameters
        ----------
        fused : tensor, shape (B, T, J, 4)
        error_rad : tensor, shape (B, T, J)
        """
        off = self._turns(fused) - self.mean  # (B, T, 3 (J - 1))
        error = error_rad[..., 1:].repeat_interleave(3, dim=-1)
        total = self.covariance + torch.diag_embed(error**2)
        root = torch.linalg.cholesky(total)
        change = -(error**2) * torch.cholesky_solve(off[..., None], root)[..., 0]
        change = change / (1 + (change / (IMPLAUSIBLE * error)) ** 4)
        return torch.cat([fused[..., :1, :], self._poses(off + self.mean + change)], dim=-2)

    def _turns(self, q: Tensor) -> Tensor:
        """Tell the turns of all joints but the root from the usual pose, shape (..., 3 (J - 1)).

        Which way somebody faces says nothing about the pose. A turn is told by twice the vector
        part of its quaternion: the rotation vector, for small angles.
        """
        back = self.rest * self.rest.new_tensor([1.0, -1.0, -1.0, -1.0])
        turn = multiply(back.expand_as(q)[..., 1:, :].to(q), q[..., 1:, :])
        turn = torch.where(turn[..., :1] < 0, -turn, turn)
        return (2 * turn[..., 1:]).flatten(-2)

    def _poses(self, turns: Tensor) -> Tensor:
        """Undo :meth:`_turns`: return the quaternions of all joints but the root."""
        xyz = turns.reshape(*turns.shape[:-1], -1, 3) / 2
        w = (1 - (xyz**2).sum(dim=-1, keepdim=True)).clamp_min(1e-6).sqrt()
        rest = self.rest[1:].expand(*w.shape[:-1], 4)
        return unit(multiply(rest, torch.cat([w, xyz], dim=-1)))


def principal_axis(entries: Tensor) -> Tensor:
    """Find the eigenvector with the largest eigenvalue of symmetric 4 x 4 matrices.

    Squaring a matrix five times raises its eigenvalues to the 32nd power: all but the largest
    vanish, and every column is a multiple of its eigenvector.

    Parameters
    ----------
    entries : tensor, shape (..., 10); see ``PAIRS``

    Returns
    -------
    tensor, shape (..., 4), of length 1
    """
    i, j = PAIRS
    where = torch.empty(4, 4, dtype=torch.long, device=entries.device)
    where[i, j] = where[j, i] = torch.arange(10, device=entries.device)
    matrix = entries[..., where.flatten()].reshape(*entries.shape[:-1], 4, 4)
    for _ in range(5):
        matrix = matrix / matrix.diagonal(dim1=-2, dim2=-1).sum(-1)[..., None, None]
        matrix = matrix @ matrix
    longest = matrix.diagonal(dim1=-2, dim2=-1).argmax(dim=-1)
    column = matrix.gather(-1, longest[..., None, None].expand(*matrix.shape[:-1], 1))
    return unit(column[..., 0])


def _evidence(own: Tensor, other: Tensor) -> Tensor:
    """Measure what speaks against a source, shape (B, T, J, 6), about -1 to 1.

    These are distances on a logarithmic scale: to its own frames before and after, to the mean
    of the two, at one frame and at four, to the other source, and to the mean of the other
    source's frames before and after.
    """
    other_between = _between(other, 1)
    distances = [
        _distance(own, _shift(own, -1)),
        _distance(own, _shift(own, 1)),
        _distance(own, _between(own, 1)),
        _distance(own, _between(own, 4)),
        _distance(own, other),
        _distance(own, other_between),
    ]
    return (torch.log(torch.stack(distances, dim=-1) + 1e-3) + 3.5) / 3.5


def _distance(p: Tensor, q: Tensor) -> Tensor:
    distance: Tensor = (p - same_side(q, p)).norm(dim=-1)
    return distance


def _shift(q: Tensor, frames: int) -> Tensor:
    """Look so many frames ahead, or back; beyond the ends the last frame is seen."""
    n_frames = q.shape[1]
    there = (torch.arange(n_frames, device=q.device) + frames).clamp(0, n_frames - 1)
    return q[:, there]


def _between(q: Tensor, frames: int) -> Tensor:
    """Find the mean of the frames before and after."""
    before = _shift(q, -frames)
    return unit(before + same_side(_shift(q, frames), before))
