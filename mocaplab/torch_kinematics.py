"""Forward kinematics in torch, so that a loss can be told in positions and not in angles.

The same numbers as :func:`mocaplab.kinematics.forward_kinematics`, with gradients, on any
device, in the precision of the channels. A degree at the hip moves a foot further than a
degree at the ankle: a loss on positions knows that, a loss on angles does not.
"""

from __future__ import annotations

import torch
from torch import Tensor

from mocaplab.motion import Skeleton


def forward_kinematics_torch(skeleton: Skeleton, channels: Tensor) -> tuple[Tensor, Tensor]:
    """Position and orientation of every joint in the world.

    Parameters
    ----------
    skeleton : Skeleton
    channels : Tensor, shape (..., T, C), floating point
        Degrees for rotations, file length units for positions, in file channel order. A
        position channel replaces that coordinate of the joint's OFFSET.

    Returns
    -------
    positions : Tensor, shape (..., T, J, 3), file length units
    orientations : Tensor, shape (..., T, J, 3, 3)
        Matrices that take a vector from the joint's own axes to the world's.

    Raises
    ------
    ValueError
        If the last axis is not C wide, or the channels are whole numbers.
    """
    if channels.shape[-1:] != (skeleton.n_channels,) or not channels.is_floating_point():
        raise ValueError(
            f"expected channels of shape (..., {skeleton.n_channels}) in floating point, got "
            f"{tuple(channels.shape)} in {channels.dtype}"
        )
    # Nothing is written into a tensor here, because autograd could not look back through it.
    translations = _translations(skeleton, channels)
    turns = _local_rotations(skeleton, channels)
    return join_chain(skeleton.parents.tolist(), translations, turns)


def join_chain(
    parents: list[int], translations: Tensor, turns: list[Tensor | None]
) -> tuple[Tensor, Tensor]:
    """Follow the bones from the root to the ends; see :func:`forward_kinematics_torch`.

    Parameters
    ----------
    parents : list of J int, -1 for the root
    translations : Tensor, shape (..., J, 3), each joint relative to its parent
    turns : list of J Tensors, shape (..., 3, 3), or None for joints that do not turn
    """
    positions: list[Tensor] = []
    orientations: list[Tensor] = []
    for joint, parent in enumerate(parents):
        place, turn = translations[..., joint, :], turns[joint]
        if parent >= 0:
            upper = orientations[parent]
            place = positions[parent] + (upper @ place[..., None])[..., 0]
            turn = upper if turn is None else upper @ turn
        elif turn is None:
            turn = torch.eye(3).to(translations).expand(*translations.shape[:-2], 3, 3)
        positions.append(place)
        orientations.append(turn)
    return torch.stack(positions, dim=-2), torch.stack(orientations, dim=-3)


def end_site_positions_torch(skeleton: Skeleton, channels: Tensor) -> Tensor:
    """Positions of the End Sites, shape (..., T, E, 3); see :func:`forward_kinematics_torch`."""
    positions, orientations = forward_kinematics_torch(skeleton, channels)
    parents = torch.tensor(skeleton.end_site_parents, device=channels.device)
    offsets = torch.tensor(skeleton.end_site_offsets).to(channels)[..., None]
    return positions[..., parents, :] + (orientations[..., parents, :, :] @ offsets)[..., 0]


def _translations(skeleton: Skeleton, channels: Tensor) -> Tensor:
    """Joints relative to their parents, shape (..., T, J, 3)."""
    offsets = torch.tensor(skeleton.offsets).to(channels)
    flat = offsets.reshape(-1).expand(*channels.shape[:-1], -1)  # (..., T, 3 J)
    moved = [c for c, turns in enumerate(skeleton.is_rotation.tolist()) if not turns]
    if moved:
        # Offsets and channels side by side; then each coordinate is picked from one of them.
        pick = list(range(flat.shape[-1]))
        for channel in moved:
            axis = "XYZ".index(skeleton.channel_kind[channel][0])
            pick[3 * int(skeleton.channel_joint[channel]) + axis] = flat.shape[-1] + channel
        chosen = torch.tensor(pick, device=channels.device)
        flat = torch.cat([flat, channels], dim=-1).index_select(-1, chosen)
    return flat.reshape(*channels.shape[:-1], -1, 3)


def _local_rotations(skeleton: Skeleton, channels: Tensor) -> list[Tensor | None]:
    """Rotations relative to the parents, each (..., T, 3, 3); None where nothing turns."""
    turns: list[Tensor | None] = [None] * skeleton.n_joints
    by_channel: dict[int, Tensor] = {}
    for axis in "XYZ":  # all turns about one axis at once
        columns = [c for c, kind in enumerate(skeleton.channel_kind) if kind == f"{axis}rotation"]
        chosen = torch.tensor(columns, dtype=torch.long, device=channels.device)
        matrices = _axis_matrices(axis, channels.index_select(-1, chosen))
        by_channel |= dict(zip(columns, matrices.unbind(dim=-3), strict=True))
    for channel in sorted(by_channel):  # file order, which is the order of the product
        joint = int(skeleton.channel_joint[channel])
        before = turns[joint]
        turns[joint] = by_channel[channel] if before is None else before @ by_channel[channel]
    return turns


def _axis_matrices(axis: str, angles_deg: Tensor) -> Tensor:
    """Rotations about one axis, shape (..., 3, 3), by angles of shape (...)."""
    angle = torch.deg2rad(angles_deg)
    cosine, sine = torch.cos(angle), torch.sin(angle)
    one, zero = torch.ones_like(angle), torch.zeros_like(angle)
    rows = {
        "X": [one, zero, zero, zero, cosine, -sine, zero, sine, cosine],
        "Y": [cosine, zero, sine, zero, one, zero, -sine, zero, cosine],
        "Z": [cosine, -sine, zero, sine, cosine, zero, zero, zero, one],
    }[axis]
    return torch.stack(rows, dim=-1).reshape(*angle.shape, 3, 3)
