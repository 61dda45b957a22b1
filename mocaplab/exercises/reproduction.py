"""Checks of notebook 10: read an interval, compare fairly, spot an unfair opponent."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from mocaplab.comparison.bootstrap import Interval
from mocaplab.exercises.answers import NOT_YET, NOTHING, as_number, call, known, not_a_number, short
from mocaplab.reproduction.verdicts import FAILS, HOLDS, OPEN, WEAKER, judge_ratio

WORDS = {"holds": HOLDS, "weaker": WEAKER, "fails": FAILS, "open": OPEN}
"""The short words that the exercise asks for."""

COMPARISONS: dict[str, tuple[str, bool]] = {
    "A": ("EBF reaches 15 frames to each side. A Gaussian of 125 ms (15 frames) is cut off there "
          "too, at one sigma.", True),
    "B": ("EBF and BF are both trained for 40 epochs on the same clips, with the same noise.",
          False),
    "C": ("EBF is trained for 200 epochs, NN for 20, on the same clips.", True),
    "D": ("The Gaussian's width is chosen on the training clips of each holdout.", False),
    "E": ("The width of a Gaussian is chosen for each test clip, by looking at its truth. It is "
          "listed among the methods.", True),
    "F": ("Wiener filter and EBF learn from the same training clips; the Wiener filter needs two "
          "seconds for it, EBF an hour.", False),
}  # fmt: skip
"""Comparisons: what was done, and whether it is unfair to one of the two."""

REASONS = {
    "A": "cut at one sigma, its weights end where they still matter; a whole Gaussian is better",
    "B": "both get the same clips, the same noise and the same number of epochs",
    "C": "nobody knows what NN would have reached after 200 epochs",
    "D": "tuning on training clips is what an honest opponent must do",
    "E": "it sees the truth, which no method may; as a bound it is welcome, as a method it is not",
    "F": "fairness is about what a method may know, not about how long it takes",
}


def check_verdict(answer: Any, paper: float, ours: tuple[float, float, float]) -> str:
    """Check what a ratio with its interval says about the paper's ratio.

    Parameters
    ----------
    answer : str, a word of ``WORDS``
    paper : float, below 1
    ours : (value, low, high)
    """
    if answer is None:
        return NOT_YET
    word = answer.strip().lower() if isinstance(answer, str) else None
    word = next((short for short, long in WORDS.items() if word in (short, long)), None)
    if word is None:
        return f"The answer is one of {', '.join(WORDS)}, not {short(answer)}."
    interval = Interval(*ours)
    right = judge_ratio(paper, interval)
    if WORDS[word] == right.word:
        return f"Right: {right.word}. {right.why[0].upper()}{right.why[1:]}."
    if word == "open":
        return "Something can be said: is 1 inside the interval, and is the paper's ratio?"
    if word == "fails" and interval.high < 1:
        return "All of the interval is below 1: the effect is there. How large may it be?"
    if interval.low > 1:
        return "Look at which side of 1 the interval is."
    if interval.high >= 1:
        return "1 is inside the interval: the two errors may be the same. What else is inside?"
    return "The effect is there. Does the interval reach the paper's ratio, or end before it?"


def check_ratio(answer: Any) -> str:
    """Check a function that compares two methods: ``my_ratio(ours, theirs)``.

    Both are dicts from clip to error. It returns the ratio of the mean errors over the clips
    that both have.
    """
    if answer is None:
        return NOT_YET
    ours = {"walk": 2.0, "run": 3.0, "kick": 10.0}
    theirs = {"walk": 4.0, "run": 3.0, "jump": 1.0}
    result, problem = call(answer, dict(ours), dict(theirs))
    if problem:
        if "KeyError" in problem:
            return f"{problem}. Not every clip is in both: take those that are."
        return problem
    if result is None:
        return NOTHING
    got = as_number(result)
    if got is None:
        return not_a_number(result)
    if np.isclose(got, 5 / 7):
        again, problem = call(answer, {"a": 1.0, "b": 6.0}, {"b": 3.0, "a": 4.0})
        if as_number(again) is None or not np.isclose(as_number(again) or 0.0, 1.0):
            return "The clips of the two may come in another order: look them up by their names."
        return "Right: the mean errors over the two common clips are 2.5 and 3.5, their ratio 0.71."
    hints = {
        15 / 8: "You took all clips of each. A hard clip that only one of them was tested on "
        "decides then: take the clips that both have.",
        (15 / 3) / (8 / 3): "You took all clips of each: take those that both have.",
        (0.5 + 1.0) / 2: "That is the mean of the clips' ratios. There an easy clip counts as "
        "much as a hard one: divide the mean errors.",
        7 / 5: "That is theirs by ours. Below 1 should mean that ours is better.",
        -1.0: "That is the difference of the means. A ratio was asked for.",
        -2.0: "That is the difference of the sums. A ratio was asked for.",
    }
    return known(got, hints, rel_tol=1e-6) or (
        f"For errors of 2, 3 (and a kick of 10) against 4, 3 (and a jump of 1) you get {got:.3g}. "
        "Take the common clips, the mean error of each method on them, and divide."
    )


def check_unfair(answer: Any, comparisons: Mapping[str, tuple[str, bool]] = COMPARISONS) -> str:
    """Check which comparisons are unfair; the answer is their letters, in any container."""
    if answer is None:
        return NOT_YET
    try:
        letters = {str(letter).strip().upper() for letter in answer} - {"", ","}
    except TypeError:
        return f"Give the letters, such as {{'A', 'B'}}, not {short(answer)}."
    unknown = sorted(letters - set(comparisons))
    if unknown:
        return f"There is no comparison {short(unknown[0])}; there are {', '.join(comparisons)}."
    unfair = {letter for letter, (_, is_unfair) in comparisons.items() if is_unfair}
    accused = sorted(letters - unfair)
    if accused:
        return f"{accused[0]} is fair: {REASONS[accused[0]]}."
    missing = unfair - letters
    if missing:
        n = len(missing)
        return (
            f"All that you named are unfair, and {n} more {'is' if n == 1 else 'are'}. Ask of "
            "each: may both know the same, and did somebody take the same care of both?"
        )
    return f"Right. {' '.join(f'{letter}: {REASONS[letter]}.' for letter in sorted(unfair))}"
