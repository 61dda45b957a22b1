import pickle

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from data_tools.amass import SMPL_JOINTS, load_amass
from data_tools.exponential_maps import load_exponential_map
from mocaplab.files import FormatError


@pytest.fixture
def vectors():
    """Rotation vectors of 52 joints that move evenly, 30 frames."""
    rng = np.random.default_rng(0)
    return np.linspace(0, 1, 30)[:, None] * rng.normal(size=(1, 156))


def write_amass(path, **arrays):
    np.savez(path, **arrays)
    return path


def check_rotations(clip, vectors, joint):
    expected = Rotation.from_rotvec(vectors)
    found = Rotation.from_quat(clip.quaternions[:, joint][:, [1, 2, 3, 0]])
    assert (expected.inv() * found).magnitude().max() < 1e-7


@pytest.mark.parametrize("rate_name", ["mocap_framerate", "mocap_frame_rate"])
def test_amass(vectors, rate_name, tmp_path):
    arrays = {"poses": vectors, "trans": vectors[:, :3], "gender": np.array("male")}
    path = write_amass(tmp_path / "walk.npz", **arrays, **{rate_name: np.array(120.0)})
    clip = load_amass(path, "walk")
    assert clip.segments == SMPL_JOINTS
    assert clip.quaternions.shape == (30, 22, 4)
    assert (clip.name, clip.action, clip.frame_time) == ("walk", "walk", 1 / 120)
    check_rotations(clip, vectors[:, 63:66], 21)


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ({"poses": np.zeros((3, 156))}, "expected poses and mocap_framerate, got poses"),
        ({"poses": np.zeros((3, 60)), "mocap_framerate": 60.0}, r"shape \(T, 66 or more\)"),
        ({"poses": np.zeros((3, 66)), "mocap_framerate": 0.0}, "frame rate from 1 to 1000"),
        ({"poses": np.full((3, 66), np.nan), "mocap_framerate": 60.0}, "pelvis in frame 0"),
        ({"poses": np.array(["a"] * 66)[None], "mocap_framerate": 60.0}, "expected poses of shape"),
    ],
)
def test_what_is_no_motion_of_amass_is_refused(arrays, message, tmp_path):
    with pytest.raises(ValueError, match=f"walk.npz: not a motion of AMASS .*{message}"):
        load_amass(write_amass(tmp_path / "walk.npz", **arrays))


def test_nothing_in_an_amass_file_is_executed(tmp_path):
    objects = np.array([{"a": 1}], dtype=object)
    path = write_amass(tmp_path / "walk.npz", poses=objects, mocap_framerate=60.0)
    with pytest.raises(ValueError, match="not a motion of AMASS"):
        load_amass(path)
    for content in (b"no archive", pickle.dumps([1, 2]), b"PK\x03\x04 cut off", b""):
        path.write_bytes(content)
        with pytest.raises(ValueError, match="not a motion of AMASS"):
            load_amass(path)
    with pytest.raises(FileNotFoundError):
        load_amass(tmp_path / "none.npz")


@pytest.mark.parametrize(("columns", "joints"), [(99, 32), (117, 38)])
def test_exponential_maps(vectors, columns, joints, tmp_path):
    path = tmp_path / "walking_1.txt"
    np.savetxt(path, vectors[:, :columns], delimiter=",")
    clip = load_exponential_map(path, 50, action="walking")
    assert clip.quaternions.shape == (30, joints, 4)
    assert clip.segments[:2] == ("joint_00", "joint_01")
    assert (clip.name, clip.frame_time) == ("walking_1", 1 / 50)
    check_rotations(clip, vectors[:, 6:9], 1)
    some = load_exponential_map(path, 50, joints=[1, 7])
    assert some.segments == ("joint_01", "joint_07")
    check_rotations(some, vectors[:, 24:27], 1)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("1,2,3\n", "map.txt:1: expected 99 or 117 numbers with commas, got 3"),
        ("{row}\n\n" + "0," * 116 + "0\n", "map.txt:3: expected 99 numbers with commas, got 117"),
        ("{row}\n" + "0," * 98 + "x\n", "map.txt:2: expected numbers"),
        ("0," * 98 + "nan\n", "map.txt:1: expected finite numbers"),
        ("\n", "map.txt: expected lines of 99 or 117 numbers, got none"),
    ],
)
def test_other_text_is_refused(text, message, tmp_path):
    path = tmp_path / "map.txt"
    path.write_text(text.replace("{row}", ",".join(["0"] * 99)))
    with pytest.raises(FormatError) as error:
        load_exponential_map(path, 25)
    assert message in str(error.value)


def test_wrong_requests_are_refused(tmp_path):
    path = tmp_path / "map.txt"
    path.write_text(",".join(["0"] * 99))
    with pytest.raises(ValueError, match="fps above 0"):
        load_exponential_map(path, 0)
    with pytest.raises(ValueError, match="joints from 0 to 31, got 32"):
        load_exponential_map(path, 25, joints=[32])
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(FormatError, match="no text"):
        load_exponential_map(path, 25)
