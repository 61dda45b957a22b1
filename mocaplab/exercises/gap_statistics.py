"""Checks for the exercises of notebook 02 on gaps: how long they are, and how many there are.

As in :mod:`mocaplab.exercises.noise`, no check raises, whatever the answer is.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from mocaplab.exercises.answers import (
    NOT_YET,
    as_array,
    as_number,
    call,
    known,
    not_a_number,
    short,
)
from mocaplab.motion import FloatArray
from mocaplab.noise.gaps import PAPER_FPS

WANTED_SHARE = 0.05
WANTED_GAP_S = 0.25


def check_gap_lengths(answer: Any) -> str:
    """Check a function (observed, frame_time) that lists the gaps' lengths in seconds."""
    if answer is None:
        return NOT_YET
    frame_time, runs, between = 0.01, [3, 1, 7, 3], [4, 2, 5, 1, 6]
    observed = np.repeat(np.arange(9) % 2 == 0, [4, 3, 2, 1, 5, 7, 1, 3, 6])
    result, problem = call(answer, observed, frame_time)
    if problem:
        return problem
    got = as_array(result)
    if got is None:
        return f"Return a list of numbers, one for each gap, not {short(result)}."
    frames = np.sort(np.atleast_1d(got).ravel()) / frame_time
    hints = [
        (np.array(between), "These are the times between the gaps. True means observed: a gap "
         "is where the mask is False."),
        (np.array(runs) / frame_time, "These are frames. Multiply by the frame time."),
        (np.array(between) / frame_time, "These are the times between the gaps, in frames. "
         "A gap is where the mask is False, and lengths are asked in seconds."),
        (np.array(runs) / frame_time**2, "You divided by the frame time. Multiply: frames times "
         "seconds a frame."),
        (np.array(runs) - 1, "Each gap is one frame short. From frame 3 to frame 5 are 3 frames, "
         "not 2."),
        (np.array(runs) + 1, "Each gap is one frame too long. You count one of the observed "
         "frames beside it."),
        (np.array([sum(runs)]), "That is the time in all gaps together. Return one number a gap."),
        (np.array(runs[:-1]), "The last gap is missing. Does your loop store a run only when the "
         "next one begins?"),
        (np.array([max(runs)]), "That is the longest gap alone. Return one number a gap."),
        (np.array([len(runs)]) / frame_time, "That is how many gaps there are, not how long."),
    ]  # fmt: skip
    if _same_numbers(frames, np.array(runs)):
        return _check_no_gap(answer, frame_time)
    for wrong, hint in hints:
        if _same_numbers(frames, wrong):
            return hint
    return (
        f"For a mask with gaps of {', '.join(map(str, runs))} frames of {frame_time} s your "
        f"function returns {short(result)}."
    )


def _check_no_gap(answer: Callable[..., Any], frame_time: float) -> str:
    result, problem = call(answer, np.ones(5, dtype=bool), frame_time)
    if problem:
        return f"With a mask without any gap: {problem}"
    got = as_array([] if result is None else result)
    if got is None or got.size:
        return f"A mask without any gap has no lengths, but you return {short(result)}."
    return "Right: every gap is found, in seconds, and none where there is none."


def hidden_share_expected(start_probability: float, mean_frames: float) -> float:
    """Share of a long clip that gaps hide, in the model of :func:`mocaplab.noise.gaps.gap_mask`.

    A frame is seen if no gap that started n frames before it is longer than n, for any n.
    Close to 1 - exp(-start_probability * mean_frames).
    """
    longer = (1 - 1 / mean_frames) ** np.arange(math.ceil(40 * mean_frames))
    return float(1 - np.prod(1 - start_probability * longer))


def check_start_probability(answer: Any) -> str:
    """Check the start probability that hides ``WANTED_SHARE`` with ``WANTED_GAP_S`` gaps."""
    p = as_number(answer)
    if p is None:
        return NOT_YET if answer is None else not_a_number(answer)
    frames = WANTED_GAP_S * PAPER_FPS
    rate = -math.log(1 - WANTED_SHARE)
    hints = {
        WANTED_SHARE: "That is the share itself. Each start hides many frames, so starts must "
        "be much rarer.",
        100 * WANTED_SHARE / frames: "You took 5 for 5 %. As a share it is 0.05.",
        WANTED_SHARE / WANTED_GAP_S: "You divided by seconds. p is for one frame, 1/120 s: count "
        "the mean length in frames.",
        rate / WANTED_GAP_S: "This is how many gaps start in a second. p is for one frame.",
        WANTED_SHARE / 15: "That is for a mean length of 15 frames, the default. Here a gap lasts "
        "0.25 s on average.",
        WANTED_SHARE * frames: "You multiplied. Longer gaps hide more each, so fewer must start.",
        (1 - WANTED_SHARE) / frames: "That is for 95 % hidden: did you swap seen and hidden?",
        -math.log(WANTED_SHARE) / frames: "That leaves 5 % to be seen: swap seen and hidden.",
    }
    hint = known(p, hints, rel_tol=0.02)
    if hint:
        return hint
    if not 0 <= p <= 1:
        return "A probability lies between 0 and 1."
    share = hidden_share_expected(p, frames)
    if abs(share - WANTED_SHARE) < 0.0025:
        return f"Right: p = {p:.3g} hides {100 * share:.1f} % of a long clip."
    way = "less" if share > WANTED_SHARE else "more"
    return f"p = {p:.3g} hides {100 * share:.2g} %. Start gaps {way} often."


def _same_numbers(a: FloatArray, b: FloatArray) -> bool:
    return a.shape == b.shape and np.allclose(np.sort(a), np.sort(b))
