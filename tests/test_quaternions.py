"""Arithmetic with quaternions against scipy, and the two signs of each."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation, Slerp

from mocaplab.quaternions import (
    align_hemisphere,
    follow_hemisphere,
    quaternion_inverse,
    quaternion_multiply,
    quaternion_rotate,
    quaternion_to_matrix,
    rotation_vector_to_quaternion,
    slerp,
)

few = settings(max_examples=50, deadline=None)
vectors = arrays(np.float64, (5, 3), elements=st.floats(-10, 10))


def random_quaternions(*shape, seed=0):
    q = np.random.default_rng(seed).normal(size=(*shape, 4))
    return q / np.linalg.norm(q, axis=-1, keepdims=True)


def scipy_rotation(q):
    return Rotation.from_quat(np.asarray(q)[..., [1, 2, 3, 0]])


def assert_same_rotation(a, b, atol=1e-12):
    np.testing.assert_allclose(np.abs(np.sum(a * b, axis=-1)), 1, atol=atol)


@pytest.mark.parametrize("leading", [(), (4,), (2, 3)])
def test_products_turn_right_first_as_scipys_do(leading):
    a, b = random_quaternions(*leading), random_quaternions(*leading, seed=1)
    product = quaternion_multiply(a, b)
    assert product.shape == (*leading, 4)
    np.testing.assert_allclose(
        quaternion_to_matrix(product), quaternion_to_matrix(a) @ quaternion_to_matrix(b), atol=1e-14
    )
    one = np.broadcast_to([1.0, 0, 0, 0], product.shape)
    np.testing.assert_allclose(quaternion_multiply(a, quaternion_inverse(a)), one, atol=1e-15)
    v = np.random.default_rng(2).normal(size=(*leading, 3))
    flat = scipy_rotation(a.reshape(-1, 4)).apply(v.reshape(-1, 3))
    np.testing.assert_allclose(quaternion_rotate(a, v), flat.reshape(v.shape), atol=1e-14)


def test_one_quaternion_turns_many_vectors_and_many_turn_one():
    q, v = random_quaternions(7), np.array([1.0, 2.0, 3.0])
    assert quaternion_rotate(q, v).shape == (7, 3)
    assert quaternion_rotate(q[0], np.tile(v, (5, 1))).shape == (5, 3)
    assert quaternion_multiply(q[0], q).shape == (7, 4)


@few
@given(a=vectors, b=vectors, c=vectors)
def test_products_keep_length_and_may_be_bracketed_anyhow(a, b, c):
    a, b, c = (rotation_vector_to_quaternion(x) for x in (a, b, c))
    left = quaternion_multiply(quaternion_multiply(a, b), c)
    np.testing.assert_allclose(left, quaternion_multiply(a, quaternion_multiply(b, c)), atol=1e-14)
    np.testing.assert_allclose(np.linalg.norm(left, axis=-1), 1, atol=1e-14)


@pytest.mark.parametrize("seed", range(10))
def test_slerp_is_scipys(seed):
    p, q = random_quaternions(2, seed=seed)
    t = np.linspace(0, 1, 21)
    expected = Slerp([0, 1], scipy_rotation(np.stack([p, q])))(t).as_quat()[:, [3, 0, 1, 2]]
    found = slerp(p, q, t)
    assert found.shape == (21, 4)
    assert_same_rotation(found, expected)
    np.testing.assert_allclose(found[0], p, atol=1e-15)
    assert np.all(found @ p >= -1e-15)
    np.testing.assert_allclose(np.linalg.norm(found, axis=-1), 1, atol=1e-14)
    np.testing.assert_allclose(slerp(p, -q, t), found, atol=1e-14)


@pytest.mark.parametrize("angle", [0.0, 1e-300, 1e-12, 1e-8, 1e-4, 1.0, np.pi - 1e-9])
def test_slerp_turns_evenly_from_no_angle_to_half_a_turn(angle):
    p = random_quaternions()
    axis = np.array([2.0, -1.0, 2.0]) / 3
    q = quaternion_multiply(p, rotation_vector_to_quaternion(angle * axis))
    t = np.array([-0.5, 0.0, 0.25, 0.5, 1.0, 1.5])
    expected = quaternion_multiply(p, rotation_vector_to_quaternion(t[:, None] * angle * axis))
    np.testing.assert_allclose(slerp(p, q, t), expected, atol=1e-14)


def test_slerp_of_opposite_rotations_takes_the_end_as_given():
    p, q = np.array([1.0, 0, 0, 0]), np.array([0.0, 1, 0, 0])
    root = np.sqrt(0.5)
    np.testing.assert_allclose(slerp(p, q, 0.5), [root, root, 0, 0])
    np.testing.assert_allclose(slerp(p, -q, 0.5), [root, -root, 0, 0])
    np.testing.assert_array_equal(slerp(p, -p, 0.3), p)


def test_slerp_broadcasts_times_against_joints():
    p, q = random_quaternions(6), random_quaternions(6, seed=1)
    found = slerp(p, q, np.linspace(0, 1, 5)[:, None])
    assert found.shape == (5, 6, 4)
    np.testing.assert_allclose(found[2, 3], slerp(p[3], q[3], 0.5), atol=1e-15)


@few
@given(path=arrays(np.float64, (20, 2, 4), elements=st.floats(-1, 1)))
def test_hemisphere_leaves_no_opposite_neighbours(path):
    aligned = align_hemisphere(path)
    np.testing.assert_array_equal(np.abs(aligned), np.abs(path))
    np.testing.assert_array_equal(aligned[0], path[0])
    assert np.all(np.sum(aligned[1:] * aligned[:-1], axis=-1) >= 0)
    assert np.all((aligned == path).all(axis=-1) | (aligned == -path).all(axis=-1))


def test_hemisphere_finds_planted_signs_also_across_a_gap():
    turn = np.linspace(0, 9, 300)[:, None, None] * np.array([[0.6, 0.8, 0.0], [0.0, 0.6, -0.8]])
    smooth = rotation_vector_to_quaternion(turn)
    signs = np.random.default_rng(3).choice([-1.0, 1.0], (300, 2, 1))
    signs[:5] = 1.0
    planted = smooth * signs
    planted[100:105, 0] = planted[:3, 1] = np.nan
    seen = ~np.isnan(planted)
    aligned = align_hemisphere(planted)
    np.testing.assert_array_equal(~np.isnan(aligned), seen)
    np.testing.assert_array_equal(aligned[seen], smooth[seen])
    np.testing.assert_array_equal(align_hemisphere(planted[:1]), planted[:1])


def test_quaternions_that_are_not_unit_are_refused():
    q = random_quaternions(3)
    quaternion_to_matrix(q * (1 + 5e-7))  # single precision passes
    q[1] *= 1.01
    for use in (quaternion_to_matrix, quaternion_inverse, lambda x: slerp(x, x, 0.5)):
        with pytest.raises(ValueError, match=r"length 1 \(within 1e-06\), got length 1.01; divide"):
            use(q)
    with pytest.raises(ValueError, match="got length 0"):
        quaternion_rotate(np.zeros(4), np.zeros(3))
    with pytest.raises(ValueError, match="got length inf"):
        quaternion_to_matrix([np.inf, 0, 0, 0])


def test_wrong_shapes_are_refused():
    with pytest.raises(ValueError, match=r"quaternions of shape \(..., 4\), got \(2, 3\)"):
        quaternion_multiply(np.zeros((2, 3)), np.zeros((2, 4)))
    with pytest.raises(ValueError, match=r"vectors of shape \(..., 3\), got \(\)"):
        quaternion_rotate([1, 0, 0, 0], 1.0)
    with pytest.raises(ValueError, match=r"\(T, ..., 4\), got \(4,\)"):
        align_hemisphere(np.zeros(4))


def test_nan_quaternions_pass_through():
    q = random_quaternions(3)
    q[1] = np.nan
    matrix = quaternion_to_matrix(q)
    assert np.isnan(matrix[1]).all()
    assert np.isfinite(matrix[[0, 2]]).all()


def test_two_wrong_frames_do_not_turn_all_that_follow():
    angle = 0.02 * np.arange(60)
    clean = np.stack([np.cos(angle), np.sin(angle), 0 * angle, 0 * angle], axis=-1)[:, None]
    wrong = clean.copy()
    wrong[30, 0], wrong[31, 0] = [0.3, 0.2, 0.9, 0], [0.3, 0.2, -0.9, 0]
    wrong /= np.linalg.norm(wrong, axis=-1, keepdims=True)
    signs = np.random.default_rng(0).choice([-1.0, 1.0], size=(60, 1, 1))
    signs[0] = 1
    np.testing.assert_allclose(follow_hemisphere(signs * clean), clean)
    np.testing.assert_allclose(follow_hemisphere(signs * wrong)[32:], clean[32:])
    assert np.sum(align_hemisphere(wrong)[40] * clean[40]) < 0
    with pytest.raises(ValueError, match=r"shape \(T, ..., 4\)"):
        follow_hemisphere([1, 0, 0, 0])
