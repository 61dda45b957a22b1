"""The checks of notebook 01 accept right answers and meet each typical mistake with its hint."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mocaplab.doctor import diagnose
from mocaplab.euler import alternate_euler, wrap_degrees
from mocaplab.exercises.answers import NOT_YET
from mocaplab.exercises.bvh import (
    check_channel_value,
    check_end_sites,
    check_mystery,
    check_rotation,
    check_switches,
    check_unwrap,
    mystery_clip,
)
from mocaplab.motion import Motion, Skeleton
from mocaplab.rotations import axis_angle_to_matrix, euler_to_matrix, matrix_to_euler


@pytest.fixture(scope="module")
def arm():
    skeleton = Skeleton(
        joint_names=("Shoulder", "Elbow", "Wrist"),
        parents=[-1, 0, 1],
        offsets=[[0, 0, 0], [30, 0, 0], [25, 0, 0]],
        channel_names=(
            ("Xposition", "Yposition", "Zposition", "Zrotation", "Xrotation", "Yrotation"),
            ("Zrotation", "Xrotation", "Yrotation"),
            ("Xrotation", "Yrotation", "Zrotation"),
        ),
        end_site_parents=[2],
        end_site_offsets=[[10, 0, 0]],
    )
    frames = np.array(
        [
            [0, 140, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0],
            [0, 140, 0, -60, 0, 0, 90, 0, 0, 0, 0, 0],
            [5, 142, 3, -40, 10, 25, 70, -15, 8, 12, 30, -20],
            [5, 144, 6, -20, 5, 35, 40, -35, 14, 22, 45, -10],
        ]
    )
    return Motion(skeleton, 0.5, frames)


@pytest.fixture(scope="module")
def right_arm(embedded):
    """The right arm of a walk in the order XZY, which switches branches and wraps."""
    walk = embedded["walk_38"]
    columns = [i for i, name in enumerate(walk.skeleton.channel_labels) if "RightArm." in name]
    return matrix_to_euler(euler_to_matrix(walk.channels[:, columns], "ZYX"), "XZY")


def test_no_answer_yet(arm, right_arm):
    assert check_channel_value(None, arm, "Wrist.Yrotation", 2) == NOT_YET
    assert check_end_sites(None, arm) == NOT_YET
    assert check_switches(None, right_arm, "XZY") == NOT_YET
    for check in (check_rotation, check_unwrap, check_mystery):
        assert check(None) == NOT_YET


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (30, "Right: 30"),
        ([30.0], "Right: 30"),
        (np.float32(30), "Right: 30"),
        (-20, "Every joint has an order"),  # read as Z X Y, like the other joints
        (12, "Every joint has an order"),
        (-15, "is Elbow.Xrotation"),
        (142, "six numbers for the root"),
        (0, "not frame 2"),  # frame 2, counted from 1
        (45, "not frame 2"),
        (40, "Frames count from 0"),
        (0.5236, "in degrees"),
        ("thirty", "one number"),
        ({}, "one number"),
        (np.nan, "one number"),
        ([30, 12], "one number"),
    ],
)
def test_channel_value(arm, answer, words):
    assert words in check_channel_value(answer, arm, "Wrist.Yrotation", 2)


def product(angles_deg, order, multiply=np.matmul, to_radians=np.radians):
    result = axis_angle_to_matrix(order[0], to_radians(angles_deg[0]))
    for axis, angle in zip(order[1:], angles_deg[1:], strict=True):
        result = multiply(result, axis_angle_to_matrix(axis, to_radians(angle)))
    return result


def scipy_matrix(angles_deg, order):
    return Rotation.from_euler(order, angles_deg, degrees=True).as_matrix()


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (euler_to_matrix, "Right"),
        (scipy_matrix, "Right"),
        (lambda a, o: product(a, o).tolist(), "Right"),
        (lambda a, o: scipy_matrix(a, o.lower()), "other way round"),
        (lambda a, o: product(a, o, to_radians=float), "radians, and you gave them degrees"),
        (lambda a, o: product(np.radians(a), o), "radians twice"),
        (lambda a, o: scipy_matrix(a, "XYZ"), "Right for XYZ alone"),
        (lambda a, o: product(a, "ZXY"), "Right for ZXY alone"),
        (lambda a, o: product([a["XYZ".index(axis)] for axis in o], o), "first letter"),
        (lambda a, o: product(-a, o), "wrong way round"),
        (lambda a, o: product(a, o).T, "transpose"),
        (lambda a, o: product(a, o, np.multiply), "product of matrices is @"),
        (lambda a, o: np.ones((3, 3)), "no rotation"),
        (lambda a, o: np.eye(3), "not this one"),
        (lambda a, o: np.eye(2), "shape (2, 2)"),
        (lambda a, o: None, "end with return"),
        (lambda a, o: "R", "finite numbers"),
        (lambda a, o: np.full((3, 3), np.nan), "finite numbers"),
        (lambda a: a, "stopped with TypeError"),
        (np.eye(3), "the function itself"),
    ],
)
def test_rotation(answer, words):
    assert words in check_rotation(answer)


def turned(turns, at, offsets):
    return (turns[:, at] @ offsets[..., None])[..., 0]


def sites_by_loop(positions, turns, skeleton):
    result = np.empty((len(positions), len(skeleton.end_site_parents), 3))
    for e, (joint, offset) in enumerate(
        zip(skeleton.end_site_parents, skeleton.end_site_offsets, strict=True)
    ):
        result[:, e] = positions[:, joint] + turns[:, joint] @ offset
    return result


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (sites_by_loop, "Right"),
        (lambda p, w, s: sites_by_loop(p, w, s).tolist(), "Right"),
        (lambda p, w, s: p[:, s.end_site_parents] + s.end_site_offsets, "Turn each one first"),
        (lambda p, w, s: turned(w, s.end_site_parents, s.end_site_offsets), "Add the position"),
        (lambda p, w, s: p[:, s.end_site_parents], "the joints themselves"),
        (lambda p, w, s: sites_by_loop(p, np.swapaxes(w, -1, -2), s), "backwards"),
        (
            lambda p, w, s: (
                p[:, s.end_site_parents]
                + turned(w, s.parents[s.end_site_parents], s.end_site_offsets)
            ),
            "one further up",
        ),
        (
            lambda p, w, s: p[:, :7] + turned(w, np.arange(7), s.end_site_offsets),
            "skeleton.end_site_parents",
        ),
        (lambda p, w, s: 2 * sites_by_loop(p, w, s), "Not yet"),
        (lambda p, w, s: p, "shape (488, 31, 3)"),
        (lambda p, w, s: p[0, 99], "stopped with IndexError"),
        ("positions", "the function itself"),
    ],
)
def test_end_sites(walk, answer, words):
    assert words in check_end_sites(answer, walk)


def by_loop(angles):
    result = [float(angles[0])]
    for a in angles[1:]:
        result.append(result[-1] + (a - result[-1] + 180) % 360 - 180)
    return result


def one_way(angles):
    return angles + 360 * np.cumsum(np.diff(angles, prepend=angles[0]) < -180)


def mend_once(angles):
    step = np.diff(angles, prepend=angles[0])
    return angles - 360 * np.sign(step) * (np.abs(step) > 180)


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (by_loop, "Right"),
        (lambda a: np.unwrap(a, period=360), "Right"),
        (lambda a: np.degrees(np.unwrap(np.radians(a))) + 720, "Right"),
        (np.unwrap, "period=360"),
        (lambda a: np.unwrap(np.radians(a)), "back in degrees"),
        (lambda a: a, "Nothing has changed"),
        (lambda a: a % 360, "Modulo"),
        (np.abs, "sign"),
        (mend_once, "one frame after each jump"),
        (one_way, "other way round"),
        (lambda a: a - (np.unwrap(a, period=360) - a), "add 360"),
        (lambda a: a[1:], "shape (110,)"),
        (lambda a: 0.5 * a, "should be 10"),
        (lambda a: a.unwrap(), "stopped with AttributeError"),
        (17, "the function itself"),
    ],
)
def test_unwrap(answer, words):
    assert words in check_unwrap(answer)


VERDICT = {
    "LeftUpLeg": "real jump",
    "Neck": "full turn",
    "RightArm": "branch switch",
    "RightUpLeg": "real jump",
}


def test_mystery_is_what_the_doctor_finds(embedded):
    clip, frame = mystery_clip(embedded["walk_38"])
    found = {f.where.split(".")[0]: f for f in diagnose(clip) if f.kind != "constant"}
    names = {"jump": "real jump"}
    assert {joint: names.get(f.kind, f.kind) for joint, f in found.items()} == VERDICT
    assert all(f.frames == ((frame, frame),) for f in found.values())


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (VERDICT, "Right"),
        (VERDICT | {"Head": "full turn"}, "Right"),
        (VERDICT | {"LeftUpLeg": "branch switch"}, "3 of 4 are right. Look at LeftUpLeg: Two"),
        (VERDICT | {"RightUpLeg": "full turn"}, "360 degrees, and this one is not"),
        (VERDICT | {"Neck": "real jump"}, "How far apart"),
        (VERDICT | {"Neck": "branch switch"}, "Only one channel"),
        (VERDICT | {"RightArm": "full turn"}, "or by 180"),
        (VERDICT | {"RightArm": "real jump"}, "How far apart"),
        (VERDICT | {"Neck": "wrap"}, "do not know 'wrap'"),
        (VERDICT | {"Neck": ["full turn"]}, "do not know"),
        ({"Neck": "full turn"}, "LeftUpLeg yet"),
        (["real jump"], "dictionary"),
        ("real jump", "dictionary"),
        ({}, "dictionary"),
    ],
)
def test_mystery(answer, words):
    assert words in check_mystery(answer)


def switches(angles, order):
    other = alternate_euler(angles, order)
    stay = np.linalg.norm(wrap_degrees(angles[1:] - angles[:-1]), axis=1)
    return np.flatnonzero(np.linalg.norm(wrap_degrees(other[1:] - angles[:-1]), axis=1) < stay) + 1


def unwrapped_switches(angles, order):
    other = alternate_euler(angles, order)
    stay = np.linalg.norm(np.diff(angles, axis=0), axis=1)
    return np.flatnonzero(np.linalg.norm(other[1:] - angles[:-1], axis=1) < stay) + 1


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (switches, "Right: 4"),
        (lambda a, o: set(switches(a, o).tolist()), "Right: 4"),
        (lambda a, o: switches(a, o) - 1, "one too early"),
        (unwrapped_switches, "Wrap each difference"),
        (
            lambda a, o: np.flatnonzero((np.abs(np.diff(a, axis=0)) > 90).any(axis=1)) + 1,
            "Wrap each difference",
        ),
        (lambda a, o: np.isin(np.arange(len(a)), switches(a, o)), "one value for every frame"),
        (lambda a, o: len(switches(a, o)), "How many"),
        (lambda a, o: [], "found 0 frames, too few"),
        (lambda a, o: np.arange(9), "too many"),
        (lambda a, o: [1, 2, 3, 4], "not the right ones"),
        (lambda a, o: None, "end with return"),
        (lambda a, o: 1 / 0, "ZeroDivisionError"),
        ([111], "the function itself"),
    ],
)
def test_switches(right_arm, answer, words):
    assert words in check_switches(answer, right_arm, "XZY")
