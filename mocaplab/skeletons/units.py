"""Which length unit a file uses: BVH does not say, but a body has a size."""

from __future__ import annotations

import numpy as np

from mocaplab.motion import Skeleton
from mocaplab.skeletons.rest_pose import ancestors, rest_positions

CM_PER_UNIT_OF = {
    "millimetre": 0.1,
    "centimetre": 1.0,
    "inch": 2.54,
    "CMU's unit": 2.54 / 0.45,
    "metre": 100.0,
}
"""Centimetres in one unit, for the units that files come in."""

LEG_CM = (75.0, 135.0)
"""A leg, hip and foot included, is this long; the two units nearest to each other differ by
a factor of 2.2, so no length fits two of them."""


def leg_length(skeleton: Skeleton) -> float:
    """Length of the bones from the root to the joint that is lowest at rest, Y being up.

    Returns
    -------
    float, file length units

    Raises
    ------
    ValueError
        If no joint lies below the root.
    """
    heights = rest_positions(skeleton)[:, 1]
    leg = ancestors(skeleton, int(np.argmin(heights)))[:-1]
    if heights.min() >= heights[0]:
        raise ValueError("expected a leg, got no joint below the root at rest (Y is up)")
    return float(np.linalg.norm(skeleton.offsets[leg], axis=1).sum())


def cm_per_unit(skeleton: Skeleton) -> float:
    """Find how long the unit of a file is, from the length of the leg.

    Tried are millimetres, centimetres, inches, CMU's unit (2.54 / 0.45 cm) and metres. A file
    in yet another unit, or of a giant, is refused only if its leg fits none of these.

    Parameters
    ----------
    skeleton : Skeleton of a person, Y being up

    Returns
    -------
    float, centimetres in one unit

    Raises
    ------
    ValueError
        If the leg has a person's length, ``LEG_CM``, in none of these units.
    """
    length = leg_length(skeleton)
    low, high = LEG_CM
    for factor in CM_PER_UNIT_OF.values():
        if low <= length * factor <= high:
            return factor
    tried = ", ".join(f"{length * f:.4g} cm in {unit}s" for unit, f in CM_PER_UNIT_OF.items())
    raise ValueError(
        f"expected a leg of {low:g} to {high:g} cm, got {length:.4g} file units, which are "
        f"{tried}; pass cm_per_unit, the "
        f"number of centimetres in one file unit"
    )
