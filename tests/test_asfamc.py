"""ASF/AMC: the format's own kinematics, and an exact conversion to BVH."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from test_acclaim import AMC, load, write

from data_tools.amc import AmcMotion, load_amc
from data_tools.asf import load_asf
from data_tools.asfamc import amc_to_motion, asf_forward_kinematics, asf_to_skeleton, main
from mocaplab.bvh import load_bvh, save_bvh
from mocaplab.kinematics import end_site_positions, forward_kinematics


def oracle_tips(motion: AmcMotion, frame: int) -> dict[str, np.ndarray]:
    """Tips of all bones by scipy, recursing from the root, in the format's own words."""
    skeleton, tips = motion.skeleton, {}

    def turn(angles, order):
        """Turns about fixed axes: scipy's lower-case letters."""
        if not order:
            return Rotation.identity()
        return Rotation.from_euler(order.lower(), np.array(angles), degrees=True)

    def visit(index, start, parent_turn):
        tips[skeleton.bones[index].name if index >= 0 else "root"] = start
        for child, bone in enumerate(skeleton.bones):
            if bone.parent == index:
                c = turn(bone.axis_deg, bone.axis_order)
                angles = motion.angles_deg[bone.name][frame] if bone.dofs else []
                own = parent_turn * c * turn(angles, bone.dofs) * c.inv()
                visit(child, start + own.apply(bone.direction) * bone.length, own)

    root = turn(motion.root_angles_deg[frame], skeleton.root_order)
    visit(-1, motion.root_positions[frame], root)
    return tips


def check_conversion(motion: AmcMotion, atol: float) -> float:
    """Compare the BVH's kinematics with the ASF's; return the largest difference."""
    tips, orientations = asf_forward_kinematics(motion)
    converted = amc_to_motion(motion)
    positions, turns = forward_kinematics(converted)
    parents = np.maximum(converted.skeleton.parents, 0)  # a joint lies at its parent's tip
    worst = np.abs(positions - tips[:, parents]).max()
    ends = end_site_positions(converted)
    worst = max(worst, np.abs(ends - tips[:, converted.skeleton.end_site_parents]).max())
    worst = max(worst, np.abs(turns - orientations).max())
    assert worst < atol
    return float(worst)


def test_a_two_bone_arm_by_hand(tmp_path):
    """The arm's frame is turned by 90 degrees about Z: its own X axis is the world's Y.

    In frame 2, 90 degrees about that axis swing the arm from X to -Z, and the root's 90
    degrees about Z turn the hip from Y to -X. The other bone, (-3, 4, 0) at rest, turned by
    90 degrees about Y is (0, 4, 3), and by the root (-4, 0, 3).
    """
    tips, _ = asf_forward_kinematics(load(tmp_path))
    rest = [(0, 0, 0), (0, 3, 0), (2, 3, 0), (3, 3, 0), (-3, 7, 0)]
    np.testing.assert_allclose(tips[0], rest, atol=1e-12)
    moved = [(10, 20, 30), (7, 20, 30), (7, 20, 28), (7, 20, 27), (3, 20, 33)]
    np.testing.assert_allclose(tips[1], moved, atol=1e-12)


def test_kinematics_are_as_scipy_says(tmp_path):
    motion = load(tmp_path)
    tips, _ = asf_forward_kinematics(motion)
    for frame in range(3):
        expected = list(oracle_tips(motion, frame).values())
        np.testing.assert_allclose(tips[frame], expected, atol=1e-12)


def test_conversion_is_exact_and_survives_the_file(tmp_path):
    motion = load(tmp_path)
    check_conversion(motion, 1e-12)
    converted = amc_to_motion(motion, fps=60)
    assert converted.fps == pytest.approx(60)
    assert converted.skeleton.joint_names == ("root", "hip", "arm", "hand", "other")
    assert asf_to_skeleton(motion.skeleton).offsets.tolist() == [
        [0, 0, 0],
        [0, 0, 0],
        [0, 3, 0],
        [2, 0, 0],
        [0, 3, 0],
    ]
    save_bvh(converted, tmp_path / "m.bvh")
    np.testing.assert_array_equal(load_bvh(tmp_path / "m.bvh").channels, converted.channels)
    with pytest.raises(ValueError, match="fps above 0"):
        amc_to_motion(motion, fps=0)


