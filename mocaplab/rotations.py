"""Rotations: Euler angles, matrices and quaternions, and the traps of Euler angles.

Euler angles are in degrees, because that is what BVH files hold; everything else is
in radians or has no unit. An Euler *order* such as ``"ZYX"`` lists the axes as the
file does. The rotations are intrinsic: with angles (a, b, c) the matrix is
``R = R_Z(a) @ R_Y(b) @ R_X(c)``, and a child's vector v becomes ``R @ v``.

Every function works on any number of leading axes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from mocaplab.motion import FloatArray


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
    angles = np.radians(np.asarray(angles_deg, dtype=np.float64))
    if not order or angles.shape[-1:] != (len(order),) or set(order) - set("XYZ"):
        raise ValueError(f"order {order!r} does not fit angles of shape {angles.shape}")
    matrix = axis_angle_to_matrix(order[0], angles[..., 0])
    for i, axis in enumerate(order[1:], start=1):
        matrix = matrix @ axis_angle_to_matrix(axis, angles[..., i])
    return matrix


def matrix_to_rotation_vector(matrix: ArrayLike) -> FloatArray:
    """Rotation vector (axis times angle) of a rotation matrix.

    Parameters
    ----------
    matrix : array, shape (..., 3, 3)

    Returns
    -------
    array, shape (..., 3), radians, of length at most pi
    """
    from scipy.spatial.transform import Rotation  # as fast as ours, and here only

    matrix = np.asarray(matrix, dtype=np.float64)
    flat = Rotation.from_matrix(matrix.reshape(-1, 3, 3)).as_rotvec()
    return np.asarray(flat).reshape(*matrix.shape[:-2], 3)
