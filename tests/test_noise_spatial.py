"""Spatial noise: the amount that comes out, and what must not change."""

from dataclasses import replace

import numpy as np
import pytest

from mocaplab.bvh import load_bvh
from mocaplab.euler import make_continuous
from mocaplab.kinematics import forward_kinematics
from mocaplab.measures.movement import bone_lengths
from mocaplab.motion import Motion, Skeleton, moving_channels
from mocaplab.noise.spatial import (
    END_FACTOR,
    end_joints,
    has_own_place,
    joints_that_move,
    spatial_noise,
    spatial_noise_ends,
)

CMU_UNIT_CM = 2.54 / 0.45


@pytest.fixture(scope="module")
def clean(embedded) -> Motion:
    """A walk at 15 frames per second."""
    motion = make_continuous(embedded["walk_01"])
    return replace(motion, channels=motion.channels[::8], frame_time=8 * motion.frame_time)


@pytest.fixture(scope="module")
def noisy(clean) -> Motion:
    return spatial_noise(clean, 0.5, rng=np.random.default_rng(0))


def realised_cm(clean, noisy, unit_cm=CMU_UNIT_CM):
    """Root mean square position error along an axis, of every joint."""
    error = forward_kinematics(noisy)[0] - forward_kinematics(clean)[0]
    return unit_cm * np.sqrt(np.mean(error**2, axis=(0, 2)))


def counted(motion):
    return joints_that_move(motion) & has_own_place(motion.skeleton)


@pytest.mark.parametrize("std_cm", [0.1, 0.5, 1.0, 3.0])
def test_realised_noise_is_what_was_asked_for(clean, std_cm):
    noisy = spatial_noise(clean, std_cm, rng=np.random.default_rng(1))
    of_joint = realised_cm(clean, noisy)[counted(clean)] / std_cm
    assert np.sqrt(np.mean(of_joint**2)) == pytest.approx(1, abs=0.05)
    assert (np.abs(of_joint - 1) < (0.15 if std_cm < 3 else 0.45)).all()


def test_the_root_its_neighbours_and_constants_stay(clean, noisy):
    still = ~moving_channels(clean)
    np.testing.assert_array_equal(noisy.channels[:, still], clean.channels[:, still])
    assert realised_cm(clean, noisy)[~joints_that_move(clean)].max() < 1e-12


def test_bones_keep_their_lengths(clean, noisy):
    parents = clean.skeleton.parents
    before = bone_lengths(forward_kinematics(clean)[0], parents)
    after = bone_lengths(forward_kinematics(noisy)[0], parents)
    np.testing.assert_allclose(after, before, atol=1e-9)


def test_last_joints_move_only_end_sites_and_stay_clean(clean, noisy):
    toes = clean.skeleton.channel_joint == clean.skeleton.joint_names.index("LeftToeBase")
    np.testing.assert_array_equal(noisy.channels[:, toes], clean.channels[:, toes])


def test_no_jumps_and_no_drift(clean, noisy):
    error = noisy.channels - clean.channels
    assert np.abs(error).max() < 60
    assert np.abs(np.diff(noisy.channels, axis=0))[:, clean.skeleton.is_cleaned].max() < 90


def test_errors_of_different_frames_are_independent(clean, noisy):
    hand = clean.skeleton.joint_names.index("LeftHand")
    error = (forward_kinematics(noisy)[0] - forward_kinematics(clean)[0])[:, hand]
    error = error - error.mean(axis=0)
    neighbours = np.mean(error[1:] * error[:-1]) / np.mean(error**2)
    assert abs(neighbours) < 0.25  # 180 pairs: a standard deviation of 0.08


def test_joints_that_move(clean):
    names = np.array(clean.skeleton.joint_names)
    still = set(names[~joints_that_move(clean)])
    # The hip joints and thighs hang on the root without a joint that turns between them
    assert {"Hips", "LHipJoint", "RHipJoint", "LowerBack"} <= still
    assert {"LeftLeg", "LeftToeBase", "Head", "RightHand"}.isdisjoint(still)


def test_joints_on_their_parent_move_with_it(clean):
    skeleton = clean.skeleton
    thumb = skeleton.joint_names.index("LThumb")
    assert not has_own_place(skeleton)[thumb]
    assert joints_that_move(clean)[thumb]


def test_seed_decides(clean):
    short = clean.slice_frames(0, 10)
    once, again, other = (
        spatial_noise(short, 0.5, rng=np.random.default_rng(seed)) for seed in (0, 0, 5)
    )
    np.testing.assert_array_equal(again.channels, once.channels)
    assert np.abs(other.channels - once.channels).max() > 1


def test_no_noise_is_the_clean_motion(clean):
    none = spatial_noise(clean, 0.0, rng=np.random.default_rng(0))
    np.testing.assert_array_equal(none.channels, clean.channels)


def test_a_motion_that_stands_still_gets_none(clean):
    still = clean.with_channels(np.repeat(clean.channels[:1], 5, axis=0))
    noisy = spatial_noise(still, 1.0, rng=np.random.default_rng(0))
    np.testing.assert_array_equal(noisy.channels, still.channels)


