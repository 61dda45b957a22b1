"""mocaplab clean, as a user calls it."""

import numpy as np
import pytest

from mocaplab.bvh import load_bvh, save_bvh
from mocaplab.cli import main
from mocaplab.noise.angular import angular_noise
from mocaplab.noise.faults import frozen_frames, spikes
from mocaplab.noise.gaps import load_gaps


@pytest.fixture
def noisy_file(walk, tmp_path):
    noisy = angular_noise(walk, 0.3, rng=np.random.default_rng(0))
    save_bvh(noisy.with_channels(noisy.channels.round(4)), tmp_path / "noisy.bvh")
    return tmp_path / "noisy.bvh"


def clean(*arguments):
    return main(["clean", *map(str, arguments), "--model", "ebf"])


def refused(capsys, *arguments):
    assert clean(*arguments) == 2
    captured = capsys.readouterr()
    assert captured.err.count("\n") == 1
    return captured.err


def test_listed_gaps_are_filled_or_left_open(noisy_file, tmp_path, capsys):
    gaps, out = tmp_path / "gaps.csv", tmp_path / "out.bvh"
    gaps.write_text("channel,first_frame,last_frame\nLeftLeg,50,70\nRightLeg.Xrotation,100,299\n")
    assert clean(noisy_file, "-o", out, "--gaps", gaps, "--max-gap", "1") == 0
    printed = capsys.readouterr().out
    assert (
        "filled    63 samples inside 3 gaps, the longest of 0.17 s; expect an error of" in printed
    )
    assert "left open 1 gaps that are too long" in printed
    assert "out.gaps.csv, which lists the gaps" in printed
    cleaned = load_bvh(out)
    left = ~load_gaps(tmp_path / "out.gaps.csv", cleaned)
    column = cleaned.skeleton.channel_index("RightLeg.Xrotation")
    assert np.flatnonzero(left.any(axis=0)).tolist() == [column]
    assert left[100:300, column].all()
    np.testing.assert_allclose(np.diff(cleaned.channels[99:301, column], 2), 0, atol=1e-5)
    # The list that was left is what --gaps reads; an older list does not stay.
    again = tmp_path / "again.bvh"
    assert clean(out, "-o", again, "--gaps", tmp_path / "out.gaps.csv") == 0
    assert clean(noisy_file, "-o", out) == 0
    assert (tmp_path / "out.gaps.csv").read_text().count("\n") == 1


def test_faults_are_found_when_asked_for(walk, tmp_path, capsys):
    rng = np.random.default_rng(0)
    spoilt = frozen_frames(spikes(walk, 0.002, rng=rng), 1.0, rng=rng)
    save_bvh(spoilt, tmp_path / "spoilt.bvh")
    assert clean(tmp_path / "spoilt.bvh", "-o", tmp_path / "out.bvh", "--detect") == 0
    printed = capsys.readouterr().out
    assert "frozen frames and" in printed
    assert "treated them as gaps" in printed
    assert clean(tmp_path / "spoilt.bvh", "-o", tmp_path / "plain.bvh") == 0
    assert "frozen" not in capsys.readouterr().out
    errors = [
        np.sqrt(np.mean((load_bvh(tmp_path / name).channels - walk.channels) ** 2))
        for name in ("out.bvh", "plain.bvh")
    ]
    assert errors[0] < 0.5 * errors[1]


def test_joints_of_other_names_are_matched_and_told(walk, noisy_file, tmp_path, capsys):
    text = noisy_file.read_text()
    for name in walk.skeleton.joint_names:
        text = text.replace(f" {name}\n", f" mixamorig:{name}\n")
    (tmp_path / "other.bvh").write_text(text)
    assert clean(tmp_path / "other.bvh", "-o", tmp_path / "out.bvh") == 0
    assert "mixamorig:LeftLeg = LeftLeg" in capsys.readouterr().out
    assert clean(noisy_file, "-o", tmp_path / "plain.bvh") == 0
    same = [load_bvh(tmp_path / name).channels for name in ("out.bvh", "plain.bvh")]
    np.testing.assert_array_equal(*same)


def test_what_would_destroy_what_is_read_is_refused(noisy_file, tmp_path, capsys):
    before = noisy_file.read_bytes()
    assert "written over what is read" in refused(capsys, noisy_file, "-o", noisy_file)
    gaps = tmp_path / "out.gaps.csv"
    gaps.write_text("channel,first_frame,last_frame\nLeftLeg,50,70\n")
    message = refused(capsys, noisy_file, "-o", tmp_path / "out.bvh", "--gaps", gaps)
    assert "written over what is read" in message
    assert noisy_file.read_bytes() == before


def test_bad_options(noisy_file, tmp_path, capsys):
    with pytest.raises(SystemExit):
        clean(noisy_file, "-o", tmp_path / "out.bvh", "--max-gap", "-1")
    assert "must be seconds, 0 or more, got '-1'" in capsys.readouterr().err
    message = refused(capsys, tmp_path, "-o", tmp_path / "out", "--gaps", "x.csv")
    assert "the gaps of one file" in message


def test_one_frame(walk, tmp_path, capsys):
    save_bvh(walk.slice_frames(0, 1), tmp_path / "one.bvh")
    assert clean(tmp_path / "one.bvh", "-o", tmp_path / "out.bvh", "--detect", "--report") == 0
    assert "nothing was changed" in capsys.readouterr().out
    assert (tmp_path / "out.bvh").read_text() == (tmp_path / "one.bvh").read_text()


def test_report_is_one_page_that_needs_nothing_else(noisy_file, tmp_path, capsys):
    gaps, out = tmp_path / "gaps.csv", tmp_path / "out.bvh"
    gaps.write_text("channel,first_frame,last_frame\nLeftLeg,50,70\n")
    arguments = [noisy_file, "-o", out, "--gaps", gaps, "--report", "--detect"]
    assert clean(*arguments) == 0
    assert "out.html, the report" in capsys.readouterr().out
    page = (tmp_path / "out.html").read_text()
    for text in ("Before and after", "Foot skate", "Why was this smoothed?", "What was refused"):
        assert text in page
    assert "How sure are the filled gaps?" in page
    assert page.count('src="data:image/png;base64,') == page.count("src=") == 2
    assert page.count("http") == 0
