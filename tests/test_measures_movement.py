"""What follows from positions over time, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from test_kinematics import arm

from mocaplab.bvh import load_bvh
from mocaplab.kinematics import end_site_positions, forward_kinematics
from mocaplab.measures.movement import (
    accelerations,
    bone_lengths,
    foot_contacts,
    foot_heights,
    foot_points,
    jitter,
    root_angular_velocity,
    velocities,
)
from mocaplab.motion import Motion, Skeleton
from mocaplab.motion_model import CM_PER_UNIT


@pytest.mark.parametrize("axis", "XYZ")
@pytest.mark.parametrize("rad_per_s", [0.5, -2.0, 20.0])
def test_a_constant_spin_has_a_constant_angular_velocity(axis, rad_per_s):
    """Tilt the root first: the velocity is told in the root's own axes, tilt or not."""
    order = ("ZXY", "XYZ", "YZX")["YZX".index(axis)]
    time_s = np.arange(50) / 60
    channels = np.stack([np.full(50, 25.0), np.full(50, -70.0), np.degrees(rad_per_s * time_s)], 1)
    names = tuple(f"{letter}rotation" for letter in order)
    skeleton = Skeleton(("Root",), [-1], np.zeros((1, 3)), (names,), [], np.zeros((0, 3)))
    expected = np.zeros((50, 3))
    expected[:, "XYZ".index(axis)] = rad_per_s
    velocity = root_angular_velocity(Motion(skeleton, 1 / 60, channels))
    np.testing.assert_allclose(velocity, expected, atol=1e-9)


def test_angular_velocity_does_not_see_the_heading_nor_the_way_angles_are_told():
    names = ("Yrotation", "Xrotation", "Zrotation")
    skeleton = Skeleton(("Root",), [-1], np.zeros((1, 3)), (names,), [], np.zeros((0, 3)))
    path = np.cumsum(np.random.default_rng(0).normal(size=(30, 3)), axis=0)
    velocity = root_angular_velocity(Motion(skeleton, 0.01, path))
    turned = root_angular_velocity(Motion(skeleton, 0.01, path + np.array([123.0, 0, 0])))
    np.testing.assert_allclose(turned, velocity, atol=1e-9)
    jumpy = path + 360.0 * (np.arange(30)[:, None] % 2)
    np.testing.assert_allclose(
        root_angular_velocity(Motion(skeleton, 0.01, jumpy)), velocity, atol=1e-9
    )


def test_angular_velocity_repeats_its_last_value_and_knows_single_frames(small_motion):
    velocity = root_angular_velocity(small_motion)
    assert velocity.shape == (40, 3)
    np.testing.assert_array_equal(velocity[-1], velocity[-2])
    assert not root_angular_velocity(small_motion.slice_frames(3, 4)).any()


def test_jitter_of_a_cubic_path_is_its_constant_jerk():
    """Root and child move as (t^3, 2 t^3, 2 t^3): the jerk is 6 * (1, 2, 2), of length 18."""
    time_s = np.arange(12) * 0.1
    names = (("Xposition", "Yposition", "Zposition"), ())
    cubic = arm(time_s[:, None] ** 3 * [1, 2, 2], names)
    assert jitter(cubic) == pytest.approx(18.0, rel=1e-9)
    assert jitter(cubic.with_channels(time_s[:, None] ** 2 * [5, -3, 1])) == pytest.approx(
        0, abs=1e-9
    )


def test_jitter_needs_four_frames_and_grows_with_noise(small_motion):
    assert jitter(small_motion.slice_frames(0, 3)) == 0.0
    noise = np.random.default_rng(0).normal(size=small_motion.channels.shape)
    assert jitter(small_motion.with_channels(small_motion.channels + noise)) > 10 * jitter(
        small_motion
    )


