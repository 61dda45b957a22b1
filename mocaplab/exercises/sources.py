"""Checks for the exercises of notebook 09, two sources: see :mod:`mocaplab.exercises`."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from mocaplab.exercises.answers import (
    NOT_YET,
    NOTHING,
    as_array,
    as_number,
    call,
    not_a_number,
    short,
)
from mocaplab.motion import FloatArray
from mocaplab.quaternions import quaternion_multiply, rotation_vector_to_quaternion, slerp
from mocaplab.rotations import euler_to_quaternion, quaternion_to_euler
from mocaplab.two_sources.baselines import quaternion_distance

Fuse = Callable[[FloatArray, FloatArray], FloatArray]

SAME_ROTATION_DEG = 0.05  # two that are no further apart count as one: rounding does less


def _turned(start: FloatArray, *vector_deg: float) -> FloatArray:
    """Turn a rotation on by a rotation vector in degrees."""
    return quaternion_multiply(start, rotation_vector_to_quaternion(np.radians(vector_deg)))


_HERE = rotation_vector_to_quaternion([0.7, -0.4, 1.1])
_ANGLE_CASES = (
    (_HERE, _turned(_HERE, 0, 24, 32)),  # 40 degrees apart
    (_HERE, -_turned(_HERE, 0, 24, 32)),
    (_HERE, _turned(_HERE, 170, 0, 0)),
    (1.000000000001 * _HERE, _HERE),  # as rounding leaves it: the product is above 1
)
_MEAN_CASES = (
    (_HERE, _turned(_HERE, 20, 60, -10), 1.0, 4.0),
    (_turned(_HERE, 20, 60, -10), -_HERE, 9.0, 1.0),
    (_HERE, -_turned(_HERE, -30, 5, 40), 2.0, 2.0),
)


def check_quaternion_angle(answer: Any) -> str:
    """Check ``f(p, q)``: degrees from one rotation to another, both unit quaternions, w first."""
    if answer is None:
        return NOT_YET
    for p, q in _ANGLE_CASES:
        result, problem = call(answer, p.copy(), q.copy())
        if problem:
            return problem
        if result is None:
            return NOTHING
        array = as_array(result)
        if array is not None and array.size == 1 and np.isnan(array).all():
            return (
                "For a rotation and itself you answer NaN: rounding may leave a product a little "
                "above 1, and no angle has such a cosine. Cut it at 1."
            )
        got = as_number(result)
        if got is None:
            return not_a_number(result)
        dot = float(np.sum(p * q))
        right = math.degrees(2 * math.acos(min(abs(dot), 1.0)))
        if math.isclose(got, right, rel_tol=1e-4, abs_tol=1e-3):
            continue
        return f"For two rotations {right:.0f} degrees apart you answer {got:.4g}. " + _angle_hint(
            got, p, q
        )
    return "Right: twice the angle whose cosine is the size of the product."


def _angle_hint(got: float, p: FloatArray, q: FloatArray) -> str:
    dot = float(np.clip(np.sum(p * q), -1, 1))
    half, signed = math.acos(abs(dot)), math.acos(dot)
    hints = [
        (math.degrees(half), "A quaternion holds half the angle: take it twice."),
        (2 * half, "That is in radians."),
        (half, "That is in radians, and a quaternion holds half the angle: take it twice."),
        (math.degrees(2 * signed), "Here q came as -q, the same rotation: look at |p . q|."),
        (abs(dot), "That is the cosine of half the angle. Turn it into an angle."),
        (1 - abs(dot), "1 - |p . q| is a distance, but no angle: what has the cosine |p . q|?"),
        (float(np.abs(p - q).sum()), "That is the L1 distance of paper B, not an angle."),
        (float(np.linalg.norm(p - q)), "That is the length of p - q, not an angle."),
    ]
    for value, hint in hints:
        if math.isclose(got, value, rel_tol=1e-3, abs_tol=1e-6):
            return hint
    return "The product of the two, p . q, is the cosine of half the angle, but for its sign."


def check_joined_signs(answer: Any) -> str:
    """Check ``f(quaternions)``, shape (T, 4): the same rotations, with signs that do not jump."""
    if answer is None:
        return NOT_YET
    given = _jumping()
    result, problem = call(answer, given.copy())
    if problem:
        return problem
    if result is None:
        return NOTHING
    got = as_array(result)
    if got is None or got.shape != given.shape:
        what = short(result) if got is None else f"shape {got.shape}"
        return f"Return an array of the shape that came, {given.shape}, not {what}."
    if not np.allclose(np.abs(got), np.abs(given), atol=1e-6):
        return "Every frame must stay q or become -q. Yours has other numbers."
    if not np.allclose(np.abs(np.sum(got * given, axis=-1)), 1.0, atol=1e-6):
        return (
            "You changed the sign of single numbers, which makes another rotation. All four "
            "change together, or none."
        )
    jumps = int(np.sum(np.sum(got[1:] * got[:-1], axis=-1) < 0))
    if not jumps:
        return "Right: the same rotations, and no jump."
    for wrong, hint in _wrong_signs(given):
        if np.allclose(got, wrong, atol=1e-6):
            return f"{jumps} jumps are left. {hint}"
    return f"{jumps} jumps are left: frames whose product with the frame before is below 0."


def _jumping() -> FloatArray:
    """Make a joint that turns by more than a full turn, told with jumping signs, (45, 4)."""
    steps = np.arange(45)
    turn = np.radians(10.0 * steps)[:, None] * [0.6, 0.0, 0.8]
    path = quaternion_multiply(_HERE, rotation_vector_to_quaternion(turn))
    flipped = np.isin(steps % 11, (3, 4, 5, 8))  # runs of one frame, and of three
    return np.where(flipped[:, None], -path, path)


def _wrong_signs(q: FloatArray) -> list[tuple[FloatArray, str]]:
    """List what typical wrong rules make of quaternions, each with its hint."""

    def where_negative(product: FloatArray) -> FloatArray:
        return np.where(product[:, None] < 0, -q, q)

    raw = np.concatenate([[1.0], np.sum(q[1:] * q[:-1], axis=-1)])
    return [
        (q, "You changed nothing."),
        (where_negative(q[:, 0]), "Where w itself passes through 0, w >= 0 makes a jump."),
        (
            where_negative(np.sum(q * q[0], axis=-1)),
            "The joint turns further than half a turn. Compare each frame with the one before.",
        ),
        (
            where_negative(raw),
            "Compare with the frame before as it is after your change, not as it came.",
        ),
        (np.where(raw[:, None] < 0, q, -q), "The test is turned round: a jump is below 0."),
    ]


def check_trusting_mean(answer: Any) -> str:
    """Check ``f(p, q, variance_p, variance_q)``: the mean of two rotations, weighted by trust.

    All means of rotations in use count as right: see :func:`_means`.
    """
    if answer is None:
        return NOT_YET
    for p, q, var_p, var_q in _MEAN_CASES:
        result, problem = call(answer, p.copy(), q.copy(), var_p, var_q)
        if problem:
            return problem
        if result is None:
            return NOTHING
        got = as_array(result)
        if got is None or got.shape != (4,) or not np.isfinite(got).all():
            return f"Return one quaternion, four numbers, not {short(result)}."
        length = float(np.linalg.norm(got))
        if length < 1e-9:
            return "Your mean is 0, which is no rotation. Look at the signs of p and q."
        weight = var_q / (var_p + var_q)  # of p: 1 / var_p over the sum of both
        if not any(_apart_deg(got, m) < SAME_ROTATION_DEG for m in _means(p, q, weight)):
            return f"With variances {var_p:g} and {var_q:g}: " + _mean_hint(got, p, q, var_p, var_q)
        if not math.isclose(length, 1.0, abs_tol=1e-5):
            return f"The direction is right, but its length is {length:.3f}. Divide by the length."
    return "Right: signs first, weights 1 / variance, length 1 last."


def _means(p: FloatArray, q: FloatArray, weight: float) -> list[FloatArray]:
    """Weigh p and q by the sum, by slerp and by the eigenvector of Markley et al. (2007)."""
    near = -q if np.sum(p * q) < 0 else q
    products = weight * np.outer(p, p) + (1 - weight) * np.outer(q, q)
    eigenvector = np.linalg.eigh(products)[1][:, -1]
    return [_unit(weight * p + (1 - weight) * near), slerp(p, near, 1 - weight), eigenvector]


def _mean_hint(got: FloatArray, p: FloatArray, q: FloatArray, var_p: float, var_q: float) -> str:
    weight = var_q / (var_p + var_q)
    std_p, std_q = math.sqrt(var_p), math.sqrt(var_q)
    careless = _unit(weight * p + (1 - weight) * q)
    equal, swapped, by_std = (_means(p, q, w) for w in (0.5, 1 - weight, std_q / (std_p + std_q)))
    euler = [
        euler_to_quaternion(
            weight * quaternion_to_euler(p, order) + (1 - weight) * quaternion_to_euler(q, order),
            order,
        )
        for order in ("ZYX", "XYZ", "ZXY", "YXZ")
    ]
    hints = [
        ([careless], "p and q point apart, so they nearly cancel. Turn one to the other's side."),
        (equal, "You weigh both alike. The source with less variance deserves more."),
        (swapped, "The source with more variance gets more weight. Turn the weights round."),
        (by_std, "You took standard deviations: the best weights go with 1 / variance."),
        (euler, "That is the mean of Euler angles, which is not the rotation in between."),
        ([p, q], "That is one of the two alone. The other one knows something too."),
    ]
    for means, hint in hints:
        if any(_apart_deg(got, mean) < SAME_ROTATION_DEG for mean in means):
            return hint
    return "not the mean. Weigh p and q with 1 / variance, add them, and scale to length 1."


def check_fair_opponent(
    answer: Any,
    opponents: Mapping[str, Fuse],
    pairs: Sequence[tuple[FloatArray, FloatArray, FloatArray]],
) -> str:
    """Check the name of the opponent with the least L1 distance on training pairs.

    ``pairs`` are (a, b, clean), each of shape (T, J, 4).
    """
    if answer is None:
        return NOT_YET
    name = answer.strip() if isinstance(answer, str) else ""
    if name not in opponents:
        return f"The answer is one of {', '.join(map(repr, opponents))}, not {short(answer)}."
    errors = {
        key: float(np.mean([quaternion_distance(f(a, b), c).sum(-1).mean() for a, b, c in pairs]))
        for key, f in opponents.items()
    }
    ranking = sorted(errors, key=lambda key: errors[key])
    place = ranking.index(name)
    if place == 0:
        return f"Right: it leaves {errors[name]:.2f} on the training clips, less than the others."
    told = f"It leaves {errors[name]:.2f} on the training clips, and {place} others leave less. "
    if place == len(ranking) - 1:
        return told + "You found the weakest: small errors are good ones."
    if place == 1:
        return told.replace("1 others leave", "one other leaves") + "Nearly: compare once more."
    return told + "Who beats a weak opponent has shown little."


def _unit(q: FloatArray) -> FloatArray:
    unit: FloatArray = q / np.linalg.norm(q)
    return unit


def _apart_deg(p: FloatArray, q: FloatArray) -> float:
    """Tell the angle between two rotations, exact for small ones."""
    apart = min(np.linalg.norm(_unit(p) - _unit(q)), np.linalg.norm(_unit(p) + _unit(q)))
    return math.degrees(4 * math.asin(min(float(apart) / 2, 1.0)))
