"""Every way to spoil a clean motion, by name, and recipes that join them.

A recipe is ``NAME:AMOUNT`` or several joined by ``+``, such as
``"angular:0.5+gaps:0.001"``: each is applied to what the one before left.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from difflib import get_close_matches

import numpy as np

from mocaplab.euler import make_continuous
from mocaplab.gaps import gap_mask, hide
from mocaplab.motion import Corrupted, Motion
from mocaplab.noise import angular_noise


@dataclass(frozen=True)
class Corruption:
    """One way to spoil a motion.

    Parameters
    ----------
    name : str
    amount : float
        What a recipe without a number gets.
    unit : str
        What the amount means, with its unit.
    summary : str
        One line for a list.
    apply : called as ``apply(motion, amount, rng=rng)``
        Returns the spoilt motion, NaN where a sample is hidden. It refuses an amount that
        makes no sense with a ValueError.
    """

    name: str
    amount: float
    unit: str
    summary: str
    apply: Callable[..., Motion]


def _gaps(motion: Motion, amount: float, *, rng: np.random.Generator) -> Motion:
    return hide(motion, gap_mask(motion, amount, rng=rng))


CORRUPTIONS: dict[str, Corruption] = {
    corruption.name: corruption
    for corruption in (
        Corruption(
            "angular", 0.5, "x each angle's deviation", "Gaussian noise (paper A)", angular_noise
        ),
        Corruption(
            "gaps", 0.001, "starts per channel and 1/120 s", "gaps in single channels", _gaps
        ),
    )
}
"""All corruptions by name; a new one is one entry."""


def parse_recipe(recipe: str) -> list[tuple[Corruption, float]]:
    """Read a recipe such as ``"angular:0.5+gaps:0.001"``.

    An amount may be left out: ``"angular"`` has its default. A number alone, ``"0.5"``, is
    an amount of angular noise.

    Returns
    -------
    list of (Corruption, amount), in the order in which they are applied

    Raises
    ------
    ValueError
        If a name is unknown (the message has the nearest ones) or an amount no number.
    """
    return [_parse_step(step.strip(), recipe) for step in recipe.split("+")]


def _parse_step(step: str, recipe: str) -> tuple[Corruption, float]:
    name, colon, text = step.partition(":")
    if not colon and _is_number(step):
        name, colon, text = "angular", ":", step
    if name not in CORRUPTIONS:
        near = get_close_matches(name, CORRUPTIONS, cutoff=0.0)
        raise ValueError(
            f"recipe {recipe!r}: expected NAME:AMOUNT joined by +, got {step!r}; the nearest "
            f"names are {', '.join(near)}"
        )
    if colon and not _is_number(text):
        raise ValueError(f"recipe {recipe!r}: expected a number after {name!r}, got {text!r}")
    return CORRUPTIONS[name], float(text) if colon else CORRUPTIONS[name].amount


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def corrupt(motion: Motion, recipe: str = "angular:0.5", *, rng: np.random.Generator) -> Corrupted:
    """Make a spoilt motion out of a clean one.

    Parameters
    ----------
    motion : Motion
        The clean clip. It is made continuous first; its poses do not change.
    recipe : str
        What is done to it, see :func:`parse_recipe` and ``CORRUPTIONS``.
    rng : numpy.random.Generator

    Returns
    -------
    Corrupted
        With NaN in ``observed`` where the mask is False.

    Raises
    ------
    ValueError
        If the recipe cannot be read, an amount makes no sense, or the clip has gaps.
    """
    steps = parse_recipe(recipe)
    gap = np.argwhere(np.isnan(motion.channels))
    if gap.size:
        frame, channel = gap[0]
        raise ValueError(
            f"motion {motion.name!r}: expected a clean clip, got a gap in "
            f"{motion.skeleton.channel_labels[channel]} in frame {frame}; fill it first"
        )
    clean = observed = make_continuous(motion)
    for corruption, amount in steps:
        observed = corruption.apply(observed, amount, rng=rng)
    return Corrupted(clean, observed, ~np.isnan(observed.channels))
