"""Every measure against a case worked out by hand, or against scipy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import procrustes
from scipy.spatial.transform import Rotation
from test_kinematics import arm
from test_measures_movement import stepping

from mocaplab.bvh import load_bvh
from mocaplab.corruption import corrupt
from mocaplab.filters import GaussianDenoiser, Untouched
from mocaplab.kinematics import forward_kinematics
from mocaplab.measures.by_name import (
    GAP_MEASURES,
    MEASURES,
    GapBin,
    acceleration_error_cm_s2,
    bone_length_change_percent,
    euler_mae_rad,
    foot_skate_cm_s,
    gap_rms_by_length,
    gap_rms_deg,
    geodesic_deg,
    ground_penetration_cm,
    harm_deg,
    jitter_cm_s3,
    mpjpe_cm,
    pa_mpjpe_cm,
    peak_speed_loss_percent,
    procrustes_align,
    quaternion_l1,
    rms_all_deg,
    rms_moving_deg,
)
from mocaplab.measures.gaps import shares_within
from mocaplab.measures.movement import foot_contacts, jitter
from mocaplab.motion import Corrupted, moving_channels
from mocaplab.motion_model import CM_PER_UNIT

ANGLE_MEASURES = [
    rms_all_deg,
    rms_moving_deg,
    harm_deg,
    geodesic_deg,
    quaternion_l1,
    euler_mae_rad,
]
POSITION_MEASURES = [
    mpjpe_cm,
    pa_mpjpe_cm,
    acceleration_error_cm_s2,
    peak_speed_loss_percent,
    foot_skate_cm_s,
    ground_penetration_cm,
]
SLIDER = (("Xposition", "Yposition", "Zposition"), ())


def bend(*elbow_deg):
    """Hold the shoulder still and bend the elbow to an angle a frame; frames 0.1 s apart."""
    return arm([[0.0, angle] for angle in elbow_deg])


def on_path(x, frame_time):
    """Slide the arm along X, unbent."""
    return replace(arm(np.stack([x, 0 * x, 0 * x], axis=1), SLIDER), frame_time=frame_time)


# --- angles ---


def test_rms_counts_still_channels_or_not(walk):
    moving = moving_channels(walk)
    off = walk.with_channels(walk.channels + 2.0 * moving)
    assert rms_moving_deg(off, walk) == pytest.approx(2.0)
    share = moving.sum() / walk.skeleton.is_cleaned.sum()
    assert rms_all_deg(off, walk) == pytest.approx(2.0 * np.sqrt(share))


def test_rms_leaves_the_root_out(walk):
    channels = walk.channels.copy()
    channels[:, :6] += 100.0
    assert rms_all_deg(walk.with_channels(channels), walk) == 0.0


def test_rms_is_the_root_of_the_mean_of_squares():
    """Errors 0, 3, 4, 0 degrees at the elbow: the mean of the squares is 25 / 4."""
    assert rms_all_deg(bend(0, 13, 14, 5), bend(0, 10, 10, 5)) == pytest.approx(2.5)
    assert harm_deg(bend(0, 13, 14, 5), bend(0, 10, 10, 5)) == pytest.approx(2.5)


@pytest.mark.parametrize("measure", [rms_moving_deg, harm_deg, geodesic_deg])
def test_where_nothing_moves_nothing_is_wrong(measure):
    assert measure(bend(7, 8), bend(5, 5)) == 0.0


def test_geodesic_angle_of_a_hinge_is_its_difference():
    """Off by 30 and by 50 degrees; 350 is 10 the other way round."""
    assert geodesic_deg(bend(30, 60), bend(0, 10)) == pytest.approx((30 + 50) / 2)
    assert geodesic_deg(bend(350, 10), bend(0, 10)) == pytest.approx((10 + 0) / 2)


def test_geodesic_angle_of_two_quarter_turns_is_a_third_of_a_turn():
    """90 degrees about Z and then about X carry the axes X, Y, Z round: a turn by 120."""
    names = ((), ("Zrotation", "Xrotation", "Yrotation"))
    clean = arm([[0, 0, 0], [10, 0, 0]], names)
    assert geodesic_deg(arm([[90, 90, 0], [10, 0, 0]], names), clean) == pytest.approx(60)
    # The alternate triple of the clean pose is no error at all.
    assert geodesic_deg(arm([[180, 180, 180], [10, 0, 0]], names), clean) == pytest.approx(
        0, abs=1e-6
    )


def test_quaternion_l1_of_a_quarter_turn_is_one():
    """(sqrt(1/2), 0, 0, sqrt(1/2)) minus (1, 0, 0, 0): 1 - sqrt(1/2) + sqrt(1/2) = 1."""
    still = arm([[0, 0], [0, 0]])
    assert quaternion_l1(arm([[0, 90], [0, 0]]), still) == pytest.approx(1 / 2)
    assert quaternion_l1(arm([[90, 90], [90, 90]]), still) == pytest.approx(2)


def test_quaternion_l1_takes_the_nearer_sign():
    """A full turn makes -q out of q: the same pose."""
    assert quaternion_l1(bend(360 + 90, 360), bend(0, 0)) == pytest.approx(1 / 2)


def test_euler_difference_is_wrapped_and_summed_over_joints():
    """350 is 10 degrees off and 20 is 20, in one frame of two."""
    off = euler_mae_rad(arm([[350, 20], [0, 0]]), arm([[0, 0], [0, 0]]))
    assert off == pytest.approx(np.radians(30) / 2)


# --- gaps ---


def test_gap_error_looks_at_hidden_samples_only():
    """Hidden: errors 3 and 4. Observed: 100, which does not count."""
    clean, filled = bend(0, 0, 0, 0), bend(100, 3, 4, 0)
    mask = np.array([[1, 1], [1, 0], [1, 0], [1, 1]], dtype=bool)
    assert gap_rms_deg(filled, clean, mask) == pytest.approx(np.sqrt((9 + 16) / 2))
    assert np.isnan(gap_rms_deg(filled, clean, np.ones((4, 2), dtype=bool)))


def test_hidden_positions_are_no_degrees():
    sliding = on_path(np.arange(3.0), 0.1)
    assert np.isnan(gap_rms_deg(sliding, sliding, np.zeros((3, 3), dtype=bool)))


def test_gap_error_by_length():
    """Two gaps of 0.2 s with errors 3 and 5, one of 0.5 s with error 7: that begins a bin."""
    error = np.zeros((20, 2))
    mask = np.ones((20, 2), dtype=bool)
    for channel, first, frames, size in ((0, 0, 2, 3.0), (1, 18, 2, 5.0), (1, 4, 5, 7.0)):
        mask[first : first + frames, channel] = False
        error[first : first + frames, channel] = size
    table = gap_rms_by_length(arm(error), arm(np.zeros((20, 2))), mask, [0.1, 0.25, 0.5, 1.0])
    assert [table[0][:2], *table[0][3:]] == [(0.1, 0.25), 2, 4]
    assert table[0].rms_deg == pytest.approx(np.sqrt((9 + 25) / 2))
    assert table[1][3:] == (0, 0)
    assert np.isnan(table[1].rms_deg)
    assert table[2] == GapBin(0.5, 1.0, pytest.approx(7.0), 1, 5)


def test_every_length_of_gap_has_a_measure_of_its_own():
    """Gaps of 5, 6 and 300 frames at 120 per second, with errors 3, 4 and 5."""
    clean = replace(arm(np.zeros((400, 2))), frame_time=1 / 120)
    error, mask = np.zeros((400, 2)), np.ones((400, 2), dtype=bool)
    for channel, first, frames, size in ((0, 0, 5, 3.0), (0, 10, 6, 4.0), (1, 20, 300, 5.0)):
        mask[first : first + frames, channel] = False
        error[first : first + frames, channel] = size
    observed = clean.with_channels(np.where(mask, 0.0, np.nan))
    clip = Corrupted(clean, observed, mask)
    found = {n: m.score(clean.with_channels(error), clip) for n, m in GAP_MEASURES.items()}
    known = {name: value for name, value in found.items() if not np.isnan(value)}
    assert known == {
        "gap_rms_from_0_s_deg": pytest.approx(3),
        "gap_rms_from_0.05_s_deg": pytest.approx(4),
        "gap_rms_from_2_s_deg": pytest.approx(5),
    }


def test_gap_lengths_are_in_seconds_whatever_the_frame_rate():
    """Half a second at 30 and at 120 frames, and where a file rounds 1/120 s down."""
    for frames, frame_time in ((15, 1 / 30), (60, 1 / 120), (60, 0.0083333)):
        motion = replace(arm(np.zeros((100, 2))), frame_time=frame_time)
        mask = np.ones((100, 2), dtype=bool)
        mask[10 : 10 + frames, 1] = False
        assert [b.shortest_s for b in gap_rms_by_length(motion, motion, mask) if b.gaps] == [0.5]


def test_gap_measures_refuse_masks_and_edges_that_do_not_fit():
    motion = bend(1, 2, 3)
    with pytest.raises(ValueError, match=r"expected a mask of shape \(3, 2\), got \(3,\)"):
        gap_rms_deg(motion, motion, np.ones(3, dtype=bool))
    with pytest.raises(ValueError, match="two or more increasing gap lengths"):
        gap_rms_by_length(motion, motion, np.ones((3, 2), dtype=bool), [0.5, 0.1])


# --- positions ---


def test_mpjpe_of_an_arm_that_is_raised():
    """The elbow is at (0, 2, 0), not (2, 0, 0): sqrt(8) in one of 2 frames, 1 of 2 joints."""
    raised = arm([[90, 45], [0, 0]])
    error = mpjpe_cm(raised, arm([[0, 0], [0, 0]]), cm_per_unit=10.0)
    assert error == pytest.approx(10 * np.sqrt(8) / 4)


def test_procrustes_of_a_bent_line():
    """A line laid over a roof: no turn and no scale help, the middle and the ends share.

    The centre of the roof is 1/3 high: errors 1/3, 2/3, 1/3.
    """
    line = np.array([[-1, 0, 0], [0, 0, 0], [1, 0, 0.0]])
    roof = np.array([[-1, 0, 0], [0, 1, 0], [1, 0, 0.0]])
    raised = line + np.array([0, 1 / 3, 0])
    np.testing.assert_allclose(procrustes_align(line, roof), raised, atol=1e-12)


def test_procrustes_undoes_move_turn_and_scale_frame_by_frame():
    rng = np.random.default_rng(0)
    reference = rng.normal(size=(6, 9, 3))
    turned = Rotation.random(6, random_state=1).as_matrix() @ np.swapaxes(reference, 1, 2)
    moved = np.swapaxes(turned, 1, 2) * rng.uniform(0.1, 9, (6, 1, 1)) + rng.normal(size=(6, 1, 3))
    np.testing.assert_allclose(procrustes_align(moved, reference), reference, atol=1e-12)


@pytest.mark.parametrize("mirror", [1.0, -1.0])
def test_procrustes_agrees_with_scipy(mirror):
    """Of mirror images too, where scipy's `procrustes` would mirror and `Rotation` does not."""
    rng = np.random.default_rng(2)
    x = rng.normal(size=(12, 3)) * [mirror, 1, 1]
    y = x * [mirror, 1, 1] * 3 + 0.3 * rng.normal(size=(12, 3)) + [5, 0, -2]
    x0, y0 = x - x.mean(axis=0), y - y.mean(axis=0)
    turned = Rotation.align_vectors(y0, x0)[0].apply(x0)
    expected = y.mean(axis=0) + turned * np.linalg.lstsq(turned.reshape(-1, 1), y0.ravel())[0]
    fitted = procrustes_align(x, y)
    np.testing.assert_allclose(fitted, expected, atol=1e-10)
    if mirror > 0:
        left = np.sum((fitted - y) ** 2) / np.sum(y0**2)
        assert left == pytest.approx(procrustes(y, x)[2], rel=1e-10)


