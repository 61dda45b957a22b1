"""The jobs of a comparison: one method, one corruption, one holdout."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mocaplab.comparison.methods import part_network
from mocaplab.corruption import parse_recipe
from mocaplab.measures.by_name import MEASURES
from mocaplab.motion import Corrupted, Motion
from mocaplab.splits import Split

ORACLE = "oracle"
"""The row of :func:`mocaplab.tuning.oracle_gaussian`, which sees the clean signal."""


@dataclass(frozen=True)
class Job:
    """One method, one corruption, one holdout.

    Parameters
    ----------
    holdout : str, the split's name
    split : Split
    corruption : str, a recipe, see :func:`mocaplab.corruption.parse_recipe`
    method : str, a name in ``METHODS``, a network (``part_network``), or ``ORACLE``
    measures : tuple of str, names in ``MEASURES``
    seed : int
    repetitions : int, times that fresh noise is drawn for every test clip
    epochs : int, for which networks are trained, or None for their usual number
    detail : bool
        Rows have also the RMS of every frame and of every joint, over all angles, as lists
        by_frame_deg and by_joint_deg.
    """

    holdout: str
    split: Split
    corruption: str
    method: str
    measures: tuple[str, ...]
    seed: int
    repetitions: int
    epochs: int | None = None
    detail: bool = False

    @property
    def name(self) -> str:
        """A name that can be a file's."""
        return _file_name(f"{self.corruption}-{self.network_name}")

    @property
    def network_name(self) -> str:
        """The name without the corruption, which a trained network does not depend on."""
        usual = self.epochs is None or part_network(self.method) is None
        epochs = "" if usual else f"-{self.epochs}"
        return _file_name(f"{self.method}-{self.holdout}{epochs}")


def _file_name(text: str) -> str:
    return re.sub(r"[^\w.+-]", "_", text)


def make_jobs(
    splits: Mapping[str, Split],
    recipes: Sequence[str],
    methods: Sequence[str],
    measures: Sequence[str],
    *,
    seed: int,
    repetitions: int,
    epochs: int | None = None,
) -> list[Job]:
    """List all jobs, those of one corruption together, so that its noise is drawn once."""
    return [
        Job(holdout, split, recipe, method, tuple(measures), seed, repetitions, epochs)
        for recipe in recipes
        for holdout, split in splits.items()
        for method in methods
    ]


def spell_recipe(recipe: str) -> str:
    """Spell a recipe with all its amounts, one spelling for each: ``"0.5"`` is ``"angular:0.5"``.

    Raises
    ------
    ValueError
        If the recipe cannot be read.
    """
    spelled = [f"{step.name}:{amount:g}" for step, amount in parse_recipe(recipe)]
    return "+".join(step.replace("e+", "e") for step in spelled)  # a plus joins steps


def usable_measures(clip: Motion) -> tuple[list[str], dict[str, str]]:
    """Try every measure on a clip: some need feet, or a skeleton of a person's size.

    Returns
    -------
    names : list of str
    refused : dict from the other names to why
    """
    corrupted = Corrupted(clip, clip, np.ones(clip.channels.shape, dtype=bool))
    names, refused = [], {}
    for name, measure in MEASURES.items():
        try:
            measure.score(clip, corrupted)
            names.append(name)
        except ValueError as error:
            refused[name] = str(error)
    return names, refused
