"""What feet do on the ground: slide over it, sink into it.

Both need a skeleton with feet, as :func:`mocaplab.measures.movement.foot_points` does, and raise a
ValueError for any other. The clean motion says where the ground is and when a foot stands; so
a bad motion cannot lift its feet to score well.
"""

from __future__ import annotations

import numpy as np

from mocaplab.measures.angles import check_pair
from mocaplab.measures.movement import foot_contacts, foot_heights, foot_points
from mocaplab.measures.positions import derivative
from mocaplab.motion import Motion


def foot_skate_cm_s(motion: Motion, clean: Motion, *, cm_per_unit: float) -> float:
    """Mean horizontal speed of feet while they should stand.

    A foot should stand where :func:`mocaplab.measures.movement.foot_contacts` says so of the clean
    motion, now and a step later (:func:`mocaplab.measures.positions.derivative`). The heel may
    rise meanwhile: of the ball and the tip of the foot, the one that is slower in the clean
    motion is looked at. So the clean motion itself slides a little, too.

    Parameters
    ----------
    motion, clean : Motion
        Of one skeleton, length and frame time, without gaps; ValueError otherwise.
    cm_per_unit : float, centimetres in one file unit

    Returns
    -------
    float, centimetres of slide per second of contact
        NaN if no foot ever stands: it is not known whether one would have slid.
    """
    check_pair(motion, clean)
    speed_cm_s, clean_cm_s = (
        np.linalg.norm(derivative(path, 1, clean.frame_time), axis=-1) * cm_per_unit
        for path in (foot_points(each)[:, :, 1:, [0, 2]] for each in (motion, clean))
    )  # (T - step, 2, 2): left and right, ball and tip
    contacts = foot_contacts(clean, cm_per_unit=cm_per_unit)
    step = len(contacts) - len(speed_cm_s)
    stands = contacts[:-step] & contacts[step:]
    point = np.argmin(clean_cm_s, axis=-1)[..., None]
    slide_cm_s = np.take_along_axis(speed_cm_s, point, axis=-1)[..., 0]
    return float(slide_cm_s[stands].mean()) if stands.any() else np.nan


def ground_penetration_cm(motion: Motion, clean: Motion, *, cm_per_unit: float) -> float:
    """Mean depth of the feet below the ground; a foot above it has depth 0.

    The depth is that of the lowest of ankle, ball and tip; the mean is over all frames and
    both feet. The ground is at the height below which the lower foot of the clean motion is
    in a twentieth of all frames, as for :func:`mocaplab.measures.movement.foot_contacts`; so the
    clean motion itself sinks in a little, too.

    Parameters
    ----------
    motion, clean : Motion
    cm_per_unit : float

    Returns
    -------
    float, centimetres
    """
    check_pair(motion, clean)
    ground = np.percentile(foot_heights(clean).min(axis=1), 5)
    depth = np.maximum(0.0, ground - foot_heights(motion))
    return float(depth.mean() * cm_per_unit)
