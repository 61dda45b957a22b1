"""Unit quaternions: to and from matrices and rotation vectors, and arithmetic with them.

A quaternion is four numbers (w, x, y, z), **w first**: a turn by ``angle`` about a unit
axis is ``(cos(angle / 2), sin(angle / 2) * axis)``. q and -q are the same rotation. Some
programs, scipy among them, put w last: move it before the numbers come here.

Every function works on any number of leading axes. NaN comes out where NaN goes in.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from mocaplab.motion import FloatArray

TOLERANCE = 1e-6
"""How far a length may be from 1, or an entry of a matrix from a rotation's: numbers that
went through single precision or a file with six decimals still pass."""


def as_shape(values: ArrayLike, trailing: tuple[int, ...], what: str) -> FloatArray:
    """Return an array of float64; ValueError unless its shape ends in ``trailing``."""
    array = np.asarray(values, dtype=np.float64)
    if array.shape[-len(trailing) :] != trailing:
        expected = ", ".join(map(str, trailing))
        raise ValueError(f"expected {what} of shape (..., {expected}), got {array.shape}")
    return array


def as_quaternion(values: ArrayLike) -> FloatArray:
    """Return quaternions scaled to length 1.

    Raises
    ------
    ValueError
        If the last axis is not 4, or a length differs from 1 by more than ``TOLERANCE``.
    """
    q = as_shape(values, (4,), "quaternions")
    norm = np.sqrt(np.sum(q * q, axis=-1, keepdims=True))
    wrong = np.abs(norm - 1.0) > TOLERANCE
    if wrong.any():
        raise ValueError(
            f"expected quaternions of length 1 (within {TOLERANCE:g}), got length "
            f"{norm[wrong][0]:.6g}; divide by the length first"
        )
    unit: FloatArray = q / norm
    return unit


def as_matrix(values: ArrayLike) -> FloatArray:
    """Return rotation matrices as they are.

    Raises
    ------
    ValueError
        If the last axes are not (3, 3), or a matrix is not a rotation within ``TOLERANCE``.
    """
    m = as_shape(values, (3, 3), "matrices")
    with np.errstate(invalid="ignore"):  # infinity minus infinity
        # Orthogonal columns of length 1, and right-handed: the third is the cross product.
        a, b, c = np.moveaxis(m, -1, 0)
        errors = np.stack([np.sum(a * a, -1) - 1, np.sum(b * b, -1) - 1, np.sum(a * b, -1)])
        error = np.abs(errors).max(axis=0)
        for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
            cross = a[..., j] * b[..., k] - a[..., k] * b[..., j]
            error = np.maximum(error, np.abs(cross - c[..., i]))
        wrong = ~(error <= TOLERANCE) & ~np.isnan(m).any(axis=(-2, -1))
        if wrong.any():
            first = m[wrong][0]
            apart = np.abs(first.T @ first - np.eye(3)).max()
            raise ValueError(
                f"expected rotation matrices (within {TOLERANCE:g}), got one with determinant "
                f"{np.linalg.det(first):.6g} and columns off orthonormal by {apart:.3g}"
            )
    return m


def quaternion_to_matrix(quaternion: ArrayLike) -> FloatArray:
    """Rotation matrices, shape (..., 3, 3), of unit quaternions, shape (..., 4)."""
    w, x, y, z = np.moveaxis(as_quaternion(quaternion), -1, 0)
    matrix = np.empty((*w.shape, 3, 3))
    matrix[..., 0, 0] = 1 - 2 * (y * y + z * z)
    matrix[..., 1, 1] = 1 - 2 * (x * x + z * z)
    matrix[..., 2, 2] = 1 - 2 * (x * x + y * y)
    for i, j, both, turn in ((0, 1, x * y, w * z), (1, 2, y * z, w * x), (2, 0, z * x, w * y)):
        matrix[..., i, j] = 2 * (both - turn)
        matrix[..., j, i] = 2 * (both + turn)
    return matrix


def matrix_to_quaternion(matrix: ArrayLike) -> FloatArray:
    """Return unit quaternions, (..., 4) with w >= 0, of rotation matrices, (..., 3, 3)."""
    m = as_matrix(matrix)
    # Four times the product of any two components is a sum of entries of the matrix. The
    # row with the largest square is the quaternion times a number that is far from 0.
    products = np.empty((4, 4, *m.shape[:-2]))
    x, y, z = m[..., 0, 0], m[..., 1, 1], m[..., 2, 2]
    for a, square in enumerate((x + y + z, x - y - z, y - x - z, z - x - y)):
        products[a, a] = 1 + square
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        both, turn = m[..., i, j] + m[..., j, i], m[..., j, i] - m[..., i, j]
        products[1 + i, 1 + j] = products[1 + j, 1 + i] = both
        products[0, 1 + k] = products[1 + k, 0] = turn
    largest = np.argmax(products[range(4), range(4)], axis=0)
    row = np.take_along_axis(products, largest[None, None], axis=0)[0]
    q = as_quaternion(np.moveaxis(row / np.linalg.norm(row, axis=0), 0, -1))
    return np.where(q[..., :1] < 0, -q, q)


def quaternion_to_rotation_vector(quaternion: ArrayLike) -> FloatArray:
    """Rotation vectors (axis times angle) of unit quaternions.

    Parameters
    ----------
    quaternion : array, shape (..., 4)

    Returns
    -------
    array, shape (..., 3), radians, of length at most pi
    """
    q = as_quaternion(quaternion)
    q = np.where(q[..., :1] < 0, -q, q)  # the shorter way round
    sine = np.linalg.norm(q[..., 1:], axis=-1, keepdims=True)
    angle = 2 * np.arctan2(sine, q[..., :1])
    tiny = sine < 1e-8  # there, the angle is twice the sine to the last digit
    return q[..., 1:] * np.where(tiny, 2.0, angle / np.where(tiny, 1.0, sine))


def rotation_vector_to_quaternion(vector_rad: ArrayLike) -> FloatArray:
    """Return unit quaternions, shape (..., 4), of rotation vectors, (..., 3), radians."""
    vector = as_shape(vector_rad, (3,), "rotation vectors")
    angle = np.linalg.norm(vector, axis=-1, keepdims=True)
    # numpy's sinc(x) is sin(pi x) / (pi x), and 1 at 0.
    xyz = vector / 2 * np.sinc(angle / (2 * np.pi))
    return np.concatenate([np.cos(angle / 2), xyz], axis=-1)


def quaternion_multiply(left: ArrayLike, right: ArrayLike) -> FloatArray:
    """Quaternion product, shape (..., 4): turn by ``right`` first, then by ``left``."""
    a0, a1, a2, a3 = np.moveaxis(as_shape(left, (4,), "quaternions"), -1, 0)
    b0, b1, b2, b3 = np.moveaxis(as_shape(right, (4,), "quaternions"), -1, 0)
    return np.stack(
        [
            a0 * b0 - a1 * b1 - a2 * b2 - a3 * b3,
            a0 * b1 + a1 * b0 + a2 * b3 - a3 * b2,
            a0 * b2 - a1 * b3 + a2 * b0 + a3 * b1,
            a0 * b3 + a1 * b2 - a2 * b1 + a3 * b0,
        ],
        axis=-1,
    )


def quaternion_inverse(quaternion: ArrayLike) -> FloatArray:
    """Return the rotations back, shape (..., 4), of unit quaternions."""
    return as_quaternion(quaternion) * [1.0, -1.0, -1.0, -1.0]


def quaternion_rotate(quaternion: ArrayLike, vector: ArrayLike) -> FloatArray:
    """Turn vectors, shape (..., 3), by unit quaternions, shape (..., 4)."""
    points = as_shape(vector, (3,), "vectors")
    return (quaternion_to_matrix(quaternion) @ points[..., None])[..., 0]


def slerp(start: ArrayLike, end: ArrayLike, t: ArrayLike) -> FloatArray:
    """Turn evenly from one rotation to another, the shorter way round.

    Parameters
    ----------
    start, end : array, shape (..., 4), unit quaternions
    t : float or array, shape (...)
        0 at the start, 1 at the end; broadcast against the leading axes. Values outside
        go on turning.

    Returns
    -------
    array, shape (..., 4), unit quaternions in the hemisphere of ``start``
        Between rotations that are half a turn apart, both ways are equally short; the
        one to ``end`` as it is given is taken.
    """
    p, q = as_quaternion(start), as_quaternion(end)
    share = np.asarray(t, dtype=np.float64)[..., None]
    q = np.where(np.sum(p * q, axis=-1, keepdims=True) < 0, -q, q)
    # This form of the angle between p and q (at most pi / 2) is exact near 0 too.
    apart, together = np.linalg.norm([q - p, q + p], axis=-1)
    angle = 2 * np.arctan2(apart, together)[..., None] / np.pi
    # The textbook's sin((1 - t) angle) / sin(angle), without its 0 / 0 at angle 0.
    weight_p = (1 - share) * np.sinc((1 - share) * angle)
    weight_q = share * np.sinc(share * angle)
    between: FloatArray = (weight_p * p + weight_q * q) / np.sinc(angle)
    return between


def align_hemisphere(quaternions: ArrayLike) -> FloatArray:
    """Choose the signs of quaternions so that they do not jump from frame to frame.

    Each quaternion takes the sign that brings it nearer to the one before; the first
    stays. Averages, filters and networks need this: q and -q are the same rotation, but
    far apart as numbers.

    Parameters
    ----------
    quaternions : array, shape (T, ..., 4); NaN where nothing was observed

    Returns
    -------
    array, shape (T, ..., 4)
    """
    q = as_shape(quaternions, (4,), "quaternions")
    if q.ndim < 2:
        raise ValueError(f"expected quaternions of shape (T, ..., 4), got {q.shape}")
    # Where there is a gap, look back to the last frame that was observed.
    frames = np.arange(len(q)).reshape(-1, *[1] * (q.ndim - 2))
    last = np.maximum.accumulate(np.where(np.isnan(q).any(axis=-1), 0, frames), axis=0)
    before = np.take_along_axis(q, last[:-1, ..., None], axis=0)
    turned = np.sum(q[1:] * before, axis=-1, keepdims=True) < 0
    # Whether a frame lies opposite the one before does not depend on what was done to
    # that one, so the signs multiply up and no loop over frames is needed.
    flips = np.cumsum(turned, axis=0) % 2 == 1
    return np.concatenate([q[:1], np.where(flips, -q[1:], q[1:])])


def follow_hemisphere(quaternions: ArrayLike, memory: float = 0.75) -> FloatArray:
    """Choose signs as :func:`align_hemisphere` does, for recordings in which frames are wrong.

    There, two frames in a row that could be anything turn the sign of all that follow. Here
    each quaternion is compared with a running mean of those before it, which few wrong frames
    cannot turn.

    Parameters
    ----------
    quaternions : array, shape (T, ..., 4), without NaN
    memory : float between 0 and 1, what one frame leaves of the running mean

    Returns
    -------
    array, shape (T, ..., 4)
    """
    q = as_shape(quaternions, (4,), "quaternions").copy()
    if q.ndim < 2:
        raise ValueError(f"expected quaternions of shape (T, ..., 4), got {q.shape}")
    mean = q[0].copy()
    for t in range(1, len(q)):  # each sign depends on the one before
        opposite = np.sum(mean * q[t], axis=-1, keepdims=True) < 0
        q[t] = np.where(opposite, -q[t], q[t])
        mean = memory * mean + (1 - memory) * q[t]
    return q
