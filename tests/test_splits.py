"""Holdouts: the paper's numbers, nothing on both sides, the same seed the same split."""

import json

import numpy as np
import pytest

from data_tools.catalogue import choose, load_catalogue
from data_tools.splits import main, read_clips
from mocaplab.splits import (
    PAPER_TEST,
    Split,
    holdout_counts,
    leave_one_action_out,
    make_splits,
    paper_holdouts,
    subject_holdouts,
)

TRIALS = choose(load_catalogue())
ACTIONS = [trial.action for trial in TRIALS]
SUBJECTS = [trial.subject for trial in TRIALS]


def counts(indices):
    return {action: sum(ACTIONS[i] == action for i in indices) for action in PAPER_TEST}


@pytest.mark.parametrize("seed", range(5))
def test_paper_holdouts(seed):
    splits = paper_holdouts(ACTIONS, rng=np.random.default_rng(seed))
    assert len(splits) == 5
    for split in splits:
        assert counts(split.test) == PAPER_TEST
        assert sorted(split.train + split.test) == list(range(100))
    assert len({i for split in splits for i in split.test}) == 50
    assert splits == paper_holdouts(ACTIONS, rng=np.random.default_rng(seed))
    assert splits != paper_holdouts(ACTIONS, rng=np.random.default_rng(seed + 1))


@pytest.mark.parametrize("seed", range(20))
def test_no_subject_is_on_both_sides(seed):
    for split in subject_holdouts(ACTIONS, SUBJECTS, rng=np.random.default_rng(seed)):
        assert counts(split.test) == PAPER_TEST
        assert min(counts(split.train).values()) > 0
        assert not {SUBJECTS[i] for i in split.train} & {SUBJECTS[i] for i in split.test}


def test_leave_one_action_out():
    splits = leave_one_action_out(ACTIONS)
    assert set(splits) == set(PAPER_TEST)
    for action, split in splits.items():
        assert {ACTIONS[i] for i in split.test} == {action}
        assert action not in {ACTIONS[i] for i in split.train}
        assert sorted(split.train + split.test) == list(range(100))


def test_too_few_clips_are_refused():
    with pytest.raises(ValueError, match="5 holdouts with 4 of 'walk' each need at least 20"):
        paper_holdouts(["walk"] * 19, rng=np.random.default_rng(0))
    with pytest.raises(ValueError, match="in both"):
        leave_one_action_out(["walk"] * 3)
    with pytest.raises(ValueError, match="expected a subject a clip, got 2 for 100"):
        subject_holdouts(ACTIONS, [1, 2], rng=np.random.default_rng(0))
    with pytest.raises(ValueError, match="found 0 of 5 such holdouts"):
        subject_holdouts(ACTIONS, [1] * 100, rng=np.random.default_rng(0))
    with pytest.raises(ValueError, match="1 in both"):
        Split((0, 1), (1, 2))


CMU = ["walk"] * 58 + ["run", "jump", "kick", "basketball"] * 5


def test_a_collection_without_the_papers_actions_gets_holdouts_of_its_own():
    six = {"walk": 6, "run": 1, "jump": 1, "kick": 1, "basketball": 1}
    assert holdout_counts(CMU) == six
    splits = make_splits("paper", CMU, seed=0)
    assert list(splits) == [f"holdout_{i}" for i in range(1, 6)]
    for split in splits.values():
        assert {a: [CMU[i] for i in split.test].count(a) for a in six} == six
        assert sorted(split.train + split.test) == list(range(78))
    assert len({i for split in splits.values() for i in split.test}) == 50


@pytest.mark.parametrize(
    ("actions", "n_holdouts", "expected"),
    [
        (ACTIONS, 5, PAPER_TEST),
        (["walk"] * 12 + ["run"] * 4, 5, {"walk": 2}),  # 4 runs do not suffice for 5
        (["walk"] * 12 + ["run"] * 4, 2, {"walk": 6, "run": 2}),
        (["walk"] * 30 + ["run"] * 15, 1, {"walk": 7, "run": 3}),
        (["walk"] * 2, 1, {"walk": 1}),  # one is left to train on
    ],
)
def test_places_in_a_holdout(actions, n_holdouts, expected):
    assert holdout_counts(actions, n_holdouts) == expected


def test_names_that_tell_no_action_make_one_group():
    splits = make_splits("paper", ["a", "b", "c", "d"], seed=0, n_holdouts=2)
    assert sorted(i for split in splits.values() for i in split.test) == [0, 1, 2, 3]


def test_splits_by_kind():
    splits = make_splits("subject", ACTIONS, SUBJECTS, seed=0)
    assert splits == make_splits("subject", ACTIONS, SUBJECTS, seed=0)
    for split in splits.values():
        assert not {SUBJECTS[i] for i in split.train} & {SUBJECTS[i] for i in split.test}
    assert make_splits("action", ACTIONS, seed=0) == {
        f"without_{action}": split for action, split in leave_one_action_out(ACTIONS).items()
    }


def test_splits_that_cannot_be_made():
    with pytest.raises(ValueError, match=r"kinds of splits are paper, subject, action, got 'x'"):
        make_splits("x", ACTIONS, seed=0)
    with pytest.raises(ValueError, match=r"need a clips\.csv that has the column subject"):
        make_splits("subject", ACTIONS, seed=0)
    with pytest.raises(ValueError, match="at least 5 clips of one action, got 4 of 'walk'"):
        make_splits("paper", ["walk"] * 4 + ["run"] * 2, seed=0)
    with pytest.raises(ValueError, match="1 holdouts need at least 2 clips"):
        make_splits("paper", ["walk"], seed=0, n_holdouts=1)


def test_the_command_writes_splits_by_name(tmp_path, capsys):
    for source in ("embedded", "catalogue"):
        out = tmp_path / f"{source}.json"
        assert main([source, "-o", str(out), "--seed", "3"]) == 0
        splits = json.loads(out.read_text())
        assert len(splits["paper"]) == 5
        assert len(splits["paper"][0]["test"]) == 10
        assert ("by_subject" in splits) == (source == "catalogue")
        first = out.read_bytes()
        main([source, "-o", str(out), "--seed", "3"])
        assert out.read_bytes() == first
    assert "no subjects are known, so none by subject" in capsys.readouterr().out


def test_a_folder_is_read_from_its_list(tmp_path):
    (tmp_path / "clips.csv").write_text("clip,action\n02_01,walk\n35_17,jog\n")
    assert read_clips(str(tmp_path)) == (["02_01", "35_17"], ["walk", "jog"], [2, 35])
    (tmp_path / "clips.csv").write_text("clip,action,subject\na,walk,2\nb,jog,\n")
    assert read_clips(str(tmp_path)) == (["a", "b"], ["walk", "jog"], None)


def test_the_command_refuses_what_is_no_list(tmp_path, capsys):
    out = str(tmp_path / "out.json")
    assert main([str(tmp_path), "-o", out]) == 2
    (tmp_path / "clips.csv").write_text("name\nx\n")
    assert main([str(tmp_path), "-o", out]) == 2
    assert "expected the columns clip and action" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("1_walk,walk,1", "every clip once"),
        (",walk,1", "a clip and its action"),
        ("x", "a clip and its action"),
    ],
)
def test_a_list_with_a_bad_line_is_refused(tmp_path, capsys, line, words):
    path = tmp_path / "clips.csv"
    path.write_text(f"clip,action,frames\n1_walk,walk,1\n{line}\n")
    assert main([str(tmp_path), "-o", str(tmp_path / "out.json")]) == 2
    assert words in capsys.readouterr().err
