import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mocaplab.two_sources.prediction_baselines import (
    constant_velocity,
    horizon_frames,
    mean_pose_predictor,
    prediction_error_rad,
    zero_velocity,
)


def arrays(rotations, shape):
    return rotations.as_quat()[:, [3, 0, 1, 2]].reshape(*shape, 4)


@pytest.fixture
def turning():
    """Two joints that turn evenly about fixed axes for 20 frames."""
    angles = np.arange(20)[:, None, None] * np.array([[0.02, 0.01, 0], [0, 0, -0.05]])
    return arrays(Rotation.from_rotvec(angles.reshape(-1, 3)), (20, 2))


def test_constant_velocity_is_right_about_an_even_turn(turning):
    predicted = constant_velocity(turning[:12], 8)
    np.testing.assert_allclose(predicted, turning[12:], atol=1e-12)


def test_zero_velocity_repeats_the_last_frame(turning):
    predicted = zero_velocity(turning[None, :12], 3)
    assert predicted.shape == (1, 3, 2, 4)
    np.testing.assert_allclose(predicted - turning[11], 0, atol=1e-15)


def test_mean_pose_ignores_the_past(turning):
    predict = mean_pose_predictor(turning[5])
    assert predict(turning[None, :12], 4).shape == (1, 4, 2, 4)
    np.testing.assert_allclose(predict(turning[:12], 4)[3], turning[5], atol=1e-12)


def test_error_is_that_of_scipys_euler_angles():
    rng = np.random.default_rng(0)
    pair = [Rotation.random(30, rng=rng) for _ in range(2)]
    angles = [r.as_euler("ZYX") for r in pair]
    wrapped = (angles[0] - angles[1] + np.pi) % (2 * np.pi) - np.pi
    expected = np.abs(wrapped).reshape(10, 9).sum(axis=1)
    found = prediction_error_rad(*(arrays(r, (10, 3)) for r in pair), "ZYX")
    np.testing.assert_allclose(found, expected, atol=1e-9)


def test_error_wraps_by_hand():
    # 179 and -179 degrees about z are 2 degrees apart.
    q = [arrays(Rotation.from_euler("z", [[a]], degrees=True), (1, 1)) for a in (179, -179)]
    assert prediction_error_rad(*q, "ZYX")[0] == pytest.approx(np.radians(2))


def test_horizons_are_frames_of_25_fps():
    assert horizon_frames(25) == {80: 1, 160: 3, 320: 7, 400: 9}
    with pytest.raises(ValueError, match="80 ms lies between two frames at 30"):
        horizon_frames(30)


def test_too_short_a_past_is_refused(turning):
    with pytest.raises(ValueError, match="2 or more"):
        constant_velocity(turning[:1], 3)
