"""The checks of notebook 09: right answers pass, typical wrong ones get their own hint."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mocaplab.exercises.answers import NOT_YET
from mocaplab.exercises.sources import (
    check_fair_opponent,
    check_joined_signs,
    check_quaternion_angle,
    check_trusting_mean,
)
from mocaplab.quaternions import align_hemisphere, slerp
from mocaplab.rotations import euler_to_quaternion, quaternion_to_euler


def rotation(q):
    return Rotation.from_quat(np.roll(q, -1))  # scipy puts w last


def dot(p, q):
    return np.clip(np.sum(p * q), -1, 1)


@pytest.mark.parametrize(
    "angle",
    [
        lambda p, q: np.degrees(2 * np.arccos(min(abs(float(p @ q)), 1.0))),
        lambda p, q: np.degrees((rotation(p).inv() * rotation(q)).magnitude()),
        lambda p, q: [np.degrees(2 * np.arccos(np.abs(dot(p, q))))],
    ],
)
def test_right_angles(angle):
    assert check_quaternion_angle(angle).startswith("Right")


@pytest.mark.parametrize(
    ("angle", "hint"),
    [
        (lambda p, q: np.degrees(np.arccos(abs(dot(p, q)))), "take it twice"),
        (lambda p, q: 2 * np.arccos(abs(dot(p, q))), "radians"),
        (lambda p, q: np.arccos(abs(dot(p, q))), "radians, and a quaternion holds half"),
        (lambda p, q: np.degrees(2 * np.arccos(dot(p, q))), "came as -q"),
        (lambda p, q: abs(dot(p, q)), "cosine of half"),
        (lambda p, q: 1 - abs(dot(p, q)), "no angle"),
        (lambda p, q: np.abs(p - q).sum(), "L1"),
        (lambda p, q: np.linalg.norm(p - q), "length of p - q"),
        (lambda p, q: 12.0, "but for its sign"),
        (lambda p, q: np.nan, "NaN"),
        (lambda p, q: None, "returns nothing"),
        (lambda p, q: "far", "one number"),
        (lambda p, q: p, "one number"),
        (lambda p: p, "TypeError"),
        (40, "function itself"),
    ],
)
def test_wrong_angles(angle, hint):
    assert hint in check_quaternion_angle(angle)


def test_an_angle_that_forgets_about_rounding():
    def angle(p, q):
        with np.errstate(invalid="ignore"):
            return np.degrees(2 * np.arccos(np.abs(np.sum(p * q))))

    assert "Cut it at 1" in check_quaternion_angle(angle)


def join(q):
    q = q.copy()
    for t in range(1, len(q)):
        if q[t] @ q[t - 1] < 0:
            q[t] = -q[t]
    return q


@pytest.mark.parametrize(
    "rule", [join, align_hemisphere, lambda q: -join(q), lambda q: join(q).tolist()]
)
def test_right_signs(rule):
    assert check_joined_signs(rule).startswith("Right")


def against_raw(q):
    return np.array([q[0], *[b if a @ b >= 0 else -b for a, b in pairwise(q)]])


@pytest.mark.parametrize(
    ("rule", "hint"),
    [
        (lambda q: q, "changed nothing"),
        (lambda q: np.where(q[:, :1] < 0, -q, q), "w >= 0 makes a jump"),
        (lambda q: np.where((q @ q[0])[:, None] < 0, -q, q), "the one before"),
        (against_raw, "not as it came"),
        (np.abs, "single numbers"),
        (lambda q: q / 2, "other numbers"),
        (lambda q: q[1:], "shape (44, 4)"),
        (lambda q: np.where((np.arange(len(q)) % 2)[:, None], -q, q), "jumps are left"),
        (lambda q: "joined", "array of the shape"),
        (lambda q: None, "returns nothing"),
        (lambda: 1, "TypeError"),
        ([1], "function itself"),
    ],
)
def test_wrong_signs(rule, hint):
    assert hint in check_joined_signs(rule)


def trusting_mean(p, q, var_p, var_q):
    if np.sum(p * q) < 0:
        q = -q
    m = p / var_p + q / var_q
    return m / np.linalg.norm(m)


def by_slerp(p, q, var_p, var_q):
    return -slerp(p, q, var_p / (var_p + var_q))


def by_scipy(p, q, var_p, var_q):
    both = Rotation.concatenate([rotation(p), rotation(q)])
    return np.roll(both.mean(weights=[1 / var_p, 1 / var_q]).as_quat(), 1)


@pytest.mark.parametrize(
    "rule", [trusting_mean, by_slerp, by_scipy, lambda *x: list(trusting_mean(*x))]
)
def test_right_means(rule):
    assert check_trusting_mean(rule).startswith("Right")


def careless(p, q, var_p, var_q):
    m = p / var_p + q / var_q
    return m / np.linalg.norm(m)


def of_euler_angles(p, q, var_p, var_q):
    weight = var_q / (var_p + var_q)
    angles = weight * quaternion_to_euler(p, "ZYX") + (1 - weight) * quaternion_to_euler(q, "ZYX")
    return euler_to_quaternion(angles, "ZYX")


@pytest.mark.parametrize(
    ("rule", "hint"),
    [
        (careless, "other's side"),
        (of_euler_angles, "Euler"),
        (lambda p, q, a, b: trusting_mean(p, q, b, a), "Turn the weights round"),
        (lambda p, q, a, b: trusting_mean(p, q, 1, 1), "weigh both alike"),
        (lambda p, q, a, b: trusting_mean(p, q, a**0.5, b**0.5), "standard deviations"),
        (lambda p, q, a, b: 3 * trusting_mean(p, q, a, b), "length is 3"),
        (lambda p, q, a, b: p, "one of the two alone"),
        (lambda p, q, a, b: np.eye(4)[1], "not the mean"),
        (lambda p, q, a, b: 0 * p, "is 0"),
        (lambda p, q, a, b: p * np.nan, "four numbers"),
        (lambda p, q, a, b: 7, "four numbers"),
        (lambda p, q, a, b: None, "returns nothing"),
        (lambda p, q: p, "TypeError"),
        ("mean", "function itself"),
    ],
)
def test_wrong_means(rule, hint):
    assert hint in check_trusting_mean(rule)


@pytest.fixture(scope="module")
def pairs():
    rng = np.random.default_rng(0)
    clean = np.zeros((6, 2, 4))
    clean[..., 0] = 1.0
    noise = 0.01 * rng.normal(size=(2, *clean.shape))
    return [(clean + noise[0], clean + 5 * noise[1], clean)]


OPPONENTS = {
    "source A": lambda a, b: a,
    "source B": lambda a, b: b,
    "mean": lambda a, b: (a + b) / 2,
    "four to one": lambda a, b: (4 * a + b) / 5,
}


@pytest.mark.parametrize(
    ("name", "hint"),
    [
        ("source A", "Right: "),
        (" source A ", "Right: "),
        ("source B", "the weakest"),
        ("four to one", "one other leaves less. Nearly"),
        ("mean", "2 others leave less. Who beats a weak"),
        ("Mean", "one of 'source A'"),
        (3, "not 3"),
        (np.zeros(2), "not array"),
    ],
)
def test_fair_opponent(name, hint, pairs):
    assert hint in check_fair_opponent(name, OPPONENTS, pairs)


def test_not_yet(pairs):
    for check in (check_quaternion_angle, check_joined_signs, check_trusting_mean):
        assert check(None) == NOT_YET
    assert check_fair_opponent(None, OPPONENTS, pairs) == NOT_YET
