"""Files of gap fillers: what is read is what was written; damage is refused."""

import json

import numpy as np
import pytest
from safetensors.numpy import load_file, save_file

from data_tools.gap_models import fit_to_motions
from mocaplab.datasets import clip_digest
from mocaplab.files import FormatError
from mocaplab.gap_fillers.files import load_filler, save_filler, shipped_filler
from mocaplab.noise.gaps import hide, long_gap_mask


@pytest.fixture(scope="module")
def filler(embedded):
    return fit_to_motions(embedded.clips[:3])


@pytest.fixture(scope="module")
def path(filler, tmp_path_factory):
    path = tmp_path_factory.mktemp("gaps") / "gaps.safetensors"
    save_filler(filler, path)
    return path


def test_read_as_written(filler, path, walk):
    again = load_filler(path)
    assert again.trained_on == filler.trained_on
    assert again.channel_labels == filler.channel_labels
    holed = hide(walk, long_gap_mask(walk, 0.5, rng=np.random.default_rng(0)))
    expected, found = filler.fill(holed), again.fill(holed)
    np.testing.assert_allclose(found.motion.channels, expected.motion.channels, atol=0.02)
    np.testing.assert_allclose(found.std_deg, expected.std_deg, rtol=0.01)


def test_it_notes_its_clips(filler, embedded):
    assert filler.trained_on == {clip.name: clip_digest(clip) for clip in embedded.clips[:3]}


@pytest.mark.parametrize("what", ["format", "labels", "caution", "nan"])
def test_damage_is_refused(path, tmp_path, what):
    from safetensors import safe_open

    with safe_open(path, framework="np") as file:
        header = json.loads(file.metadata()["mocaplab"])
    arrays = dict(load_file(path))
    if what == "format":
        header["format"] = "another"
    elif what == "labels":
        header["channel_labels"] = header["channel_labels"][:-1]
    elif what == "caution":
        header["caution"] = -1
    else:
        arrays["covariance"] = np.full_like(arrays["covariance"], np.nan)
    damaged = tmp_path / "damaged.safetensors"
    save_file(arrays, damaged, {"mocaplab": json.dumps(header)})
    with pytest.raises(FormatError, match="expected a gap filler"):
        load_filler(damaged)


def test_other_files_are_refused(tmp_path):
    with pytest.raises(FileNotFoundError, match="no such file"):
        load_filler(tmp_path / "none")
    text = tmp_path / "text"
    text.write_text("HIERARCHY")
    with pytest.raises(FormatError, match="expected a gap filler"):
        load_filler(text)


def test_the_shipped_one_has_not_seen_the_clips_held_out_from_the_cleaners():
    from mocaplab.checkpoints import shipped_checkpoint

    assert shipped_filler().trained_on == shipped_checkpoint("ebf").trained_on


def test_the_shipped_one_fills_embedded_clips(walk):
    holed = hide(walk, long_gap_mask(walk, 1.0, rng=np.random.default_rng(1)))
    filled = shipped_filler().fill(holed)
    hidden = np.isnan(holed.channels)
    error = (filled.motion.channels - walk.channels)[hidden]
    assert np.sqrt(np.mean(error**2)) < 2 * np.sqrt(np.mean(filled.std_deg[hidden] ** 2))
