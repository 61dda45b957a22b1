"""The readers of ASF and AMC files take what CMU writes and refuse the rest with the line."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from data_tools.acclaim import AcclaimError
from data_tools.amc import AmcMotion, load_amc
from data_tools.asf import load_asf

ASF = """\
# two arms at a hip, the second of which has a hand
:version 1.10
:name VICON
:units
  mass 1.0
  length 0.45
  angle deg
:documentation
   free text :here, begin and end mean nothing
:root
   order TX TY TZ RX RY RZ
   axis XYZ
   position 0 0 0
   orientation 0 0 0
:bonedata
  begin
     id 1
     name hip
     direction 0 1 0
     length 3
     axis 0 0 0 XYZ
  end
  begin
     id 2
     name arm
     direction 1 0 0
     length 2
     axis 0 0 90 XYZ
    dof rx ry rz
    limits (-160.0 20.0)
           (-70.0 70.0)
           (-inf inf)
  end
  begin
     id 3
     name hand
     direction 1 0 0
     length 1
     axis 30 -20 90 ZXY
    dof rz rx
  end
  begin
     id 4
     name other
     direction -0.6 0.8 0
     length 5
     axis 0 0 0 XYZ
    dof ry
  end
:hierarchy
  begin
    root hip
    hip arm other
    arm hand
  end
