"""Checks and data of the assignment ``rotations``: see :mod:`mocaplab.assignments.grading`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from mocaplab.assignments.contest import Contest, call_or_refuse
from mocaplab.assignments.grading import NotRight, student_rng
from mocaplab.assignments.judges import judge_function, judge_numbers
from mocaplab.exercises.answers import as_array
from mocaplab.motion import FloatArray, moving_channels
from mocaplab.poses import motion_to_quaternions
from mocaplab.quaternions import (
    quaternion_inverse,
    quaternion_multiply,
    quaternion_to_rotation_vector,
    slerp,
)
from mocaplab.rotations import euler_to_matrix, euler_to_quaternion, matrix_to_euler
from mocaplab.synthesis import synthesize

KEY_STEP = 12
"""From key to key are this many frames: 10 keys a second at 120 frames per second."""
_ORDERS = ("ZXY", "YZX", "ZYX", "YXZ", "XZY")


@dataclass(frozen=True)
class RotationWork:
    """A student's own rotations."""

    order: str
    matrix: FloatArray  # (3, 3)
    quaternions: FloatArray  # (T, 4), one joint over time, with signs that jump
    pair: tuple[FloatArray, FloatArray]  # two matrices


def draw_work(student: str) -> RotationWork:
    """Draw the rotations of a student."""
    rng = student_rng(student, "rotations")
    order = str(rng.choice(_ORDERS))
    # Sizes apart from each other, so that no wrong order is right by chance.
    angles = rng.permutation(np.array([24, 40, 56]) + rng.uniform(0, 8, 3))
    angles = angles * rng.choice([-1, 1], 3)
    # More than a whole turn: it leaves the first frame's side, and w passes through 0.
    turn = rng.uniform(-90, 90) + rng.choice([-1, 1]) * np.linspace(0, 520, 80)
    wobble = rng.uniform(10, 30, 2) * np.sin(np.linspace(0, 9, 80)[:, None] + rng.uniform(size=2))
    q = euler_to_quaternion(np.column_stack([turn, wobble]), "ZYX") * rng.choice([-1, 1], (80, 1))
    pair = euler_to_matrix(rng.uniform(-80, 80, (2, 3)), "ZXY")
    return RotationWork(order, euler_to_matrix(np.round(angles, 1), order), q, (pair[0], pair[1]))


# ------------------------------------------------------------------ 1: angles of a matrix


def check_angles(answer: Any, work: RotationWork) -> str:
    """Check Euler angles of a matrix, in degrees, in a given order."""
    order, matrix = work.order, work.matrix
    got = None if answer is None or answer is ... else as_array(answer)
    if got is not None and got.size == 3 and np.isfinite(got).all():
        apart = np.abs(euler_to_matrix(got.ravel(), order) - matrix).max()
        if apart < 0.004:  # a fifth of a degree: any triple of angles that makes this matrix
            return "Right: these angles make your matrix."
    right = matrix_to_euler(matrix, order)
    listed = [float(right[order.index(axis)]) for axis in "XYZ"]
    mistakes = {
        "These are radians. BVH files have degrees.": np.radians(right),
        "The right angles in the wrong places: the first angle belongs to the first letter of "
        "the order, not to X.": np.array(listed),
        "The right angles from back to front: the first letter of the order comes first.": right[
            ::-1
        ],
        "These angles turn the other way round: they make the transposed matrix.": matrix_to_euler(
            matrix.T, order
        ),
        "All signs are the wrong way round.": -right,
        "These are the angles for the order from back to front: the first letter's matrix stands "
        "on the left.": matrix_to_euler(matrix, order[::-1]),
        "These are the angles for the order XYZ.": matrix_to_euler(matrix, "XYZ"),
    }
    return judge_numbers(
        answer,
        right,
        mistakes,
        rtol=0.0,
        atol=0.25,
        otherwise="These angles make another matrix. Test them: "
        "euler_to_matrix(your angles, work.order) should be work.matrix.",
    )


# ------------------------------------------------------------------ 2: how far apart


def check_angle_between(answer: Any, work: RotationWork) -> str:
    """Check a function that returns the angle between two rotations, in degrees."""
    a, b = work.pair
    turn = euler_to_matrix([30.0, 0.0, 0.0], "YXZ")
    cases = {
        "your two matrices": (a, b),
        "30 degrees apart": (a, a @ turn),
        "a rotation and itself": (a, a),
        "a rotation and itself, rounded": (a * (1 + 1e-12), a),
        "half a turn apart": (a, a @ np.diag([1.0, -1.0, -1.0])),
    }

    def cosine(m: FloatArray) -> Any:
        return np.clip((np.trace(m) - 1) / 2, -1, 1)

    mistakes = {
        "These are radians. Give degrees.": lambda a, b: np.arccos(cosine(a.T @ b)),
        "You multiplied the two matrices. The turn from one to the other is the transpose of one "
        "times the other.": lambda a, b: np.degrees(np.arccos(cosine(a @ b))),
        "That is the cosine of the angle. np.arccos undoes it.": lambda a, b: cosine(a.T @ b),
        "The trace of a turn is 1 + 2 cos(angle): take 1 away before you halve it.": lambda a, b: (
            np.degrees(np.arccos(np.clip(np.trace(a.T @ b) / 2, -1, 1)))
        ),
        "That is how far the numbers of the matrices differ, not an angle.": lambda a, b: (
            np.linalg.norm(a - b)
        ),
        "That is half of the angle.": lambda a, b: (
            np.degrees(np.arccos(cosine(a.T @ b))) / 2
        ),
    }  # fmt: skip
    return judge_function(
        answer,
        cases,
        lambda a, b: np.degrees(np.arccos(cosine(a.T @ b))),
        mistakes,
        rtol=1e-6,
        atol=1e-3,
        nan_hint="Rounding pushes the cosine beyond 1: keep it between -1 and 1 (np.clip).",
    )


