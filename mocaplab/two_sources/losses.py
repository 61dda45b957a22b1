"""Losses and small arithmetic on quaternions in torch. Shapes (..., J, 4), w first."""

from __future__ import annotations

import torch
from torch import Tensor

from mocaplab.motion import Skeleton
from mocaplab.torch_kinematics import join_chain


def unit(q: Tensor) -> Tensor:
    """Scale quaternions to length 1."""
    scaled: Tensor = q / q.norm(dim=-1, keepdim=True).clamp_min(1e-8)
    return scaled


def same_side(q: Tensor, reference: Tensor) -> Tensor:
    """Return q or -q, whichever is nearer to the reference: the same rotation."""
    return torch.where((q * reference).sum(dim=-1, keepdim=True) < 0, -q, q)


def l1_loss(predicted: Tensor, truth: Tensor) -> Tensor:
    """Paper B's loss (Eq. 1): L1 distance, summed over joints, mean over frames.

    q and -q count as far apart, so the signs must have been chosen before.

    Parameters
    ----------
    predicted, truth : tensor, shape (..., J, 4)

    Returns
    -------
    tensor, one number
    """
    return (predicted - truth).abs().sum(dim=(-2, -1)).mean()


def invariant_l1_loss(predicted: Tensor, truth: Tensor) -> Tensor:
    """Paper B's loss to whichever of truth and -truth is nearer, which is the same rotation."""
    straight = (predicted - truth).abs().sum(dim=-1)
    opposite = (predicted + truth).abs().sum(dim=-1)
    return torch.minimum(straight, opposite).sum(dim=-1).mean()


def quaternion_to_matrix_torch(q: Tensor) -> Tensor:
    """Rotation matrices, shape (..., 3, 3), of unit quaternions, shape (..., 4)."""
    w, x, y, z = q.unbind(dim=-1)
    rows = [
        torch.stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)], dim=-1),
        torch.stack([2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)], dim=-1),
        torch.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], dim=-1),
    ]
    return torch.stack(rows, dim=-2)


def multiply(left: Tensor, right: Tensor) -> Tensor:
    """Quaternion product, shape (..., 4): turn by ``right`` first, then by ``left``."""
    a, u = left[..., :1], left[..., 1:]
    b, v = right[..., :1], right[..., 1:]
    w = a * b - (u * v).sum(dim=-1, keepdim=True)
    return torch.cat([w, a * v + b * u + torch.linalg.cross(u, v, dim=-1)], dim=-1)


def kinematics_loss(
    predicted: Tensor, truth: Tensor, skeleton: Skeleton, joints: list[int]
) -> Tensor:
    """Mean distance of the joints' positions, found by forward kinematics.

    A degree at the hip moves the foot further than a degree at the ankle, and this loss knows
    it (QuaterNet: Pavllo et al. 2018). The root stands at the origin, and joints that are not
    among the chosen ones do not turn, in both poses.

    Parameters
    ----------
    predicted, truth : tensor, shape (..., J, 4); any length but 0, any sign
    skeleton : Skeleton
    joints : the J joints of the skeleton that the quaternions turn

    Returns
    -------
    tensor, one number, file length units
    """
    offsets = torch.tensor(skeleton.offsets).to(predicted)
    offsets = torch.cat([torch.zeros_like(offsets[:1]), offsets[1:]])
    positions = []
    for q in (predicted, truth):
        matrices = quaternion_to_matrix_torch(unit(q))
        turns: list[Tensor | None] = [None] * skeleton.n_joints
        for place, joint in enumerate(joints):
            turns[joint] = matrices[..., place, :, :]
        places = offsets.expand(*q.shape[:-2], -1, 3)
        positions.append(join_chain(skeleton.parents.tolist(), places, turns)[0])
    distance: Tensor = (positions[0] - positions[1]).norm(dim=-1)
    return distance.mean()
