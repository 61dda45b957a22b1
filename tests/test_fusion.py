from dataclasses import replace

import numpy as np
import pytest

from mocaplab.bvh import load_bvh, save_bvh
from mocaplab.cli import main
from mocaplab.euler import alternate_euler, make_continuous
from mocaplab.fusion import Fuser
from mocaplab.poses import motion_to_quaternions
from mocaplab.resampling import resample
from mocaplab.rotation_channels import rotations_to_channels
from mocaplab.two_sources.model_files import SourceModel, build_source_network, save_source_model
from mocaplab.two_sources.networks import TwoSourceConfig
from mocaplab.two_sources.noise import source_noise_motion
from mocaplab.two_sources.robust import RobustConfig


@pytest.fixture(scope="module")
def tiny():
    """An untrained network for skeletons that have the joints Hips and Spine."""
    network = build_source_network(RobustConfig(2, n_trust=4, radius=4), seed=0)
    return Fuser(SourceModel(network, ("Hips", "Spine"), 1 / 120, {}))


@pytest.fixture(scope="module")
def pair(embedded):
    """Two noisy recordings of a walk: b began 17 frames earlier."""
    clip = embedded["walk_01"].slice_frames(0, 260)
    a, b = (source_noise_motion(clip, 1.0, rng=np.random.default_rng(i)) for i in range(2))
    return clip.slice_frames(17, 240), a.slice_frames(17, 240), b


def l1(motion, clean):
    p, q = motion_to_quaternions(motion), motion_to_quaternions(clean)
    return np.minimum(np.abs(p - q).sum(axis=-1), np.abs(p + q).sum(axis=-1)).sum(axis=-1).mean()


def test_the_shipped_network_fuses_better_than_the_mean(pair):
    clean, a, b = pair
    fused, report = Fuser().fuse(a, b)
    assert report.offset.frames == 17
    assert report.corrected
    assert fused.n_frames == clean.n_frames == report.n_frames
    same = b.slice_frames(17, 240)
    mean = a.with_channels((a.channels + same.channels) / 2)
    assert l1(fused, clean) < 0.6 * min(l1(mean, clean), l1(a, clean), l1(same, clean))
    assert report.jitter_fused < 0.3 * report.jitter_a
    assert 0.3 < report.trust_a < 0.7


def test_a_clean_source_is_trusted_over_pure_noise(pair):
    clean, _, _ = pair
    noise = source_noise_motion(clean, 100.0, rng=np.random.default_rng(5))
    fused, report = Fuser().fuse(clean, noise, offset_s=0.0)
    back, other = Fuser().fuse(noise, clean, offset_s=0.0)
    assert report.trust_a > 0.9
    assert other.trust_a < 0.1
    for motion in (fused, back):
        assert l1(motion, clean) < 0.02 * l1(noise, clean)


def test_what_does_not_move_stays(pair):
    clean, a, b = pair
    fused, _ = Fuser().fuse(a, b)
    kept = np.ptp(clean.channels, axis=0) < 1e-3
    position = ~clean.skeleton.is_rotation
    assert kept.sum() > 10
    np.testing.assert_array_equal(fused.channels[:, kept], a.channels[:, kept])
    np.testing.assert_array_equal(fused.channels[:, position], a.channels[:, position])


def test_the_result_has_no_jumps(pair):
    _, a, b = pair
    fused, _ = Fuser().fuse(a, b)
    moving = fused.skeleton.is_cleaned
    assert np.abs(np.diff(fused.channels[:, moving], axis=0)).max() < 30


def test_the_angles_are_told_as_in_the_first_file(pair):
    """A whole file may hold the other triple of a joint, and full turns."""
    clean, _, _ = pair
    columns = [clean.skeleton.channel_index(f"LeftArm.{axis}rotation") for axis in "ZYX"]
    channels = clean.channels.copy()
    channels[:, columns] = alternate_euler(channels[:, columns], "ZYX")
    channels[:, columns[2]] += 720
    told_otherwise = clean.with_channels(channels)
    fused, _ = Fuser().fuse(told_otherwise, told_otherwise, offset_s=0.0)
    assert np.abs(fused.channels - channels).max() < 5