# ------------------------------------------------------------------ 3: signs of quaternions


def check_same_side(answer: Any, work: RotationWork) -> str:
    """Check a function that makes the signs of quaternions follow each other, shape (T, 4)."""
    cases = {"your joint": (work.quaternions,), "one frame": (work.quaternions[:1],)}

    def right(q: FloatArray) -> Any:
        dots = np.sum(q[1:] * q[:-1], axis=1)
        signs = np.cumprod(np.concatenate([[1.0], np.where(dots < 0, -1.0, 1.0)]))
        return q * signs[:, None]

    def by(reference: FloatArray, q: FloatArray) -> Any:
        return np.where(np.sum(q * reference, axis=1, keepdims=True) < 0, -q, q)

    mistakes: dict[str, Callable[..., Any]] = {
        "Nothing has changed. Where two neighbours have a product below 0, one needs the other "
        "sign.": lambda q: q,
        "You compare each quaternion with its neighbour as it was. Compare with the neighbour "
        "after it was corrected: one change of sign goes on to the end.": lambda q: by(
            np.concatenate([q[:1], q[:-1]]), q
        ),
        "You compare all with the first frame. A joint that turns far leaves that side; compare "
        "with the frame before.": lambda q: by(q[:1], q),
        "You made w positive everywhere. Where a joint turns by more than half a turn, w passes "
        "through 0, and the sign jumps.": lambda q: np.where(q[:, :1] < 0, -q, q),
        "Absolute values make another rotation of it. A quaternion changes its sign as a "
        "whole.": np.abs,
    }
    return judge_function(answer, cases, (right, lambda q: -right(q)), mistakes)


# ------------------------------------------------------------------ 4: slerp


def check_slerp(answer: Any, work: RotationWork) -> str:
    """Check a function (start, end, t) that turns evenly from one quaternion to another."""
    a = euler_to_quaternion([10.0, 20.0, -30.0], "ZYX")
    b = quaternion_multiply(a, euler_to_quaternion([0.0, 110.0, 0.0], "ZYX"))
    cases = {
        "t = 0.2": (a, b, 0.2),
        "t = 0.7": (b, a, 0.7),
        "an end with the other sign": (a, -b, 0.2),
        "two equal quaternions": (np.eye(4)[0], np.eye(4)[0], 0.4),
    }

    def long_way(a: FloatArray, b: FloatArray, t: float) -> Any:
        angle = np.arccos(np.clip(a @ b, -1, 1))
        return (np.sin((1 - t) * angle) * a + np.sin(t * angle) * b) / np.sin(angle)

    def near(a: FloatArray, b: FloatArray) -> Any:
        return b if a @ b >= 0 else -b

    def straight(a: FloatArray, b: FloatArray, t: float) -> Any:
        return (1 - t) * a + t * near(a, b)

    def unit(q: FloatArray) -> Any:
        return q / np.linalg.norm(q)

    mistakes = {
        "That is a straight line: its points have no length 1, so they are no rotations.": straight,
        "That is a straight line brought back to length 1. It passes the same places, but not "
        "evenly: slower near the ends.": lambda a, b, t: unit(straight(a, b, t)),
        "You go from the end to the start: t = 0 is the start.": lambda a, b, t: slerp(a, b, 1 - t),
        "You go the long way round. q and -q are one rotation: take the sign of the end that is "
        "nearer to the start.": long_way,
        "A straight line that also goes the long way round.": lambda a, b, t: unit(
            (1 - t) * a + t * b
        ),
    }
    return judge_function(
        answer,
        cases,
        (slerp, lambda a, b, t: -slerp(a, b, t)),
        mistakes,
        atol=1e-6,
        nan_hint="Where both are equal the sine of the angle is 0, and 0 / 0 is NaN. Treat this "
        "case by itself.",
    )


# ------------------------------------------------------------------ beat the score


def slerp_between_keys(keys: FloatArray, step: int) -> Any:
    """Turn evenly from key to key: the answer to beat."""
    at = np.arange((len(keys) - 1) * step + 1) / step
    first = np.minimum(at.astype(int), len(keys) - 2)
    return slerp(keys[first], keys[first + 1], (at - first)[:, None])


def _score_between(answer: Any, seed: int) -> float:
    errors = []
    for number, action in enumerate(("walk", "run", "kick")):
        rng = np.random.default_rng([seed, number])
        motion = synthesize(action, duration_s=2.0, rng=rng, name=action)
        joints = np.unique(motion.skeleton.channel_joint[moving_channels(motion)])
        truth = motion_to_quaternions(motion)[:, joints]
        keys = truth[::KEY_STEP]
        keys = keys * rng.choice([-1.0, 1.0], (*keys.shape[:2], 1))
        result = as_array(call_or_refuse(answer, keys, KEY_STEP))
        if result is None or result.shape != truth.shape:
            shape = "no numbers" if result is None else result.shape
            raise NotRight(
                f"For keys of shape {keys.shape} return the shape {truth.shape}, from the first "
                f"key to the last, not {shape}."
            )
        length = np.linalg.norm(result, axis=-1, keepdims=True)
        if not np.allclose(length, 1, atol=0.01):
            raise NotRight("Your quaternions have not the length 1.")
        turn = quaternion_multiply(quaternion_inverse(truth), result / length)
        vector = quaternion_to_rotation_vector(turn)
        errors.append(np.degrees(np.linalg.norm(vector, axis=-1)).mean())
    return float(np.mean(errors))


CONTEST = Contest("rotations", "degrees", _score_between, slerp_between_keys, goal=0.85)