def test_procrustes_of_points_that_coincide_is_the_centre():
    fitted = procrustes_align(np.ones((2, 3, 3)), np.arange(18.0).reshape(2, 3, 3))
    np.testing.assert_allclose(fitted[1], [[12, 13, 14]] * 3)
    with pytest.raises(ValueError, match=r"one shape \(..., J, 3\), got \(4, 3\), \(5, 3\)"):
        procrustes_align(np.ones((4, 3)), np.ones((5, 3)))


def test_pa_mpjpe_does_not_see_where_the_body_stands_and_looks(small_motion):
    channels = small_motion.channels.copy()
    channels[:, :6] += [3, -4, 12, 50, 60, 70]
    elsewhere = small_motion.with_channels(channels)
    assert pa_mpjpe_cm(elsewhere, small_motion, cm_per_unit=1.0) == pytest.approx(0, abs=1e-9)
    channels[:, 3:6] = small_motion.channels[:, 3:6]
    moved = small_motion.with_channels(channels)
    assert mpjpe_cm(moved, small_motion, cm_per_unit=2.0) == pytest.approx(2 * 13)


def test_pa_mpjpe_of_a_pose_agrees_with_scipy(small_motion):
    noise = np.random.default_rng(0).normal(size=small_motion.channels.shape)
    noisy = small_motion.with_channels(small_motion.channels + 20 * noise)
    errors = []
    for p, q in zip(forward_kinematics(noisy)[0], forward_kinematics(small_motion)[0], strict=True):
        p0, q0 = p - p.mean(axis=0), q - q.mean(axis=0)
        turned = Rotation.align_vectors(q0, p0)[0].apply(p0)
        fitted = turned * np.sum(turned * q0) / np.sum(turned**2)
        errors.append(np.linalg.norm(fitted - q0, axis=1).mean())
    measured = pa_mpjpe_cm(noisy, small_motion, cm_per_unit=1.0)
    assert measured == pytest.approx(np.mean(errors), rel=1e-9)


