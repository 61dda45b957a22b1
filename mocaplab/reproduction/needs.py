"""What a figure needs: which methods are fitted and tested, on which noise and which clips."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mocaplab.comparison.job import Job
from mocaplab.comparison.methods import part_network
from mocaplab.corruption import parse_recipe
from mocaplab.datasets import Dataset
from mocaplab.reproduction.plan import Plan
from mocaplab.splits import Split, leave_one_action_out, make_splits

NOISE, SPATIAL = "angular:0.5", "spatial:0.5"
"""What the paper has numbers for, in its text."""

PAPERS = ("gaussian_58", "gaussian_125", "ebd_denoiser", "example_based")
"""What the paper compares EBF with."""
RMS = ("rms_all_deg", "rms_moving_deg")
GAPS = ("gaps", "joint_gaps", "long_gaps")
GROUPS = ("holdout", "without", "subjects", "half", "quarter")
"""Kinds of splits: the paper's; without one action; without the tested people; fewer clips."""


@dataclass(frozen=True)
class Need:
    """Methods to be fitted and tested.

    Parameters
    ----------
    methods : tuple of str, see :class:`mocaplab.comparison.job.Job`
    recipes : tuple of str, the noise that is tested on
    group : one of ``GROUPS``
    headline : bool
        EBF and Blend as fully trained networks, if the plan has some.
    detail : bool, also the error of every frame and joint
    """

    methods: tuple[str, ...]
    recipes: tuple[str, ...] = (NOISE,)
    group: str = "holdout"
    headline: bool = False
    detail: bool = False


def make_groups(
    dataset: Dataset, subjects: Sequence[int] | None, plan: Plan
) -> dict[str, dict[str, Split]]:
    """Make all splits of a plan: group -> name -> Split.

    The group "whole" has the holdouts' tests, and all clips to train on that a full training has.
    A group that these clips do not allow is empty: "subjects" where nobody wrote down who
    moves, "without" where there is only one action.
    """
    actions, rng = dataset.actions, np.random.default_rng([plan.seed, 7])

    def thin(split: Split, train: int | None, test: int | None) -> Split:
        return Split(
            _spread(split.train, actions, train, rng), _spread(split.test, actions, test, rng)
        )

    whole = make_splits("paper", actions, seed=plan.seed, n_holdouts=plan.possible_holdouts)
    used = dict(list(whole.items())[: max(plan.holdouts, plan.full)])
    holdouts = {
        name: thin(split, plan.train_clips, plan.test_clips) for name, split in used.items()
    }
    tested = {i for split in list(holdouts.values())[: plan.holdouts] for i in split.test}
    groups: dict[str, dict[str, Split]] = {name: {} for name in GROUPS}
    groups["holdout"] = holdouts
    groups["whole"] = {n: Split(used[n].train, split.test) for n, split in holdouts.items()}
    if len(set(actions)) > 1:
        for action, split in leave_one_action_out(actions).items():
            test = tuple(i for i in split.test if i in tested)
            if test:
                left = thin(Split(split.train, test), plan.train_clips, None)
                groups["without"][f"without_{action}"] = left
    try:
        strict = make_splits("subject", actions, subjects, seed=plan.seed, n_holdouts=1)
        split = strict["holdout_1"]
        groups["subjects"] = {"subjects_1": thin(split, plan.train_clips, plan.test_clips)}
    except ValueError:
        pass  # it is not known who moves, or too few people do
    first = holdouts["holdout_1"]
    for name, share in (("half", 2), ("quarter", 4)):
        n = len(first.train) // share
        if n:
            groups[name] = {f"{name}_1": thin(first, n, None)}
    return groups


def _spread(
    clips: Sequence[int], actions: Sequence[str], n: int | None, rng: np.random.Generator
) -> tuple[int, ...]:
    """Choose n clips, so that all actions have their turn before one has a second."""
    if n is None or n >= len(clips):
        return tuple(clips)
    turns: dict[str, int] = {}
    order = []
    for clip in rng.permutation(clips).tolist():
        turns[actions[clip]] = turns.get(actions[clip], 0) + 1
        order.append((turns[actions[clip]], clip))
    return tuple(sorted(clip for _, clip in sorted(order, key=lambda pair: pair[0])[:n]))


def make_jobs(
    needs: Iterable[Need], dataset: Dataset, groups: Mapping[str, Mapping[str, Split]], plan: Plan
) -> list[Job]:
    """List all jobs that some figures need, each once."""
    found: dict[tuple[object, ...], Job] = {}
    for need in needs:
        for method in need.methods:
            full = need.headline and plan.is_full(method)
            # What stands beside fully trained networks is fitted on as many clips as they are.
            whole = plan.full and need.group == "holdout" and (full or not part_network(method))
            n = max(plan.holdouts, plan.full) if whole and need.headline else plan.holdouts
            epochs = None if full else plan.epochs_of(method)
            splits = list(groups["whole" if whole else need.group].items())
            for holdout, split in splits if need.group == "without" else splits[:n]:
                for recipe in need.recipes:
                    # Networks learn from recipes of their own; all others from what is tested.
                    fits = part_network(method) is None
                    test = _long_enough(dataset, split, recipe, fits=fits)
                    if test is None:
                        continue
                    job = Job(
                        holdout=holdout,
                        split=test,
                        corruption=recipe,
                        method=method,
                        measures=measures_of(recipe),
                        seed=plan.seed,
                        repetitions=plan.repetitions,
                        epochs=epochs,
                        detail=need.detail,
                    )
                    key = (holdout, recipe, method, epochs)
                    detail = need.detail or (key in found and found[key].detail)
                    found[key] = replace(job, detail=detail)
    return list(found.values())


def measures_of(recipe: str) -> tuple[str, ...]:
    """Choose what is measured: errors, inside gaps too, and the harm done to a clean clip."""
    steps = [(step.name, amount) for step, amount in parse_recipe(recipe)]
    gaps = ("gap_rms_deg",) if any(name in GAPS for name, _ in steps) else ()
    harm = ("harm_deg",) if steps == [("angular", 0.0)] else ()
    return (*RMS, *gaps, *harm)


def _long_enough(dataset: Dataset, split: Split, recipe: str, *, fits: bool) -> Split | None:
    """Keep the clips that a long gap fits into; None if there are none left.

    Training clips are kept too, unless a method fits to them after the recipe corrupted them.
    """
    gap_s = max((a for step, a in parse_recipe(recipe) if step.name == "long_gaps"), default=0.0)
    if not gap_s:
        return split
    train, test = (
        tuple(i for i in part if dataset.clips[i].duration_s > gap_s + 0.25)
        for part in (split.train, split.test)
    )
    train = train if fits else split.train
    return Split(train, test) if train and test else None
