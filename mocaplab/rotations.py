"""Rotations: Euler angles to and from matrices, quaternions, rotation vectors and 6D.

Euler angles are in degrees, because that is what BVH files hold; everything else is
in radians or has no unit. An Euler *order* such as ``"ZYX"`` lists the axes as the
file does. The rotations are intrinsic: with angles (a, b, c) the matrix is
``R = R_Z(a) @ R_Y(b) @ R_X(c)``, and a child's vector v becomes ``R @ v``. Quaternions
have w first; what else can be done with them stands in :mod:`mocaplab.quaternions`.

Every function works on any number of leading axes. NaN comes out where NaN goes in.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from mocaplab.euler import check_order
from mocaplab.motion import FloatArray
from mocaplab.quaternions import (
    as_matrix,
    as_shape,
    matrix_to_quaternion,
    quaternion_to_matrix,
    quaternion_to_rotation_vector,
    rotation_vector_to_quaternion,
)

GIMBAL_LOCK = 1e-10
"""Nearer to lock than this (a sine), the first and third angle are one."""


def axis_angle_to_matrix(axis: str, angle_rad: ArrayLike) -> FloatArray:
    """Rotation about one coordinate axis.

    Parameters
    ----------
    axis : "X", "Y" or "Z"
    angle_rad : array, shape (...), radians

    Returns
    -------
    array, shape (..., 3, 3)
    """
    if axis not in ("X", "Y", "Z"):
        raise ValueError(f"expected the axis X, Y or Z, got {axis!r}")
    angle = np.asarray(angle_rad, dtype=np.float64)
    i = "XYZ".index(axis)
    j, k = (i + 1) % 3, (i + 2) % 3
    matrix = np.zeros((*angle.shape, 3, 3))
    cosine, sine = np.cos(angle), np.sin(angle)
    matrix[..., i, i] = 1.0
    matrix[..., j, j] = matrix[..., k, k] = cosine
    matrix[..., j, k] = -sine
    matrix[..., k, j] = sine
    return matrix


def euler_to_matrix(angles_deg: ArrayLike, order: str) -> FloatArray:
    """Rotation matrices from intrinsic Euler angles in file order.

    Parameters
    ----------
    angles_deg : array, shape (..., n), degrees, one angle a letter of ``order``
    order : str of n letters out of "XYZ", such as ``"ZYX"``; n may be 1, 2 or 3

    Returns
    -------
    array, shape (..., 3, 3)
    """
    angles = np.asarray(angles_deg, dtype=np.float64)
    if not order or angles.shape[-1:] != (len(order),) or set(order) - set("XYZ"):
        raise ValueError(f"order {order!r} does not fit angles of shape {angles.shape}")
    matrix = np.empty((3, 3, *angles.shape[:-1]))  # an entry lies in one piece in memory
    fill_matrix(matrix, np.moveaxis(angles, -1, 0), order)
    return np.moveaxis(matrix, (0, 1), (-2, -1))


def fill_matrix(matrix: FloatArray, angles_deg: FloatArray, order: str) -> None:
    """Write what :func:`euler_to_matrix` returns into memory that is there already.

    Parameters
    ----------
    matrix : array, shape (3, 3, ...), to be filled; rows and columns come first
    angles_deg : array, shape (n, ...), degrees; the letters of ``order`` come first
    order : str of n letters
    """
    angles = np.radians(angles_deg)
    if sorted(order) != ["X", "Y", "Z"]:
        product = axis_angle_to_matrix(order[0], angles[0])
        for axis, angle in zip(order[1:], angles[1:], strict=True):
            product = product @ axis_angle_to_matrix(axis, angle)
        matrix[:] = np.moveaxis(product, (-2, -1), (0, 1))
        return
    # The product multiplied out, as it is in most files. The formulas are those of "XYZ";
    # YZX and ZXY only rename the axes, the other three also mirror, which turns angles round.
    i, j, k = ("XYZ".index(axis) for axis in order)
    cos_i, cos_j, cos_k = np.cos(angles)
    sin_i, sin_j, sin_k = np.sin(angles if (j - i) % 3 == 1 else -angles)
    matrix[i, i], matrix[i, j], matrix[i, k] = cos_j * cos_k, -cos_j * sin_k, sin_j
    matrix[j, i] = cos_i * sin_k + sin_i * sin_j * cos_k
    matrix[j, j] = cos_i * cos_k - sin_i * sin_j * sin_k
    matrix[j, k] = -sin_i * cos_j
    matrix[k, i] = sin_i * sin_k - cos_i * sin_j * cos_k
    matrix[k, j] = sin_i * cos_k + cos_i * sin_j * sin_k
    matrix[k, k] = cos_i * cos_j


def matrix_to_euler(matrix: ArrayLike, order: str) -> FloatArray:
    """Intrinsic Euler angles of rotation matrices, for any of the 12 orders.

    Of the two triples of a rotation, the one is returned whose middle angle lies in
    [-90, 90] degrees (in [0, 180] for a repeated axis, such as "ZXZ"). At gimbal lock,
    that is at the ends of this range, only the sum or difference of the first and third
    angle is known: the third is then 0.

    Parameters
    ----------
    matrix : array, shape (..., 3, 3)
    order : str of three letters out of "XYZ", neighbours different

    Returns
    -------
    array, shape (..., 3), degrees
    """
    checked = as_matrix(matrix)
    unknown = np.isnan(checked.sum(axis=-1).sum(axis=-1, keepdims=True))  # (..., 1)
    return np.where(unknown, np.nan, _matrix_to_euler(checked, order))


def _matrix_to_euler(m: FloatArray, order: str) -> FloatArray:
    check_order(order)
    i, j = "XYZ".index(order[0]), "XYZ".index(order[1])
    k = 3 - i - j
    sign = 1.0 if (j - i) % 3 == 1 else -1.0  # is (i, j, k) a right-handed set of axes?
    if order[0] == order[2]:
        sine_first, cosine_first = m[..., j, i], -sign * m[..., k, i]
    else:
        sine_first, cosine_first = -sign * m[..., j, k], m[..., k, k]
    reach = np.hypot(sine_first, cosine_first)
    locked = reach < GIMBAL_LOCK
    first = np.arctan2(
        np.where(locked, sign * m[..., k, j], sine_first),
        np.where(locked, m[..., j, j], cosine_first),
    )
    # Row j of the matrix with the first turn undone knows the third turn alone, even
    # close to lock, where the first is uncertain: the third makes up for its error.
    cosine, sine = np.cos(first)[..., None], sign * np.sin(first)[..., None]
    row = cosine * m[..., j, :] + sine * m[..., k, :]
    if order[0] == order[2]:
        middle = np.arctan2(reach, m[..., i, i])
        third = np.arctan2(-sign * row[..., k], row[..., j])
    else:
        middle = np.arctan2(sign * m[..., i, k], reach)
        third = np.arctan2(sign * row[..., i], row[..., j])
    third = np.where(locked, 0.0, third)
    angles_deg: FloatArray = np.degrees(np.stack([first, middle, third], axis=-1))
    return angles_deg


def euler_to_quaternion(angles_deg: ArrayLike, order: str) -> FloatArray:
    """Quaternions from intrinsic Euler angles; arguments as in :func:`euler_to_matrix`.

    Returns
    -------
    array, shape (..., 4), w first; smooth in the angles, so w may be negative
    """
    angles = np.asarray(angles_deg, dtype=np.float64)
    if not order or angles.shape[-1:] != (len(order),) or set(order) - set("XYZ"):
        raise ValueError(f"order {order!r} does not fit angles of shape {angles.shape}")
    half = np.radians(angles) / 2
    q = [np.ones(half.shape[:-1]), *np.zeros((3, *half.shape[:-1]))]
    for letter, axis in enumerate(order):
        i = 1 + "XYZ".index(axis)
        j, k = 1 + i % 3, 1 + (i + 1) % 3
        c, s = np.cos(half[..., letter]), np.sin(half[..., letter])
        # q times (c, s about axis i)
        q[0], q[i] = c * q[0] - s * q[i], c * q[i] + s * q[0]
        q[j], q[k] = c * q[j] + s * q[k], c * q[k] - s * q[j]
    return np.stack(q, axis=-1)


def quaternion_to_euler(quaternion: ArrayLike, order: str) -> FloatArray:
    """Intrinsic Euler angles, shape (..., 3), of quaternions: see :func:`matrix_to_euler`."""
    return _matrix_to_euler(quaternion_to_matrix(quaternion), order)


def matrix_to_rotation_vector(matrix: ArrayLike) -> FloatArray:
    """Rotation vectors (axis times angle), shape (..., 3), radians, of rotation matrices."""
    return quaternion_to_rotation_vector(matrix_to_quaternion(matrix))


def rotation_vector_to_matrix(vector_rad: ArrayLike) -> FloatArray:
    """Rotation matrices, shape (..., 3, 3), of rotation vectors, shape (..., 3), radians."""
    return quaternion_to_matrix(rotation_vector_to_quaternion(vector_rad))


def matrix_to_sixd(matrix: ArrayLike) -> FloatArray:
    """Return the first two columns of rotation matrices, one after the other.

    These six numbers, shape (..., 6), change smoothly with the rotation, which no three or
    four can do (Zhou et al. 2019, "On the continuity of rotation representations in neural
    networks").
    """
    m = as_matrix(matrix)
    return np.concatenate([m[..., 0], m[..., 1]], axis=-1)


def sixd_to_matrix(sixd: ArrayLike) -> FloatArray:
    """Rotation matrices from two columns, which need be neither unit nor orthogonal.

    The first column is scaled to length 1, the second made orthogonal to it (Gram-Schmidt,
    equation 15 of Zhou et al. 2019); the third is their cross product.

    Parameters
    ----------
    sixd : array, shape (..., 6): see :func:`matrix_to_sixd`

    Returns
    -------
    array, shape (..., 3, 3)
        ValueError if a column is zero or both lie on one line.
    """
    values = as_shape(sixd, (6,), "6D rotations")
    first, second = values[..., :3], values[..., 3:]
    size = np.linalg.norm(values, axis=-1, keepdims=True)
    length = np.linalg.norm(first, axis=-1, keepdims=True)
    x = first / np.where(length > 0, length, 1.0)
    y = second - np.sum(x * second, axis=-1, keepdims=True) * x
    rest = np.linalg.norm(y, axis=-1, keepdims=True)
    if np.any(np.minimum(length, rest) <= 1e-9 * size):
        raise ValueError("expected two columns in different directions, got zero or parallel ones")
    y = y / rest
    return np.stack([x, y, np.cross(x, y)], axis=-1)