"""

AMC = """\
#!OML:ASF C:\\somewhere
:FULLY-SPECIFIED
:DEGREES
1
root 0 0 0 0 0 0
arm 0 0 0
hand 0 0
other 0
2
root 10 20 30 0 0 90
arm 90 0 0
hand 0 0
other 90
3
root 1 2 3 10 -20 30
arm 15 -25 1e1
other -40
hand 5 6
"""


def write(folder, asf=ASF, amc=AMC):
    (folder / "s.asf").write_bytes(asf.encode())
    (folder / "m.amc").write_bytes(amc.encode())
    return folder / "s.asf", folder / "m.amc"


def load(folder, asf=ASF, amc=AMC) -> AmcMotion:
    skeleton, motion = write(folder, asf, amc)
    return load_amc(motion, load_asf(skeleton))


def test_readers_take_what_the_files_say(tmp_path):
    motion = load(tmp_path)
    skeleton = motion.skeleton
    assert skeleton.name == "VICON"
    assert skeleton.cm_per_unit == pytest.approx(5.6444, abs=1e-4)
    assert [(bone.name, bone.parent, bone.dofs) for bone in skeleton.bones] == [
        ("hip", -1, ""),
        ("arm", 0, "XYZ"),
        ("hand", 1, "ZX"),
        ("other", 0, "Y"),
    ]
    assert skeleton.bones[1].limits_deg == ((-160, 20), (-70, 70), (-np.inf, np.inf))
    assert skeleton.bones[2].axis_order == "ZXY"
    assert motion.n_frames == 3
    assert motion.root_positions.tolist() == [[0, 0, 0], [10, 20, 30], [1, 2, 3]]
    assert motion.angles_deg["hand"].tolist() == [[0, 0], [0, 0], [5, 6]]
    assert motion.name == "m"


def test_windows_line_ends_and_capitals_mean_the_same(tmp_path):
    plain = load(tmp_path)
    other = load(tmp_path, ASF.replace("\n", "\r\n"), AMC.replace("\n", " \r\n").lower())
    assert other.skeleton == plain.skeleton
    np.testing.assert_array_equal(other.root_positions, plain.root_positions)


ASF_ERRORS = [
    ("", None, "an ASF file", "empty"),
    ("a\0b", None, "an ASF file", "binary"),
    ("hello", 1, "a section", "'hello'"),
    (ASF.replace(":root", ":rooot"), 10, "each once of :version", "':rooot'"),
    (ASF.replace("angle deg", "angle rad"), 7, "angle deg", "'angle rad'"),
    (ASF.replace("length 0.45", "length 0"), 6, "above 0", "'length 0'"),
    (ASF.replace("  mass 1.0\n", ""), 4, "mass below", "none"),
    (ASF.replace("position 0 0 0", "position 0 1 0"), 13, "position 0 0 0", "0 1 0"),
    (ASF.replace("position 0 0 0", "position 0 0"), 13, "three numbers", "'position 0 0'"),
    (ASF.replace("TX TY TZ RX", "TY TX TZ RX"), 11, "order TX TY TZ", "TY TX"),
    (ASF.replace("TX TY TZ RX RY RZ", "TX TY TZ RX RY R"), 11, "order TX TY TZ", "RY R"),
    (ASF.replace("   axis XYZ", "   axis XYX"), 12, "an order such as XYZ", "'axis XYX'"),
    (ASF.replace("name arm", "name hip"), 23, "a new name", "'hip'"),
    (ASF.replace("name arm", "name left arm"), 25, "one word", "left arm"),
    (ASF.replace("direction 1 0 0\n     length 2", "direction 2 0 0\n     length 2"), 26, "1", "2"),
    (ASF.replace("length 2", "length x"), 27, "a number above 0", "'x'"),
    (ASF.replace("length 2", "length nan"), 27, "a number above 0", "'nan'"),
    (ASF.replace("axis 0 0 90 XYZ", "axis 0 0 90"), 28, "an order such as XYZ", "'axis 0 0 90'"),
    (ASF.replace("dof rx ry rz", "dof rx ry tz"), 29, "each at most once", "tz"),
    (ASF.replace("(-inf inf)", "(3 2)"), 32, "limits such as", "(3 2)"),
    (ASF.replace("           (-inf inf)\n", ""), 30, "3 pairs of limits", "2"),
    (ASF.replace("     id 3\n", "     id 3\n     id 3\n"), 36, "each once of id", "'id 3'"),
    (ASF.replace("    dof ry\n  end\n", "    dof ry\n"), 42, "an end", "none"),
    (ASF.replace("  end\n  begin\n     id 2", "     id 2"), 22, "each once of id", "'id 2'"),
    (ASF.replace("arm hand\n", "arm foot\n"), 54, "bones of :bonedata", "'foot'"),
    (ASF.replace("arm hand\n", "arm hip\n"), 54, "each the child of one", "'hip'"),
    (ASF.replace("    arm hand\n", ""), 50, "bone 'hand' below", "none"),
    (ASF.replace("    root hip\n", ""), 52, "root or the name of a child", "'hip'"),
    (ASF.replace("arm hand\n  end\n", "arm hand\n"), 50, "begin and end", "':hierarchy'"),
    (ASF[: ASF.index(":hierarchy")], None, "a section :hierarchy", "none"),
]


@pytest.mark.parametrize(("text", "line", "expected", "got"), ASF_ERRORS)
def test_broken_skeletons_are_refused_with_the_line(tmp_path, text, line, expected, got):
    path, _ = write(tmp_path, asf=text)
    with pytest.raises(AcclaimError) as caught:
        load_asf(path)
    error = caught.value
    assert (error.path, error.line) == (str(path), line), str(error)
    assert expected in error.expected
    assert got in error.got


AMC_ERRORS = [
    ("# nothing", None, "an AMC file", "empty"),
    (":DEGREES", None, "frames", "the end of the file"),
    (AMC.replace(":DEGREES", ":RADIANS"), 3, ":DEGREES", "':RADIANS'"),
    (AMC.replace(":FULLY-SPECIFIED\n", ""), 3, ":FULLY-SPECIFIED", "'1'"),
    (AMC.replace("DEGREES\n1\n", "DEGREES\n"), 4, "a frame number", "root"),
    (AMC.replace("\n2\n", "\n3\n"), 9, "frame number 2", "'3'"),
    (AMC.replace("\n2\n", "\n"), 9, "root once in a frame", "a second"),
    (AMC.replace("arm 90 0 0", "arm 90 0"), 11, "3 numbers after arm", "2"),
    (AMC.replace("arm 90 0 0", "arm 90 0 x"), 11, "3 finite numbers", "'x'"),
    (AMC.replace("arm 90 0 0", "arm 90 0 inf"), 11, "3 finite numbers", "'inf'"),
    (AMC.replace("arm 90 0 0", "leg 90 0 0"), 11, "a bone of the skeleton", "'leg'"),
    (AMC.replace("arm 90 0 0", "hip 90 0 0"), 11, "with angles", "'hip'"),
    (AMC.replace("arm 90 0 0", ""), 9, "arm in the frame", "none"),
    (AMC.replace("other -40\n", ""), 14, "other in the frame", "none"),
    (AMC[: AMC.index("hand 5")], 14, "hand in the frame", "none"),
]


@pytest.mark.parametrize(("text", "line", "expected", "got"), AMC_ERRORS)
def test_broken_motions_are_refused_with_the_line(tmp_path, text, line, expected, got):
    skeleton, path = write(tmp_path, amc=text)
    with pytest.raises(AcclaimError) as caught:
        load_amc(path, load_asf(skeleton))
    error = caught.value
    assert (error.path, error.line) == (str(path), line), str(error)
    assert expected in error.expected
    assert got in error.got


@settings(
    max_examples=400,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(st.data())
def test_nothing_but_acclaim_errors_comes_out_of_damaged_files(tmp_path, data):
    """Cut bytes out of either file, or put others in, and read both."""
    files = [ASF.encode(), AMC.encode()]
    which = data.draw(st.integers(0, 1))
    start = data.draw(st.integers(0, len(files[which])))
    cut = data.draw(st.integers(0, 30))
    junk = data.draw(
        st.one_of(st.binary(max_size=4), st.sampled_from([b"\n", b" 1", b":", b"end"]))
    )
    files[which] = files[which][:start] + junk + files[which][start + cut :]
    for name, content in zip(("s.asf", "m.amc"), files, strict=True):
        (tmp_path / name).write_bytes(content)
    try:
        motion = load_amc(tmp_path / "m.amc", load_asf(tmp_path / "s.asf"))
    except AcclaimError:
        return
    assert motion.n_frames == len(motion.root_angles_deg)
    assert all(len(values) == motion.n_frames for values in motion.angles_deg.values())
