"""Which clips to train on and which to test on.

- *paper*: paper A (section 4) tests on "5 randomly sampled holdouts of 10 motions each", of
  4 walks, 2 jogs, 2 runs, 1 jump and 1 kick. It does not say that the holdouts are
  disjoint, but it counts "50 motions in our test holdouts", so here no clip is in two of
  them. In each, all clips outside the holdout are for training. Other collections get
  holdouts of the same size; see :func:`holdout_counts`.
- *by subject*: the same holdouts, but whoever is in the test is not in the training. CMU
  gives some people several subject numbers, so even this is strict only in the numbers.
  Clips of test subjects that are not in the holdout are left out altogether, and holdouts
  may share clips.
- *leave one action out*: each action in turn is the test (paper A, section 5).

``mocaplab.datasets.split_holdout`` holds out a share of any collection instead.
"""

from __future__ import annotations

import csv
import os
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

PAPER_TEST = {"walk": 4, "jog": 2, "run": 2, "jump": 1, "kick": 1}
"""Clips of every action in one holdout of paper A, section 4."""

KINDS = ("paper", "subject", "action")
"""The kinds of splits that :func:`make_splits` makes."""


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


def make_splits(
    kind: str,
    actions: Sequence[str],
    subjects: Sequence[int] | None = None,
    *,
    seed: int,
    n_holdouts: int = 5,
) -> dict[str, Split]:
    """Split any collection, the same way for the same seed.

    Parameters
    ----------
    kind : "paper", "subject" or "action"
    actions : sequence of str, one a clip
        If no two clips show the same action, all clips are one group.
    subjects : sequence of int, one a clip, or None where they are not known
    seed : int
    n_holdouts : int, for "paper" and "subject"

    Returns
    -------
    dict from a name, such as ``"holdout_1"`` or ``"without_jump"``, to Split

    Raises
    ------
    ValueError
        If there are too few clips, actions or subjects, or subjects are not known.
    """
    if kind not in KINDS:
        raise ValueError(f"the kinds of splits are {', '.join(KINDS)}, got {kind!r}")
    if kind == "action":
        return {f"without_{a}": split for a, split in leave_one_action_out(actions).items()}
    if len(set(actions)) == len(actions):
        actions = ["clip"] * len(actions)
    counts = holdout_counts(actions, n_holdouts)
    rng = np.random.default_rng([seed, KINDS.index(kind)])
    if kind == "paper":
        splits = paper_holdouts(actions, rng=rng, n_holdouts=n_holdouts, counts=counts)
    elif subjects is None:
        raise ValueError("splits by subject need a clips.csv that has the column subject")
    else:
        splits = subject_holdouts(actions, subjects, rng=rng, n_holdouts=n_holdouts, counts=counts)
    return {f"holdout_{i}": split for i, split in enumerate(splits, start=1)}


def holdout_counts(actions: Sequence[str], n_holdouts: int = 5, size: int = 10) -> dict[str, int]:
    """Decide how many clips of every action one holdout gets.

    Paper A's numbers, where the collection has enough of its five actions. Otherwise one
    clip of every action that has enough for all holdouts; the rest of the places go, one
    by one, to the action with the most clips for each place that it has (D'Hondt's rule).

    Parameters
    ----------
    actions : sequence of str, one a clip
    n_holdouts : int, holdouts that share no clip
    size : int, clips in one holdout, if there are so many

    Raises
    ------
    ValueError
        If no action has a clip for each holdout.
    """
    there = Counter(actions)
    if all(there[action] >= n_holdouts * n for action, n in PAPER_TEST.items()):
        return dict(PAPER_TEST)
    enough = max(n_holdouts, 2)  # of a single clip, none would be left to train on
    counts = {action: 1 for action in sorted(there) if there[action] >= enough}
    if not counts:
        action, most = there.most_common(1)[0] if there else ("any action", 0)
        raise ValueError(
            f"{n_holdouts} holdouts need at least {enough} clips of one action, got "
            f"{most} of {action!r}; ask for fewer holdouts"
        )
    while sum(counts.values()) < size:
        free = [a for a in counts if _has_enough(there[a], counts[a] + 1, n_holdouts)]
        if not free:
            break
        counts[max(free, key=lambda action: there[action] / (counts[action] + 1))] += 1
    return counts


def _has_enough(clips: int, in_holdout: int, n_holdouts: int) -> bool:
    """Tell whether there are clips for n holdouts, and others to train on in each of them."""
    return clips >= n_holdouts * in_holdout and clips > in_holdout


def _of_action(actions: Sequence[str], counts: Mapping[str, int], n: int) -> dict[str, list[int]]:
    """Group clips by action, and check that there are enough for n holdouts."""
    groups = {action: [i for i, a in enumerate(actions) if a == action] for action in counts}
    for action, clips in groups.items():
        if not _has_enough(len(clips), counts[action], n):
            raise ValueError(
                f"{n} holdouts with {counts[action]} of {action!r} each need at least "
                f"{max(n * counts[action], counts[action] + 1)} such clips, got {len(clips)}; "
                "ask for fewer holdouts"
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


def read_clip_list(
    folder: str | os.PathLike[str],
) -> tuple[list[str], list[str], list[int] | None]:
    """Read names, actions and, where known, subjects from a folder's ``clips.csv``.

    The columns are clip and action, and subject if there is one; without it, the subject is
    the number that a clip's name begins with (``35_17`` is of subject 35).

    Raises
    ------
    ValueError, OSError
        If there is no such list, or a line of it lacks something.
    """
    path = Path(folder) / "clips.csv"
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
