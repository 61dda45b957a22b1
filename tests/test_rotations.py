"""Every conversion against scipy: 12 orders, leading axes, gimbal lock, none and half a turn."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation

from mocaplab.quaternions import (
    matrix_to_quaternion,
    quaternion_to_matrix,
    quaternion_to_rotation_vector,
    rotation_vector_to_quaternion,
)
from mocaplab.rotations import (
    axis_angle_to_matrix,
    euler_to_matrix,
    euler_to_quaternion,
    matrix_to_euler,
    matrix_to_rotation_vector,
    matrix_to_sixd,
    quaternion_to_euler,
    rotation_vector_to_matrix,
    sixd_to_matrix,
)

ORDERS = ["".join(axes) for axes in product("XYZ", repeat=3) if axes[0] != axes[1] != axes[2]]
LEADING = [(), (4,), (2, 3)]
few = settings(max_examples=25, deadline=None)
triples = arrays(np.float64, (5, 3), elements=st.floats(-1000, 1000))


def scipy_matrix(angles_deg, order):
    flat = Rotation.from_euler(order, np.reshape(angles_deg, (-1, len(order))), degrees=True)
    return flat.as_matrix().reshape(*np.shape(angles_deg)[:-1], 3, 3)


def scipy_quaternion(matrix):
    """Scipy's quaternion with w moved to the front, and w >= 0."""
    last = Rotation.from_matrix(np.reshape(matrix, (-1, 3, 3))).as_quat()
    q = last[:, [3, 0, 1, 2]] * np.where(last[:, 3:] < 0, -1, 1)
    return q.reshape(*np.shape(matrix)[:-2], 4)


def middle_lock(order):
    """The middle angles at which an order is locked."""
    return (0.0, 180.0) if order[0] == order[2] else (90.0, -90.0)


def hard_angles(order, kind, rng):
    """40 triples where a conversion may lose digits."""
    triple = rng.uniform(-180, 180, (40, 3))
    locks = rng.choice(middle_lock(order), 40)
    if kind == "locked":
        triple[:, 1] = locks
    elif kind == "almost locked":
        triple[:, 1] = locks + 10.0 ** rng.uniform(-13, -1, 40) * rng.choice([-1, 1], 40)
    elif kind == "almost no turn":
        triple = 10.0 ** rng.uniform(-15, -2, (40, 1)) * rng.normal(size=(40, 3))
    elif kind == "almost half a turn":
        axis = rng.normal(size=(40, 3))
        axis /= np.linalg.norm(axis, axis=1, keepdims=True)
        short = np.pi - 10.0 ** rng.uniform(-15, -2, (40, 1)) * rng.choice([0, 1], (40, 1))
        triple = quaternion_to_euler(rotation_vector_to_quaternion(axis * short), order)
    return triple


KINDS = ["random", "locked", "almost locked", "almost no turn", "almost half a turn"]


def test_there_are_twelve_orders():
    assert len(ORDERS) == 12


@pytest.mark.parametrize("order", [*ORDERS, "X", "Y", "Z", "XY", "ZX", "YZ", "ZY"])
@pytest.mark.parametrize("leading", LEADING)
def test_euler_to_matrix_is_scipys(order, leading):
    angles_deg = np.random.default_rng(0).uniform(-400, 400, (*leading, len(order)))
    matrix = euler_to_matrix(angles_deg, order)
    assert matrix.shape == (*leading, 3, 3)
    np.testing.assert_allclose(matrix, scipy_matrix(angles_deg, order), atol=1e-13)


@pytest.mark.parametrize(
    ("shape", "order"),
    [((3,), "xyz"), ((3,), "XYW"), ((2,), "XYZ"), ((3,), ""), ((0,), ""), ((), "X")],
)
def test_euler_to_matrix_refuses(shape, order):
    with pytest.raises(ValueError, match="does not fit angles of shape"):
        euler_to_matrix(np.zeros(shape), order)


def test_a_quarter_turn_about_z_takes_x_to_y():
    quarter = axis_angle_to_matrix("Z", np.pi / 2)
    np.testing.assert_allclose(quarter @ [1, 0, 0], [0, 1, 0], atol=1e-15)