def test_any_skeleton_can_be_fused(small_motion, tiny):
    a, b = (
        small_motion.with_channels(
            small_motion.channels
            + np.random.default_rng(i).normal(size=small_motion.channels.shape)
        )
        for i in range(2)
    )
    fuser = Fuser(replace(tiny.model, segments=("Hips", "Tail")))
    fused, report = fuser.fuse(a, b, offset_s=0.0)
    assert not report.corrected
    assert "another skeleton" in str(report)
    assert l1(fused, make_continuous(small_motion)) < l1(a, small_motion)


def test_a_hinge_stays_a_hinge(small_motion):
    channels = rotations_to_channels(motion_to_quaternions(small_motion), small_motion.skeleton)
    turning = small_motion.skeleton.is_rotation
    again = motion_to_quaternions(small_motion.with_channels(channels))
    expected = motion_to_quaternions(small_motion)
    cosine = np.abs(np.sum(again * expected, axis=-1))
    np.testing.assert_allclose(cosine, 1, atol=1e-12)
    assert not channels[:, ~turning].any()


def test_long_files_are_fused_in_parts_without_seams(pair, monkeypatch):
    _, a, b = pair
    whole, _ = Fuser().fuse(a, b)
    monkeypatch.setattr("mocaplab.fusion.CHUNK_FRAMES", 100)
    parts, _ = Fuser().fuse(a, b)
    np.testing.assert_allclose(parts.channels, whole.channels, atol=0.05)


def test_what_cannot_be_fused_is_refused(small_motion, walk, tiny):
    with pytest.raises(ValueError, match=r"same joints and channels, got 'walk_01' \(96"):
        tiny.fuse(walk, small_motion)
    with pytest.raises(ValueError, match=r"one frame rate, got 120 frames per second .* and 60"):
        tiny.fuse(walk, resample(walk, 60))
    holed = walk.channels.copy()
    holed[3, 10] = np.nan
    with pytest.raises(ValueError, match="is NaN in frame 3"):
        tiny.fuse(walk, walk.with_channels(holed))
    for offset in (np.nan, 1e9):
        with pytest.raises(ValueError, match="offset"):
            tiny.fuse(walk, walk, offset_s=offset)
    network = build_source_network(TwoSourceConfig(2, n_hidden=4), seed=0)
    with pytest.raises(ValueError, match="kind RobustFusion, got TwoSourceLSTM"):
        Fuser(SourceModel(network, ("a", "b"), 0.01, {}))


def test_command(pair, tiny, tmp_path, capsys):
    clean, a, b = pair
    paths = [str(tmp_path / f"{name}.bvh") for name in ("a", "b", "fused")]
    save_bvh(a, paths[0])
    save_bvh(b, paths[1])
    assert main(["fuse", *paths[:2], "-o", paths[2]]) == 0
    printed = capsys.readouterr().out
    assert "0.142 s (17 frames)" in printed
    fused = load_bvh(paths[2])
    assert l1(fused, clean) < 0.6 * l1(a, clean)
    model = tmp_path / "tiny.safetensors"
    save_source_model(tiny.model, model)
    assert main(["fuse", *paths[:2], "-o", paths[2], "--offset", "0.1", "--model", str(model)]) == 0
    assert "0.100 s (12 frames)" in capsys.readouterr().out


def test_command_tells_what_is_wrong(pair, small_motion, tmp_path, capsys):
    _, a, _ = pair
    save_bvh(a, tmp_path / "a.bvh")
    save_bvh(small_motion, tmp_path / "b.bvh")
    paths = [str(tmp_path / name) for name in ("a.bvh", "b.bvh", "out.bvh")]
    assert main(["fuse", *paths[:2], "-o", paths[2]]) == 2
    assert "same joints and channels" in capsys.readouterr().err
    assert not (tmp_path / "out.bvh").exists()