def test_foot_points_are_joints_and_end_sites(walk):
    points = foot_points(walk)
    positions, sites = forward_kinematics(walk)[0], end_site_positions(walk)
    names = walk.skeleton.joint_names
    assert points.shape == (walk.n_frames, 2, 3, 3)
    for side, name in enumerate(("Left", "Right")):
        ball = names.index(name + "ToeBase")
        site = walk.skeleton.end_site_parents.tolist().index(ball)
        np.testing.assert_array_equal(points[:, side, 0], positions[:, names.index(name + "Foot")])
        np.testing.assert_array_equal(points[:, side, 1], positions[:, ball])
        np.testing.assert_allclose(points[:, side, 2], sites[:, site], atol=1e-12)
    np.testing.assert_array_equal(foot_heights(walk), points[..., 1].min(axis=2))


def test_foot_points_need_feet(small_motion):
    with pytest.raises(ValueError, match="expected a joint LeftToeBase with an End Site"):
        foot_points(small_motion)


TIME_S = np.arange(30) * 0.1


def path(time_s, *coefficients):
    """Two points on polynomials in time, shape (T, 2, 3)."""
    powers = sum(c * time_s**n for n, c in enumerate(coefficients))
    return powers[:, None, None] * np.array([[1, -2, 0.5], [3, 0, 4]])


def test_velocities_and_accelerations_of_a_parabola_are_exact_at_the_ends_too():
    positions = path(TIME_S, 5, -3, 2)
    velocity = path(TIME_S, -3, 4)
    np.testing.assert_allclose(velocities(positions, 0.1), velocity, atol=1e-11)
    np.testing.assert_allclose(accelerations(positions, 0.1), path(0 * TIME_S, 4), atol=1e-10)


def test_accelerations_of_a_cubic_are_exact_inside():
    result = accelerations(path(TIME_S, 1, 0, -1, 2), 0.1)
    np.testing.assert_allclose(result[1:-1], path(TIME_S, -2, 12)[1:-1], atol=1e-10)
    np.testing.assert_array_equal(result[[0, -1]], result[[1, -2]])


def test_on_a_circle_the_speed_and_the_pull_to_the_centre_are_as_in_physics():
    """Radius 2, 3 radians a second: speed 6 along the circle, acceleration 18 inwards."""
    time_s = np.arange(2000) * 0.001
    circle = 2 * np.stack([np.cos(3 * time_s), np.zeros(2000), np.sin(3 * time_s)], axis=1)
    velocity, acceleration = velocities(circle, 0.001), accelerations(circle, 0.001)
    np.testing.assert_allclose(np.linalg.norm(velocity, axis=1), 6, rtol=1e-4)
    np.testing.assert_allclose(acceleration[1:-1], -9 * circle[1:-1], atol=1e-4)


def test_missing_frames_spread_to_their_neighbours_only():
    positions = path(TIME_S, 5, -3, 2)
    positions[10, 1, 2] = np.nan
    velocity, acceleration = velocities(positions, 0.1), accelerations(positions, 0.1)
    assert np.argwhere(np.isnan(velocity)).tolist() == [[9, 1, 2], [11, 1, 2]]
    assert np.argwhere(np.isnan(acceleration)).tolist() == [[9, 1, 2], [10, 1, 2], [11, 1, 2]]


@pytest.mark.parametrize("function", [velocities, accelerations])
def test_differences_need_three_frames(function):
    assert function(np.ones((3, 4)), 0.5).tolist() == np.zeros((3, 4)).tolist()
    with pytest.raises(ValueError, match=r"at least 3 frames, got shape \(2, 4\)"):
        function(np.ones((2, 4)), 0.5)


