"""Checks for the exercises of notebook 02 on noise; those on gaps are in ``gap_statistics``.

As in :mod:`mocaplab.exercises`, each returns a sentence that begins with "Right:" only if
the answer is right, and never raises whatever the answer is.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from mocaplab.exercises.answers import (
    NOT_YET,
    NOTHING,
    OTHER_DRAW,
    as_array,
    as_number,
    call,
    known,
    not_a_number,
    short,
)
from mocaplab.kinematics import forward_kinematics
from mocaplab.motion import FloatArray, Motion, moving_channels
from mocaplab.noise.angular import movement_std
from mocaplab.noise.spatial import has_own_place, joints_that_move
from mocaplab.skeletons.units import cm_per_unit

WANTED_DB = 10.0


def check_k_of_snr(answer: Any) -> str:
    """Check which k makes noise of ``WANTED_DB`` decibels."""
    k = as_number(answer)
    if k is None:
        return NOT_YET if answer is None else not_a_number(answer)
    right = 10 ** (-WANTED_DB / 20)
    if math.isclose(k, right, rel_tol=0.02):
        return f"Right: k = {k:.3g} gives {-20 * math.log10(k):.1f} dB."
    if k <= 0:
        return "k is a share of the movement, so it is over 0. A larger k is a lower SNR."
    hints = {
        right**2: "That would be right for powers. k compares standard deviations, and a power "
        "is a deviation squared: so it is 20 log10, not 10 log10.",
        1 / right: "You turned the ratio over: this noise is louder than the movement. The "
        "signal stands on top of the fraction, the noise below.",
        1 / right**2: "You turned the ratio over, and took 10 log10 where deviations need 20.",
        math.exp(-WANTED_DB / 20): "Decibels use the logarithm to base 10: undo it with "
        "10 ** x, not with exp(x).",
    }
    hint = known(k, hints, rel_tol=0.02)
    return hint or f"k = {k:.3g} gives {-20 * math.log10(k):.1f} dB, and {WANTED_DB:g} are wanted."


def check_uniform_noise(answer: Any, clean: Motion) -> str:
    """Check a function (motion, k, rng) that adds uniform noise of k deviations."""
    if answer is None:
        return NOT_YET
    k = 0.5
    first, problem = call(answer, clean, k, np.random.default_rng(5))
    if problem:
        return problem
    again, _ = call(answer, clean, k, np.random.default_rng(5))
    other, _ = call(answer, clean, 0.2, np.random.default_rng(5))
    values = [_channels(result, clean) for result in (first, again, other)]
    if isinstance(values[0], str):
        return values[0]
    noisy, repeated, weaker = (v if not isinstance(v, str) else clean.channels for v in values)
    if not np.array_equal(noisy, repeated):
        return OTHER_DRAW
    error = noisy - clean.channels
    spread, moves = movement_std(clean), moving_channels(clean)
    if np.allclose(error, 0):
        return "Your function changed nothing. Is k used, and the noise added?"
    if not noisy[:, ~clean.skeleton.is_cleaned].any():
        return "You return the noise alone. Add it to motion.channels."
    if np.any(error[:, ~clean.skeleton.is_cleaned]):
        return "The root moved too. Its 6 channels stay clean: their spread must count as 0."
    if np.any(error[:, ~moves]):
        return "Channels that never move got noise. Scale by each channel's own spread, which is 0."
    return _judge_uniform(error[:, moves] / spread[moves], weaker, noisy, clean, k)


def _judge_uniform(
    noise: FloatArray, weaker: FloatArray, noisy: FloatArray, clean: Motion, k: float
) -> str:
    """Judge noise over the spread of its channel, shape (T, channels that move)."""
    size = float(np.sqrt(np.mean(noise**2)))
    per_channel = np.sqrt(np.mean(noise**2, axis=0))
    largest = float(np.abs(noise).max())
    if np.allclose(noise, noise[0]):
        return "Every frame got the same number. Draw one for each frame and channel."
    if np.allclose(noise, noise[:, :1]):
        return "All channels got the same numbers. Draw one for each frame and channel."
    if per_channel.max() > 1.5 * per_channel.min():
        return "The noise does not follow each channel's own spread: take std over axis=0 alone."
    if abs(noise.mean()) > 0.02:
        return (
            f"The noise has a mean of {noise.mean():.2f} deviations: that is a bias. Spread it "
            f"evenly between minus and plus the same number."
        )
    if np.allclose(noisy, weaker):
        return "k = 0.2 and k = 0.5 give the same noise. Multiply by k."
    if largest > 2 * k and math.isclose(size, k, rel_tol=0.03):
        return "The size is right, but this is Gaussian noise: use rng.uniform."
    hints = {
        k / math.sqrt(3): "Your noise lies between -k and +k deviations, but its own standard "
        "deviation is less: numbers spread evenly over -a to a have a / sqrt(3). What must a be?",
        k / math.sqrt(12): "Your noise is one k wide in all. Numbers spread evenly over a width w "
        "have the deviation w / sqrt(12). How wide must it be?",
        k * math.sqrt(3): "You multiplied by 3 where sqrt(3) belongs.",
        2 * k: "You took the whole width on each side: sqrt(12) is from end to end.",
    }
    if math.isclose(size, k, rel_tol=0.015):
        return f"Right: {size:.3f} deviations of each channel, none over {largest:.2f}."
    hint = known(size, hints, rel_tol=0.03)
    return hint or f"The noise has {size:.3f} deviations of its channel; wanted are k = {k}."


def check_noise_left(answer: Any, solved: Motion, clean: Motion) -> str:
    """Check how far joints are off along each axis, RMS in cm, over those that can move."""
    got = as_number(answer)
    if got is None:
        return NOT_YET if answer is None else not_a_number(answer)
    unit = cm_per_unit(clean.skeleton)
    error = (forward_kinematics(solved)[0] - forward_kinematics(clean)[0]) * unit
    moving = error[:, joints_that_move(clean) & has_own_place(clean.skeleton)]
    right = _rms(moving)
    if math.isclose(got, right, rel_tol=0.01):
        return f"Right: {got:.2f} cm along each axis, where 0.50 cm were added."
    angles = (solved.channels - clean.channels)[:, moving_channels(clean)]
    hints = {
        right / unit: "That is in units of the file. One unit is cm_per_unit centimetres.",
        right / unit**2: "You divided by cm_per_unit. Multiply: a unit is longer than 1 cm.",
        right * math.sqrt(3): "That is the RMS distance in space. It adds up three axes; along "
        "each axis it is smaller by sqrt(3). Take the mean over x, y and z too.",
        float(np.linalg.norm(moving, axis=-1).mean()): "That is the mean distance. Square each "
        "coordinate's error, take the mean over all of them, then the root.",
        _rms(error): "You counted joints that cannot move, such as the root. They have no error "
        "and make the mean smaller: choose error[:, moves].",
        _rms(error) / unit: "That is over all joints and in units of the file: choose "
        "error[:, moves], and multiply by cm_per_unit.",
        right**2: "That is the mean square, in square centimetres. Take the root.",
        float(np.mean(np.abs(moving))): "That is the mean absolute error. Square first.",
        float(np.mean(moving)): "Plus and minus cancel in a plain mean. Square first.",
        _rms(angles): "That is the error of the angles, in degrees. Use the positions.",
        0.5: "0.5 cm were added, but the bones absorbed a part of it. Measure what is left.",
    }
    hint = known(got, hints, rel_tol=0.005)
    return hint or f"You got {got:.4g} cm. Positions minus clean positions, squared, mean, root."


def check_bias(answer: Any) -> str:
    """Check a function (q, theta, rng) that adds paper B's bias to quaternions."""
    if answer is None:
        return NOT_YET
    theta, shape = 0.01, (5, 40, 4)
    # All joints at rest: whatever differs then between frames or joints is the noise.
    rest = np.broadcast_to([1.0, 0.0, 0.0, 0.0], shape)
    result, problem = call(answer, rest.copy(), theta, np.random.default_rng(6))
    if problem:
        return problem
    if result is None:
        return NOTHING
    noisy = as_array(result)
    if noisy is None or noisy.shape != shape:
        found = short(result) if noisy is None else f"an array of shape {noisy.shape}"
        return f"For quaternions of shape {shape} you return {found}."
    again, _ = call(answer, rest.copy(), theta, np.random.default_rng(6))
    if not np.array_equal(noisy, np.asarray(again), equal_nan=True):
        return OTHER_DRAW
    return _judge_bias(noisy, theta)


