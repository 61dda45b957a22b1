"""Paper B's noise on quaternions."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mocaplab.motion import moving_channels
from mocaplab.poses import motion_to_quaternions
from mocaplab.two_sources.noise import SourceNoise, source_noise, source_noise_motion, two_sources

NO_TURN = np.tile([1.0, 0.0, 0.0, 0.0], (50, 2000, 1))
"""50 frames of 2000 joints that do not turn: noise shows in x, y and z."""


def only(**sizes):
    """Noise of the given parameters, the others 0."""
    names = ("bias_mean", "bias_std", "imprecision_mean", "imprecision_std")
    names += ("lost_mean", "lost_std", "lost_probability")
    return SourceNoise(**(dict.fromkeys(names, 0.0) | sizes))


def test_the_papers_numbers():
    noise = SourceNoise()
    assert (noise.bias_mean, noise.bias_std) == (0.005, 0.002)
    assert (noise.imprecision_mean, noise.imprecision_std) == (0.005, 0.002)
    assert (noise.lost_mean, noise.lost_std, noise.lost_probability) == (1.0, 0.01, 0.01)


def test_the_bias_is_constant_over_time_and_new_in_each_joint():
    noisy = source_noise(NO_TURN, only(bias_mean=0.01), rng=np.random.default_rng(0))
    np.testing.assert_array_equal(noisy, np.broadcast_to(noisy[:1], noisy.shape))
    assert noisy[0, :, 1:].std() == pytest.approx(0.01, rel=0.03)
    assert noisy[0, :, 1:].mean() == pytest.approx(0, abs=0.001)


def test_the_imprecision_is_new_in_each_frame():
    noisy = source_noise(NO_TURN, only(imprecision_mean=0.01), rng=np.random.default_rng(0))
    assert noisy[..., 1:].std(axis=0, ddof=1).mean() == pytest.approx(0.01, rel=0.03)
    assert noisy[..., 1:].mean(axis=0).std() == pytest.approx(0.01 / np.sqrt(50), rel=0.03)
    # Rotation vectors of twice the size, about 1 degree for paper B's 0.005.
    degrees = Rotation.from_quat(noisy.reshape(-1, 4)[:, [1, 2, 3, 0]]).magnitude() * 180 / np.pi
    assert np.sqrt(np.mean(degrees**2)) == pytest.approx(
        2 * np.sqrt(3) * 0.01 * 180 / np.pi, rel=0.01
    )


def test_lost_tracking_hits_whole_joints_in_single_frames():
    noise = only(lost_mean=1.0, lost_probability=0.03)
    noisy = source_noise(NO_TURN, noise, rng=np.random.default_rng(0))
    lost = (noisy != NO_TURN).any(axis=-1)
    assert lost.mean() == pytest.approx(0.03, rel=0.03)
    assert (noisy[lost] != NO_TURN[lost]).all()
    # Frames are lost one by one: the frame after a lost one is no likelier to be lost.
    assert lost[1:][lost[:-1]].mean() == pytest.approx(0.03, rel=0.3)
    # (1, 0, 0, 0) + N(0, 1): x / w is a ratio of Gaussians, so half of them are far off.
    assert np.median(np.abs(noisy[lost][:, 0])) < 0.75


def test_sizes_are_drawn_once_a_motion():
    noise = only(imprecision_mean=0.01, imprecision_std=0.003)
    sizes = [
        source_noise(NO_TURN[:, :50], noise, rng=np.random.default_rng(s))[..., 1:].std()
        for s in range(300)
    ]
    assert np.mean(sizes) == pytest.approx(0.01, rel=0.05)
    assert np.std(sizes) == pytest.approx(0.003, rel=0.1)


def test_length_hemisphere_and_gaps(walk):
    quaternions = motion_to_quaternions(walk)
    quaternions[50:] *= -1  # the same rotations
    quaternions[3, 4] = np.nan
    noisy = source_noise(quaternions, SourceNoise(), rng=np.random.default_rng(0))
    assert np.isnan(noisy[3, 4]).all()
    assert np.isnan(noisy).sum() == 4
    quaternions[50:] *= -1
    lengths = np.linalg.norm(noisy, axis=-1)
    np.testing.assert_allclose(lengths[~np.isnan(lengths)], 1.0)
    assert np.nanmin(np.sum(noisy * quaternions, axis=-1)) >= 0


def test_two_sources_are_independent(walk):
    quaternions = motion_to_quaternions(walk)
    noise = only(imprecision_mean=0.005)
    a, b = two_sources(quaternions, noise, rng=np.random.default_rng(0))
    errors = [(x - quaternions).ravel() for x in (a, b)]
    assert abs(np.corrcoef(errors)[0, 1]) < 0.02
    again = two_sources(quaternions, noise, rng=np.random.default_rng(0))
    np.testing.assert_array_equal(again, (a, b))


@pytest.mark.parametrize("turns", [0, 360])
def test_the_angles_of_a_motion_stay_near_its_own(walk, turns):
    channels = walk.channels.copy()
    channels[50:, walk.skeleton.channel_index("LeftArm.Zrotation")] += turns
    motion = walk.with_channels(channels)
    noisy = source_noise_motion(motion, 0.0, rng=np.random.default_rng(0))
    np.testing.assert_allclose(noisy.channels, motion.channels, atol=1e-6)
    noisy = source_noise_motion(motion, 1.0, rng=np.random.default_rng(0)).channels
    moving = moving_channels(walk)
    np.testing.assert_array_equal(noisy[:, ~moving], motion.channels[:, ~moving])
    off = np.abs(noisy - motion.channels)[:, moving]
    assert np.median(off) == pytest.approx(0.5, abs=0.25)
    assert 0.001 < np.mean(off > 30) < 0.02
    assert off.max() <= 270


def test_twice_as_bad():
    noise = SourceNoise().scaled(2)
    assert noise == SourceNoise(0.01, 0.004, 0.01, 0.004, 1.0, 0.01, 0.02)
    assert SourceNoise().scaled(100).lost_probability == 1
    assert SourceNoise().scaled(1) == SourceNoise()


def test_nonsense_is_refused(walk, small_motion):
    rng = np.random.default_rng(0)
    with pytest.raises(ValueError, match=r"bias_std must lie in \[0, 100\], got -1"):
        SourceNoise(bias_std=-1)
    with pytest.raises(ValueError, match=r"lost_probability must lie in \[0, 1\], got 1.5"):
        SourceNoise(lost_probability=1.5)
    with pytest.raises(ValueError, match=r"amount of source noise must lie in \[0, 100\], got nan"):
        source_noise_motion(walk, np.nan, rng=rng)
    with pytest.raises(ValueError, match="expected quaternions of length 1"):
        source_noise(2 * NO_TURN, SourceNoise(), rng=rng)
    with pytest.raises(ValueError, match=r"shape \(T, J, 4\), got \(5, 4\)"):
        source_noise(NO_TURN[0, :5], SourceNoise(), rng=rng)
    with pytest.raises(ValueError, match="three rotation channels or none"):
        source_noise_motion(small_motion, 1.0, rng=rng)
