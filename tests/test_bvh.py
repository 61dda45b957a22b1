"""Reading and writing BVH: odd files that must be read, bad files that must be refused."""

from __future__ import annotations

import contextlib
import os
import re
import stat
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mocaplab.bvh import BVHError, load_bvh, save_bvh
from mocaplab.motion import CHANNEL_NAMES, Motion, Skeleton

PLAIN = """\
HIERARCHY
ROOT Hips
{
  OFFSET 0 1 2
  CHANNELS 3 Xposition Zrotation Yrotation
  JOINT Leg
  {
    OFFSET 0 -4.5 0
    CHANNELS 1 Xrotation
    End Site
    {
      OFFSET 0 -5 1
    }
  }
}
MOTION
Frames: 2
Frame Time: 0.0083333
1 2 3 4
5 6 7 8
"""
VALUES = [[1, 2, 3, 4], [5, 6, 7, 8]]


def same(a: Motion, b: Motion) -> None:
    """Everything but the name is equal, bit for bit."""
    assert a.skeleton.joint_names == b.skeleton.joint_names
    assert a.skeleton.channel_names == b.skeleton.channel_names
    for field in ("parents", "offsets", "end_site_parents", "end_site_offsets"):
        np.testing.assert_array_equal(getattr(a.skeleton, field), getattr(b.skeleton, field))
    assert a.frame_time == b.frame_time
    np.testing.assert_array_equal(a.channels, b.channels)


@pytest.fixture
def read(tmp_path):
    """Write text or bytes to a file and read it as BVH."""

    def write_and_load(content: str | bytes) -> Motion:
        path = tmp_path / "clip.bvh"
        path.write_bytes(content.encode() if isinstance(content, str) else content)
        return load_bvh(path)

    return write_and_load


def test_a_plain_file(read):
    motion = read(PLAIN)
    skeleton = motion.skeleton
    assert motion.name == "clip"
    assert motion.frame_time == 0.0083333  # as the file says, not 1 / 120
    assert skeleton.joint_names == ("Hips", "Leg")
    assert skeleton.parents.tolist() == [-1, 0]
    assert skeleton.offsets.tolist() == [[0, 1, 2], [0, -4.5, 0]]
    assert skeleton.channel_names == (("Xposition", "Zrotation", "Yrotation"), ("Xrotation",))
    assert skeleton.end_site_parents.tolist() == [1]
    assert skeleton.end_site_offsets.tolist() == [[0, -5, 1]]
    assert motion.channels.tolist() == VALUES


ODD_BUT_READ = {
    "Windows line ends": PLAIN.replace("\n", "\r\n"),
    "old Mac line ends": PLAIN.replace("\n", "\r"),
    "byte order mark": "\ufeff" + PLAIN,
    "no newline at the end": PLAIN.rstrip(),
    "blank lines between": PLAIN.replace("\n", "\n\n \t\n"),
    "trailing blanks": PLAIN.replace("\n", " \t \n"),
    "tabs for blanks": PLAIN.replace(" ", "\t").replace("End\t", "End ").replace("e\tT", "e T"),
    "no indentation": re.sub(r"(?m)^ +", "", PLAIN),
    "lower case": PLAIN.lower().replace("hips", "Hips").replace("leg", "Leg"),
    "capitals": PLAIN.upper().replace("HIPS", "Hips").replace("LEG", "Leg"),
    "End site": PLAIN.replace("End Site", "End site"),
    "Frames, tab": PLAIN.replace("Frames: ", "Frames:\t"),
    "Frames, no blank": PLAIN.replace("Frames: ", "Frames:"),
    "Frame Time, many blanks": PLAIN.replace("Frame Time: ", "Frame  Time :   "),
    "brace on the joint's line": re.sub(r"\n *\{", " {", PLAIN),
    "brace touching the name": re.sub(r"\n *\{", "{", PLAIN),
    "scientific notation": PLAIN.replace("1 2 3 4", "1e0 0.2E+1 +3 400e-2"),
    "all values on one line": PLAIN.replace("3 4\n5", "3 4 5"),
    "one value a line": PLAIN.replace("1 2 3 4\n5 6 7 8", "1\n2\n3\n4\n5\n6\n7\n8"),
    "lines broken in a frame": PLAIN.replace("1 2 3 4\n5 6 7 8", "1 2 3\n4 5\n6 7 8"),
    "a blank line before the values": PLAIN.replace("0083333\n", "0083333\n\n"),
}


