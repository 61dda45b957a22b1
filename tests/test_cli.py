"""The command line, as a user calls it."""

import os
import stat
import subprocess
import sys

import numpy as np
import pytest

from mocaplab.bvh import load_bvh, save_bvh
from mocaplab.cli import main
from mocaplab.commands import info as info_command
from mocaplab.gap_fillers.curves import lerp_gaps


@pytest.fixture
def walk_file(walk, tmp_path):
    save_bvh(walk, tmp_path / "walk.bvh")
    return tmp_path / "walk.bvh"


def test_corrupt_then_clean_then_compare(walk_file, tmp_path, capsys):
    noisy, clean = tmp_path / "noisy.bvh", tmp_path / "clean.bvh"
    assert main(["corrupt", str(walk_file), "--seed", "1", "-o", str(noisy)]) == 0
    assert main(["clean", str(noisy), "-o", str(clean)]) == 0
    printed = capsys.readouterr().out
    assert "degrees RMS on the" in printed
    assert "jitter    before " in printed
    assert main(["evaluate", "--reference", str(walk_file), str(noisy), str(clean)]) == 0
    rows = [line.split("|") for line in capsys.readouterr().out.splitlines()]
    errors = {row[1].strip(): float(row[2]) for row in rows[2:]}
    assert errors["clean.bvh"] < 0.5 * errors["noisy.bvh"]


def test_clean_preserves_what_it_should(walk_file, tmp_path):
    noisy, clean = tmp_path / "noisy.bvh", tmp_path / "clean.bvh"
    main(["corrupt", str(walk_file), "-o", str(noisy)])
    main(["clean", str(noisy), "-o", str(clean)])
    hierarchy = [path.read_text().split("MOTION")[0] for path in (noisy, clean)]
    assert hierarchy[0] == hierarchy[1]
    before, after = load_bvh(noisy), load_bvh(clean)
    assert after.frame_time == before.frame_time
    still = np.ptp(before.channels, axis=0) == 0
    still[:6] = True
    assert still.sum() > 20
    np.testing.assert_array_equal(after.channels[:, still], before.channels[:, still])
    assert (after.channels != before.channels).any(axis=0).sum() > 50


def test_the_same_seed_gives_the_same_file(walk_file, tmp_path):
    files = [tmp_path / name for name in ("a.bvh", "b.bvh", "c.bvh")]
    for path, seed in zip(files, "112", strict=True):
        main(["corrupt", str(walk_file), "--seed", seed, "-o", str(path)])
    assert files[0].read_bytes() == files[1].read_bytes() != files[2].read_bytes()


def test_info_tells_what_is_in_a_file(walk_file, walk, capsys):
    assert main(["info", str(walk_file)]) == 0
    printed = capsys.readouterr().out
    assert f"frames    {walk.n_frames} at 120 per second" in printed
    assert "joints    31, and 7 end sites" in printed
    assert "LeftLeg  [Zrotation Yrotation Xrotation]" in printed


def test_info_lists_findings_in_few_lines(walk, tmp_path, capsys):
    channels = walk.channels.copy()
    channels[50:, walk.skeleton.channel_index("LeftLeg.Xrotation")] += 360
    save_bvh(walk.with_channels(channels), tmp_path / "wrapped.bvh")
    assert main(["info", str(tmp_path / "wrapped.bvh")]) == 0
    findings = capsys.readouterr().out.split("\nfindings\n")[1].split("\nskeleton")[0]
    turn, constant = findings.splitlines()
    assert turn.startswith("  1 full turn in LeftLeg.Xrotation: no movement")
    assert constant.startswith("  22 constant angles in LHipJoint.Zrotation, ")
    assert " and 19 more: " in constant


def test_info_of_a_file_without_findings(small_motion, tmp_path, capsys):
    save_bvh(small_motion, tmp_path / "small.bvh")
    assert main(["info", str(tmp_path / "small.bvh")]) == 0
    assert "findings\n  nothing to mention\nskeleton\n" in capsys.readouterr().out


def test_evaluate_prints_a_table_for_clips(walk_file, capsys):
    assert main(["evaluate", str(walk_file), "--repeats", "1"]) == 0
    printed = capsys.readouterr().out
    for text in ("| EBF", "| noisy", "Gaussian tuned per channel", "angles that move", "walk (1)"):
        assert text in printed


def test_train_clean_and_resume_on_own_files(embedded, tmp_path, capsys):
    folder, model = tmp_path / "clips", tmp_path / "model.safetensors"
    folder.mkdir()
    for clip in embedded.clips[:4]:
        save_bvh(clip, folder / f"{clip.name}.bvh")
    arguments = ["train", str(folder), "-o", str(model), "--epochs", "1"]
    assert main(arguments) == 0
    assert "test on the 1 clips held out" in capsys.readouterr().out
    assert model.exists()
    assert not (tmp_path / "model.safetensors.part").exists()
    noisy, out = folder / f"{embedded.clips[0].name}.bvh", tmp_path / "out.bvh"
    assert main(["clean", str(noisy), "-o", str(out), "--model", str(model)]) == 0
    # A second evaluation leaves the training clips out, or says that none is left.
    assert main(["evaluate", str(folder), "--model", str(model), "--repeats", "1"]) == 0
    assert "3 clips that the model was trained on are left out" in capsys.readouterr().out


