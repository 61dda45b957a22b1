"""The two traps of Euler angles, full turns and branch switches, and how they are undone."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from data_tools.count_jumps import count_jumps, smallest_step
from data_tools.count_jumps import main as count_jumps_main
from mocaplab.bvh import load_bvh
from mocaplab.euler import (
    align_euler,
    align_to,
    alternate_euler,
    channels_of_order,
    continuity,
    make_continuous,
    motion_continuity,
    rotation_triples,
    unwrap_degrees,
    wrap_degrees,
)
from mocaplab.kinematics import forward_kinematics
from mocaplab.motion import Motion, Skeleton
from mocaplab.rotations import euler_to_matrix

ORDERS = ["".join(axes) for axes in product("XYZ", repeat=3) if axes[0] != axes[1] != axes[2]]
few = settings(max_examples=25, deadline=None)
triples = arrays(np.float64, (5, 3), elements=st.floats(-1000, 1000))


def smooth_triples(order, rng, n_frames=200):
    """A path that turns fully about two axes but stays 25 degrees off gimbal lock."""
    t = np.linspace(0, 1, n_frames)
    centre = 90.0 if order[0] == order[2] else 0.0
    middle = centre + 65 * np.sin(2 * np.pi * t + rng.uniform(0, 6))
    return np.stack([700 * t + rng.uniform(-90, 90), middle, 50 - 900 * t], axis=-1)


@given(st.floats(-1e6, 1e6))
def test_wrap_degrees_stays_in_range_and_changes_only_full_turns(angle):
    wrapped = wrap_degrees(angle)
    assert -180 <= wrapped < 180
    assert (wrapped - angle) / 360 == pytest.approx(np.round((wrapped - angle) / 360), abs=1e-9)


@pytest.mark.parametrize(
    ("angle", "wrapped"),
    [
        (180, -180),
        (-180, -180),
        (540, -180),
        (0.1, 0.1),
        (359, -1),
        (-190.0, 170),
        (np.nextafter(-180, -181), np.nextafter(180, 0)),
        (np.nan, np.nan),
    ],
)
def test_wrap_degrees_exactly(angle, wrapped):
    np.testing.assert_array_equal(wrap_degrees(angle), wrapped)


@pytest.mark.parametrize("order", ORDERS)
@few
@given(angles_deg=triples)
def test_the_alternate_triple_is_the_same_rotation(order, angles_deg):
    other = alternate_euler(angles_deg, order)
    np.testing.assert_allclose(
        euler_to_matrix(other, order), euler_to_matrix(angles_deg, order), atol=1e-12
    )
    twice = alternate_euler(other, order)
    np.testing.assert_allclose(wrap_degrees(twice - angles_deg + 90), 90, atol=1e-9)


@pytest.mark.parametrize("order", ["XY", "XXY", "XYY", "xyz", "XYZX", ""])
def test_the_alternate_triple_needs_a_proper_order(order):
    with pytest.raises(ValueError, match="three letters"):
        alternate_euler(np.zeros(3), order)


@pytest.mark.parametrize("order", ORDERS)
@few
@given(angles_deg=triples, reference=triples)
def test_align_euler_takes_the_nearest_of_all_triples(order, angles_deg, reference):
    aligned = align_euler(angles_deg, reference, order)
    np.testing.assert_allclose(
        euler_to_matrix(aligned, order), euler_to_matrix(angles_deg, order), atol=1e-12
    )
    distance = np.linalg.norm(aligned - reference, axis=-1)
    for triple in (angles_deg, alternate_euler(angles_deg, order)):
        rival = reference + wrap_degrees(triple - reference)
        assert np.all(distance <= np.linalg.norm(rival - reference, axis=-1) + 1e-9)


def test_align_euler_leaves_near_angles_alone_bit_for_bit():
    rng = np.random.default_rng(2)
    angles_deg = rng.uniform(-60, 60, (50, 3))
    aligned = align_euler(angles_deg, angles_deg + rng.normal(size=(50, 3)), "ZYX")
    np.testing.assert_array_equal(aligned, angles_deg)


def test_align_euler_keeps_nan_where_it_was_and_ignores_nan_in_the_reference():
    angles_deg = np.array([[370.0, np.nan, 10.0], [5.0, 6.0, 367.0]])
    reference = np.array([[0.0, 0.0, 0.0], [np.nan, 0.0, 0.0]])
    expected = [[10.0, np.nan, 10.0], [5.0, 6.0, 7.0]]
    np.testing.assert_array_equal(align_euler(angles_deg, reference, "XYZ"), expected)


@pytest.mark.parametrize("order", ORDERS)
def test_continuity_recovers_planted_turns_and_switches(order):
    rng = np.random.default_rng(3)
    smooth = smooth_triples(order, rng)
    switched = rng.random(len(smooth)) < 0.2
    switched[0] = False  # frame 0 sets the branch
    planted = np.where(switched[:, None], alternate_euler(smooth, order), smooth)
    planted += 360.0 * rng.integers(-3, 4, smooth.shape) * (np.arange(200) > 0)[:, None]

    sign, offset = continuity(planted, order)
    np.testing.assert_allclose(sign * planted + offset, smooth, atol=1e-10)
    np.testing.assert_allclose(sign * (smooth - offset), planted, atol=1e-10)
    assert set(np.unique(sign)) <= {-1.0, 1.0}
    np.testing.assert_array_equal(offset % 180, 0)


@pytest.mark.parametrize("order", ORDERS)
@few
@given(path=arrays(np.float64, (30, 3), elements=st.floats(-180, 180)))
def test_continuity_keeps_rotations_and_leaves_no_jump_it_could_remove(order, path):
    sign, offset = continuity(path, order)
    continuous = sign * path + offset
    np.testing.assert_array_equal(continuous[0], path[0])
    np.testing.assert_allclose(
        euler_to_matrix(continuous, order), euler_to_matrix(path, order), atol=1e-12
    )
    step = np.linalg.norm(np.diff(continuous, axis=0), axis=-1)
    best = align_euler(continuous[1:], continuous[:-1], order)
    assert np.all(step <= np.linalg.norm(best - continuous[:-1], axis=-1) + 1e-9)


@pytest.mark.parametrize("order", ["ZYX", "YXZ", "ZXZ"])
@pytest.mark.parametrize("hidden", ["middle", "start", "end", "one channel", "scattered"])
def test_continuity_is_not_disturbed_by_nan(order, hidden):
    rng = np.random.default_rng(4)
    smooth = smooth_triples(order, rng, n_frames=600)
    switched = np.arange(600)[:, None] // 50 % 2 == 1
    planted = np.where(switched, alternate_euler(smooth, order), smooth)
    planted[1:] = wrap_degrees(planted[1:])
    gap = np.zeros_like(planted, dtype=bool)
    if hidden == "scattered":
        gap = rng.random(planted.shape) < 0.2
        gap[0] = False
    else:
        rows = {"middle": slice(295, 305), "start": slice(0, 7), "end": slice(580, 600)}
        gap[rows.get(hidden, slice(295, 305)), 2 if hidden == "one channel" else slice(None)] = True
    planted[gap] = np.nan

    sign, offset = continuity(planted, order)
    continuous = sign * planted + offset
    np.testing.assert_array_equal(np.isnan(continuous), gap)
    assert np.isfinite(sign).all()
    assert np.isfinite(offset).all()
    # After a hidden start the turn count is a convention: compare up to a constant.
    shift = np.nanmean(continuous - smooth, axis=0)
    np.testing.assert_allclose((continuous - smooth - shift)[~gap], 0, atol=1e-8)
    np.testing.assert_allclose(wrap_degrees(shift), 0, atol=1e-9)


def test_continuity_goes_on_through_a_gap():
    """What fills a gap is put back on the branch and turn of the frame before the gap."""
    planted = smooth_triples("ZYX", np.random.default_rng(8))
    planted[50:] = alternate_euler(planted[50:], "ZYX")
    planted[1:] = wrap_degrees(planted[1:])
    planted[120:130] = planted[195:] = np.nan
    planted[170:175, :2] = np.nan
    sign, offset = continuity(planted, "ZYX")
    assert offset[119].any()
    for start, stop, channels in [(120, 130, [0, 1, 2]), (170, 175, [0, 1]), (195, 200, [0, 1, 2])]:
        for held in (sign[:, channels], offset[:, channels]):
            np.testing.assert_array_equal(held[start:stop], [held[start - 1]] * (stop - start))


def test_continuity_of_a_channel_that_was_never_observed():
    path = smooth_triples("ZYX", np.random.default_rng(5))
    path[:, 1] = np.nan
    sign, offset = continuity(wrap_degrees(path), "ZYX")
    assert np.isfinite(sign * offset).all()


def test_continuity_of_one_frame_changes_nothing():
    sign, offset = continuity(np.array([[350.0, -170.0, 20.0]]), "ZYX")
    assert sign.tolist() == [[1, 1, 1]]
    assert offset.tolist() == [[0, 0, 0]]


def test_continuity_works_on_many_joints_at_once():
    rng = np.random.default_rng(6)
    paths = wrap_degrees(np.stack([smooth_triples("ZYX", rng) for _ in range(3)], axis=1))
    sign, offset = continuity(paths, "ZYX")
    for joint in range(3):
        alone = continuity(paths[:, joint], "ZYX")
        np.testing.assert_array_equal(sign[:, joint], alone[0])
        np.testing.assert_array_equal(offset[:, joint], alone[1])


def wrapped_motion() -> tuple[Motion, Motion]:
    """A smooth motion, and the same poses as a file would hold them: with jumps."""
    skeleton = Skeleton(
        joint_names=("Root", "Ball", "Hinge", "Saddle"),
        parents=[-1, 0, 1, 2],
        offsets=[[0, 0, 0], [1, 0, 0], [0, 2, 0], [0, 0, 3]],
        channel_names=(
            ("Zrotation", "Xposition", "Yrotation", "Xrotation"),
            ("Yrotation", "Zrotation", "Xrotation"),
            ("Yrotation",),
            ("Zrotation", "Xrotation"),
        ),
        end_site_parents=[],
        end_site_offsets=np.zeros((0, 3)),
    )
    rng = np.random.default_rng(7)
    smooth = np.empty((200, 10))
    smooth[:, 1] = np.linspace(0, 2000, 200)  # a position may pass 180
    smooth[:, [0, 2, 3]] = smooth_triples("ZYX", rng)
    smooth[:, 4:7] = smooth_triples("YZX", rng)
    smooth[:, 7:] = np.linspace([0, 10, 20], [800, -900, 1000], 200)
    jumpy = smooth.copy()
    jumpy[90:130, 4:7] = alternate_euler(jumpy[90:130, 4:7], "YZX")
    jumpy[1:, skeleton.is_rotation] = wrap_degrees(jumpy[1:, skeleton.is_rotation])
    return Motion(skeleton, 0.01, smooth), Motion(skeleton, 0.01, jumpy)


def test_make_continuous_recovers_balls_hinges_and_saddles():
    smooth, jumpy = wrapped_motion()
    np.testing.assert_allclose(make_continuous(jumpy).channels, smooth.channels, atol=1e-9)
    sign, offset = motion_continuity(jumpy)
    assert not offset[:, 1].any()  # the position
    np.testing.assert_allclose(sign * (smooth.channels - offset), jumpy.channels, atol=1e-9)


def test_a_root_that_goes_far_in_each_frame_is_not_taken_for_a_trembling_joint():
    """In millimetres, a walk goes over 20 units a frame."""
    smooth, jumpy = (
        m.with_channels(m.channels * np.where(m.skeleton.is_rotation, 1, 100))
        for m in wrapped_motion()
    )
    np.testing.assert_allclose(make_continuous(jumpy).channels, smooth.channels, atol=1e-9)


def test_make_continuous_keeps_every_position(small_motion):
    _, jumpy = wrapped_motion()
    for motion in (jumpy, small_motion):
        before, after = (
            forward_kinematics(motion)[0],
            forward_kinematics(make_continuous(motion))[0],
        )
        np.testing.assert_allclose(after, before, atol=1e-9)


def test_make_continuous_keeps_nan():
    smooth, jumpy = wrapped_motion()
    holed = jumpy.channels.copy()
    holed[50:60] = np.nan
    continuous = make_continuous(jumpy.with_channels(holed)).channels
    np.testing.assert_array_equal(np.isnan(continuous), np.isnan(holed))
    seen = ~np.isnan(holed)
    np.testing.assert_allclose(continuous[seen], smooth.channels[seen], atol=1e-9)


def test_align_to_goes_back_to_a_files_own_angles():
    smooth, jumpy = wrapped_motion()
    np.testing.assert_allclose(align_to(smooth, jumpy).channels, jumpy.channels, atol=1e-9)


def test_align_to_refuses_another_skeleton_or_length(small_motion):
    smooth, _ = wrapped_motion()
    with pytest.raises(ValueError, match="same joints"):
        align_to(smooth, small_motion)
    with pytest.raises(ValueError, match=r"\(200 frames\).*\(1 frames\)"):
        align_to(smooth, smooth.slice_frames(0, 1))


def test_rotation_triples_keep_file_order():
    _, motion = wrapped_motion()
    assert rotation_triples(motion.skeleton) == [(0, [0, 2, 3], "ZYX"), (1, [4, 5, 6], "YZX")]


@pytest.mark.parametrize(
    "name", ["cmu/walk_14.bvh", "cmu/run_01.bvh", "cmu/kick_04.bvh", "cmu_daz/salsa_10.bvh"]
)
def test_real_clips_become_continuous_and_keep_their_poses(data_dir, name):
    motion = load_bvh(data_dir / name)
    continuous = make_continuous(motion)
    np.testing.assert_allclose(
        forward_kinematics(continuous)[0], forward_kinematics(motion)[0], atol=1e-9
    )
    for _, columns, order in rotation_triples(motion.skeleton):
        path = continuous.channels[:, columns]
        step = np.linalg.norm(np.diff(path, axis=0), axis=-1)
        best = np.linalg.norm(align_euler(path[1:], path[:-1], order) - path[:-1], axis=-1)
        assert np.all(step <= best + 1e-9)
    np.testing.assert_allclose(align_to(continuous, motion).channels, motion.channels, atol=1e-9)


def test_weak_noise_does_not_hide_a_wrap_and_strong_noise_is_not_taken_for_one(small_motion):
    joint = [small_motion.skeleton.channel_index(f"Spine.{axis}rotation") for axis in "XYZ"]
    still = np.zeros((2000, small_motion.skeleton.n_channels))
    noise = np.random.default_rng(0).normal(size=(2000, 3))

    weak = still.copy()
    weak[:, joint] = 8 * noise
    wrapped = weak.copy()
    wrapped[700:, joint[0]] += 360
    repaired = make_continuous(small_motion.with_channels(wrapped))
    np.testing.assert_allclose(repaired.channels, weak, atol=1e-9)

    strong = still.copy()
    strong[:, joint] = 90 * noise
    assert (np.abs(np.diff(strong[:, joint], axis=0)) > 180).any()
    left_alone = make_continuous(small_motion.with_channels(strong))
    np.testing.assert_array_equal(left_alone.channels, strong)


def test_unwrap_degrees_joins_turns_across_gaps_and_keeps_nan():
    smooth = np.linspace([0.0, 500.0], [1500.0, -900.0], 50)
    wrapped = wrap_degrees(smooth)
    wrapped[0] = smooth[0]
    gap = np.zeros(wrapped.shape, dtype=bool)
    gap[20:23] = True
    wrapped[gap] = np.nan
    unwrapped = unwrap_degrees(wrapped)
    np.testing.assert_array_equal(np.isnan(unwrapped), gap)
    np.testing.assert_allclose(unwrapped[~gap], smooth[~gap], atol=1e-10)


def test_channels_of_order_groups_joints_and_leaves_none_out(small_motion):
    assert channels_of_order(small_motion.skeleton) == {
        "ZYX": ([0], [[3, 4, 5]]),
        "XYZ": ([1], [[6, 7, 8]]),
        "YXZ": ([2], [[9, 10, 11]]),
        "ZXY": ([3], [[12, 13, 14]]),
        "X": ([4], [[15]]),
    }


@pytest.mark.parametrize("order", ["ZYX", "XZY", "ZXZ", "X", "ZX"])
def test_the_smallest_step_is_found_by_trying_all(order):
    rng = np.random.default_rng(9)
    start = rng.uniform(-400, 400, (50, len(order)))
    end = start + rng.uniform(-40, 40, start.shape)
    written_otherwise = end + 360.0 * rng.integers(-2, 3, end.shape)
    if len(order) == 3:
        written_otherwise[::2] = alternate_euler(written_otherwise[::2], order)
    smallest = smallest_step(start, written_otherwise, order)
    assert np.all(smallest <= np.abs(end - start).max(axis=-1) + 1e-9)
    if len(order) != 3:
        np.testing.assert_allclose(smallest, np.abs(end - start).max(axis=-1), atol=1e-9)


def test_jumps_are_counted_before_and_after():
    smooth, jumpy = wrapped_motion()
    found = count_jumps(jumpy)
    assert found.before > 10
    assert (found.after, found.removable) == (0, 0)
    assert found.shift < 1e-9
    flipped = smooth.channels.copy()
    flipped[100:, 4] += 170  # a real turn: no angles explain it
    found = count_jumps(smooth.with_channels(flipped))
    assert (found.before, found.after, found.removable) == (1, 1, 0)


def test_no_jump_is_left_in_real_clips_that_other_angles_would_remove(data_dir, capsys):
    """The table is printed too: ``pytest -s`` or ``python -m data_tools.count_jumps``."""
    assert count_jumps_main([str(data_dir)]) == 0
    table = capsys.readouterr().out
    print(table)
    _, _, _, before, after, removable, shift = table.splitlines()[-1].split()
    assert int(before) > int(after)
    assert int(removable) == 0
    assert float(shift) < 1e-9


def test_the_jump_counter_asks_for_one_folder(tmp_path, capsys):
    for arguments in ([], [str(tmp_path / "nowhere")]):
        with pytest.raises(SystemExit, match="2"):
            count_jumps_main(arguments)
    assert "is not a folder" in capsys.readouterr().err
    assert count_jumps_main([str(tmp_path)]) == 0
    assert "all 0 files" in capsys.readouterr().out
