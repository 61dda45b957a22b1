import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from mocaplab.two_sources.baselines import (
    gated_gaussian_mean,
    gaussian_mean,
    lost_samples,
    mean_of_sources,
    quaternion_distance,
    shake,
    smooth_rotations,
    steadier_frames,
    steadier_source,
    tune_width,
)
from mocaplab.two_sources.noise import SourceNoise, two_sources


def random_rotations(n, seed=0):
    return Rotation.random(n, rng=np.random.default_rng(seed))


def arrays(rotations, shape):
    return rotations.as_quat()[:, [3, 0, 1, 2]].reshape(*shape, 4)


def swing(n_frames=240, joints=3):
    """Joints that swing a little, each in its own way; 120 frames a second."""
    phase = np.arange(n_frames)[:, None] / 120 * 2 * np.pi + np.arange(joints)
    vectors = np.stack([0.4 * np.sin(phase), 0.2 * np.cos(phase), 0 * phase], axis=-1)
    return arrays(Rotation.from_rotvec(vectors.reshape(-1, 3)), (n_frames, joints))


def apart(p, q):
    rotations = [Rotation.from_quat(x.reshape(-1, 4)[:, [1, 2, 3, 0]]) for x in (p, q)]
    return (rotations[0].inv() * rotations[1]).magnitude()


def test_the_mean_is_half_way_between_the_two():
    p, q = random_rotations(20), random_rotations(20, seed=1)
    expected = [
        Slerp([0, 1], Rotation.concatenate([one, other]))(0.5)
        for one, other in zip(p, q, strict=True)
    ]
    found = mean_of_sources(arrays(p, (20, 1)), -arrays(q, (20, 1)))
    assert apart(found, arrays(Rotation.concatenate(expected), (20, 1))).max() < 1e-7


def test_smoothing_agrees_with_the_geodesic_mean_of_scipy():
    q = swing()
    smooth = smooth_rotations(q, 0.02, 1 / 120)
    frames = np.arange(240)
    for frame in (60, 100, 155):
        weights = np.exp(-0.5 * ((frames - frame) / (0.02 * 120)) ** 2)
        near = np.abs(frames - frame) <= 10
        mean = Rotation.from_quat(q[near, 0][:, [1, 2, 3, 0]]).mean(weights[near])
        assert apart(smooth[frame, 0], mean.as_quat()[[3, 0, 1, 2]]) < 1e-5


def test_smoothing_does_not_depend_on_the_frame_rate():
    q = swing()
    fast, slow = smooth_rotations(q, 0.05, 1 / 120), smooth_rotations(q[::2], 0.05, 1 / 60)
    assert apart(fast[60:180:2], slow[30:90]).max() < 2e-3


def test_the_steadier_source_is_taken_for_each_joint():
    clean = swing()
    rng = np.random.default_rng(0)
    bad, good = (clean + size * rng.normal(size=clean.shape) for size in (0.1, 0.01))
    a, b = bad.copy(), good.copy()
    a[:, 1], b[:, 1] = good[:, 1], bad[:, 1]
    a, b, good = (x / np.linalg.norm(x, axis=-1, keepdims=True) for x in (a, b, good))
    assert apart(steadier_source(a, b), good).max() < 1e-6


def test_frame_by_frame_a_lost_frame_is_taken_from_the_other():
    clean = swing()
    a = clean.copy()
    a[100, 0] = [0, 1, 0, 0]
    assert apart(steadier_frames(a, clean), clean).max() < 1e-6


def test_shake_by_hand():
    # A turn of 0.2 rad in the middle frame only: |q - 1| = 2 sin(0.05).
    q = np.zeros((5, 1, 4))
    q[..., 0] = 1
    q[2, 0] = [np.cos(0.1), np.sin(0.1), 0, 0]
    assert shake(q)[2, 0] == pytest.approx(2 * np.sin(0.05))
    assert shake(q[:2]).shape == (2, 1)


def test_lost_samples_are_found_and_left_out():
    clean = swing()
    a, b = two_sources(clean, SourceNoise(lost_probability=0), rng=np.random.default_rng(1))
    a = a.copy()
    for frame in (40, 41, 120):
        a[frame, 2] = [0, 0.6, 0.8, 0]
    found = lost_samples(a)
    assert found[[40, 41, 120], 2].all()
    assert found.mean() < 0.03
    gated, plain = (f(a, b, 0.02, 1 / 120) for f in (gated_gaussian_mean, gaussian_mean))
    near = slice(118, 123)
    assert apart(gated[near, 2], clean[near, 2]).max() < 0.03
    assert apart(plain[near, 2], clean[near, 2]).max() > 0.1


def test_distance_by_hand():
    truth = np.array([[[1.0, 0, 0, 0], [0, 1.0, 0, 0]]])
    q = np.array([[[-0.6, 0.8, 0, 0], [0, 1.0, 0, 0]]])
    np.testing.assert_allclose(quaternion_distance(q, truth), [[0.4 + 0.8, 0]])


def test_the_width_is_tuned_to_the_noise():
    clean = swing()
    rng = np.random.default_rng(2)
    weak, strong = (
        SourceNoise(bias_mean=0, bias_std=0, imprecision_mean=size, lost_probability=0)
        for size in (0.002, 0.1)
    )
    widths = [
        tune_width([(*two_sources(clean, noise, rng=rng), clean)], 1 / 120)
        for noise in (weak, strong)
    ]
    assert widths[0] < widths[1]
    with pytest.raises(ValueError, match="at least one training clip"):
        tune_width([], 1 / 120)


def test_other_shapes_are_refused():
    with pytest.raises(ValueError, match="one shape"):
        mean_of_sources(swing(10), swing(11))
