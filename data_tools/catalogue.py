"""Which CMU trials show a walk, a jog, a run, a jump or a kick.

    python -m data_tools.catalogue        counts by action and subject

The subjects, trials and labels in ``cmu_catalogue.csv`` are those of the public index of
the CMU motion capture database; the descriptions are short wordings of its labels. No
recording was looked at. The column ``basis`` tells how an action was decided:

- "named": the index calls the trial by this action.
- "run/jog": the index says just that. As it calls other trials plainly "run", these are
  filed under jog, which fits the paper's split, but some may be runs.
- "wording": read from a compound or a foreign word, such as "JogThrough".
"""

from __future__ import annotations

import argparse
import csv
import os
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

CATALOGUE = Path(__file__).parent / "cmu_catalogue.csv"
PAPER_MIX = {"walk": 40, "jog": 20, "run": 20, "jump": 10, "kick": 10}
"""Clips of every action in paper A, section 4."""
BASES = ("named", "run/jog", "wording")
COLUMNS = ["subject", "trial", "action", "description", "basis"]
LAST_SUBJECT, LAST_TRIAL = 144, 99


@dataclass(frozen=True)
class Trial:
    """One recording of the CMU database.

    Parameters
    ----------
    subject, trial : int, from 1, as CMU counts them
    action : str, one of ``PAPER_MIX``
    description : str, what the index says, in short
    basis : str, how the action was decided, see above
    """

    subject: int
    trial: int
    action: str
    description: str
    basis: str

    @property
    def clip(self) -> str:
        """The name of the trial's files, without an ending, such as ``"02_01"``."""
        return f"{self.subject:02d}_{self.trial:02d}"


def load_catalogue(path: str | os.PathLike[str] = CATALOGUE) -> tuple[Trial, ...]:
    """Read and check a catalogue.

    Raises
    ------
    ValueError
        If columns are missing, a number is out of range, an action or basis is unknown,
        or a trial is listed twice. The message names the line.
    """
    with open(path, newline="", encoding="utf-8") as file:
        reader = csv.DictReader(file)
        if reader.fieldnames != COLUMNS:
            raise ValueError(
                f"{path}:1: expected the columns {', '.join(COLUMNS)}, "
                f"got {', '.join(reader.fieldnames or ['nothing'])}"
            )
        lines: dict[tuple[int, int], int] = {}
        trials = []
        for row in reader:
            trial = _row_to_trial(row, f"{path}:{reader.line_num}")
            first = lines.setdefault((trial.subject, trial.trial), reader.line_num)
            if first != reader.line_num:
                raise ValueError(
                    f"{path}:{reader.line_num}: trial {trial.clip} is also on line {first}; "
                    f"leave one of them out"
                )
            trials.append(trial)
    if not trials:
        raise ValueError(f"{path}: expected at least one trial below the columns, got none")
    return tuple(trials)


def _row_to_trial(row: Mapping[str, str | None], where: str) -> Trial:
    """Check one line of the catalogue; ``where`` is its file and line."""
    values = {column: (row[column] or "").strip() for column in COLUMNS}
    if None in row or not all(values.values()):
        raise ValueError(f"{where}: expected {len(COLUMNS)} values, none empty, got {row}")
    numbers = []
    for column, last in (("subject", LAST_SUBJECT), ("trial", LAST_TRIAL)):
        text = values[column]
        if not text.isdecimal() or not 1 <= int(text) <= last:
            raise ValueError(f"{where}: expected a {column} from 1 to {last}, got {text!r}")
        numbers.append(int(text))
    for column, known in (("action", tuple(PAPER_MIX)), ("basis", BASES)):
        if values[column] not in known:
            raise ValueError(
                f"{where}: expected {column} to be one of {', '.join(known)}, "
                f"got {values[column]!r}"
            )
    subject, trial = numbers
    return Trial(subject, trial, values["action"], values["description"], values["basis"])


def choose(trials: Sequence[Trial], mix: Mapping[str, int] = PAPER_MIX) -> tuple[Trial, ...]:
    """Choose so many trials of every action, from as many subjects as there are.

    The first trial of every subject comes first, then the second of every subject, and so
    on: the choice is always the same, and no subject dominates.

    Parameters
    ----------
    trials : sequence of Trial
    mix : dict from action to how many; by default that of paper A

    Raises
    ------
    ValueError
        If a number is negative, or there are not so many trials of an action.
    """
    chosen: list[Trial] = []
    for action, count in mix.items():
        of_action = [trial for trial in trials if trial.action == action]
        if not 0 <= count <= len(of_action):
            raise ValueError(
                f"expected between 0 and {len(of_action)} trials of {action!r}, which is how "
                f"many are listed, got {count}; ask for fewer"
            )
        seen: Counter[int] = Counter()
        rounds = {}
        for trial in of_action:
            rounds[trial] = seen[trial.subject]
            seen[trial.subject] += 1
        chosen += sorted(of_action, key=rounds.__getitem__)[:count]
    return tuple(chosen)


def summarize(trials: Sequence[Trial]) -> str:
    """Write a table: for every action its trials, and how many each subject has."""
    lines = []
    for action in PAPER_MIX:
        of_action = [trial for trial in trials if trial.action == action]
        subjects = Counter(trial.subject for trial in of_action)
        bases = Counter(trial.basis for trial in of_action)
        lines.append(
            f"{action:5} {len(of_action):4} trials of {len(subjects):2} subjects; decided by "
            + ", ".join(f"{basis} {n}" for basis, n in bases.items())
        )
        lines.append("      " + "  ".join(f"{s:02d}: {n}" for s, n in sorted(subjects.items())))
    return "\n".join([*lines, f"total {len(trials):4} trials"])


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the counts of the catalogue."""
    parser = argparse.ArgumentParser(
        prog="python -m data_tools.catalogue",
        description="Count the CMU trials that are listed, by action and subject.",
    )
    parser.add_argument("--list", action="store_true", help="print every trial as well")
    options = parser.parse_args(arguments)
    trials = load_catalogue()
    if options.list:
        for trial in trials:
            print(f"{trial.clip:7} {trial.action:5} {trial.description} [{trial.basis}]")
    print(summarize(trials))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