@pytest.mark.parametrize("fps", [30, 60, 120])
def test_acceleration_error_and_jitter_of_polynomials(fps):
    """x = 4 t^2 is off by 8 units/s^2 and x = 2 t^3 has a jerk of 12, at any frame rate."""
    time_s = np.arange(2 * fps) / fps
    clean = on_path(5 * time_s, 1 / fps)
    off = on_path(5 * time_s + 4 * time_s**2, 1 / fps)
    error = acceleration_error_cm_s2(off, clean, cm_per_unit=2.0)
    assert error == pytest.approx(2 * 8, rel=1e-6)
    cubic = on_path(2 * time_s**3 - time_s**2, 1 / fps)
    assert jitter_cm_s3(cubic, cm_per_unit=2.0) == pytest.approx(2 * 12, rel=1e-6)


def test_at_30_fps_jitter_is_that_from_frame_to_frame(small_motion):
    slow = replace(small_motion, frame_time=1 / 30)
    assert jitter_cm_s3(slow, cm_per_unit=3.0) == pytest.approx(3 * jitter(slow))


def test_30_and_120_fps_agree_on_smooth_and_on_noisy_motion(walk):
    """Every fourth frame of the same recording, shaky or not."""
    assert walk.fps == pytest.approx(120, rel=1e-4)
    noisy = corrupt(walk, "angular:0.5", rng=np.random.default_rng(0)).observed
    slow = [
        replace(each, channels=each.channels[::4], frame_time=4 * each.frame_time)
        for each in (noisy, walk)
    ]
    for measure in (acceleration_error_cm_s2, foot_skate_cm_s, mpjpe_cm, pa_mpjpe_cm):
        fast = measure(noisy, walk, cm_per_unit=1.0)
        assert measure(*slow, cm_per_unit=1.0) == pytest.approx(fast, rel=0.05)
    for i, each in enumerate((noisy, walk)):
        fast = jitter_cm_s3(each, cm_per_unit=1.0)
        assert jitter_cm_s3(slow[i], cm_per_unit=1.0) == pytest.approx(fast, rel=0.05)