@pytest.mark.parametrize("content", ODD_BUT_READ.values(), ids=ODD_BUT_READ)
def test_odd_files_are_read_like_the_plain_one(read, content):
    same(read(content), read(PLAIN))


@pytest.mark.parametrize(
    "name", ["Left Leg", "Left  Leg", "Bein-Größe", "左足", "a:b.c", "End Site", "MOTION", "}", "3"]
)
def test_joint_names_are_kept(read, name):
    assert read(PLAIN.replace("Leg", name)).skeleton.joint_names == ("Hips", name)


def test_names_in_an_old_code_page_are_read(read):
    motion = read(PLAIN.replace("Leg", "Füße").encode("latin-1"))
    assert motion.skeleton.joint_names == ("Hips", "Füße")


def test_positions_on_every_joint(read):
    text = PLAIN.replace("1 Xrotation", "4 Zposition Xposition Yposition Yrotation")
    motion = read(text.replace("3 4", "3 4 4 4 4").replace("7 8", "7 8 8 8 8"))
    assert motion.skeleton.channel_names[1] == ("Zposition", "Xposition", "Yposition", "Yrotation")
    assert motion.channels.shape == (2, 7)


SITE = "End Site\n{\nOFFSET 0 0 %d\n}\n"


@pytest.mark.parametrize(
    ("before", "after", "parents"),
    [("", SITE % 1, [1, 0]), (SITE % 1, "", [0, 1]), (SITE % 1, SITE % 2 + SITE % 3, [0, 1, 0, 0])],
)
def test_several_end_sites_keep_their_order(read, tmp_path, before, after, parents):
    text = PLAIN.replace("  JOINT", before + "JOINT").replace("}\nMOTION", after + "}\nMOTION")
    motion = read(text)
    assert motion.skeleton.end_site_parents.tolist() == parents
    save_bvh(motion, tmp_path / "again.bvh")
    same(load_bvh(tmp_path / "again.bvh"), motion)


def test_a_joint_may_have_no_channels(read):
    motion = read(PLAIN.replace("1 Xrotation", "0").replace("3 4", "3").replace("7 8", "7"))
    assert motion.skeleton.channel_names[1] == ()
    assert motion.channels.tolist() == [[1, 2, 3], [5, 6, 7]]


def edit(old: str, new: str) -> str:
    """Change one place of the plain file."""
    assert PLAIN.count(old) == 1, old
    return PLAIN.replace(old, new)