@pytest.mark.parametrize("leading", [(1,), (3,), (2, 4)])
def test_rotation_vector_gives_the_vector_back(leading):
    vectors = np.random.default_rng(1).uniform(-1.7, 1.7, (*leading, 3))
    matrices = Rotation.from_rotvec(vectors.reshape(-1, 3)).as_matrix().reshape(*leading, 3, 3)
    np.testing.assert_allclose(matrix_to_rotation_vector(matrices), vectors, atol=1e-12)


def test_rotation_vector_survives_no_turn_and_half_a_turn():
    assert matrix_to_rotation_vector(np.eye(3)).tolist() == [0, 0, 0]
    half = matrix_to_rotation_vector(np.diag([1.0, -1.0, -1.0]))
    np.testing.assert_allclose(np.abs(half), [np.pi, 0, 0])


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("order", ORDERS)
def test_there_and_back_by_every_way(order, kind):
    angles_deg = hard_angles(order, kind, np.random.default_rng(2))
    matrix = scipy_matrix(angles_deg, order)
    # Nearer to lock than GIMBAL_LOCK, 1e-10, the angles are those at lock.
    tight = {"atol": 3e-10 if kind.startswith("almost") else 1e-12, "rtol": 0}
    np.testing.assert_allclose(euler_to_matrix(angles_deg, order), matrix, atol=1e-13)
    for euler in (
        matrix_to_euler(matrix, order),
        quaternion_to_euler(matrix_to_quaternion(matrix), order),
    ):
        np.testing.assert_allclose(scipy_matrix(euler, order), matrix, **tight)
        low, high = (0, 180) if order[0] == order[2] else (-90, 90)
        assert np.all((euler[:, 1] >= low) & (euler[:, 1] <= high))
        assert np.all(np.abs(euler) <= 180)
        if kind == "locked":
            np.testing.assert_array_equal(euler[:, 2], 0)
    q = euler_to_quaternion(angles_deg, order)
    np.testing.assert_allclose(quaternion_to_matrix(q), matrix, atol=1e-13)
    # Rotation vectors, and through them 6D.
    vector = matrix_to_rotation_vector(matrix)
    assert np.all(np.linalg.norm(vector, axis=-1) <= np.pi + 1e-12)
    np.testing.assert_allclose(rotation_vector_to_matrix(vector), matrix, atol=1e-12)
    np.testing.assert_allclose(sixd_to_matrix(matrix_to_sixd(matrix)), matrix, atol=1e-12)


@pytest.mark.parametrize("leading", LEADING)
@pytest.mark.parametrize("order", ORDERS)
def test_euler_angles_are_scipys(order, leading):
    rng = np.random.default_rng(3)
    matrix = scipy_matrix(rng.uniform(-180, 180, (*leading, 3)), order)
    flat = Rotation.from_matrix(matrix.reshape(-1, 3, 3)).as_euler(order, degrees=True)
    np.testing.assert_allclose(matrix_to_euler(matrix, order), flat.reshape(*leading, 3), atol=1e-9)


@pytest.mark.parametrize("leading", LEADING)
def test_quaternions_rotation_vectors_and_6d_are_scipys(leading):
    vectors = np.random.default_rng(4).normal(size=(*leading, 3))
    vectors *= 3 / np.maximum(3, np.linalg.norm(vectors, axis=-1, keepdims=True))
    flat = Rotation.from_rotvec(vectors.reshape(-1, 3))
    matrix = flat.as_matrix().reshape(*leading, 3, 3)
    quaternion = scipy_quaternion(matrix)
    close = {"atol": 1e-12, "rtol": 0}
    np.testing.assert_allclose(matrix_to_quaternion(matrix), quaternion, **close)
    np.testing.assert_allclose(quaternion_to_matrix(quaternion), matrix, **close)
    np.testing.assert_allclose(rotation_vector_to_matrix(vectors), matrix, **close)
    np.testing.assert_allclose(rotation_vector_to_quaternion(vectors), quaternion, **close)
    np.testing.assert_allclose(quaternion_to_rotation_vector(quaternion), vectors, **close)
    np.testing.assert_allclose(quaternion_to_rotation_vector(-quaternion), vectors, **close)
    six = np.concatenate([matrix[..., :, 0], matrix[..., :, 1]], axis=-1)
    np.testing.assert_array_equal(matrix_to_sixd(matrix), six)


