"""Feet on the floor: contact, height and speed."""

from __future__ import annotations

import numpy as np
import pytest

from mocaplab.foot_placement import (
    contact_weights,
    height_correction,
    place_feet,
    stance_velocity,
)
from mocaplab.measures.movement import foot_heights, foot_points
from mocaplab.motion import Motion
from mocaplab.motion_model import CM_PER_UNIT


def test_a_walk_that_floats_and_skates_gets_its_floor_and_path_back(walk: Motion) -> None:
    path = walk.channels[:, [0, 2]]
    velocity = np.gradient(path, walk.frame_time, axis=0)
    channels = walk.channels.copy()
    channels[:, 1] += 3.0 + np.linspace(0, 2, walk.n_frames)
    channels[:, [0, 2]] = 100.0  # the path is lost; its speed is known only roughly
    placed = place_feet(walk.with_channels(channels), 0.9 * velocity, airborne_s=0.0)
    low_cm = foot_heights(placed).min(axis=1) * CM_PER_UNIT
    assert np.median(np.abs(low_cm)) < 0.6
    travelled, expected = (np.linalg.norm(x[-1] - x[0]) for x in (placed.channels[:, [0, 2]], path))
    assert travelled == pytest.approx(expected, rel=0.05)
    assert not placed.channels[0, [0, 2]].any()
    np.testing.assert_array_equal(placed.channels[:, 3:], walk.channels[:, 3:])


def test_contact_is_the_lowest_nearby() -> None:
    low = np.array([0.0, 3, 6, 3, 0, 9, 9, 9])
    weights = contact_weights(low, 2)
    np.testing.assert_array_equal(weights[[0, 4, 7]], 1.0)
    assert weights[[1, 2, 3, 5]].max() < 1e-3
    np.testing.assert_array_equal(contact_weights(low, 0), 1.0)


def test_flight_is_bridged_by_the_correction_of_both_contacts() -> None:
    """The floor lies at 2 and later at 4: corrected are contacts, and a line between."""
    frames = np.arange(300.0)
    low = 2.0 + frames / 150
    flight = (frames > 100) & (frames < 200)
    rise = height_correction(low + 5.0 * flight, (~flight).astype(float))
    np.testing.assert_allclose(rise, -low, atol=0.02)


@pytest.mark.parametrize("n", [1, 2, 3, 4])
def test_short_clips_are_put_on_the_floor(n: int) -> None:
    np.testing.assert_allclose(height_correction(np.full(n, 7.0), np.ones(n)), -7.0, atol=1e-4)


def test_in_the_air_the_expected_velocity_decides(walk: Motion) -> None:
    feet = foot_points(walk)
    expected = np.tile([3.0, 5.0], (walk.n_frames, 1))
    feet[..., 1] += 50.0
    np.testing.assert_allclose(stance_velocity(feet, expected, walk.frame_time), expected)
    np.testing.assert_array_equal(stance_velocity(feet[:1], expected[:1], 0.01), expected[:1])