def test_bone_lengths_of_points_and_of_motions(small_motion):
    points = np.array([[[7, 7, 7], [7, 10, 11], [7, 10, 23.0]]])
    assert bone_lengths(points, [-1, 0, 1]).tolist() == [[0, 5, 12]]
    skeleton = small_motion.skeleton
    lengths = bone_lengths(forward_kinematics(small_motion)[0], skeleton.parents)
    expected = np.linalg.norm(skeleton.offsets, axis=1) * [0, 1, 1, 1, 1]
    np.testing.assert_allclose(lengths, np.broadcast_to(expected, (40, 5)), atol=1e-12)
    with pytest.raises(ValueError, match=r"got \(1, 3, 3\) and \(2,\)"):
        bone_lengths(points, [-1, 0])


def stepping(cm_per_unit: float) -> Motion:
    """Legs that are sliders: the left foot rises at 30 cm/s, the right one glides.

    Left: on the floor for 1 s, up for 1 s. Right: 2 cm above the floor, still for 0.5 s,
    then at 100 cm/s along the floor. The frames are 0.01 s apart.
    """
    time_s = np.arange(201) * 0.01
    left_up_cm = 30 * np.clip(time_s - 1, 0, None)
    right_along_cm = 100 * np.clip(time_s - 0.5, 0, None)
    sliders = ("Yposition", "Zposition")
    skeleton = Skeleton(
        ("Hips", "LeftFoot", "LeftToeBase", "RightFoot", "RightToeBase"),
        [-1, 0, 1, 0, 3],
        np.array([[0, 0, 0], [10, 0, 0], [0, 0, 10], [-10, 0, 0], [0, 0, 10]]) / cm_per_unit,
        (("Yposition",), sliders, (), sliders, ()),
        [2, 4],
        np.array([[0, 0, 5], [0, 0, 5]]) / cm_per_unit,
    )
    zero = np.zeros(201)
    ankles_cm = np.stack([zero + 80, left_up_cm - 80, zero, zero - 78, right_along_cm], axis=1)
    return Motion(skeleton, 0.01, ankles_cm / cm_per_unit)


@pytest.mark.parametrize("cm_per_unit", [CM_PER_UNIT, 1.0])
def test_feet_that_are_low_and_slow_stand(cm_per_unit):
    """The left foot is 5 cm high after 1 + 1/6 s; the right one moves from 0.5 s on.

    A central difference sees the start a frame early, at half its speed, 50 cm/s.
    """
    motion = stepping(cm_per_unit)
    limits = {"max_height_cm": 5, "max_speed_cm_s": 40, "cm_per_unit": cm_per_unit}
    contacts = foot_contacts(motion, **limits)
    assert np.flatnonzero(contacts[:, 0]).tolist() == list(range(117))
    assert np.flatnonzero(contacts[:, 1]).tolist() == list(range(50))
    slow = foot_contacts(motion, **limits | {"max_speed_cm_s": 20})
    assert np.flatnonzero(slow[:, 0]).tolist() == list(range(101))  # at 100: 15 cm/s
    low = foot_contacts(motion, **limits | {"max_height_cm": 1})
    assert not low[:, 1].any()
    assert not foot_contacts(motion, **limits, floor=-1000.0).any()


def test_walkers_stand_on_each_foot_for_most_of_a_stride(walk):
    """Textbooks: about 60 % of a stride, and never without any foot on the ground."""
    contacts = foot_contacts(walk)
    assert np.all((contacts.mean(axis=0) > 0.5) & (contacts.mean(axis=0) < 0.7))
    assert contacts.any(axis=1).mean() > 0.95


@pytest.mark.parametrize("name", ["walk_01", "walk_05", "walk_20"])
def test_real_walks_stand_as_long(data_dir, name):
    contacts = foot_contacts(load_bvh(data_dir / "cmu" / f"{name}.bvh"))
    assert np.all((contacts.mean(axis=0) > 0.45) & (contacts.mean(axis=0) < 0.75))
    assert contacts.any(axis=1).mean() > 0.95


def test_foot_contacts_refuse_gaps(walk):
    channels = walk.channels.copy()
    channels[50, 10] = np.nan
    with pytest.raises(ValueError, match="fill them first"):
        foot_contacts(walk.with_channels(channels))
