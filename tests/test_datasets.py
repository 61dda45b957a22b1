"""Data sets, splits and training pieces."""

from dataclasses import replace

import numpy as np
import pytest

from mocaplab.bvh import save_bvh
from mocaplab.corruption import angular_noise
from mocaplab.datasets import (
    Dataset,
    Windows,
    clip_digest,
    load_dataset,
    load_folder,
    split_holdout,
)
from mocaplab.motion import moving_channels
from mocaplab.movement import root_angular_velocity


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


def test_pieces_are_where_they_say(walk):
    windows = Windows([walk], n_frames=50, margin=10)
    moving = moving_channels(walk)
    for batch in windows.batches(8, (0.0, 0.0), rng=np.random.default_rng(0)):
        np.testing.assert_array_equal(batch.observed, batch.clean)
        np.testing.assert_allclose(batch.std[0, 0], walk.channels.std(axis=0) * moving)
        np.testing.assert_allclose(batch.mean[0, 0], walk.channels.mean(axis=0))
        for piece, weight in zip(batch.clean, batch.weight, strict=True):
            start = np.flatnonzero((walk.channels == piece[0]).all(axis=1))[0]
            np.testing.assert_array_equal(piece, walk.channels[start : start + 50])
            assert weight[:10].any() == (start == 0)
            assert weight[-10:].any() == (start + 50 == walk.n_frames)
            assert weight[10:-10].all()


def test_a_piece_at_another_speed_is_the_clip_played_so(walk):
    windows = Windows([walk], n_frames=60, margin=10)
    batch = next(windows.batches(4, (0.3, 0.3), (1.5, 1.5), rng=np.random.default_rng(0)))
    velocity = root_angular_velocity(walk)
    # Where the piece starts is not told: it is where its first frame fits best.
    for piece, turning in zip(batch.clean, batch.root_velocity, strict=True):
        starts = np.linspace(0, walk.n_frames - 1 - 59 * 1.5, 4000)
        column = walk.skeleton.channel_index("LeftLeg.Xrotation")
        frames = np.arange(walk.n_frames)
        times = starts[:, None] + 1.5 * np.arange(60)
        played = np.interp(times, frames, walk.channels[:, column])
        best = np.argmin(np.abs(played - piece[:, column]).sum(axis=1))
        np.testing.assert_allclose(played[best], piece[:, column], atol=0.3)
        for axis in range(3):
            expected = 1.5 * np.interp(times[best], frames, velocity[:, axis])
            np.testing.assert_allclose(turning[:, axis], expected, atol=0.05)


def test_pieces_are_measured_as_the_cleaner_measures_a_clip(walk):
    """The deviation that training assumes is that of the noisy clip."""
    windows = Windows([walk], n_frames=60, margin=10)
    batch = next(windows.batches(1, (0.7, 0.7), rng=np.random.default_rng(0)))
    noisy = angular_noise(walk, 0.7, rng=np.random.default_rng(1)).channels
    moving = moving_channels(walk)
    np.testing.assert_allclose(batch.std[0, 0, moving], noisy.std(axis=0)[moving], rtol=0.1)


def test_noise_of_pieces_lies_in_the_range(walk):
    windows = Windows([walk], n_frames=100, margin=10)
    batch = next(windows.batches(64, (0.4, 0.6), rng=np.random.default_rng(0)))
    scale = windows.scales[0]
    relative = (batch.observed - batch.clean)[..., scale > 0] / scale[scale > 0]
    per_piece = relative.std(axis=(1, 2))
    assert 0.38 < per_piece.min() < 0.43
    assert 0.57 < per_piece.max() < 0.62


def test_short_clips_are_played_back_and_forth(walk):
    windows = Windows([walk.slice_frames(0, 30)], n_frames=50, margin=10)
    batch = next(windows.batches(2, (0.0, 0.0), rng=np.random.default_rng(0)))
    np.testing.assert_array_equal(batch.clean[0, 30:], walk.channels[29:9:-1])
    with pytest.raises(ValueError, match="all margin"):
        Windows([walk], n_frames=20, margin=10)


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
