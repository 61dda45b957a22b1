"""The rules by which a claim holds or fails. Nothing here knows any number of ours.

A claim about the size of an effect is a ratio of two mean errors. Ours comes with the interval
of a paired bootstrap over clips. Where the interval has both "no effect" and the paper's number
in it, more clips are needed, and the rules say so.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mocaplab.comparison.bootstrap import Interval

HOLDS, WEAKER, FAILS, OPEN = "holds", "holds weaker", "fails", "cannot be tested here"
NOT_ASKED = "not in the paper"
"""For what the paper did not try: there is nothing to agree with."""

ALIKE = 1.10
"""Two mean errors are alike when neither is more than a tenth above the other."""
NEARLY = 1.25
"""... and nearly alike up to a quarter."""


@dataclass(frozen=True)
class Verdict:
    """What became of a claim, and why, in a sentence."""

    word: str
    why: str


def judge_ratio(paper: float, ours: Interval) -> Verdict:
    """Judge "this error is ``paper`` times that one".

    - the interval is on the other side of 1: fails
    - it is on the paper's side and reaches the paper's ratio, or goes beyond it: holds
    - it is on the paper's side and does not reach it: holds weaker
    - it has 1 in it, and the paper's ratio too: cannot be tested
    - it has 1 in it, and the paper's ratio not: fails
    """
    if np.isnan(ours.value):
        return Verdict(OPEN, "there is no such ratio")
    if paper > 1:  # turn it round, so that an effect is always a ratio below 1
        found = judge_ratio(1 / paper, Interval(1 / ours.value, 1 / ours.high, 1 / ours.low))
        return found
    if ours.low > 1:
        return Verdict(FAILS, "it is the other way round")
    if ours.high < 1:
        if ours.low <= paper:
            return Verdict(HOLDS, "the effect is there, and as large as in the paper")
        return Verdict(WEAKER, "the effect is there, and smaller than in the paper")
    if ours.low <= paper:
        return Verdict(OPEN, "the interval has both no effect and the paper's effect in it")
    return Verdict(FAILS, "no effect is seen, and one as large as the paper's is ruled out")


def judge_below(limit: float, ours: Interval) -> Verdict:
    """Judge "this number is below the limit" by its interval."""
    if np.isnan(ours.value):
        return Verdict(OPEN, "there is no such number")
    if ours.high < limit:
        return Verdict(HOLDS, f"all of the interval is below {limit:g}")
    if ours.low > limit:
        return Verdict(FAILS, f"all of the interval is above {limit:g}")
    return Verdict(OPEN, f"the interval has {limit:g} in it")


def judge_above(limit: float, ours: Interval) -> Verdict:
    """Judge "this number is above the limit" by its interval."""
    found = judge_below(limit, ours)
    turned = {HOLDS: FAILS, FAILS: HOLDS}
    return Verdict(turned.get(found.word, found.word), found.why)


def judge_size(value: float, holds: float, weaker: float) -> Verdict:
    """Judge "this is almost nothing" by two limits."""
    if np.isnan(value):
        return Verdict(OPEN, "there is no such number")
    if value <= holds:
        return Verdict(HOLDS, f"it is at most {holds:g}")
    if value <= weaker:
        return Verdict(WEAKER, f"it is at most {weaker:g}, and more than {holds:g}")
    return Verdict(FAILS, f"it is more than {weaker:g}")


def judge_at_least(value: float, holds: float, weaker: float) -> Verdict:
    """Judge "this is nearly complete" by two limits."""
    if np.isnan(value):
        return Verdict(OPEN, "there is no such number")
    if value >= holds:
        return Verdict(HOLDS, f"it is at least {holds:g}")
    if value >= weaker:
        return Verdict(WEAKER, f"it is at least {weaker:g}, and less than {holds:g}")
    return Verdict(FAILS, f"it is less than {weaker:g}")


def judge_alike(ratios: Sequence[Interval]) -> Verdict:
    """Judge "these errors are almost the same": ratios with their intervals, all of them.

    It holds if every interval lies within ``ALIKE``, holds weaker within ``NEARLY``, and fails
    if one lies wholly beyond ``ALIKE``.
    """
    if not ratios or any(np.isnan(r.value) for r in ratios):
        return Verdict(OPEN, "there is no such ratio")

    def within(margin: float) -> bool:
        return all(r.low >= 1 / margin and r.high <= margin for r in ratios)

    if within(ALIKE):
        return Verdict(HOLDS, f"every interval is within {ALIKE - 1:.0%}")
    if within(NEARLY):
        return Verdict(WEAKER, f"every interval is within {NEARLY - 1:.0%}, not {ALIKE - 1:.0%}")
    if any(r.low > ALIKE or r.high < 1 / ALIKE for r in ratios):
        return Verdict(FAILS, f"one of them is beyond {ALIKE - 1:.0%}, with all of its interval")
    return Verdict(OPEN, f"intervals reach beyond {NEARLY - 1:.0%}")


def judge_every(
    ours: Mapping[str, float], others: Mapping[str, Mapping[str, float]]
) -> tuple[Verdict, int, int]:
    """Judge "it beats all others on every clip".

    It holds if it does, holds weaker if it does on three clips of four, and fails otherwise.

    Parameters
    ----------
    ours : dict from clip to error
    others : dict from method to such a dict; only clips that all have count

    Returns
    -------
    Verdict, the number of clips won, and the number of clips
    """
    clips = [c for c in ours if others and all(c in errors for errors in others.values())]
    lost: dict[str, int] = {}
    won = 0
    for clip in clips:
        rival = min(others, key=lambda name: others[name][clip])
        if ours[clip] < others[rival][clip]:
            won += 1
        else:
            lost[rival] = lost.get(rival, 0) + 1
    if not clips:
        return Verdict(OPEN, "no clip has all errors"), 0, 0
    if won == len(clips):
        return Verdict(HOLDS, "on every clip"), won, len(clips)
    losses = ", ".join(f"{n} to {name}" for name, n in sorted(lost.items()))
    word = WEAKER if won >= 0.75 * len(clips) else FAILS
    return Verdict(word, f"lost on {len(clips) - won} of {len(clips)}: {losses}"), won, len(clips)
