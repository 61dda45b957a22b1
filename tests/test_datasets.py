"""Data sets, splits and training pieces."""

from dataclasses import replace

import pytest

from mocaplab.bvh import save_bvh
from mocaplab.datasets import (
    Dataset,
    clip_digest,
    load_dataset,
    load_folder,
    split_holdout,
)


def test_embedded_has_the_mix_of_the_paper(embedded):
    counts = {action: embedded.actions.count(action) for action in set(embedded.actions)}
    assert counts == {"walk": 40, "jog": 20, "run": 20, "jump": 10, "kick": 10}
    assert embedded.skeleton.n_channels == 96
    assert embedded["walk_01"].fps == pytest.approx(120, rel=1e-4)
    with pytest.raises(KeyError, match="no clip 'swim'"):
        embedded["swim"]


def test_real_clips_come_in_the_same_form(data_dir, embedded):
    real = load_dataset("cmu", data_dir / "cmu")
    assert len(real) == 78
    assert real.actions.count("walk") == 58
    assert real.skeleton.same_as(embedded.skeleton)


def test_unknown_data_set_is_refused():
    with pytest.raises(ValueError, match="'embedded' and 'cmu'"):
        load_dataset("amass")
    with pytest.raises(ValueError, match="needs the folder"):
        load_dataset("cmu")


def test_folder_takes_actions_from_the_list_or_the_names(tmp_path, walk, small_motion):
    save_bvh(walk, tmp_path / "slow_walk_01.bvh")
    assert load_folder(tmp_path).actions == ("slow_walk",)
    (tmp_path / "clips.csv").write_text("clip,action,frames\nslow_walk_01,stroll,3\n")
    assert load_folder(tmp_path).actions == ("stroll",)
    save_bvh(small_motion, tmp_path / "other.bvh")
    with pytest.raises(ValueError, match="share one skeleton, but"):
        load_folder(tmp_path)


def test_folder_without_bvh_is_refused(tmp_path):
    with pytest.raises(ValueError, match=r"no \.bvh file"):
        load_folder(tmp_path)
    with pytest.raises(NotADirectoryError, match="not a folder"):
        load_folder(tmp_path / "nowhere")


def test_split_holds_out_a_share_of_every_action(embedded):
    train, test = split_holdout(embedded, 0.1, seed=3)
    assert {a: test.actions.count(a) for a in set(test.actions)} == {
        "walk": 4,
        "jog": 2,
        "run": 2,
        "jump": 1,
        "kick": 1,
    }
    assert not set(train.clips) & set(test.clips)
    assert set(train.clips) | set(test.clips) == set(embedded.clips)
    assert split_holdout(embedded, 0.1, seed=3)[1].clips == test.clips
    assert split_holdout(embedded, 0.1, seed=4)[1].clips != test.clips
    with pytest.raises(ValueError, match="between 0 and 1"):
        split_holdout(embedded, 0.0)
    with pytest.raises(ValueError, match="at least two clips, got one"):
        split_holdout(embedded.select([0], "one"))


def test_digest_knows_content_not_names(walk):
    assert clip_digest(walk) == clip_digest(replace(walk, name="other"))
    assert clip_digest(walk) != clip_digest(walk.with_channels(walk.channels + 1e-9))


def test_two_clips_of_one_name_are_refused(walk):
    with pytest.raises(ValueError, match="'walk_01' twice"):
        Dataset("twice", (walk, walk), ("walk", "walk"))


@pytest.mark.parametrize(
    ("content", "words"),
    [("name,frames\nx,3\n", "columns clip and action"), ("clip,action\nx\n", "needs an action")],
)
def test_a_bad_list_of_clips_is_named(tmp_path, walk, content, words):
    save_bvh(walk, tmp_path / "walk.bvh")
    (tmp_path / "clips.csv").write_text(content)
    with pytest.raises(ValueError, match=rf"clips\.csv.*{words}"):
        load_folder(tmp_path)


def test_a_data_set_needs_clips():
    with pytest.raises(ValueError, match="needs clips"):
        Dataset("none", (), ())


def test_split_of_clips_whose_names_tell_no_action(embedded):
    clips = embedded.clips[:8]
    names = Dataset("names", clips, tuple(clip.name for clip in clips))
    train, test = split_holdout(names, 0.25, seed=0)
    assert (len(train), len(test)) == (6, 2)
