"""Set the feet of a motion on the floor: not above it, not through it, not sliding.

Angles drawn from a model, or averaged, or cleaned, are each a little wrong, and at the end
of a leg the errors add up: the feet float and skate. Here the angles are left alone and
the root is moved instead, first up and down until the lower foot meets the floor, then
along the floor at the speed at which the foot that stands stands still. That is how
walking works: the foot holds, and the body travels over it.
"""

from __future__ import annotations

import numpy as np

from mocaplab.measures.movement import foot_points
from mocaplab.motion import FloatArray, Motion
from mocaplab.motion_model import CM_PER_UNIT

CONTACT_CM = 2.0  # a foot at this height counts as standing with weight exp(-1)
MISMATCH_CM_S = 40.0  # as does one whose speed differs by this much from the one expected
STIFFNESS = 100.0  # how reluctantly the correction of the height bends


def place_feet(motion: Motion, velocity: FloatArray, *, airborne_s: float) -> Motion:
    """Move the root so that feet touch the floor, y = 0, and stand still while they do.

    Parameters
    ----------
    motion : Motion, on a CMU skeleton
        Its path along the floor is not looked at.
    velocity : array, shape (T, 2), file units / s
        Expected velocity of the root along x and z. It decides alone while both feet are
        in the air, and it helps to tell which foot stands.
    airborne_s : float, seconds
        Within this time of every frame some foot touches the floor; 0 if one always does.

    Returns
    -------
    Motion
        The same angles; the path starts at x = z = 0.
    """
    channels = motion.channels.copy()
    feet = foot_points(motion)  # (T, 2, 3, 3)
    low = feet[..., 1].min(axis=(1, 2))
    rise = height_correction(low, contact_weights(low, round(airborne_s / motion.frame_time)))
    channels[:, 1] += rise
    feet[..., 1] += rise[:, None, None]
    velocity = stance_velocity(feet, velocity, motion.frame_time)
    path = np.cumsum(velocity, axis=0) * motion.frame_time
    channels[:, [0, 2]] = path - path[0]
    return motion.with_channels(channels)


def contact_weights(low: FloatArray, radius: int) -> FloatArray:
    """Weigh how surely the lower foot touches the floor.

    Parameters
    ----------
    low : array, shape (T,), file units
        Height of the lowest point of both feet.
    radius : int, frames
        The lowest of that many frames before and after is taken to be on the floor.

    Returns
    -------
    array, shape (T,), between 0 and 1
    """
    padded = np.pad(low, radius, constant_values=np.inf)
    nearby = np.lib.stride_tricks.sliding_window_view(padded, 2 * radius + 1).min(axis=1)
    return np.asarray(np.exp(-(((low - nearby) * CM_PER_UNIT / CONTACT_CM) ** 2)))


def height_correction(low: FloatArray, weights: FloatArray) -> FloatArray:
    """Find the smooth correction of the root's height that brings feet to the floor.

    This is Whittaker's smoother: the correction r makes the sum of

        weights * (low + r)^2  +  STIFFNESS * (second differences of r)^2

    as small as it can be. Where the weights are 0, in flight, only the second term counts
    and r is a cubic between the contacts before and after.

    Parameters
    ----------
    low, weights : array, shape (T,)

    Returns
    -------
    array, shape (T,), file units
    """
    from scipy.linalg import solveh_banded

    n = len(low)
    if n < 3:  # no second differences
        return np.full(n, -low.min())
    # The upper three bands of D' D, where D takes second differences.
    bands = np.zeros((3, n))
    bands[0, 2:] = 1.0
    bands[1, 1:] = np.convolve(np.ones(n - 2), [-2.0, -2.0])
    bands[2] = np.convolve(np.ones(n - 2), [1.0, 4.0, 1.0])
    bands *= STIFFNESS
    bands[2] += weights + 1e-6  # so that one contact in all suffices
    return np.asarray(solveh_banded(bands, -weights * low))


def stance_velocity(feet: FloatArray, expected: FloatArray, frame_time: float) -> FloatArray:
    """Find the velocity along the floor at which a foot on the floor stands still.

    Parameters
    ----------
    feet : array, shape (T, 2, 3, 3), from ``foot_points``, for a root that stays in place
    expected : array, shape (T, 2), units / s, used where no foot is on the floor
    frame_time : float, seconds

    Returns
    -------
    array, shape (T, 2), x and z, units / s
    """
    from scipy.ndimage import gaussian_filter1d

    if len(feet) < 2:
        return expected
    points = feet[:, :, 1:].reshape(len(feet), 4, 3)  # balls and toe tips
    height_cm = points[..., 1] * CM_PER_UNIT
    backward = -np.gradient(points[..., [0, 2]], frame_time, axis=0)
    # A point that is low but would need another speed than the expected is not standing: a
    # toe that lifts off, or a toe before the heel (which has no point of its own) rolls.
    mismatch = np.linalg.norm(backward - expected[:, None], axis=-1) * CM_PER_UNIT / MISMATCH_CM_S
    weight = np.exp(-((height_cm.clip(0.0) / CONTACT_CM) ** 2) - mismatch**2)
    total = weight.sum(axis=1)[:, None]
    standing = (weight[..., None] * backward).sum(axis=1) / total.clip(1e-12)
    trust = total / (total + 0.1)
    velocity = trust * standing + (1 - trust) * expected
    return np.asarray(gaussian_filter1d(velocity, 3.0, axis=0, mode="nearest"))
