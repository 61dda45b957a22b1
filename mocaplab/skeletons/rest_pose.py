"""Skeletons at rest, that is, with nothing turned: compare two before joining them."""

from __future__ import annotations

import numpy as np

from mocaplab.motion import FloatArray, Skeleton


def rest_positions(skeleton: Skeleton) -> FloatArray:
    """Positions of the joints at rest, shape (J, 3), the root at zero."""
    rest = skeleton.offsets.copy()
    rest[0] = 0.0
    for joint, parent in enumerate(skeleton.parents.tolist()):
        if parent >= 0:
            rest[joint] += rest[parent]
    return rest


def ancestors(skeleton: Skeleton, joint: int) -> list[int]:
    """List the joint, its parent, and so on up to the root."""
    chain = [joint]
    while skeleton.parents[chain[-1]] >= 0:
        chain.append(int(skeleton.parents[chain[-1]]))
    return chain


def check_rest_poses(
    source: Skeleton, target: Skeleton, pairs: dict[int, int], tolerance_deg: float
) -> None:
    """Refuse two skeletons whose bones point different ways at rest.

    Compared is the way from each mapped joint to the next mapped joint above it.

    Parameters
    ----------
    source, target : Skeleton
    pairs : dict from joints of the target to joints of the source
    tolerance_deg : float, degrees

    Raises
    ------
    ValueError
        For the first bone that points further away than that.
    """
    here, there = rest_positions(target), rest_positions(source)
    for joint, followed in pairs.items():
        above = next((a for a in ancestors(target, joint)[1:] if a in pairs), None)
        if above is None or pairs[above] not in ancestors(source, followed):
            continue  # the root, or a map that regrows the tree: there is no bone to compare
        a, b = here[joint] - here[above], there[followed] - there[pairs[above]]
        lengths = np.linalg.norm(a) * np.linalg.norm(b)
        if lengths == 0:
            continue  # a joint on top of another points nowhere
        angle = np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b))
        if not angle <= tolerance_deg:
            raise ValueError(
                f"the rest poses differ: from {target.joint_names[above]!r} to "
                f"{target.joint_names[joint]!r} the target points {angle:.0f} degrees away from "
                f"the motion's skeleton, expected at most {tolerance_deg:g}"
            )


def leg_ratio(source: Skeleton, target: Skeleton, pairs: dict[int, int]) -> float:
    """Divide the target's length of leg by the source's.

    The leg is the bones between the root and the mapped joint that lies lowest at rest in
    the source, Y being up.

    Raises
    ------
    ValueError
        If there is no such leg.
    """
    heights = rest_positions(source)[:, 1]
    foot = min(pairs, key=lambda joint: heights[pairs[joint]])
    top = pairs[0]
    lengths = [
        sum(float(np.linalg.norm(skeleton.offsets[j])) for j in chain)
        for skeleton, chain in (
            (target, ancestors(target, foot)[:-1]),
            (
                source,
                [j for j in ancestors(source, pairs[foot]) if j not in ancestors(source, top)],
            ),
        )
    ]
    if min(lengths) == 0:
        raise ValueError(
            "expected a leg to scale the root's path by, got none: no mapped joint lies below "
            "the root at rest; give scale"
        )
    return lengths[0] / lengths[1]