LEG = "  JOINT Leg\n"
OFFSET_1 = "  OFFSET 0 1 2\n"
CHANNELS_1 = "  CHANNELS 3 Xposition Zrotation Yrotation\n"
# what is wrong: (the file, the line that shows it, what was expected, what was there)
BAD = {
    "empty": ("", None, "a BVH file", "an empty file"),
    "blank": (" \n\t\n", None, "a BVH file", "an empty file"),
    "binary": (b"\x89PNG\x00\xff\xfe", None, "a text file", "binary data"),
    "UTF-16": (PLAIN.encode("utf-16"), None, "a text file", "binary data"),
    "a NUL among the values": (edit("7 8", "7 8\0"), None, "a text file", "binary data"),
    "another format": ("<html>\n", 1, "HIERARCHY", "<html>"),
    "words after HIERARCHY": (edit("HIERARCHY", "HIERARCHY 2"), 1, "HIERARCHY", "HIERARCHY 2"),
    "HIERARCHY alone": ("HIERARCHY\n", 1, "ROOT", "end of the file"),
    "JOINT for ROOT": (edit("ROOT", "JOINT"), 2, "ROOT", "JOINT Hips"),
    "no joints": ("HIERARCHY\nMOTION\nFrames: 1\n", 2, "ROOT", "MOTION"),
    "no name": (edit(LEG, "JOINT\n"), 6, "a joint name", "JOINT"),
    "only a brace for a name": (edit(LEG + "  {", "JOINT {"), 6, "a joint name", "JOINT {"),
    "duplicate names": (edit("Leg", "Hips"), 6, "a new joint name", "'Hips' a second time"),
    "several roots": (edit("MOTION", "ROOT Dog\n{\n}\nMOTION"), 16, "MOTION", "ROOT Dog"),
    "no opening brace": (edit(LEG + "  {\n", LEG), 7, "{", "OFFSET 0 -4.5 0"),
    "no closing brace": (edit("}\nMOTION", "MOTION"), 15, "}", "MOTION"),
    "a brace too many": (edit("MOTION", "}\nMOTION"), 16, "MOTION", "}"),
    "two braces in a line": (edit("    }\n  }", "    } }"), 13, "}", "} }"),
    "cut in the hierarchy": (
        PLAIN[: PLAIN.index("    End")],
        9,
        "JOINT, End Site",
        "end of the file",
    ),
    "cut in the End Site": (
        PLAIN[: PLAIN.index("      OFFSET 0 -5")],
        11,
        "OFFSET",
        "end of the file",
    ),
    "no OFFSET": (edit(OFFSET_1, ""), 5, "OFFSET of joint 'Hips'", "JOINT Leg"),
    "no CHANNELS": (edit("    CHANNELS 1 Xrotation\n", ""), 13, "CHANNELS of joint 'Leg'", "}"),
    "OFFSET twice": (edit(OFFSET_1, OFFSET_1 * 2), 5, "OFFSET of joint 'Hips' once", "second"),
    "CHANNELS twice": (edit(CHANNELS_1, CHANNELS_1 * 2), 6, "CHANNELS of joint 'Hips'", "second"),
    "CHANNELS after a child": (
        edit(CHANNELS_1, "").replace("}\nMOTION", CHANNELS_1 + "}\nMOTION"),
        *(5, "CHANNELS of joint 'Hips' first", "JOINT Leg"),
    ),
    "OFFSET of two": (edit("0 1 2", "0 1"), 4, "OFFSET and three numbers", "OFFSET 0 1"),
    "OFFSET not a number": (edit("0 1 2", "0 one 2"), 4, "a number", "'one'"),
    "OFFSET with comma": (edit("-4.5", "-4,5"), 8, "a number", "'-4,5'"),
    "OFFSET infinite": (edit("-4.5", "1e999"), 8, "a finite number", "'1e999'"),
    "OFFSET underscore": (edit("-4.5", "4_5"), 8, "a finite number", "'4_5'"),
    "channel count too high": (edit("CHANNELS 3", "CHANNELS 4"), 5, "as many", "CHANNELS 4"),
    "channel count too low": (edit("CHANNELS 3", "CHANNELS 2"), 5, "as many", "CHANNELS 2"),
    "channel count of 5000 digits": (
        edit("CHANNELS 3", "CHANNELS " + "9" * 5000),
        5,
        "as many",
        "",
    ),
    "no channel count": (edit("CHANNELS 1 ", "CHANNELS "), 9, "a count", "CHANNELS Xrotation"),
    "unknown channel": (edit("1 Xrotation", "1 Wrotation"), 9, "Xposition", "'Wrotation'"),
    "repeated channel": (edit("Yrotation", "zrotation"), 5, "every channel once", "zrotation"),
    "no channels at all": (
        "HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 0\n}\nMOTION\nFrames: 9\nFrame Time: 1\n",
        *(7, "at least one channel", "none"),
    ),
    "End of something else": (edit("End Site", "End Point"), 10, "End Site", "End Point"),
    "End Site with CHANNELS": (edit("0 -5 1", "0 -5 1\nCHANNELS 0"), 13, "}", "CHANNELS 0"),
    "unknown keyword": (edit(LEG, "SCALE 2\n" + LEG), 6, "JOINT, End Site, OFFSET", "SCALE 2"),
    "words after MOTION": (edit("MOTION", "MOTION now"), 16, "MOTION", "MOTION now"),
    "no Frames": (edit("Frames: 2\n", ""), 17, "Frames:", "Frame Time: 0.0083333"),
    "Frames without colon": (edit("Frames: 2", "Frames 2"), 17, "Frames:", "Frames 2"),
    "Frames not whole": (edit("Frames: 2", "Frames: 2.0"), 17, "a whole number", "2.0"),
    "Frames negative": (edit("Frames: 2", "Frames: -2"), 17, "a whole number", "-2"),
    "Frames missing": (edit("Frames: 2", "Frames:"), 17, "a whole number", "''"),
    "no frames": (edit("Frames: 2", "Frames: 0"), 17, "at least one frame", "0"),
    "Frames of 5000 digits": (edit("Frames: 2", "Frames: " + "9" * 5000), 17, "a whole number", ""),
    "Frames huge": (edit("Frames: 2", "Frames: 99999999999"), 20, "99999999999 frames", "2"),
    "no Frame Time": (edit("Frame Time: 0.0083333\n", ""), 18, "Frame Time:", "1 2 3 4"),
    "frame time zero": (edit("0.0083333", "0"), 18, "a frame time above 0", "0"),
    "frame time negative": (edit("0.0083333", "-0.01"), 18, "a frame time above 0", "-0.01"),
    "frame time NaN": (edit("0.0083333", "nan"), 18, "a finite number", "nan"),
    "frame time in words": (edit("0.0083333", "120 fps"), 18, "a number", "120 fps"),
    "frame time missing": (edit(" 0.0083333", ""), 18, "a number", "''"),
    "a frame missing": (edit("5 6 7 8\n", ""), 19, "2 frames", "1"),
    "no values": (edit("1 2 3 4\n5 6 7 8\n", ""), 18, "2 frames", "0"),
    "a frame too many": (PLAIN + "9 9 9 9\n", 21, "2 frames", "one more"),
    "last frame cut": (edit("5 6 7 8", "5 6"), 20, "4 numbers", "2"),
    "a value too many": (edit("1 2 3 4", "1 2 3 4 5"), 19, "4 numbers", "5"),
    "NaN among the values": (edit("5 6 7 8", "5 6 nan 8"), 20, "a finite number", "'nan'"),
    "infinity among the values": (edit("2 3", "2 -inf"), 19, "a finite number", "'-inf'"),
    "a word among the values": (edit("5 6 7 8", "5 6 x 8"), 20, "a number", "'x'"),
    "numbers run together": (edit("5 6 7 8", "5 6.5.7 8 9"), 20, "a number", "'6.5.7'"),
    "a minus run together": (edit("5 6 7 8", "5 6-7 8"), 20, "a number", "'6-7'"),
    "an underscore in a value": (edit("5 6 7 8", "5 6_0 7 8"), 20, "a finite number", "'6_0'"),
    "hexadecimal": (edit("5 6 7 8", "5 0x6 7 8"), 20, "a number", "'0x6'"),
    "words after the values": (PLAIN + "the end\n", 21, "a number", "'the'"),
}