def test_peak_speed_that_is_lost():
    """The clean arm slides at up to 10 units/s; 7.5 is a loss of 25 %, 12.5 a gain."""
    time_s = np.arange(60) / 30
    run = np.clip(time_s - 0.5, 0, 1)
    clean = on_path(10 * run, 1 / 30)
    for speed, loss in ((7.5, 25), (10, 0), (12.5, -25), (0, 100)):
        measured = peak_speed_loss_percent(on_path(speed * run, 1 / 30), clean, cm_per_unit=3.0)
        assert measured == pytest.approx(loss, abs=1e-9)
    assert np.isnan(peak_speed_loss_percent(clean, on_path(0 * run, 1 / 30), cm_per_unit=1.0))


def test_peak_speed_is_that_of_the_joint_that_is_fastest_when_clean():
    """The elbow swings about a shoulder that stands still: the shoulder's speed is no peak."""
    time_s = np.arange(61)[:, None] / 30
    swing = 60 * np.sin(2 * np.pi * time_s) * [1, 0]
    clean = replace(arm(swing), frame_time=1 / 30)
    weak = clean.with_channels(0.5 * swing)
    # Speed 2 * angle' at the elbow; the chord of a step is shorter than its arc.
    step_rad = np.radians(60) * np.sin(2 * np.pi / 30)
    expected = 100 * (1 - np.sin(step_rad / 4) / np.sin(step_rad / 2))
    measured = peak_speed_loss_percent(weak, clean, cm_per_unit=1.0)
    assert measured == pytest.approx(expected, abs=0.01)


