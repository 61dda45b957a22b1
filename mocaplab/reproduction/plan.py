"""What is computed for a budget, decided once and kept in the output folder."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any

from mocaplab.comparison.methods import part_network
from mocaplab.datasets import Dataset, clip_digest
from mocaplab.files import write_atomically
from mocaplab.splits import make_splits

PAPER_EPOCHS = 200
BLEND_SHARE = 10
"""A Blend is trained for a tenth of the epochs of the others, as it is usually."""
FULL = ("ebf", "blend")
"""Networks that may be given as trained before."""


@dataclass(frozen=True)
class Level:
    """One step of the ladder from a smoke test to the whole of the paper."""

    train_clips: int | None  # clips trained on, spread over the actions; None: all
    test_clips: int | None  # clips tested on in each holdout; None: all
    holdouts: int
    repetitions: int  # draws of noise for every test clip
    epochs: int
    width: int  # LSTM units of paper B's network; 1000 in the paper

    def __str__(self) -> str:
        train, test = (n if n else "all" for n in (self.train_clips, self.test_clips))
        return (
            f"{self.holdouts} of 5 holdouts, {self.repetitions} of 5 draws of noise, "
            f"{self.epochs} of {PAPER_EPOCHS} epochs, trained on {train} clips, tested on {test} "
            f"of each holdout, {self.width} of 1000 LSTM units for paper B"
        )


LADDER = (
    Level(4, 2, 1, 1, 1, 16),
    Level(8, 4, 1, 1, 3, 32),
    Level(16, None, 1, 1, 5, 32),
    Level(24, None, 1, 1, 10, 64),
    Level(32, None, 1, 2, 15, 64),
    Level(None, None, 1, 2, 20, 64),
    Level(None, None, 1, 2, 40, 128),
    Level(None, None, 2, 2, 40, 128),
    Level(None, None, 3, 3, 60, 128),
    Level(None, None, 5, 3, 100, 256),
    Level(None, None, 5, 5, PAPER_EPOCHS, 1000),
)
"""From minutes to days. Paper A's networks have the paper's widths on every step."""


@dataclass(frozen=True)
class Plan(Level):
    """A level, and for what it was chosen."""

    figures: tuple[str, ...]
    data: str  # the data set's name
    digest: str  # of its clips
    budget_min: float
    seed: int
    possible_holdouts: int  # holdouts that share no clip, at most five
    full: int = 0  # holdouts for which fully trained networks were given

    def epochs_of(self, method: str) -> int | None:
        """Return the epochs of a network; None is its usual number."""
        parts = part_network(method)
        if parts is None or self.epochs == PAPER_EPOCHS:
            return None
        return max(1, self.epochs // BLEND_SHARE) if parts[0] == "blend" else self.epochs

    def is_full(self, method: str) -> bool:
        """Tell whether a fully trained network stands for this method in the headlines."""
        return bool(self.full) and method in FULL

    def headline(self, method: str) -> str:
        """Return the name under which the best trained network of a kind is scored."""
        return f"{method}+" if self.is_full(method) and self.epochs_of(method) else method

    @property
    def made_up(self) -> bool:
        """Whether no clip was recorded."""
        return self.data == "embedded"

    def label(self) -> str:
        """Say on every figure what it was made with."""
        clips = "embedded clips, made up by a model" if self.made_up else f"clips of {self.data}"
        given = f"; EBF and Blend fully trained on {self.full} holdouts" if self.full else ""
        return f"budget {self.budget_min:g} min: {Level.__str__(self)}{given}; {clips}"


def dataset_digest(dataset: Dataset) -> str:
    """Make a few letters of all clips, their names and actions."""
    digest = hashlib.sha256()
    for clip, action in zip(dataset.clips, dataset.actions, strict=True):
        digest.update(f"{clip.name}/{action}/{clip_digest(clip)}\n".encode())
    return digest.hexdigest()[:12]


def most_holdouts(dataset: Dataset, seed: int) -> int:
    """Return how many holdouts these clips allow, at most the paper's five.

    Raises
    ------
    ValueError
        If they do not allow one.
    """
    for n in (5, 4, 3, 2):
        try:
            make_splits("paper", dataset.actions, seed=seed, n_holdouts=n)
            return n
        except ValueError:
            continue
    make_splits("paper", dataset.actions, seed=seed, n_holdouts=1)
    return 1


def at_level(plan: Plan, level: Level) -> Plan:
    """Return the plan with another level, within what the clips allow."""
    values = {f.name: getattr(level, f.name) for f in fields(Level)}
    values["holdouts"] = min(level.holdouts, plan.possible_holdouts)
    return replace(plan, **values)


def save_plan(plan: Plan, path: Path) -> None:
    """Write a plan."""
    write_atomically(path, json.dumps(asdict(plan), indent=1) + "\n")


def load_plan(path: Path) -> Plan | None:
    """Read a plan, or return None if there is none.

    Raises
    ------
    ValueError
        If the file is something else.
    """
    try:
        values: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        return Plan(**values | {"figures": tuple(values["figures"])})
    except FileNotFoundError:
        return None
    except (ValueError, KeyError, TypeError):
        raise ValueError(
            f"{path}: expected the plan of a reproduction, got something else"
        ) from None


def check_same(stored: Plan, wanted: Plan, path: Path) -> None:
    """Refuse to go on in the folder of another plan.

    Fewer figures than the plan has are welcome: they are drawn from what is there.

    Raises
    ------
    ValueError
        With what differs.
    """
    names = ("data", "digest", "budget_min", "seed")
    differ = [
        f"{name} ({getattr(stored, name)}, now {getattr(wanted, name)})"
        for name in names
        if getattr(stored, name) != getattr(wanted, name)
    ]
    more = [name for name in wanted.figures if name not in stored.figures]
    if more:
        differ.append(f"figures ({', '.join(stored.figures)}; now also {', '.join(more)})")
    if wanted.full and wanted.full != stored.full:
        differ.append(f"holdouts with given networks ({stored.full}, now {wanted.full})")
    if differ:
        raise ValueError(
            f"{path.parent} has another plan: {'; '.join(differ)}; give the same options to go "
            "on with it, or choose another output folder"
        )
