"""Checks for the exercises of notebook 11, beyond the paper: see :mod:`mocaplab.exercises`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from mocaplab.corruption import CORRUPTIONS, corrupt
from mocaplab.exercises.answers import NOT_YET, NOTHING, as_number, call, known, not_a_number, short
from mocaplab.filters import Denoiser, GaussianDenoiser
from mocaplab.motion import Corrupted
from mocaplab.tuning import mean_rms, tune_gaussian

VARIANCES = ((1.0, 4.0), (9.0, 1.0), (2.0, 2.0), (0.3, 1.7))
"""Pairs of variances on which a rule for mixing is tried."""


def check_mixing_weight(answer: Any) -> str:
    """Check ``f(variance_first, variance_second)``: the best weight of the first estimate."""
    if answer is None:
        return NOT_YET
    for first, second in VARIANCES:
        result, problem = call(answer, first, second)
        if problem:
            return problem
        if result is None:
            return NOTHING
        got = as_number(result)
        if got is None:
            return not_a_number(result)
        right = second / (first + second)
        if math.isclose(got, right, rel_tol=1e-6):
            continue
        case = f"With variances {first:g} and {second:g} you answer {got:.3g}. "
        a, b = math.sqrt(first), math.sqrt(second)
        hints = {
            first / (first + second): "That gives the larger weight to the worse estimate.",
            b / (a + b): "You took standard deviations. Errors add up by their squares.",
            a / (a + b): "The worse estimate gets more, and you took standard deviations.",
            0.5: "Equal weights are best only if both are equally good.",
            1 / first: "The weights must add up to 1: divide by the sum of both.",
            second / first: "That is how much better the first is. A weight lies from 0 to 1.",
            float(first < second): "Choosing the better one throws away what the other knows.",
        }
        return case + (
            known(got, hints, rel_tol=1e-6)
            or "Write down w^2 a + (1 - w)^2 b, and ask where its slope is 0."
        )
    return "Right: each estimate counts by what the other one is off."


def check_white_noise_left(answer: Any, *, sigma: float) -> str:
    """Check the deviation that white noise of deviation 1 has after a Gaussian filter.

    The width ``sigma`` is in frames.
    """
    if answer is None:
        return NOT_YET
    got = as_number(answer)
    if got is None:
        return not_a_number(answer)
    taps = np.arange(-math.ceil(4 * sigma), math.ceil(4 * sigma) + 1)
    raw = np.exp(-0.5 * (taps / sigma) ** 2)
    weights = raw / raw.sum()
    left = float(np.sqrt(np.sum(weights**2)))
    if math.isclose(got, left, rel_tol=0.03):
        return "Right: so much noise is left, whatever the movement does."
    hints = {
        left**2: "That is the variance. The question is about the standard deviation.",
        float(np.sum(weights)): "The weights add up to 1, but noise adds up by its squares.",
        float(np.sqrt(np.sum(raw**2))): "Divide the weights by their sum first.",
        float(np.sum(raw**2)): "Divide the weights by their sum first, and take the root.",
        1 / math.sqrt(len(taps)): "That is a mean of equal weights. These are not equal.",
        1 / math.sqrt(sigma): "The window is wider than sigma. Take the weights themselves.",
        1 / sigma: "The window is wider than sigma, and noise adds up by its squares.",
        1 - left: "That is what was taken away. How much is left?",
    }
    return known(got, hints, rel_tol=0.02) or (
        "For independent x, the variance of a sum of w x is the sum of w^2 times that of each x."
    )


def check_where_it_loses(
    answer: Any, denoiser: Denoiser, train: Sequence[Corrupted], test: Sequence[Corrupted]
) -> str:
    """Check the name of a corruption for which a tuned Gaussian beats a denoiser.

    The Gaussian is tuned on training clips with the same fault, one width a channel.
    """
    if answer is None:
        return NOT_YET
    name = answer.strip() if isinstance(answer, str) else ""
    if name not in CORRUPTIONS:
        return f"The answer is one name in CORRUPTIONS, in quotes, not {short(answer)}."
    spoilt_train, spoilt_test = (
        [corrupt(c.clean, name, rng=np.random.default_rng([1, i])) for i, c in enumerate(clips)]
        for clips in (train, test)
    )
    gaussian = GaussianDenoiser(tune_gaussian(spoilt_train)[1])
    simple, ours = mean_rms(gaussian, spoilt_test), mean_rms(denoiser, spoilt_test)
    numbers = f"The Gaussian leaves {simple:.2f} degrees, the network {ours:.2f}."
    if ours > 1.05 * simple:
        return f"Right: {numbers}"
    if ours > 0.95 * simple:
        return f"{numbers} That is no clear win for either. Look for a fault unlike white noise."
    return f"{numbers} Here the network wins. Which faults did it never meet in training?"