def _judge_bias(noisy: FloatArray, theta: float) -> str:
    """Judge what became of quaternions that were all (1, 0, 0, 0)."""
    if np.array_equal(noisy, np.broadcast_to([1.0, 0.0, 0.0, 0.0], noisy.shape)):
        return "Nothing changed. Is theta used, and the bias added?"
    if np.any(noisy[..., 0] < 0):
        return "This is the bias alone. Add it to the clean quaternions."
    if not np.allclose(np.linalg.norm(noisy, axis=-1), 1):
        return (
            "These are not rotations: their length is not 1. Divide each quaternion by its own "
            "length, np.linalg.norm(..., axis=-1, keepdims=True)."
        )
    bias = noisy[..., 1:] / noisy[..., :1]
    if not np.allclose(bias, bias[:1]):
        return (
            "The error changes from frame to frame: that is imprecision. A bias is drawn once "
            "for each joint and number, shape (J, 4)."
        )
    if np.allclose(bias, bias[:, :1]):
        return "All joints got the same bias. Draw one for each joint: shape (J, 4)."
    if np.allclose(bias, bias[..., :1]):
        return "All numbers of a quaternion got the same bias. Draw shape (J, 4)."
    size = _rms(bias[0])
    if abs(bias[0].mean()) > 0.4 * size:
        return "The bias has one sign only. It is Gaussian around 0, times theta."
    if not 0.75 * theta < size < 1.3 * theta:
        return (
            f"The bias has an RMS of {size:.2g} in each number, and theta is {theta:g}. Is theta "
            f"the standard deviation, once?"
        )
    return f"Right: the same {size:.3f} RMS in every frame, and all lengths are 1."


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _channels(result: Any, clean: Motion) -> FloatArray | str:
    """Read channels from a Motion or an array; a sentence if it is neither."""
    if result is None:
        return NOTHING
    values = as_array(result.channels if isinstance(result, Motion) else result)
    shape = clean.channels.shape
    if values is None or values.shape != shape:
        found = short(result) if values is None else f"an array of shape {values.shape}"
        return f"Return a motion, or its channels of shape {shape}, not {found}."
    return values if np.isfinite(values).all() else "There are NaNs in what your function returns."
