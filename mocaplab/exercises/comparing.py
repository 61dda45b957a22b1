"""Checks for the exercises of notebook 03 that compare filters on clips: tuning, and measures.

Those about one curve are in :mod:`mocaplab.exercises.smoothing`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from mocaplab.exercises.answers import NOT_YET, NOTHING, as_number, call, known, short
from mocaplab.filters import Denoiser, GaussianDenoiser
from mocaplab.measures.by_name import MEASURES
from mocaplab.motion import Corrupted, FloatArray
from mocaplab.tuning import SIGMA_GRID_S, error_table

PAIRS_S = ((0.125, 0.032), (0.125, 0.008))
"""Widths of a weak and of a fairer Gaussian, seconds. The last one leaves nearly all the noise."""


def check_tuning(answer: Any, clips: Sequence[Corrupted], others: Sequence[Corrupted]) -> str:
    """Check a function that takes training clips and returns the best single width, seconds.

    Best is the smallest RMS error, averaged over clips (:mod:`mocaplab.tuning`).
    """
    if answer is None:
        return NOT_YET
    if not callable(answer):
        return "Give a function that takes any list of clips, not a width: def my_tune(clips):"
    found = []
    for some in (clips, others):
        result, problem = call(answer, list(some))
        if problem or result is None:
            return problem or NOTHING
        got = as_number(result)
        if got is None:
            return "Your function must return one number: a width in seconds."
        found.append(got)
    candidates = [GaussianDenoiser(sigma_s) for sigma_s in SIGMA_GRID_S]
    tables = [(some, error_table(candidates, some)) for some in (clips, others)]
    wrong = [(w, *t) for w, t in zip(found, tables, strict=True) if not _is_best_width(w, t[1])]
    if not wrong:
        return (
            f"Right: {1000 * found[0]:.0f} ms for the first list, {1000 * found[1]:.0f} ms for "
            f"the other. No width does better on the clips that your function was given."
        )
    for width, some, errors in wrong:
        if hint := _known_wrong_width(width, some, errors):
            return hint
    if found[0] == found[1]:
        return (
            "Your function gives the same width for two different lists of clips. Does it look at "
            "the clips it is given, or at some other ones?"
        )
    width = wrong[0][0]
    if not 0 < width < 1:
        return f"A width of {width:g} seconds cannot be right. Which unit is it in?"
    return (
        f"{1000 * width:.0f} ms is not the best for one of the lists. For every width: clean "
        f"each clip, take its RMS, and average over clips. Keep the width with the smallest mean."
    )


def _is_best_width(width: float, errors: FloatArray) -> bool:
    """Tell whether a width is as good as the best one, to half a percent of the error."""
    rms = _rms(errors).mean(axis=0)
    return bool(0 <= width < 1 and np.interp(width, SIGMA_GRID_S, rms) <= 1.005 * rms.min())


def _rms(errors: FloatArray) -> FloatArray:
    """Return each clip's RMS with each width, (clips, widths), up to a common factor."""
    rms: FloatArray = np.sqrt(errors.sum(axis=2))
    return rms


def _known_wrong_width(width: float, clips: Sequence[Corrupted], errors: FloatArray) -> str:
    rms, fps = _rms(errors), clips[0].clean.fps
    mean = rms.mean(axis=0)
    frames = np.array([clip.clean.n_frames for clip in clips])
    squares = rms**2
    best = float(SIGMA_GRID_S[np.argmin(mean)])
    each = SIGMA_GRID_S[np.argmin(rms, axis=1)]
    average = "Average the errors of all clips first, then choose once."
    hints = {
        float(np.argmin(mean)): "That is a place in the list of widths. Return the width at "
        "this place.",
        best * fps: "That is in frames. Times frame_time, it is in seconds.",
        best * 1000: "That is in milliseconds. The answer is wanted in seconds.",
        float(SIGMA_GRID_S[np.argmax(mean)]): "That is the width with the largest error. Take "
        "the smallest.",
        float(np.mean(each)): f"That is the mean of each clip's best width. {average}",
        float(np.median(each)): f"That is the median of each clip's best width. {average}",
        float(each[-1]): f"That is the best width of the last clip alone. {average}",
        float(each[0]): f"That is the best width of the first clip alone. {average}",
    }
    for total in (squares.mean(axis=0), frames @ squares):
        hints[float(SIGMA_GRID_S[np.argmin(total)])] = (
            "That is best by the squared errors of all clips together. There the clip with the "
            "largest errors has nearly all the say. Take the root for each clip, then the mean."
        )
    return known(width, hints, rel_tol=1e-4)