@pytest.mark.parametrize("trial", ["02_01", "02_02", "02_03", "02_04"])
def test_real_trials_convert_exactly(data_dir, trial):
    folder = data_dir / "cmu_asfamc"
    motion = load_amc(folder / f"{trial}.amc", load_asf(folder / "02.asf"))
    worst = check_conversion(motion, 1e-6)
    print(f"{trial}: {motion.n_frames} frames, BVH and ASF differ by at most {worst:.1e} units")
    tips, _ = asf_forward_kinematics(motion)
    names = ["root", *(bone.name for bone in motion.skeleton.bones)]
    for frame in range(0, motion.n_frames, 50):
        expected = oracle_tips(motion, frame)
        np.testing.assert_allclose(tips[frame], [expected[name] for name in names], atol=1e-9)


def test_walk_20_is_trial_02_01(data_dir):
    """Two conversions of one trial, by different people.

    Ours keeps every bone. The public one turns the legs by up to a degree, and lacks the
    thorax bone, so that all above the waist lies lower by its 2.07 units.
    """
    folder = data_dir / "cmu_asfamc"
    ours = amc_to_motion(load_amc(folder / "02_01.amc", load_asf(folder / "02.asf")))
    theirs = load_bvh(data_dir / "cmu" / "walk_20.bvh")
    assert ours.n_frames == theirs.n_frames == 343
    ours_at, theirs_at = forward_kinematics(ours)[0], forward_kinematics(theirs)[0]

    def apart(mine, public, shift=0):
        a = ours_at[max(0, -shift) :, ours.skeleton.joint_names.index(mine)]
        b = theirs_at[max(0, shift) :, theirs.skeleton.joint_names.index(public)]
        n = min(len(a), len(b))
        return float(np.linalg.norm(a[:n] - b[:n], axis=1).max())

    # The frames run in step: any shift moves the hips apart.
    assert apart("root", "Hips") < 1e-3
    assert min(apart("root", "Hips", shift) for shift in (-2, -1, 1, 2)) > 0.2
    legs = {
        public: apart(mine, public)
        for side, letter in (("Left", "l"), ("Right", "r"))
        for mine, public in (
            (letter + "tibia", side + "Leg"),
            (letter + "foot", side + "Foot"),
            (letter + "toes", side + "ToeBase"),
        )
    }
    print("legs, largest differences in units:", {k: round(v, 4) for k, v in legs.items()})
    assert max(legs.values()) < 0.23
    thorax = next(b for b in load_asf(folder / "02.asf").bones if b.name == "thorax")
    assert thorax.length == pytest.approx(2.07, abs=0.005)
    for mine, public in (("lowerneck", "Neck"), ("head", "Head"), ("lhumerus", "LeftArm")):
        assert apart(mine, public) == pytest.approx(thorax.length, abs=0.05)


def test_command_line_converts(tmp_path, capsys):
    skeleton, motion = write(tmp_path)
    output = tmp_path / "out.bvh"
    assert main([str(skeleton), str(motion), "-o", str(output), "--fps", "60"]) == 0
    assert "3 frames at 60 fps, 5 joints" in capsys.readouterr().out
    expected = amc_to_motion(load(tmp_path))
    np.testing.assert_array_equal(load_bvh(output).channels, expected.channels)


def test_command_line_says_what_is_wrong(tmp_path, capsys):
    skeleton, motion = write(tmp_path, amc=AMC.replace("arm 90", "arm x"))
    output = tmp_path / "out.bvh"
    assert main([str(skeleton), str(motion), "-o", str(output)]) == 2
    assert f"{motion}:11: expected 3 finite numbers, got 'x'" in capsys.readouterr().err
    assert main([str(tmp_path / "none.asf"), str(motion)]) == 2
    assert "none.asf" in capsys.readouterr().err
    assert not output.exists()


def test_command_line_explains_itself():
    command = [sys.executable, "-m", "data_tools.asfamc", "--help"]
    shown = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    assert "SKELETON.asf" in shown
    assert "example: python -m data_tools.asfamc" in shown
