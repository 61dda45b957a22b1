"""Inverse kinematics against hand-computed arms, finite differences and scipy."""

import numpy as np
import pytest
from scipy.optimize import least_squares

import mocaplab.inverse_kinematics as ik
from mocaplab.inverse_kinematics import position_jacobian, solve_angles
from mocaplab.kinematics import forward_kinematics
from mocaplab.motion import Motion, Skeleton


def arm(*lengths: float, kinds=("Zrotation",)) -> Skeleton:
    """A root at the origin and a chain along x: shoulder at the root, then one joint a bone."""
    n = len(lengths) + 2
    offsets = np.zeros((n, 3))
    offsets[2:, 0] = lengths
    return Skeleton(
        joint_names=("root", "shoulder", *(f"joint{i}" for i in range(len(lengths)))),
        parents=np.arange(n) - 1,
        offsets=offsets,
        channel_names=(("Xposition", "Yposition", "Zposition"), *[tuple(kinds)] * (n - 1)),
        end_site_parents=np.array([n - 1]),
        end_site_offsets=np.array([[1.0, 0, 0]]),
    )


def test_jacobian_equals_finite_differences(small_motion):
    skeleton = small_motion.skeleton
    jacobian = position_jacobian(small_motion)
    step = 1e-5
    for channel in np.flatnonzero(skeleton.is_rotation):
        shift = np.zeros(skeleton.n_channels)
        shift[channel] = np.degrees(step)
        up, _ = forward_kinematics(small_motion.with_channels(small_motion.channels + shift))
        down, _ = forward_kinematics(small_motion.with_channels(small_motion.channels - shift))
        difference = np.swapaxes(up - down, 1, 2) / (2 * step)
        np.testing.assert_allclose(jacobian[:, channel], difference, atol=1e-6)
    assert (jacobian[:, ~skeleton.is_rotation] == 0).all()


def test_two_bone_arm_by_the_law_of_cosines():
    skeleton = arm(3.0, 4.0)
    start = Motion(skeleton, 0.01, [[0, 0, 0, 10.0, 20.0, 0.0]])
    targets = np.zeros((1, 4, 3))
    targets[0, 3] = [3.0, 4.0, 0.0]  # the hand; 5 from the shoulder, so 3-4-5: a right angle
    solved, residual = solve_angles(start, targets, weights=[0, 0, 0, 1])
    # Elbow bent by 90 degrees; shoulder: direction of the hand minus atan(4 / 3), that is 0
    np.testing.assert_allclose(solved.channels[0, 3:5], [0.0, 90.0], atol=1e-4)
    assert residual[0, 3] < 1e-6


def test_a_target_out_of_reach_is_pointed_at():
    skeleton = arm(3.0, 4.0)
    start = Motion(skeleton, 0.01, [[0, 0, 0, 10.0, 20.0, 0.0]])
    targets = np.zeros((1, 4, 3))
    targets[0, 3] = [0.0, 10.0, 0.0]
    solved, residual = solve_angles(start, targets, weights=[0, 0, 0, 1])
    np.testing.assert_allclose(solved.channels[0, 3:5], [90.0, 0.0], atol=0.2)
    assert residual[0, 3] == pytest.approx(3.0, abs=1e-5)


def test_optimum_equals_scipys():
    skeleton = arm(3.0, 2.5, 2.0, kinds=("Zrotation", "Xrotation", "Yrotation"))
    rng = np.random.default_rng(0)
    start = Motion(skeleton, 0.01, rng.normal(size=(4, skeleton.n_channels)) * 20)
    targets = forward_kinematics(start)[0] + rng.normal(size=(4, 5, 3)) * 0.3
    weights = np.array([0.0, 0.0, 1.0, 2.0, 0.5])
    pull = 0.2
    solved, _ = solve_angles(start, targets, weights=weights, pull=pull)
    free = skeleton.is_cleaned
    for frame in range(4):
        one = start.slice_frames(frame, frame + 1)

        def residuals(angles, one=one, frame=frame):
            channels = one.channels.copy()
            channels[:, free] = angles
            error = forward_kinematics(one.with_channels(channels))[0][0] - targets[frame]
            change = np.radians(angles - one.channels[0, free])
            return np.append(error * np.sqrt(weights)[:, None], pull * change)

        best = least_squares(residuals, one.channels[0, free], xtol=1e-12, ftol=1e-14, gtol=1e-12)
        np.testing.assert_allclose(solved.channels[frame, free], best.x, atol=0.05)
        ours = np.sum(residuals(solved.channels[frame, free]) ** 2)
        assert ours == pytest.approx(2 * best.cost, rel=1e-5)