def test_a_joint_that_only_twists_its_bone_cannot_be_moved():
    skeleton = Skeleton(
        joint_names=("root", "twist", "tip"),
        parents=np.array([-1, 0, 1]),
        offsets=np.array([[0, 0, 0], [0, 0, 0], [5.0, 0, 0]]),
        channel_names=(("Xposition",), ("Xrotation",), ("Xrotation",)),
        end_site_parents=np.array([2]),
        end_site_offsets=np.ones((1, 3)),
    )
    motion = Motion(skeleton, 0.01, np.random.default_rng(0).normal(size=(20, 3)) * 10)
    noisy = spatial_noise(motion, 0.5, rng=np.random.default_rng(0), cm_per_unit=1.0)
    np.testing.assert_allclose(noisy.channels, motion.channels, atol=1e-9)


def test_the_unit_scales_the_noise(clean):
    short = clean.slice_frames(0, 20)
    found = spatial_noise(short, 0.5, rng=np.random.default_rng(0))
    given = spatial_noise(short, 1.0, rng=np.random.default_rng(0), cm_per_unit=2 * CMU_UNIT_CM)
    np.testing.assert_allclose(given.channels, found.channels, atol=1e-6)


def test_ends_get_more(clean):
    clean = clean.with_channels(clean.channels[::2])
    noisy = spatial_noise_ends(clean, 0.5, rng=np.random.default_rng(0))
    realised = realised_cm(clean, noisy) / 0.5
    is_end = np.isin(clean.skeleton.joint_names, end_joints(clean.skeleton))
    np.testing.assert_allclose(realised[is_end], END_FACTOR, rtol=0.15)
    rest = realised[counted(clean) & ~is_end]
    assert np.sqrt(np.mean(rest**2)) == pytest.approx(1, abs=0.1)


def test_end_joints_by_name(clean):
    assert set(end_joints(clean.skeleton)) == {"LeftHand", "RightHand", "LeftFoot", "RightFoot"}


@pytest.mark.parametrize(
    "names",
    [
        ("lHand", "rHand", "lFoot", "rFoot"),
        ("hand_l", "hand_r", "foot_l", "foot_r"),
        ("mixamorig:LeftHand", "mixamorig:RightHand", "mixamorig:LeftFoot", "mixamorig:RightFoot"),
        ("left wrist", "right wrist", "LeftAnkle", "RightAnkle"),
        ("L_Wrist", "R_Wrist", "L_Ankle", "R_Ankle"),
    ],
)
def test_end_joints_under_other_names(clean, names):
    own = ("LeftHand", "RightHand", "LeftFoot", "RightFoot")
    rename = dict(zip(own, names, strict=True))
    joints = tuple(rename.get(name, name) for name in clean.skeleton.joint_names)
    assert set(end_joints(replace(clean.skeleton, joint_names=joints))) == set(names)


def test_ends_that_are_not_found(small_motion):
    with pytest.raises(ValueError, match=r"two wrists and two ankles .* pass their names as ends"):
        spatial_noise_ends(small_motion, 0.5, rng=np.random.default_rng(0), cm_per_unit=1.0)
    with pytest.raises(ValueError, match="'small' has no joint 'Fin'"):
        spatial_noise_ends(small_motion, 0.5, rng=np.random.default_rng(0), ends=["Fin"])


def test_ends_by_hand(small_motion):
    noisy = spatial_noise_ends(
        small_motion, 0.5, rng=np.random.default_rng(0), cm_per_unit=1.0, ends=["LeftHand"]
    )
    realised = realised_cm(small_motion, noisy, 1.0)
    hand, arm = (small_motion.skeleton.joint_names.index(n) for n in ("LeftHand", "Left Arm"))
    assert realised[hand] / realised[arm] == pytest.approx(END_FACTOR, rel=0.1)


@pytest.mark.parametrize("std_cm", [-0.1, np.nan, np.inf, 11])
def test_bad_amounts(clean, std_cm):
    with pytest.raises(ValueError, match=r"spatial noise must lie in \[0, 10\] cm"):
        spatial_noise(clean, std_cm, rng=np.random.default_rng(0))


@pytest.mark.parametrize("unit_cm", [0.0, -1.0, np.nan])
def test_bad_units(clean, unit_cm):
    with pytest.raises(ValueError, match="positive number of centimetres in a unit"):
        spatial_noise(clean, 0.5, rng=np.random.default_rng(0), cm_per_unit=unit_cm)


def test_an_unknown_unit_is_an_error(small_motion):
    with pytest.raises(ValueError, match="pass cm_per_unit"):
        spatial_noise(small_motion, 0.5, rng=np.random.default_rng(0))


def test_gaps_are_refused(clean):
    channels = clean.channels.copy()
    channels[3, clean.skeleton.channel_index("LeftLeg.Xrotation")] = np.nan
    with pytest.raises(ValueError, match=r"LeftLeg\.Xrotation is missing \(NaN\) in frame 3"):
        spatial_noise(clean.with_channels(channels), 0.5, rng=np.random.default_rng(0))


@pytest.mark.parametrize("file", ["cmu/run_01.bvh", "cmu/kick_02.bvh", "cmu_daz/salsa_10.bvh"])
def test_real_clips(data_dir, file):
    motion = make_continuous(load_bvh(data_dir / file).slice_frames(0, 60))
    noisy = spatial_noise(motion, 0.5, rng=np.random.default_rng(0))
    unit_cm = 1.0 if "daz" in file else CMU_UNIT_CM
    of_joint = realised_cm(motion, noisy, unit_cm)[counted(motion)] / 0.5
    assert np.sqrt(np.mean(of_joint**2)) == pytest.approx(1, abs=0.05)