def check_flattering_measures(answer: Any, clips: Sequence[Corrupted]) -> str:
    """Check a function (weak, fair, clips) that names all measures by which weak looks better."""
    if answer is None:
        return NOT_YET
    if not callable(answer):
        return "Give the function itself: def my_flattering(weak, fair, clips):"
    lists = []
    for widths_s in PAIRS_S:
        result, problem = call(answer, *(GaussianDenoiser(w) for w in widths_s), list(clips))
        names, problem = _names(result, problem)
        if problem:
            return problem
        lists.append(names)
    scores = {w: _scores(GaussianDenoiser(w), clips) for pair in PAIRS_S for w in pair}
    clean = _scores(None, clips)
    for names, (weak, fair) in zip(lists, PAIRS_S, strict=True):
        if problem := _wrong_names(names, scores[weak], scores[fair], clean):
            same = " Your function gives the same list for both pairs of filters."
            return problem + (same if lists[0] == lists[1] else "")
    return (
        f"Right: by {len(lists[0])} measures 125 ms looks better than 32 ms, and by "
        f"{len(lists[1])} better than 8 ms. One measure can be bought."
    )


def _names(result: Any, problem: str) -> tuple[set[str], str]:
    """Read names of measures, or say what is wrong with them."""
    if problem or result is None:
        return set(), problem or NOTHING
    if isinstance(result, str) or not np.iterable(result):
        return set(), f"Return a list of names, also if it is only one, not {short(result)}."
    names = list(result)
    for name in names:
        if not isinstance(name, str) or name not in MEASURES:
            return set(), f"There is no measure {short(name)}. The names are the keys of MEASURES."
    return set(names), ""


def _scores(denoiser: Denoiser | None, clips: Sequence[Corrupted]) -> FloatArray:
    """Score each clip by each measure, (measures, clips); without a denoiser, the clean clip."""
    cleaned = [(denoiser.denoise(c.observed, c.mask) if denoiser else c.clean, c) for c in clips]
    return np.array([[m.score(motion, c) for motion, c in cleaned] for m in MEASURES.values()])


def _wrong_names(names: set[str], weak: FloatArray, fair: FloatArray, clean: FloatArray) -> str:
    """Say what is wrong with a list of names, or nothing; scores as of :func:`_scores`."""
    lower = np.array([measure.lower_is_better for measure in MEASURES.values()])[:, None]
    best = np.where(lower, 0.0, clean).mean(axis=1)

    def better(a: FloatArray, b: FloatArray, *, raw: bool = False) -> set[str]:
        means = a.mean(axis=1), b.mean(axis=1)
        wins = means[0] < means[1] if raw else abs(means[0] - best) < abs(means[1] - best)
        return {name for name, win in zip(MEASURES, wins, strict=True) if win}

    right = better(weak, fair)
    if names == right:
        return ""
    no_value = {n for n, scores in zip(MEASURES, weak, strict=True) if np.isnan(scores).all()}
    if names & no_value:
        return f"{min(names & no_value)} has no value (NaN) on these clips. Leave it out."
    if names == better(fair, weak):
        return "These are the measures by which the fair filter looks better. Turn it round."
    if names == better(weak, fair, raw=True):
        return "You took the smaller mean everywhere. Which measures have lower_is_better False?"
    if names < right:
        return f"What you list is right, but {len(right - names)} more should be in the list."
    return f"By {min(names - right)} the fair filter looks better. What is the best value of it?"
