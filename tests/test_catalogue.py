"""The list of CMU trials: enough of each action, checked when it is read."""

from collections import Counter

import pytest

from data_tools.catalogue import CATALOGUE, PAPER_MIX, choose, load_catalogue, main

HEAD = "subject,trial,action,description,basis\n"


def test_there_is_the_mix_of_the_paper_and_more():
    trials = load_catalogue()
    counts = Counter(trial.action for trial in trials)
    assert all(counts[action] >= n for action, n in PAPER_MIX.items())
    assert len(trials) > 100


def test_an_action_is_what_the_description_says():
    for trial in load_catalogue():
        assert trial.action in trial.description
        # The index leaves run or jog open; nothing else may claim to be "named" then.
        assert (trial.basis == "run/jog") == ("run or jog" in trial.description)
        assert trial.basis != "run/jog" or trial.action == "jog"


def test_choose_is_repeatable_and_takes_many_subjects():
    trials = load_catalogue()
    chosen = choose(trials)
    assert chosen == choose(trials)
    assert Counter(trial.action for trial in chosen) == PAPER_MIX
    assert len(set(chosen)) == 100
    for action in PAPER_MIX:
        all_subjects = {t.subject for t in trials if t.action == action}
        few = choose(trials, {action: len(all_subjects)})
        assert {t.subject for t in few} == all_subjects


def test_clip_names_have_two_digits_or_more():
    names = {trial.clip for trial in load_catalogue()}
    assert {"02_01", "104_01", "35_17"} <= names


@pytest.mark.parametrize("count", [-1, 1000])
def test_choose_refuses_more_than_there_are(count):
    with pytest.raises(ValueError, match=r"between 0 and \d+ trials of 'kick'"):
        choose(load_catalogue(), {"kick": count})


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("subject,trial\n1,1\n", ":1: expected the columns subject, trial, action"),
        ("", ":1: expected the columns .* got nothing"),
        (HEAD, "at least one trial"),
        (HEAD + "0,1,walk,walk,named\n", ":2: expected a subject from 1 to 144, got '0'"),
        (HEAD + "145,1,walk,walk,named\n", "got '145'"),
        (HEAD + "2,x,walk,walk,named\n", "expected a trial from 1 to 99, got 'x'"),
        (HEAD + "2,1,dance,walk,named\n", "expected action to be one of walk, .* got 'dance'"),
        (HEAD + "2,1,walk,walk,guessed\n", "expected basis to be one of"),
        (HEAD + "2,1,walk,,named\n", ":2: expected 5 values, none empty"),
        (HEAD + "2,1,walk,walk\n", "expected 5 values"),
        (HEAD + "2,1,walk,a, b,named\n", "expected 5 values"),
        (HEAD + "2,1,walk,w,named\n2,1,run,r,named\n", ":3: trial 02_01 is also on line 2"),
    ],
)
def test_a_broken_catalogue_is_refused(tmp_path, text, message):
    path = tmp_path / "catalogue.csv"
    path.write_text(text)
    with pytest.raises(ValueError, match=message):
        load_catalogue(path)


def test_the_command_counts(capsys):
    assert main(["--list"]) == 0
    printed = capsys.readouterr().out
    assert f"total {len(load_catalogue()):4} trials" in printed
    assert "11: 1" in printed
    assert len(printed.splitlines()) == len(CATALOGUE.read_text().splitlines()) + 10
