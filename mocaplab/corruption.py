"""Every way to spoil a clean motion, by name, and recipes that join them.

A recipe is ``NAME:AMOUNT`` or several joined by ``+``, such as
``"angular:0.5+gaps:0.001"``: each is applied to what the one before left.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from difflib import get_close_matches

import numpy as np

from mocaplab.euler import make_continuous
from mocaplab.motion import Corrupted, Motion, moving_channels
from mocaplab.noise.angular import angular_noise, biased_noise, uniform_noise, wavering_noise
from mocaplab.noise.faults import (
    drift,
    dropped_frames,
    frozen_frames,
    quantise,
    spikes,
    swaps,
)
from mocaplab.noise.gaps import gap_mask, hide, long_gap_mask
from mocaplab.noise.spatial import spatial_noise, spatial_noise_ends
from mocaplab.two_sources.noise import source_noise_motion


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


def _joint_gaps(motion: Motion, amount: float, *, rng: np.random.Generator) -> Motion:
    return hide(motion, gap_mask(motion, amount, whole_joints=True, rng=rng))


def _long_gaps(motion: Motion, amount: float, *, rng: np.random.Generator) -> Motion:
    return hide(motion, long_gap_mask(motion, amount, rng=rng))


_DEVIATIONS = "deviations of each angle"
_STARTS = "starts in 1/120 s"

CORRUPTIONS: dict[str, Corruption] = {
    corruption.name: corruption
    for corruption in (
        # Paper A
        Corruption("angular", 0.5, _DEVIATIONS, "Gaussian noise, paper A's k", angular_noise),
        Corruption("uniform", 0.5, _DEVIATIONS, "the same spread, evenly", uniform_noise),
        Corruption("biased", 0.5, _DEVIATIONS, "Gaussian noise and a constant", biased_noise),
        Corruption("wavering", 0.5, _DEVIATIONS, "Gaussian noise and a sine", wavering_noise),
        Corruption("gaps", 0.001, _STARTS, "short gaps in single angles", _gaps),
        Corruption("joint_gaps", 0.001, _STARTS, "short gaps in whole joints", _joint_gaps),
        Corruption("long_gaps", 1.0, "s", "one gap in each of three joints", _long_gaps),
        Corruption("spatial", 0.5, "cm", "errors of joint positions", spatial_noise),
        Corruption("spatial_ends", 0.5, "cm", "larger at wrists and ankles", spatial_noise_ends),
        # Paper B
        Corruption(
            "sources", 1.0, "times paper B's", "bias, jitter, lost joints", source_noise_motion
        ),
        # Real captures
        Corruption("spikes", 0.005, "of all samples", "single frames far off", spikes),
        Corruption("frozen", 0.5, "per second", "the pose is held", frozen_frames),
        Corruption("dropped", 0.5, "per second", "whole frames are missing", dropped_frames),
        Corruption("swaps", 0.5, "per second", "left is taken for right", swaps),
        Corruption("drift", 2.0, "deg in 1 s", "angles wander off as sqrt(t)", drift),
        Corruption("quantised", 1.0, "deg a step", "angles rounded to steps", quantise),
    )
}
"""All corruptions by name; a new one is one entry."""


def corruption_table() -> str:
    """List all corruptions with their default amounts and units, a line each."""
    rows = [(c.name, f"{c.amount:g} {c.unit}", c.summary) for c in CORRUPTIONS.values()]
    widths = [max(len(row[i]) for row in rows) for i in range(2)]
    return "\n".join(
        f"  {name:{widths[0]}}  {amount:{widths[1]}}  {summary}" for name, amount, summary in rows
    )


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
    steps = re.split(r"(?<!\d[eE])\+", recipe)  # not at the plus of a number such as 1e+2
    return [_parse_step(step.strip(), recipe) for step in steps]


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


def snr_db(corrupted: Corrupted) -> float:
    """Return the signal-to-noise ratio in decibels.

    It is 10 log10 of the movement's power over the error's: the squared distance of every
    clean sample from its channel's mean, summed, over the squared error, summed. Only
    channels that move and samples that were observed count. So "k noise" has
    -20 log10 k dB: 20, 6 and 1 dB for k = 0.1, 0.5 and 0.9 (paper A, section 4).

    Returns
    -------
    float, dB; infinite without any error, NaN if nothing moves or nothing was observed
    """
    clean, observed = corrupted.clean.channels, corrupted.observed.channels
    counts = corrupted.mask & moving_channels(corrupted.clean)
    signal = np.sum((clean - clean.mean(axis=0)) ** 2, where=counts)
    error = np.sum((observed - clean) ** 2, where=counts)
    with np.errstate(divide="ignore", invalid="ignore"):
        return float(10 * np.log10(signal / error))
