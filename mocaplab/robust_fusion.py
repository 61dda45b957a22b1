"""Fusion that learns which source to trust, for each joint and frame.

Paper B's network turns two sources into one with the same weights everywhere, and it says itself
where that fails: with one clean source and one of pure noise its result jitters (section
"Limitations"). This network never says a pose. It looks at how each source trembles and how far
the two are apart, and answers with a trust in each of them and with the width of a Gaussian; the
pose is the mean that follows from these.

Letters in shapes: B clips in a batch, T frames, J joints.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import torch
from torch import Tensor, nn

from mocaplab.adaptive_filter import adaptive_gaussian
from mocaplab.layers import check_sizes, dense, seeded, start_near
from mocaplab.quaternion_losses import multiply, same_side, unit

PAIRS = torch.triu_indices(4, 4)
"""The 10 entries of a symmetric 4 x 4 matrix that tell all 16."""
LARGEST_TURN_RAD = 0.1
"""How far the decoder may turn a joint: it corrects the mean, and cannot replace it."""


@dataclass(frozen=True)
class RobustConfig:
    """The shape of a RobustFusion."""

    n_joints: int  # J that the decoder knows
    n_trust: int = 16  # LSTM units in each direction that judge a joint
    n_hidden: int = 256  # units in the decoder, which knows how bodies move
    decoder: bool = True  # without it the network works for any skeleton
    radius: int = 15  # frames that the filter reaches to each side
    first_sigma_s: float = 0.02  # every width starts near this

    def __post_init__(self) -> None:
        check_sizes(self, "n_joints", "n_trust", "n_hidden", "radius")


class RobustFusion(nn.Module):
    """Weighted, smoothed mean of two sources, and a small correction by what bodies do.

    The judge is one small network for all joints: it sees a joint at a time, and so serves any
    skeleton. The decoder sees the whole pose of the joints that it was trained on. It corrects
    what no filter can see, a constant error: a knee does not bend sideways.

    Parameters
    ----------
    config : RobustConfig
    rest : tensor, shape (J, 4)
        A usual pose. It decides between q and -q where the decoder looks at them.
    seed : int, of the first weights
    """

    def __init__(self, config: RobustConfig, rest: Tensor, *, seed: int):
        super().__init__()
        self.config = config
        self.register_buffer("rest", rest)
        n, h = config.n_joints, config.n_trust
        with seeded(seed):
            self.judge = nn.LSTM(12, h, batch_first=True, bidirectional=True)
            self.trust = nn.Linear(2 * h, 1)
            self.width = nn.Linear(2 * h, 1)
            self.decoder = dense([4 * (n - 1), config.n_hidden, config.n_hidden, 3 * n])
            start_near(self.decoder, torch.zeros(3 * n))
        nn.init.constant_(self.width.bias, math.log(config.first_sigma_s))

    def forward(self, a: Tensor, b: Tensor, frame_time: float) -> Tensor:
        """Fuse two sources, shape (B, T, J, 4), into one of that shape and length 1."""
        trust, sigma_s = self.judge_sources(a, b)
        fused = self.blend(a, b, trust, sigma_s / frame_time)
        return self.correct(fused) if self.config.decoder else fused

    def judge_sources(self, a: Tensor, b: Tensor) -> tuple[Tensor, Tensor]:
        """Say how far each source is trusted, and how much is to be smoothed.

        Returns
        -------
        trust : tensor, shape (B, T, J, 2), above 0; only ratios count, between the two sources
            and between frames
        sigma_s : tensor, shape (B, T, J), seconds
        """
        n_clips, n_frames, n_joints, _ = a.shape
        of_a, of_b = _evidence(a, b), _evidence(b, a)  # (B, T, J, 6)
        both = torch.stack([torch.cat([of_a, of_b], -1), torch.cat([of_b, of_a], -1)])
        both = both.permute(0, 1, 3, 2, 4).reshape(-1, n_frames, 12)  # (2 B J, T, 12)
        x, _ = self.judge(both)  # (2 B J, T, 2h)
        x = x.view(2, n_clips, n_joints, n_frames, -1).transpose(2, 3)  # (2, B, T, J, 2h)
        trust = torch.exp(12 * torch.tanh(self.trust(x)[..., 0] / 12))
        # The same answer whichever source comes first.
        width = self.width(x.mean(dim=0))[..., 0].clamp(math.log(1e-3), math.log(1.0))
        return trust.movedim(0, -1), torch.exp(width)

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

    def correct(self, fused: Tensor) -> Tensor:
        """Turn every joint a little towards what bodies do."""
        # Not the root: which way somebody faces says nothing about the pose.
        pose = same_side(fused, self.rest)[..., 1:, :].flatten(2)  # (B, T, 4 (J - 1))
        turn = LARGEST_TURN_RAD * torch.tanh(self.decoder(pose)).view(*fused.shape[:-1], 3)
        return multiply(fused, unit(torch.cat([torch.ones_like(turn[..., :1]), turn / 2], -1)))


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
    matrix = entries[..., where.flatten()].unflatten(-1, (4, 4))
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
    return (p - same_side(q, p)).norm(dim=-1)


def _shift(q: Tensor, frames: int) -> Tensor:
    """Look so many frames ahead, or back; beyond the ends the last frame is seen."""
    n_frames = q.shape[1]
    there = (torch.arange(n_frames, device=q.device) + frames).clamp(0, n_frames - 1)
    return q[:, there]


def _between(q: Tensor, frames: int) -> Tensor:
    """Find the mean of the frames before and after."""
    before = _shift(q, -frames)
    return unit(before + same_side(_shift(q, frames), before))