def test_one_bad_frame_is_no_peak_speed():
    """At 120 frames a jump of 0.2 units in one frame would be 24 units/s; over 1/30 s it is 6."""
    time_s = np.arange(240) / 120
    clean = on_path(10 * time_s, 1 / 120)
    x = 10 * time_s
    x[100] += 0.2
    loss = peak_speed_loss_percent(on_path(x, 1 / 120), clean, cm_per_unit=1.0)
    assert loss == pytest.approx(-100 * 6 / 10)


@pytest.mark.parametrize(
    ("measure", "frames"), [(acceleration_error_cm_s2, 9), (peak_speed_loss_percent, 5)]
)
def test_measures_over_time_need_some_frames(measure, frames):
    """A step of 1/30 s is 4 frames at 120 a second."""
    short = on_path(np.arange(frames - 1.0), 1 / 120)
    with pytest.raises(ValueError, match=f"at least {frames} frames, got {frames - 1}"):
        measure(short, short, cm_per_unit=1.0)
    enough = on_path(np.arange(float(frames)), 1 / 120)
    assert measure(enough, enough, cm_per_unit=1.0) == 0.0


def test_bone_lengths_that_change():
    """Bones of 5 and 12, one a fifth longer in one frame of two, and one without length."""
    clean = np.array([[[0, 0, 0], [0, 3, 4], [0, 3, 16], [0, 3, 16.0]]] * 2)
    points = clean.copy()
    points[0, 1:] += [0, 0.6, 0.8]
    parents = [-1, 0, 1, 2]
    assert bone_length_change_percent(points, clean, parents) == pytest.approx(20 / 4)
    assert np.isnan(bone_length_change_percent(points[:, :1], clean[:, :1], [-1]))
    with pytest.raises(ValueError, match=r"of shape \(2, 4, 3\), as the clean ones, got \(1, 4"):
        bone_length_change_percent(points[:1], clean, parents)


def test_angles_keep_bone_lengths(walk):
    noisy = corrupt(walk, "angular:0.9", rng=np.random.default_rng(0)).observed
    points, truth = forward_kinematics(noisy)[0], forward_kinematics(walk)[0]
    assert bone_length_change_percent(points, truth, walk.skeleton.parents) < 1e-9


# --- feet ---


def standing(cm_per_unit):
    """Both feet on the floor and still for 2 s, 0.01 s apart; legs are sliders along Y and Z.

    Channels: hips up, left foot up and along, right foot up and along.
    """
    motion = stepping(cm_per_unit)
    return motion.with_channels(np.tile([80.0, -80, 0, -80, 0], (201, 1)) / cm_per_unit)


@pytest.mark.parametrize("cm_per_unit", [1.0, CM_PER_UNIT])
def test_a_foot_that_slides_at_a_known_speed(cm_per_unit):
    """Left: 12 cm/s along the floor. Right: shaken up and down, which is no slide."""
    clean = standing(cm_per_unit)
    channels = clean.channels.copy()
    channels[:, 2] += 12 * clean.time_s / cm_per_unit
    channels[::2, 3] += 1 / cm_per_unit
    sliding = clean.with_channels(channels)
    skate = foot_skate_cm_s(sliding, clean, cm_per_unit=cm_per_unit)
    assert skate == pytest.approx((12 + 0) / 2)
    assert foot_skate_cm_s(clean, clean, cm_per_unit=cm_per_unit) == 0.0