@pytest.mark.parametrize(("content", "line", "expected", "got"), BAD.values(), ids=BAD)
def test_bad_files_are_refused_with_the_line(read, content, line, expected, got):
    with pytest.raises(BVHError) as caught:
        read(content)
    error = caught.value
    assert error.line == line
    assert expected in error.expected
    assert got in error.got
    where = error.path if line is None else f"{error.path}:{line}"
    assert str(error) == f"{where}: expected {error.expected}, got {error.got}"
    assert len(str(error)) < 400 + len(error.path)


def test_line_numbers_count_blank_lines_and_windows_line_ends(read):
    with pytest.raises(BVHError) as caught:
        read(edit("5 6 7 8", "\n\n5 6 x 8").replace("\n", "\r\n"))
    assert caught.value.line == 22


def test_a_folder_and_a_missing_file_are_os_errors(tmp_path):
    with pytest.raises(IsADirectoryError):
        load_bvh(tmp_path)
    with pytest.raises(FileNotFoundError):
        load_bvh(tmp_path / "missing.bvh")


def test_reading_back_gives_the_same_motion(small_motion, tmp_path):
    path = tmp_path / "small.bvh"
    save_bvh(small_motion, path)
    again = load_bvh(str(path))
    same(again, small_motion)
    assert again.name == "small"


