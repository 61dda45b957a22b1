"""A claim of the paper beside what we found: one row of the claim table."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from mocaplab.comparison.bootstrap import Interval
from mocaplab.comparison.methods import part_network
from mocaplab.datasets import Dataset
from mocaplab.files import write_atomically
from mocaplab.reproduction.needs import NOISE
from mocaplab.reproduction.plan import PAPER_EPOCHS, Plan
from mocaplab.reproduction.scores import NOTHING, RMS_ALL, Scores, label_of
from mocaplab.reproduction.verdicts import (
    NOT_ASKED,
    OPEN,
    Verdict,
    judge_every,
    judge_ratio,
)
from mocaplab.splits import Split

LEAST_EPOCHS = 10
"""A network that was trained for fewer epochs proves nothing, for or against."""


@dataclass(frozen=True)
class Claim:
    """What the paper says, what we found, and the verdict."""

    figure: str
    text: str
    paper: str  # its number, or what it says
    ours: Interval
    unit: str  # of our number; "times" for a ratio
    clips: int
    verdict: str
    why: str

    def number(self) -> str:
        """Write our number with its interval."""
        return number_text(self.ours, self.unit, self.clips)


def number_text(ours: Interval, unit: str, clips: int) -> str:
    """Write a number of ours with its interval, or alone where it has none.

    A number of motions is counted and has none, nor has a mean over one clip.

    Parameters
    ----------
    ours : Interval
        Its two ends are equal where there is no interval.
    unit : str
    clips : int
        On how many clips the number stands.

    Returns
    -------
    str, such as ``"0.70 (0.61 to 0.83) times"``; ``"-"`` for a number that is NaN
    """
    if np.isnan(ours.value):
        return "-"
    if unit.endswith("motions"):
        return f"{ours.value:g} {unit}"
    value, low, high = (_rounded(x) for x in ours)
    if not np.isclose(ours.low, ours.high, rtol=1e-9, atol=0):
        return f"{value} ({low} to {high}) {unit}".strip()
    return f"{value} {unit}".strip() + (" (one clip: no interval)" if clips == 1 else "")


def _rounded(number: float) -> str:
    return f"{number:.2f}" if number == 0 or abs(number) >= 0.1 else f"{number:.2g}"


@dataclass(frozen=True, eq=False)
class Evidence:
    """All that figures and claims are made from."""

    plan: Plan
    dataset: Dataset
    groups: Mapping[str, Mapping[str, Split]]
    scores: Scores
    folder: Path

    @property
    def models(self) -> Path:
        """The folder of trained networks."""
        return self.folder / "models"

    def cached(self, name: str, make: Callable[[], list[dict[str, Any]]]) -> list[dict[str, Any]]:
        """Return rows that were made before, or make them and keep them."""
        path = self.folder / "rows" / f"extra-{name}.json"
        if not path.exists():
            write_atomically(path, json.dumps(make(), indent=0) + "\n")
        rows: list[dict[str, Any]] = json.loads(path.read_text(encoding="utf-8"))
        return rows

    def untested(self, methods: Sequence[str], n_clips: int) -> str:
        """Say why nothing can be said about some methods, or nothing if it can."""
        if n_clips == 0:
            return "no clip was tested"
        epochs = self.plan.epochs
        own = [m for m in methods if part_network(m.rstrip("+")) and not m.endswith("+")]
        if own and epochs < LEAST_EPOCHS:
            return f"networks were trained for {epochs} of {PAPER_EPOCHS} epochs"
        return self.scores.too_few(n_clips)


def make_claim(
    evidence: Evidence,
    figure: str,
    text: str,
    paper: str,
    ours: Interval,
    unit: str,
    n_clips: int,
    methods: Sequence[str],
    judge: Callable[[], Verdict] | None,
) -> Claim:
    """Put a claim together; without a judge it is a finding of ours that nobody claimed."""
    if judge is None:
        why = evidence.untested(methods, n_clips)
        return Claim(figure, text, paper, ours, unit, n_clips, NOT_ASKED, why)
    missing = evidence.untested(methods, n_clips)
    verdict = Verdict(OPEN, missing) if missing else judge()
    return Claim(figure, text, paper, ours, unit, n_clips, verdict.word, verdict.why)


def ratio_claim(
    evidence: Evidence,
    figure: str,
    text: str,
    paper: float | None,
    ours: str,
    theirs: str,
    recipe: str = NOISE,
    groups: tuple[str, str] = ("holdout", "holdout"),
    measure: str = RMS_ALL,
) -> Claim:
    """Compare two methods: "the error of ours is ``paper`` times that of theirs".

    Without a paper's number it is a finding of ours.
    """
    scores = evidence.scores
    first = scores.by_clip(ours, recipe, groups[0], measure)
    second = scores.by_clip(theirs, recipe, groups[1], measure)
    ratio, n = scores.ratio(first, second)
    judge = None if paper is None else (lambda: judge_ratio(paper, ratio))
    said = "-" if paper is None else f"{paper:.2f} times"
    return make_claim(evidence, figure, text, said, ratio, "times", n, (ours, theirs), judge)


def every_claim(
    evidence: Evidence,
    figure: str,
    text: str,
    ours: str,
    others: Sequence[str],
    recipe: str = NOISE,
    paper: str = "on every motion",
) -> Claim:
    """Compare a method with several on every clip; our number is that of the clips won."""
    scores = evidence.scores
    errors = {label_of(m): scores.by_clip(m, recipe) for m in others}
    errors = {label: found for label, found in errors.items() if found}
    verdict, won, n = judge_every(scores.by_clip(ours, recipe), errors)
    count = Interval(won, won, won) if n else NOTHING
    judge = None if paper == "-" else (lambda: verdict)
    claim = make_claim(
        evidence, figure, text, paper, count, of_motions(n), n, (ours, *others), judge
    )
    if judge is None and verdict.why and not claim.why:
        return Claim(**{**vars(claim), "why": verdict.why})
    return claim


def of_motions(n: int) -> str:
    """Return the unit of a number of clips out of n."""
    return f"of {n} motions"


def paragraph(claims: Sequence[Claim]) -> str:
    """Say in a paragraph what agrees and what does not, out of the claims alone."""
    parts = []
    for word, opening in (
        ("holds", "What agrees"),
        ("holds weaker", "What agrees in part"),
        ("fails", "What does not agree"),
        (OPEN, "What cannot be tested here"),
        (NOT_ASKED, "What the paper did not try"),
    ):
        some = [claim for claim in claims if claim.verdict == word]
        if some:
            parts.append(f"{opening}: {'; '.join(_sentence(claim) for claim in some)}.")
    return " ".join(parts) or "Nothing is claimed here."


def _sentence(claim: Claim) -> str:
    said = "" if claim.paper == "-" else f"paper: {claim.paper}; "
    why = f"; {claim.why}" if claim.why else ""
    return f"{claim.text} ({said}ours: {claim.number()}{why})"