def test_a_foot_slides_only_while_the_clean_one_stands():
    """The clean left foot rises after 1 s, at 30 cm/s: what it does later is no slide."""
    clean = stepping(1.0)
    channels = clean.channels.copy()
    channels[:, 4] = 0  # the right foot stands all the time
    clean = clean.with_channels(channels)
    last = np.flatnonzero(foot_contacts(clean, cm_per_unit=1.0)[:, 0])[-1]
    channels[last + 1 :, 2] += 1000
    late = clean.with_channels(channels)
    assert foot_skate_cm_s(late, clean, cm_per_unit=1.0) == 0.0
    channels[last, 2] += 1000
    early = clean.with_channels(channels)
    assert foot_skate_cm_s(early, clean, cm_per_unit=1.0) > 0.0


def test_of_ball_and_tip_the_one_that_stands_is_looked_at():
    """The left toes nod about the ball, which slides at 12 cm/s; the right foot is still."""
    still = standing(1.0)
    names = (("Yposition",), *[("Yposition", "Zposition"), ("Xrotation",)] * 2)
    nod = 20 * np.sin(10 * still.time_s)
    columns = [still.channels[:, :3], nod[:, None], still.channels[:, 3:], 0 * nod[:, None]]
    skeleton = replace(still.skeleton, channel_names=names)
    clean = replace(still, skeleton=skeleton, channels=np.concatenate(columns, axis=1))
    sliding = clean.with_channels(clean.channels + 12 * clean.time_s[:, None] * (np.arange(7) == 2))
    assert foot_skate_cm_s(clean, clean, cm_per_unit=1.0) == 0.0
    assert foot_skate_cm_s(sliding, clean, cm_per_unit=1.0) == pytest.approx((12 + 0) / 2)


def test_without_any_contact_skate_is_unknown():
    clean = standing(1.0)
    gliding = clean.with_channels(clean.channels + 100 * clean.time_s[:, None] * [0, 0, 1, 0, 1])
    assert not foot_contacts(gliding, cm_per_unit=1.0).any()
    assert np.isnan(foot_skate_cm_s(clean, gliding, cm_per_unit=1.0))


@pytest.mark.parametrize("cm_per_unit", [1.0, CM_PER_UNIT])
def test_a_foot_that_sinks_in(cm_per_unit):
    """Left: 3 cm deep for 50 of 201 frames, 5 cm high for 50 others, which makes up nothing."""
    clean = standing(cm_per_unit)
    channels = clean.channels.copy()
    channels[:50, 1] -= 3 / cm_per_unit
    channels[100:150, 1] += 5 / cm_per_unit
    depth = ground_penetration_cm(clean.with_channels(channels), clean, cm_per_unit=cm_per_unit)
    assert depth == pytest.approx(3 * 50 / 201 / 2)
    assert ground_penetration_cm(clean, clean, cm_per_unit=cm_per_unit) == 0.0


@pytest.mark.parametrize("measure", [foot_skate_cm_s, ground_penetration_cm])
def test_feet_are_needed(measure, small_motion):
    with pytest.raises(ValueError, match="expected a joint LeftToeBase"):
        measure(small_motion, small_motion, cm_per_unit=1.0)


# --- pairs that cannot be compared ---


@pytest.mark.parametrize("measure", ANGLE_MEASURES + POSITION_MEASURES)
def test_motions_that_differ_are_refused(measure, walk, small_motion):
    units = {"cm_per_unit": 1.0} if measure in POSITION_MEASURES else {}
    with pytest.raises(ValueError, match=r"expected motion 'small' to have the joints .* got 5"):
        measure(small_motion, walk, **units)
    with pytest.raises(ValueError, match="expected 40 frames as in 'small', got 39 in 'small'"):
        measure(small_motion.slice_frames(0, 39), small_motion, **units)
    with pytest.raises(ValueError, match=r"expected 0\.0166667 s a frame .* got 0\.0333333 s"):
        measure(replace(small_motion, frame_time=1 / 30), small_motion, **units)
    channels = small_motion.channels.copy()
    channels[7, 6] = np.nan
    with pytest.raises(ValueError, match=r"Spine\.Xrotation is NaN in frame 7; fill the gaps"):
        measure(small_motion.with_channels(channels), small_motion, **units)