def test_extreme_numbers_survive(read, tmp_path):
    values = [[5e-324, -0.0, 1e300, 0.1 + 0.2], [np.pi, -1e-17, 1 / 3, 123456789.123456789]]
    motion = replace(read(PLAIN), channels=np.array(values), frame_time=np.float64(1) / 120)
    save_bvh(motion, tmp_path / "extreme.bvh")
    again = load_bvh(tmp_path / "extreme.bvh")
    same(again, motion)
    assert np.signbit(again.channels[0, 1])


def as_words(hierarchy: str) -> list[str | float]:
    """Numbers by value: 0.00000 and 0.0 are the same."""
    return [float(w) if re.fullmatch(r"[-+.\de]+", w) else w for w in hierarchy.split()]


@pytest.mark.parametrize("name", ["cmu/walk_20.bvh", "cmu_daz/salsa_10.bvh"])
def test_a_real_file_keeps_its_hierarchy_and_values(data_dir, tmp_path, name):
    motion = load_bvh(data_dir / name)
    save_bvh(motion, tmp_path / "again.bvh")
    same(load_bvh(tmp_path / "again.bvh"), motion)
    before, after = (p.read_text() for p in (data_dir / name, tmp_path / "again.bvh"))
    assert as_words(after) == as_words(before)
    assert [line.strip() for line in after.splitlines()][:3] == [
        line.strip() for line in before.splitlines()
    ][:3]


@pytest.mark.parametrize("name", ["cmu/walk_20.bvh", "cmu_daz/salsa_10.bvh"])
def test_a_real_file_is_read_as_pybvh_reads_it(data_dir, name):
    pybvh = pytest.importorskip("pybvh")
    ours, theirs = load_bvh(data_dir / name), pybvh.read_bvh_file(data_dir / name, world_up="+y")
    assert ours.skeleton.joint_names == tuple(theirs.joint_names)
    angles = ours.channels[:, ours.skeleton.is_rotation].reshape(ours.n_frames, -1, 3)
    np.testing.assert_allclose(angles, np.degrees(theirs.joint_angles), atol=1e-10)
    np.testing.assert_allclose(ours.channels[:, ~ours.skeleton.is_rotation], theirs.root_pos)


def test_nan_is_refused_with_joint_and_frame(small_motion, tmp_path):
    values = small_motion.channels.copy()
    values[7, small_motion.skeleton.channel_index("Left Arm.Xrotation")] = np.nan
    with pytest.raises(ValueError, match=r"Left Arm\.Xrotation is NaN in frame 7; fill the gaps"):
        save_bvh(small_motion.with_channels(values), tmp_path / "nan.bvh")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "name", ["", " Leg", "Leg ", "Le\ng", "Le\rg", "Le\0g", "Leg{", "Leg {", "{", "\t", "Leg\u3000"]
)
def test_names_that_a_file_cannot_hold_are_refused(read, tmp_path, name):
    motion = read(PLAIN)
    skeleton = replace(motion.skeleton, joint_names=("Hips", name))
    with pytest.raises(ValueError, match="cannot hold the joint name"):
        save_bvh(replace(motion, skeleton=skeleton), tmp_path / "named.bvh")
    assert not (tmp_path / "named.bvh").exists()


@pytest.mark.parametrize(
    ("parents", "sites", "message"),
    [
        ([-1, 0, 0, 1], [], "joints must be in depth-first order"),
        ([-1, 0, 1, 0], [3, 2], "End Sites must be in depth-first order"),
    ],
)
def test_an_order_that_a_file_cannot_have_is_refused(tmp_path, parents, sites, message):
    skeleton = Skeleton(
        *(tuple("abcd"), parents, np.zeros((4, 3)), (("Xrotation",),) * 4),
        *(sites, np.zeros((len(sites), 3))),
    )
    with pytest.raises(ValueError, match=message):
        save_bvh(Motion(skeleton, 0.1, np.zeros((1, 4))), tmp_path / "order.bvh")


