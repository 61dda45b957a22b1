"""Noise of cheap pose trackers on quaternions: paper B's N = B + I + L.

Bias B: a constant error of each joint. Imprecision I: a small error, new in every frame.
Lost tracking L: in a few frames a joint is not recognised and could be anything. The
noise is added to the four numbers of a quaternion (paper B, Eq. 3-12).

The paper leaves some of it open. Here B is drawn once for each joint and number, I anew in
each frame, and a lost frame hits all four numbers of one joint. Results are scaled back
to length 1, which the sum is not.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import ArrayLike

from mocaplab.euler import align_to
from mocaplab.motion import FloatArray, Motion, moving_channels
from mocaplab.noise.angular import check_amount
from mocaplab.poses import motion_to_quaternions, quaternions_to_channels
from mocaplab.quaternions import align_hemisphere, as_quaternion


@dataclass(frozen=True)
class SourceNoise:
    """The seven parameters of paper B's noise, with its values.

    The size of each part is itself drawn once a motion, from a Gaussian with the given mean
    and standard deviation, so that no two motions are spoilt alike. All sizes are in parts
    of a unit quaternion: 0.005 in each number is about 1 degree of rotation.

    Raises
    ------
    ValueError
        If one is negative or not finite, or the probability is over 1.
    """

    bias_mean: float = 0.005  # mu_B
    bias_std: float = 0.002  # sigma_B
    imprecision_mean: float = 0.005  # mu_I
    imprecision_std: float = 0.002  # sigma_I
    lost_mean: float = 1.0  # mu_L
    lost_std: float = 0.01  # sigma_L
    lost_probability: float = 0.01  # p_L, per joint and frame

    def __post_init__(self) -> None:
        for field in fields(self):
            largest = 1 if field.name == "lost_probability" else 100
            check_amount(getattr(self, field.name), largest, field.name)

    def scaled(self, amount: float) -> SourceNoise:
        """Return the noise ``amount`` times as bad.

        Bias and imprecision become so many times larger, and lost frames so many times as
        frequent. How far a lost joint is off stays: it could already be anything.
        """
        check_amount(amount, 100, "the amount of source noise")
        return replace(
            self,
            bias_mean=amount * self.bias_mean,
            bias_std=amount * self.bias_std,
            imprecision_mean=amount * self.imprecision_mean,
            imprecision_std=amount * self.imprecision_std,
            lost_probability=min(amount * self.lost_probability, 1.0),
        )


def source_noise(
    quaternions: ArrayLike, noise: SourceNoise, *, rng: np.random.Generator
) -> FloatArray:
    """Add bias, imprecision and lost tracking to rotations (paper B, Eq. 3-12).

    Parameters
    ----------
    quaternions : array, shape (T, J, 4), unit quaternions, w first
        NaN where a rotation is unknown; it stays NaN.
    noise : SourceNoise
    rng : numpy.random.Generator

    Returns
    -------
    array, shape (T, J, 4), unit quaternions
        Each in the hemisphere of the clean one, whose signs are first made not to jump over
        time (:func:`mocaplab.quaternions.align_hemisphere`).

    Raises
    ------
    ValueError
        If the shape is another, or a length is not 1.
    """
    clean = as_quaternion(quaternions)
    if clean.ndim != 3:
        raise ValueError(f"expected quaternions of shape (T, J, 4), got {clean.shape}")
    clean = align_hemisphere(clean)
    # The sign of a size does not matter: it is the deviation of a symmetric Gaussian.
    theta_bias = rng.normal(noise.bias_mean, noise.bias_std)
    theta_imprecision = rng.normal(noise.imprecision_mean, noise.imprecision_std)
    theta_lost = rng.normal(noise.lost_mean, noise.lost_std)
    bias = theta_bias * rng.normal(size=clean.shape[1:])  # (J, 4), the same in all frames
    imprecision = theta_imprecision * rng.normal(size=clean.shape)
    is_lost = rng.random((*clean.shape[:2], 1)) < noise.lost_probability
    lost = is_lost * theta_lost * rng.normal(size=clean.shape)
    noisy = clean + bias + imprecision + lost
    noisy /= np.linalg.norm(noisy, axis=-1, keepdims=True)
    opposite = np.sum(noisy * clean, axis=-1, keepdims=True) < 0
    return np.where(opposite, -noisy, noisy)


def two_sources(
    quaternions: ArrayLike, noise: SourceNoise, *, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """Record the same motion with two trackers: two independent draws of the noise.

    The two also have sizes of bias, imprecision and loss of their own. See
    :func:`source_noise` for parameters and errors.

    Returns
    -------
    two arrays, shape (T, J, 4)
    """
    return source_noise(quaternions, noise, rng=rng), source_noise(quaternions, noise, rng=rng)


def source_noise_motion(motion: Motion, amount: float, *, rng: np.random.Generator) -> Motion:
    """Add paper B's noise to the joints of a motion.

    The angles come back in each joint's Euler order and as near to the motion's own as
    the same rotations allow. The root stays clean, and so do angles that never move: a
    hinge stays a hinge, which is a little kinder than the paper.

    Parameters
    ----------
    motion : Motion
    amount : float in [0, 100]
        1 is the paper's noise; see :meth:`SourceNoise.scaled`.
    rng : numpy.random.Generator

    Raises
    ------
    ValueError
        If a joint has one or two rotation channels, which cannot hold every rotation.
    """
    noise = SourceNoise().scaled(amount)
    noisy = source_noise(motion_to_quaternions(motion), noise, rng=rng)
    channels = motion.channels.copy()
    channels[:, motion.skeleton.is_rotation] = quaternions_to_channels(noisy, motion.skeleton)
    near = align_to(motion.with_channels(channels), motion)
    return motion.with_channels(np.where(moving_channels(motion), near.channels, motion.channels))