def test_reachable_targets_are_reached(walk):
    start = walk.slice_frames(0, 40)
    shift = np.random.default_rng(0).normal(size=start.channels.shape) * 4
    goal = start.with_channels(start.channels + shift * start.skeleton.is_cleaned)
    targets, _ = forward_kinematics(goal)
    solved, residual = solve_angles(start, targets)
    assert residual.max() < 1e-6
    np.testing.assert_allclose(forward_kinematics(solved)[0], targets, atol=1e-6)


def test_angles_come_back_where_positions_tell_them(small_motion):
    spine = [small_motion.skeleton.channel_index(f"Spine.{a}rotation") for a in "XYZ"]
    channels = small_motion.channels.copy()
    channels[:, spine] += [5.0, -4.0, 3.0]
    targets, _ = forward_kinematics(small_motion.with_channels(channels))
    chosen = np.isin(np.arange(small_motion.skeleton.n_channels), spine)
    solved, _ = solve_angles(small_motion, targets, channels=chosen)
    np.testing.assert_allclose(solved.channels, channels, atol=1e-4)


def test_own_positions_as_targets_change_nothing(walk):
    start = walk.slice_frames(0, 20)
    solved, residual = solve_angles(start, forward_kinematics(start)[0])
    np.testing.assert_allclose(solved.channels, start.channels, atol=1e-9)
    assert residual.max() < 1e-9


def test_root_positions_and_last_joints_stay(small_motion):
    skeleton = small_motion.skeleton
    targets = forward_kinematics(small_motion)[0] + np.random.default_rng(0).normal(size=(40, 5, 3))
    solved, _ = solve_angles(small_motion, targets)
    changed = np.abs(solved.channels - small_motion.channels).max(axis=0) > 0
    assert not changed[skeleton.channel_joint == 0].any()
    # LeftHand and Leg move only their End Sites
    assert not changed[np.isin(skeleton.channel_joint, [3, 4])].any()
    assert changed[np.isin(skeleton.channel_joint, [1, 2])].all()


def test_position_channels_below_the_root_stay():
    skeleton = arm(3.0, 4.0, kinds=("Xposition", "Yposition", "Zposition", "Zrotation"))
    channels = np.zeros((1, skeleton.n_channels))
    channels[0, skeleton.channel_index("joint0.Xposition")] = 3.0
    channels[0, skeleton.channel_index("joint1.Xposition")] = 4.0
    channels[0, skeleton.channel_index("joint0.Zrotation")] = 20.0
    targets = np.zeros((1, 4, 3))
    targets[0, 3] = [3.0, 4.0, 0.0]
    start = Motion(skeleton, 0.01, channels)
    solved, residual = solve_angles(start, targets, weights=[0, 0, 0, 1])
    assert residual[0, 3] < 1e-6
    kept = ~skeleton.is_rotation
    np.testing.assert_array_equal(solved.channels[:, kept], channels[:, kept])


def test_chunks_do_not_matter(walk, monkeypatch):
    start = walk.slice_frames(0, 30)
    targets = forward_kinematics(start)[0] + np.random.default_rng(0).normal(size=(30, 31, 3)) * 0.1
    whole, _ = solve_angles(start, targets, pull=0.2)
    monkeypatch.setattr(ik, "CHUNK_FRAMES", 7)
    parts, _ = solve_angles(start, targets, pull=0.2)
    np.testing.assert_allclose(whole.channels, parts.channels, atol=1e-9)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"targets": np.zeros((40, 4, 3))}, r"targets of shape \(40, 5, 3\), got \(40, 4, 3\)"),
        ({"targets": np.full((40, 5, 3), np.nan)}, "target of joint 'Hips' is not finite in fr"),
        ({"weights": [1, 2]}, "expected 5 weights of 0 or more"),
        ({"weights": [1, 1, 1, 1, -1]}, "expected 5 weights of 0 or more"),
        ({"weights": [1, 1, 1, 1, np.nan]}, "expected 5 weights of 0 or more"),
        ({"channels": np.ones(16)}, "channels of shape"),
        ({"channels": np.ones(3, dtype=bool)}, r"channels of shape \(16,\)"),
        ({"channels": np.ones(16, dtype=bool)}, r"below the root, got channel Hips\.Xposition"),
        ({"pull": 0.0}, "pull must be a positive length"),
        ({"pull": np.nan}, "pull must be a positive length"),
    ],
)
def test_bad_arguments(small_motion, change, message):
    arguments = {"targets": np.zeros((40, 5, 3)), **change}
    with pytest.raises(ValueError, match=message):
        solve_angles(small_motion, **arguments)


def test_gaps_are_refused(small_motion):
    channels = small_motion.channels.copy()
    channels[3, 7] = np.nan
    with pytest.raises(ValueError, match=r"Spine\.Yrotation is missing \(NaN\) in frame 3"):
        solve_angles(small_motion.with_channels(channels), np.zeros((40, 5, 3)))