@pytest.mark.parametrize("failing", ["os.replace", "os.chmod"])
def test_a_failing_write_leaves_the_old_file_whole(small_motion, tmp_path, monkeypatch, failing):
    path = tmp_path / "clip.bvh"
    path.write_text("the old file")

    def fail(*_: object) -> None:
        raise OSError("the disk is full")

    monkeypatch.setattr(failing, fail)
    with pytest.raises(OSError, match="the disk is full"):
        save_bvh(small_motion, path)
    assert path.read_text() == "the old file"
    assert os.listdir(tmp_path) == ["clip.bvh"]


def test_writing_where_one_cannot_is_an_os_error(small_motion, tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(OSError, match="file"):
        save_bvh(small_motion, tmp_path / "file" / "clip.bvh")
    with pytest.raises(FileNotFoundError):
        save_bvh(small_motion, tmp_path / "missing" / "clip.bvh")
    with pytest.raises(IsADirectoryError, match="it is a folder"):
        save_bvh(small_motion, tmp_path)
    assert os.listdir(tmp_path) == ["file"]


def test_an_unwritable_folder_is_an_os_error(small_motion, tmp_path):
    locked = tmp_path / "locked"
    locked.mkdir(mode=0o500)
    if os.access(locked, os.W_OK):
        pytest.skip("this user may write everywhere")
    with pytest.raises(PermissionError):
        save_bvh(small_motion, locked / "clip.bvh")
    assert not list(locked.iterdir())


@pytest.mark.skipif(os.name != "posix", reason="permissions are POSIX's")
def test_others_may_read_a_written_file_as_the_umask_says(small_motion, tmp_path):
    before = os.umask(0o027)
    try:
        save_bvh(small_motion, tmp_path / "clip.bvh")
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / "clip.bvh").stat().st_mode) == 0o640


finite = st.floats(allow_nan=False, allow_infinity=False)
names = st.text(st.characters(exclude_categories=["Cs", "Cc"]), min_size=1, max_size=8).filter(
    lambda name: name == name.strip() and not name.endswith("{")
)


@st.composite
def motions(draw) -> Motion:
    """Any hierarchy whose joints are in depth-first order, with any channels."""
    joint_names = tuple(draw(st.lists(names, min_size=1, max_size=6, unique=True)))
    parents, branch, sites = [-1], [0], []
    for joint in range(1, len(joint_names)):
        while len(branch) > 1 and draw(st.booleans()):
            sites += [branch.pop()] * draw(st.integers(0, 1))
        parents.append(branch[-1])
        branch.append(joint)
    subset = st.lists(st.sampled_from(CHANNEL_NAMES), max_size=6, unique=True).map(tuple)
    channels = [draw(subset.filter(len)), *(draw(subset) for _ in joint_names[1:])]
    width, length = sum(map(len, channels)), draw(st.integers(1, 3))
    block = draw(st.lists(finite, min_size=width * length, max_size=width * length))
    skeleton = Skeleton(
        *(joint_names, parents, [[draw(finite) for _ in "xyz"] for _ in joint_names]),
        *(tuple(channels), sites, np.reshape([[draw(finite)] * 3 for _ in sites], (-1, 3))),
    )
    frame_time = draw(st.floats(1e-9, 1e9))
    return Motion(skeleton, frame_time, np.reshape(block, (length, width)))


relaxed = settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


@relaxed
@given(motion=motions())
def test_any_motion_survives_a_file(tmp_path, motion):
    save_bvh(motion, tmp_path / "any.bvh")
    same(load_bvh(tmp_path / "any.bvh"), motion)