def refused(arguments, capsys):
    """Run a command that must fail, and return the one line that it prints."""
    assert main([str(a) for a in arguments]) == 2
    captured = capsys.readouterr()
    assert captured.err.count("\n") == 1
    assert captured.err.startswith(f"mocaplab {arguments[0]}: error: ")
    return captured.err


def test_missing_file(tmp_path, capsys):
    out = tmp_path / "out.bvh"
    message = refused(["clean", tmp_path / "none.bvh", "-o", out], capsys)
    assert "none.bvh: No such file" in message
    assert not out.exists()


def test_file_that_is_not_bvh(tmp_path, capsys):
    (tmp_path / "x.bvh").write_text("hello\nworld\n")
    message = refused(["clean", tmp_path / "x.bvh", "-o", tmp_path / "out.bvh"], capsys)
    assert "x.bvh:1: expected HIERARCHY, got 'hello'" in message


def test_folder_in_place_of_a_file(tmp_path, capsys):
    assert "directory" in refused(["info", tmp_path], capsys).lower()


def test_other_skeleton(small_motion, tmp_path, capsys):
    save_bvh(small_motion, tmp_path / "small.bvh")
    message = refused(["clean", tmp_path / "small.bvh", "-o", tmp_path / "out.bvh"], capsys)
    assert "another skeleton" in message
    assert "mocaplab train" in message
    assert not (tmp_path / "out.bvh").exists()


def test_nan_in_the_file(walk_file, tmp_path, capsys):
    lines = walk_file.read_text().splitlines()
    lines[-1] = lines[-1].rsplit(" ", 1)[0] + " nan"
    walk_file.write_text("\n".join(lines))
    message = refused(["clean", walk_file, "-o", tmp_path / "out.bvh"], capsys)
    assert f"walk.bvh:{len(lines)}: expected a finite number, got 'nan'" in message


def test_a_warning_of_the_library_is_a_plain_note(walk_file, walk, monkeypatch, capsys):
    def info(options):
        hidden = np.where(walk.skeleton.channel_joint == 3, np.nan, walk.channels)
        for _ in range(2):
            lerp_gaps(walk.with_channels(hidden))

    monkeypatch.setattr(info_command, "run", info)
    assert main(["info", str(walk_file)]) == 0
    notes = capsys.readouterr().err.splitlines()
    joint = walk.skeleton.joint_names[3]
    assert len(notes) == 1
    assert notes[0].startswith("mocaplab info: note: motion 'walk_01': never observed")
    assert f"{joint}.Zrotation" in notes[0]


def test_output_that_cannot_be_written(walk_file, tmp_path, capsys):
    message = refused(["clean", walk_file, "-o", tmp_path / "no" / "folder.bvh"], capsys)
    assert "there is no folder" in message
    (tmp_path / "is_a_folder").mkdir()
    message = refused(["clean", walk_file, "-o", tmp_path / "is_a_folder"], capsys)
    assert "folder" in message


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="root may write anywhere")
def test_folder_without_permission(walk_file, tmp_path, capsys):
    locked = tmp_path / "locked"
    locked.mkdir(mode=stat.S_IRUSR | stat.S_IXUSR)
    assert "no permission" in refused(["clean", walk_file, "-o", locked / "x.bvh"], capsys)


def test_model_that_is_none(walk_file, tmp_path, capsys):
    message = refused(
        ["clean", walk_file, "-o", tmp_path / "out.bvh", "--model", walk_file], capsys
    )
    assert "not a model file" in message


def test_negative_noise(walk_file, tmp_path, capsys):
    message = refused(["corrupt", walk_file, "--noise", "-1", "-o", tmp_path / "x.bvh"], capsys)
    assert "must lie in [0, 100]" in message


def test_files_of_different_length(walk, walk_file, tmp_path, capsys):
    save_bvh(walk.slice_frames(0, 50), tmp_path / "short.bvh")
    message = refused(["evaluate", "--reference", walk_file, tmp_path / "short.bvh"], capsys)
    assert "has 50 frames" in message


@pytest.mark.parametrize("command", ["clean", "corrupt", "train", "evaluate", "info"])
def test_help_shows_an_example(command, capsys):
    with pytest.raises(SystemExit) as stop:
        main([command, "--help"])
    assert stop.value.code == 0
    assert f"mocaplab {command} " in capsys.readouterr().out.split("example")[1]


def test_help_lists_the_commands(capsys):
    with pytest.raises(SystemExit):
        main(["--help"])
    printed = capsys.readouterr().out
    for command in ("clean", "corrupt", "train", "evaluate", "info"):
        assert f"\n    {command} " in printed


def test_a_reader_that_stops_early_sees_no_error(walk_file):
    command = f'"{sys.executable}" -m mocaplab info "{walk_file}" | head -1'
    done = subprocess.run(command, shell=True, capture_output=True, text=True, check=True)
    assert done.stdout.startswith("name")
    assert done.stderr == ""
