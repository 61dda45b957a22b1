"""Which clips to train on and which to test on.

    python -m data_tools.splits embedded -o splits.json
    python -m data_tools.splits cmu --seed 1 -o splits.json     a folder with clips.csv

- *paper*: paper A (section 4) tests on "5 randomly sampled holdouts of 10 motions each", of
  4 walks, 2 jogs, 2 runs, 1 jump and 1 kick. It does not say that the holdouts are
  disjoint, but it counts "50 motions in our test holdouts", so here no clip is in two of
  them. In each, all clips outside the holdout are for training.
- *by subject*: the same holdouts, but whoever is in the test is not in the training. CMU
  gives some people several subject numbers, so even this is strict only in the numbers.
  Clips of test subjects that are not in the holdout are left out altogether, and holdouts
  may share clips.
- *leave one action out*: each action in turn is the test (paper A, section 5).

``mocaplab.datasets.split_holdout`` holds out a share of any collection instead.
"""

from __future__ import annotations

import argparse
import csv
import json
import re
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mocaplab.files import write_atomically

PAPER_TEST = {"walk": 4, "jog": 2, "run": 2, "jump": 1, "kick": 1}
"""Clips of every action in one holdout of paper A, section 4."""


@dataclass(frozen=True)
class Split:
    """Indices of the clips to train on and to test on; no clip is in both.

    Parameters
    ----------
    train, test : tuple of int, ascending
    """

    train: tuple[int, ...]
    test: tuple[int, ...]

    def __post_init__(self) -> None:
        both = set(self.train) & set(self.test)
        if both or not self.train or not self.test:
            raise ValueError(
                f"expected clips to train on, and others to test on, got {len(self.train)} and "
                f"{len(self.test)} with {len(both)} in both"
            )


def _of_action(actions: Sequence[str], counts: Mapping[str, int], n: int) -> dict[str, list[int]]:
    """Group clips by action, and check that there are enough for n holdouts and a rest."""
    groups = {action: [i for i, a in enumerate(actions) if a == action] for action in counts}
    for action, clips in groups.items():
        if len(clips) <= n * counts[action]:
            raise ValueError(
                f"{n} holdouts with {counts[action]} of {action!r} each need more than "
                f"{n * counts[action]} such clips, got {len(clips)}; ask for fewer holdouts"
            )
    return groups


def paper_holdouts(
    actions: Sequence[str],
    *,
    rng: np.random.Generator,
    n_holdouts: int = 5,
    counts: Mapping[str, int] = PAPER_TEST,
) -> tuple[Split, ...]:
    """Draw the paper's holdouts; no clip is in the test of two of them.

    Parameters
    ----------
    actions : sequence of str, one a clip
    rng : numpy.random.Generator
    n_holdouts : int
    counts : dict from action to clips in one holdout; other actions are only trained on

    Raises
    ------
    ValueError
        If there are not enough clips of an action.
    """
    groups = _of_action(actions, counts, n_holdouts)
    shuffled = {action: rng.permutation(clips).tolist() for action, clips in groups.items()}
    splits = []
    for i in range(n_holdouts):
        test = {clip for action, n in counts.items() for clip in shuffled[action][i * n :][:n]}
        splits.append(_split(test, set(range(len(actions))) - test))
    return tuple(splits)


def _split(test: set[int], train: set[int]) -> Split:
    return Split(tuple(sorted(train)), tuple(sorted(test)))


def subject_holdouts(
    actions: Sequence[str],
    subjects: Sequence[int],
    *,
    rng: np.random.Generator,
    n_holdouts: int = 5,
    counts: Mapping[str, int] = PAPER_TEST,
) -> tuple[Split, ...]:
    """Draw holdouts of the paper's kind in which no subject is both trained on and tested on.

    Subjects are put into the test in random order, until there are enough clips of every
    action; then the clips are drawn among theirs.

    Parameters
    ----------
    actions : sequence of str, one a clip
    subjects : sequence of int, one a clip
    rng : numpy.random.Generator
    n_holdouts, counts : as for ``paper_holdouts``

    Raises
    ------
    ValueError
        If lengths differ, or 200 random orders leave some action without a clip to train on.
    """
    if len(actions) != len(subjects):
        raise ValueError(f"expected a subject a clip, got {len(subjects)} for {len(actions)}")
    _of_action(actions, counts, 1)
    splits: list[Split] = []
    for _ in range(200 * n_holdouts):
        if len(splits) == n_holdouts:
            break
        split = _draw_by_subject(np.array(actions), np.array(subjects), counts, rng)
        if split is not None:
            splits.append(split)
    if len(splits) < n_holdouts:
        raise ValueError(
            "expected subjects that can be parted so that every action is on both sides, found "
            f"{len(splits)} of {n_holdouts} such holdouts; use more subjects or fewer actions"
        )
    return tuple(splits)