@settings(relaxed, max_examples=300)
@given(
    place=st.integers(0, len(PLAIN) - 1),
    length=st.integers(0, 12),
    patch=st.binary(max_size=8) | st.sampled_from([*PLAIN.split(), "\n"]).map(str.encode),
)
def test_damaged_files_give_a_bvh_error_or_a_valid_motion(read, place, length, patch):
    plain = PLAIN.encode()
    with contextlib.suppress(BVHError):
        motion = read(plain[:place] + patch + plain[place + length :])
        assert np.isfinite(motion.channels).all()
        assert motion.frame_time > 0


@pytest.mark.parametrize(
    "words",
    [
        *("-0 1", "1 -0", "-0.0 -0e5", "1. .5 +1 007", "1  2\t\t3", "1 \n2 \n", "1e-08 2E+3"),
        *(
            "18446744073709551616 9007199254740993",
            "5e-324 2.2250738585072011e-308",
            "\x0c1\u30002",
        ),
        "0.1 " * 30_000 + "-0 " + "1.\n" * 20_000,  # several blocks, read in different ways
    ],
    ids=lambda words: words[:20],
)
def test_numbers_are_those_of_float_bit_by_bit(read, words):
    expected = np.array([float(word) for word in words.split()])
    text = edit("1 2 3 4\n5 6 7 8", words).replace("3 Xposition Zrotation Yrotation", "1 Xposition")
    text = text.replace("1 Xrotation", "0").replace("Frames: 2", f"Frames: {len(expected)}")
    assert read(text).channels.tobytes() == expected.tobytes()


@pytest.mark.parametrize(
    "word", ["true", "null", '"6"', "{}", "[6]", "[", "6]", "6,7", "6,", "1e999", "//", "٣_"]
)
def test_what_only_json_allows_is_refused(read, word):
    with pytest.raises(BVHError) as caught:
        read(edit("5 6 7 8", f"5 {word} 7 8"))
    assert caught.value.line == 20


@relaxed
@given(st.lists(finite, min_size=1, max_size=40))
def test_numbers_are_written_as_short_as_repr_writes_them(read, tmp_path, values):
    motion = read(PLAIN)
    skeleton = replace(motion.skeleton, channel_names=(("Xposition",), ()))
    save_bvh(Motion(skeleton, 0.1, np.array(values)[:, None]), tmp_path / "short.bvh")
    lines = (tmp_path / "short.bvh").read_text().splitlines()[-len(values) :]
    for line, value in zip(lines, values, strict=True):
        assert float(line) == value
        digits, as_repr = (re.sub(r"e.*|\D", "", text).strip("0") for text in (line, repr(value)))
        assert len(digits) <= len(as_repr)


def test_a_motion_in_columns_is_written_in_rows(small_motion, tmp_path):
    turned = small_motion.with_channels(np.asfortranarray(small_motion.channels))
    save_bvh(turned, tmp_path / "turned.bvh")
    same(load_bvh(tmp_path / "turned.bvh"), small_motion)


@pytest.mark.parametrize("end", ["\n", "\r\n"])
@pytest.mark.parametrize(
    "word", ["99999999999999999999999", str(-(2**63) - 1), str(2**64), "-0", "-0.0", "1e-320"]
)
def test_words_that_parsers_of_json_treat_in_their_own_way(tmp_path, word, end):
    """Long whole numbers, and the sign of zero, wherever in a line the word stands."""
    head, _ = PLAIN.split("1 2 3 4")
    text = head + f"{word} 2 3 {word}\n5 {word} 7 8\n"
    (tmp_path / "a.bvh").write_bytes(text.replace("\n", end).encode())
    channels = load_bvh(tmp_path / "a.bvh").channels
    expected = np.array([[float(word), 2, 3, float(word)], [5, float(word), 7, 8]])
    np.testing.assert_array_equal(channels, expected)
    np.testing.assert_array_equal(np.signbit(channels), np.signbit(expected))


@pytest.mark.parametrize("word", ["9" * 400, "1e400"])
def test_a_number_beyond_all_numbers_is_refused(tmp_path, word):
    (tmp_path / "a.bvh").write_text(PLAIN.replace("5 6 7 8", f"5 6 {word} 8"))
    with pytest.raises(BVHError, match=r"a\.bvh:20: expected a finite number"):
        load_bvh(tmp_path / "a.bvh")