def test_jitter_refuses_gaps(small_motion):
    channels = small_motion.channels.copy()
    channels[7, 6] = np.nan
    with pytest.raises(ValueError, match=r"Spine\.Xrotation is NaN in frame 7"):
        jitter_cm_s3(small_motion.with_channels(channels), cm_per_unit=1.0)


# --- the registry ---


@pytest.fixture(scope="module")
def noisy_clip(walk):
    return corrupt(walk, "angular:0.5+gaps:0.002", rng=np.random.default_rng(3))


@pytest.mark.parametrize("name", MEASURES)
def test_registered_measures_score_a_clip(name, noisy_clip):
    measure = MEASURES[name]
    noisy = Untouched().denoise(noisy_clip.observed, noisy_clip.mask)
    cleaned = GaussianDenoiser(0.03).denoise(noisy_clip.observed, noisy_clip.mask)
    before, after = (measure.score(each, noisy_clip) for each in (noisy, cleaned))
    own = measure.score(noisy_clip.clean, noisy_clip)
    if name == "harm_deg":
        assert np.isnan([before, after, own]).all()  # the input was not clean
    elif name in GAP_MEASURES and np.isnan(own):
        assert name in ("gap_rms_from_1_s_deg", "gap_rms_from_2_s_deg")  # no gap is so long
    else:
        assert abs(after - own) < abs(before - own)
        assert own < 1e-12 or name in ("jitter_cm_s3", "foot_skate_cm_s", "ground_penetration_cm")


def test_registered_lengths_know_the_unit_of_the_skeleton(noisy_clip):
    noisy = Untouched().denoise(noisy_clip.observed, noisy_clip.mask)
    expected = mpjpe_cm(noisy, noisy_clip.clean, cm_per_unit=CM_PER_UNIT)
    assert MEASURES["mpjpe_cm"].score(noisy, noisy_clip) == expected
    expected = jitter_cm_s3(noisy, cm_per_unit=CM_PER_UNIT)
    assert MEASURES["jitter_cm_s3"].score(noisy, noisy_clip) == expected


def test_harm_is_known_where_the_input_was_clean(walk):
    clip = corrupt(walk, "angular:0", rng=np.random.default_rng(0))
    smooth = GaussianDenoiser(0.058).denoise(clip.observed, clip.mask)
    assert MEASURES["harm_deg"].score(smooth, clip) == rms_moving_deg(smooth, clip.clean) > 0.5
    assert MEASURES["harm_deg"].score(clip.observed, clip) == 0.0


def test_names_end_in_their_unit():
    endings = {"deg": "_deg", "rad": "_rad", "cm": "_cm", "cm/s": "_cm_s", "cm/s^2": "_cm_s2"}
    endings |= {"cm/s^3": "_cm_s3", "%": "_percent", "": "_l1"}
    for name, measure in MEASURES.items():
        assert name.endswith(endings[measure.unit])


def test_wider_smoothing_takes_more_of_a_real_kick(data_dir):
    """What an RMS of all angles does not show: the foot gets slower, and the feet slide."""
    clip = corrupt(load_bvh(data_dir / "cmu" / "kick_02.bvh"), "0", rng=np.random.default_rng(0))
    for name in ("peak_speed_loss_percent", "foot_skate_cm_s", "harm_deg"):
        values = [
            MEASURES[name].score(GaussianDenoiser(s).denoise(clip.observed, clip.mask), clip)
            for s in (0.0, 0.03, 0.06, 0.12)
        ]
        assert np.all(np.diff(values) > 0), name


def test_shares_within_one_and_two_expected_errors():
    assert shares_within([0.5, -0.5, 1.5, -3.0], [1, 1, 1, 1]) == (0.5, 0.75)
    assert shares_within([0.5, -0.5, 1.5, -3.0], [0.1, 0.4, 2, 3]) == (0.5, 0.75)
    error = 3 * np.random.default_rng(0).normal(size=100_000)
    np.testing.assert_allclose(
        shares_within(error, np.full(100_000, 3.0)), (0.683, 0.954), atol=0.01
    )
    assert np.isnan(shares_within([], [])).all()
    with pytest.raises(ValueError, match=r"shapes \(2,\) and \(1,\)"):
        shares_within([1, 2], [1])