@few
@given(sixd=arrays(np.float64, (4, 6), elements=st.floats(-10, 10)))
def test_6d_makes_a_rotation_of_any_two_columns(sixd):
    spans = np.linalg.svd(sixd.reshape(4, 2, 3), compute_uv=False)[:, 1]
    assume(np.all(spans > 1e-4))
    matrix = sixd_to_matrix(sixd)
    np.testing.assert_allclose(np.swapaxes(matrix, -1, -2) @ matrix, [np.eye(3)] * 4, atol=1e-6)
    np.testing.assert_allclose(np.linalg.det(matrix), 1, atol=1e-6)
    plane = np.stack([sixd[:, :3], sixd[:, 3:]], axis=-1)
    np.testing.assert_allclose(np.einsum("nij,ni->nj", plane, matrix[..., 2]), 0, atol=1e-6)


@pytest.mark.parametrize("sixd", [[0, 0, 0, 1, 0, 0], [1, 2, 3, -2, -4, -6], [0] * 6])
def test_6d_refuses_columns_that_span_no_plane(sixd):
    with pytest.raises(ValueError, match="zero or parallel"):
        sixd_to_matrix(sixd)


@pytest.mark.parametrize("order", ORDERS)
@few
@given(angles_deg=triples)
def test_quaternions_of_any_angles_are_the_same_rotation(order, angles_deg):
    np.testing.assert_allclose(
        quaternion_to_matrix(euler_to_quaternion(angles_deg, order)),
        euler_to_matrix(angles_deg, order),
        atol=1e-12,
    )


@pytest.mark.parametrize("order", ["X", "ZY", "XYZ"])
def test_euler_to_quaternion_takes_hinges_too(order):
    angles_deg = np.random.default_rng(5).uniform(-180, 180, (6, len(order)))
    np.testing.assert_allclose(
        quaternion_to_matrix(euler_to_quaternion(angles_deg, order)),
        euler_to_matrix(angles_deg, order),
        atol=1e-13,
    )
    with pytest.raises(ValueError, match="does not fit angles of shape"):
        euler_to_quaternion(np.zeros(len(order) + 1), order)


@pytest.mark.parametrize("order", ["xyz", "XXY", "XY", ""])
def test_bad_orders_are_refused(order):
    with pytest.raises(ValueError, match=f"expected three letters .* got '{order}'"):
        matrix_to_euler(np.eye(3), order)


@pytest.mark.parametrize(
    ("matrix", "message"),
    [
        (np.diag([1.0, 1.0, -1.0]), "determinant -1 and columns off orthonormal by 0"),
        (1.01 * np.eye(3), r"determinant 1.0303 and columns off orthonormal by 0.0201"),
        ([[1, 0.1, 0], [0, 1, 0], [0, 0, 1]], "within 1e-06.*off orthonormal by 0.1"),
        ([[np.inf, 0, 0], [0, 1, 0], [0, 0, 1]], "expected rotation matrices"),
        (np.eye(4), r"expected matrices of shape \(..., 3, 3\), got \(4, 4\)"),
        (np.zeros(3), r"expected matrices of shape \(..., 3, 3\), got \(3,\)"),
    ],
)
@pytest.mark.filterwarnings("ignore:invalid value:RuntimeWarning")
def test_what_is_no_rotation_is_refused(matrix, message):
    for convert in (matrix_to_quaternion, matrix_to_rotation_vector, matrix_to_sixd):
        with pytest.raises(ValueError, match=message):
            convert(matrix)
    with pytest.raises(ValueError, match=message):
        matrix_to_euler(matrix, "XYZ")


def test_shapes_are_checked():
    with pytest.raises(ValueError, match=r"6D rotations of shape \(..., 6\), got \(5,\)"):
        sixd_to_matrix(np.ones(5))
    with pytest.raises(ValueError, match=r"rotation vectors of shape \(..., 3\), got \(4,\)"):
        rotation_vector_to_matrix(np.ones(4))


def test_nan_goes_through_and_spoils_nothing_else():
    angles_deg = np.array([[10.0, 20.0, 30.0], [np.nan, 1.0, 2.0], [5.0, 6.0, 7.0]])
    for back in (
        matrix_to_euler(euler_to_matrix(angles_deg, "ZYX"), "ZYX"),
        quaternion_to_euler(euler_to_quaternion(angles_deg, "ZYX"), "ZYX"),
        quaternion_to_euler(matrix_to_quaternion(euler_to_matrix(angles_deg, "ZYX")), "ZYX"),
    ):
        np.testing.assert_allclose(back[[0, 2]], angles_deg[[0, 2]], atol=1e-12)
        assert np.isnan(back[1]).any()