def _draw_by_subject(
    actions: np.ndarray[tuple[int], np.dtype[np.str_]],
    subjects: np.ndarray[tuple[int], np.dtype[np.int64]],
    counts: Mapping[str, int],
    rng: np.random.Generator,
) -> Split | None:
    """Draw one holdout, or None if an action has no clip left to train on."""
    tested = np.zeros(len(actions), dtype=bool)
    for action in rng.permutation(sorted(counts)):
        for subject in rng.permutation(np.unique(subjects[actions == action])):
            if (tested & (actions == action)).sum() < counts[action]:
                tested |= subjects == subject
    test: set[int] = set()
    for action, n in counts.items():
        if not (~tested & (actions == action)).any():
            return None
        of_action = np.flatnonzero(tested & (actions == action))
        test |= set(rng.permutation(of_action)[:n].tolist())
    return _split(test, set(np.flatnonzero(~tested).tolist()))


def leave_one_action_out(actions: Sequence[str]) -> dict[str, Split]:
    """For every action: train on all others, test on it (paper A, section 5)."""
    clips = set(range(len(actions)))
    tests = {action: {i for i in clips if actions[i] == action} for action in sorted(set(actions))}
    return {action: _split(test, clips - test) for action, test in tests.items()}


def read_clips(source: str) -> tuple[list[str], list[str], list[int] | None]:
    """Read names, actions and, where known, subjects of a collection.

    Parameters
    ----------
    source : "embedded", "catalogue" (the CMU trials of paper A's mix), or a folder with a
        ``clips.csv`` that has the columns clip and action and may have subject

    Raises
    ------
    ValueError, OSError
    """
    if source == "embedded":
        from mocaplab.datasets import load_dataset

        dataset = load_dataset("embedded")
        return [clip.name for clip in dataset.clips], list(dataset.actions), None
    if source == "catalogue":
        from data_tools.catalogue import choose, load_catalogue

        trials = choose(load_catalogue())
        names, actions = [t.clip for t in trials], [t.action for t in trials]
        return names, actions, [t.subject for t in trials]
    path = Path(source) / "clips.csv"
    try:
        with open(path, newline="", encoding="utf-8-sig") as file:
            rows = list(csv.DictReader(file))
    except (UnicodeDecodeError, csv.Error) as error:
        raise ValueError(f"{path}: expected a CSV file in UTF-8 ({error})") from None
    if not rows or not {"clip", "action"} <= set(rows[0]):
        raise ValueError(f"{path}: expected the columns clip and action, and a line a clip")
    for number, row in enumerate(rows, start=2):
        if not row["clip"] or not row["action"]:
            raise ValueError(f"{path}:{number}: expected a clip and its action")
    if len({row["clip"] for row in rows}) < len(rows):
        raise ValueError(f"{path}: expected every clip once")
    found = [row.get("subject") or row["clip"].split("_")[0] for row in rows]
    subjects = [int(s) for s in found if re.fullmatch(r"[0-9]+", s)]
    names, actions = [row["clip"] for row in rows], [row["action"] for row in rows]
    return names, actions, subjects if len(subjects) == len(rows) else None


def splits_to_json(
    names: Sequence[str], actions: Sequence[str], subjects: Sequence[int] | None, seed: int
) -> str:
    """Make all splits of a collection and write them as JSON, by clip name."""

    def named(split: Split) -> dict[str, list[str]]:
        return {"train": [names[i] for i in split.train], "test": [names[i] for i in split.test]}

    paper = paper_holdouts(actions, rng=np.random.default_rng([seed, 0]))
    splits: dict[str, object] = {"seed": seed, "paper": [named(split) for split in paper]}
    if subjects is not None:
        strict = subject_holdouts(actions, subjects, rng=np.random.default_rng([seed, 1]))
        splits["by_subject"] = [named(split) for split in strict]
    out = leave_one_action_out(actions)
    splits["leave_one_action_out"] = {action: named(split) for action, split in out.items()}
    return json.dumps(splits, indent=1) + "\n"


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the splits of a collection: 0 done, 2 refused."""
    parser = argparse.ArgumentParser(
        prog="python -m data_tools.splits",
        description="Write the paper's holdouts, stricter ones, and leave-one-action-out.",
    )
    parser.add_argument("source", help="embedded, catalogue, or a folder with clips.csv")
    parser.add_argument("-o", "--output", required=True, metavar="OUT.json")
    parser.add_argument("--seed", type=int, default=0, help="default: 0")
    options = parser.parse_args(arguments)
    try:
        names, actions, subjects = read_clips(options.source)
        write_atomically(options.output, splits_to_json(names, actions, subjects, options.seed))
    except (ValueError, OSError) as error:
        print(f"data_tools.splits: error: {error}", file=sys.stderr)
        return 2
    note = "; no subjects are known, so none by subject" if subjects is None else ""
    print(f"wrote {options.output}{note}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
