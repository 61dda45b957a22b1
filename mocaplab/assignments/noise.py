"""Checks and data of the assignment ``noise_gaps``: see :mod:`mocaplab.assignments.grading`."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from mocaplab.assignments.contest import Contest, call_or_refuse
from mocaplab.assignments.grading import NotRight, quiet_call, student_rng
from mocaplab.assignments.judges import judge_function, judge_numbers
from mocaplab.corruption import corrupt, snr_db
from mocaplab.exercises.answers import NOT_YET, OTHER_DRAW, as_array, known
from mocaplab.motion import BoolArray, Corrupted, FloatArray, moving_channels
from mocaplab.noise.angular import angular_noise, movement_std
from mocaplab.synthesis import synthesize


def draw_work(student: str) -> Corrupted:
    """Draw a student's own walk and a noisy recording of it."""
    rng = student_rng(student, "noise_gaps")
    walk = synthesize("walk", duration_s=2.5, rng=rng, name=f"walk of {student}")
    return corrupt(walk, f"angular:{rng.uniform(0.3, 0.8):.3f}", rng=rng)


# ------------------------------------------------------------------ 1: an SNR


def check_snr(answer: Any, work: Corrupted) -> str:
    """Check the signal-to-noise ratio of a recording, in decibels, over the angles that move."""
    right = snr_db(work)
    moves = moving_channels(work.clean)
    clean, observed = work.clean.channels[:, moves], work.observed.channels[:, moves]
    noise = np.sum((observed - clean) ** 2)
    signal = np.sum((clean - clean.mean(axis=0)) ** 2)
    mistakes = {
        "You turned the ratio over: the signal stands on top of the fraction.": -right,
        "You took 20 log10 of a ratio of powers. Squares are powers already: 10 log10.": 2 * right,
        "You took 10 log10 of a ratio of deviations. Deviations need 20 log10.": right / 2,
        "Decibels use the logarithm to base 10; np.log is the natural one.": right * math.log(10),
        "That is the ratio itself. Decibels are 10 log10 of it.": signal / noise,
        "That is the ratio of the deviations. Decibels are 20 log10 of it.": math.sqrt(
            signal / noise
        ),
        "Your signal is the angles themselves. What counts is how they move: take each channel's "
        "mean away first.": 10 * np.log10(np.sum(clean**2) / noise),
        "Your signal is the noisy recording. Take the clean clip.": 10
        * np.log10(np.sum((observed - observed.mean(axis=0)) ** 2) / noise),
    }
    return judge_numbers(answer, right, mistakes, rtol=0.0, atol=0.15)


# ------------------------------------------------------------------ 2: noise of a wanted SNR


def check_noise_at(answer: Any, seed: int = 3) -> str:
    """Check a function (values, snr_db, rng) that adds white noise of a wanted SNR."""
    if answer is None or answer is ...:
        return NOT_YET
    time_s = np.arange(3000)[:, None] / 120
    sizes = np.array([[1.0, 5.0, 30.0]])
    values = sizes * np.sin(2 * np.pi * (time_s + np.random.default_rng(seed).uniform(size=3))) + 40
    done: list[float] = []
    for wanted in (12.0, 4.0):
        results = []
        for _ in range(2):
            result, problem = quiet_call(answer, values, wanted, np.random.default_rng(seed))
            if problem:
                return problem
            if result is None or result is ...:
                return f"{NOT_YET} So far, your function returns nothing."
            results.append(as_array(result))
        noisy, again = results
        if noisy is None or again is None or noisy.shape != values.shape:
            return f"Return the noisy values, with the shape {values.shape} that they came in."
        if not np.array_equal(noisy, again):
            return OTHER_DRAW
        problem = _judge_noise(noisy - values, values, wanted)
        if problem:
            return f"Right for {done[0]:g} dB, but not for {wanted:g} dB: {problem}" if done else (
                problem
            )  # fmt: skip
        done.append(wanted)
    return "Right: 12 dB and 4 dB, in every channel."


def _judge_noise(noise: FloatArray, values: FloatArray, wanted: float) -> str:
    """Judge noise whose SNR should be the wanted one in every channel; nothing if it is."""
    spread = values.std(axis=0)
    ratio = noise.std(axis=0) / spread
    right = 10 ** (-wanted / 20)
    if not noise.any():
        return "Nothing has changed."
    if np.allclose((noise + values).mean(axis=0), 0, atol=3):
        return "You return the noise alone. Add it to the values."
    if (np.ptp(noise, axis=0) == 0).all():
        return "Every frame got the same number. Draw one for each frame and channel."
    if np.allclose(noise / spread, (noise / spread)[:, :1]):
        return "All channels got the same numbers. Draw one for each frame and channel."
    if np.allclose(ratio, right, rtol=0.06):
        return ""
    if ratio.max() > 1.5 * ratio.min():
        return (
            "The channels have different SNR. Scale the noise by each channel's own deviation: "
            "std over axis 0."
        )
    hints = {
        right**2: "You took the ratio of powers, 10 ** (-dB / 10), for the deviation. The "
        "deviation is its root.",
        1 / right: "Your noise is louder than the signal: where does the minus sign stand?",
        1 / right**2: "Your noise is far louder than the signal: where does the minus sign stand?",
        math.exp(-wanted / 20): "Decibels use the base 10, not e.",
        math.sqrt(right): "That is one root too many: the deviation is 10 ** (-dB / 20).",
    }
    hint = known(float(ratio.mean()), hints, rel_tol=0.06)
    return hint or f"The SNR comes out at {-20 * math.log10(ratio.mean()):.1f} dB."


# ------------------------------------------------------------------ 3: the longest gap


def check_longest_gap(answer: Any, seed: int = 3) -> str:
    """Check a function (mask, frame_time) that returns the longest gap of each channel, s."""
    rng = np.random.default_rng(seed)
    mask = np.ones((40, 4), dtype=bool)
    for channel, lengths in enumerate(([2, 7, 3], [5], [4, 1])):
        frames = 1 + np.cumsum([0, *[length + int(rng.integers(2, 5)) for length in lengths]])
        for first, length in zip(frames, lengths, strict=False):
            mask[first : first + length, channel] = False
    end = mask.copy()
    end[-9:, 1] = False
    cases = {
        "a mask of 4 channels, one without a gap": (mask, 0.01),
        "a gap that reaches to the last frame": (end, 1 / 60),
        "one channel": (mask[:, :1], 1 / 30),
    }

    def gaps(hidden: FloatArray) -> list[int]:
        runs = "".join("x" if h else " " for h in hidden).split()
        return [len(run) for run in runs] or [0]

    def of_all(choose: Any, mask: BoolArray) -> Any:
        return np.array([choose(gaps(~column)) for column in mask.T])

    def to_the_end(mask: BoolArray) -> Any:
        inside = mask.copy()
        for column in inside.T:
            if not column[-1]:
                column[np.flatnonzero(column)[-1] + 1 :] = True
        return of_all(max, inside)

    mistakes = {
        "You measured the observed runs. True means observed: a gap is where the mask is "
        "False.": lambda m, dt: of_all(max, ~m) * dt,
        "These are frames. Multiply by the seconds that a frame lasts.": lambda m, dt: of_all(
            max, m
        ),
        "You divided by the frame time. Multiply: frames times seconds a frame.": lambda m, dt: (
            of_all(max, m) / dt
        ),
        "That is the time in all gaps of the channel. The longest one was asked "
        "for.": lambda m, dt: of_all(sum, m) * dt,
        "That is the first gap of each channel. Is a later one longer?": lambda m, dt: (
            of_all(lambda runs: runs[0], m) * dt
        ),
        "That is the last gap of each channel. Keep the longest.": lambda m, dt: (
            of_all(lambda runs: runs[-1], m) * dt
        ),
        "The gap that reaches to the last frame is missing: nothing ends it.": lambda m, dt: (
            to_the_end(m) * dt
        ),
        "That is one number for the whole mask. Give one for each channel.": lambda m, dt: (
            of_all(max, m).max() * dt
        ),
        "Each gap is one frame too short: from frame 3 to frame 5 are 3 frames.": lambda m, dt: (
            (of_all(max, m) - 1).clip(0) * dt
        ),
    }
    return judge_function(answer, cases, lambda m, dt: of_all(max, m) * dt, mistakes)


# ------------------------------------------------------------------ 4: bias and white noise


def check_split(answer: Any, seed: int = 3) -> str:
    """Check a function that splits an error (T, C) with NaN in it into bias and white noise."""
    rng = np.random.default_rng(seed)
    error = rng.normal([3.0, -1.0, 0.5], [0.5, 2.0, 1.0], (400, 3))
    hidden = error.copy()
    hidden[50:130, 0] = hidden[300:, 2] = np.nan
    cases = {"an error without gaps": (error,), "an error with gaps (NaN)": (hidden,)}

    def both(mean: Any, spread: Any) -> Any:
        return np.stack([mean, spread])

    def rms(e: FloatArray) -> Any:
        return np.sqrt(np.nanmean(e**2, axis=0))

    mistakes = {
        "The second number is the RMS, and the bias is in it too. What is left when the mean is "
        "taken away?": lambda e: both(np.nanmean(e, axis=0), rms(e)),
        "The two are in the wrong order: bias first.": lambda e: both(
            np.nanstd(e, axis=0), np.nanmean(e, axis=0)
        ),
        "You took means over the channels. A channel has its own bias: means over the frames, "
        "axis 0.": lambda e: np.stack([np.nanmean(e, axis=1), np.nanstd(e, axis=1)]),
        "You counted hidden samples as 0. They say nothing: leave them out.": lambda e: both(
            np.nan_to_num(e).mean(axis=0), np.nan_to_num(e).std(axis=0)
        ),
        "The second is the variance. The deviation is its root.": lambda e: both(
            np.nanmean(e, axis=0), np.nanvar(e, axis=0)
        ),
        "A bias can be negative: do not take absolute values before the mean.": lambda e: both(
            np.nanmean(np.abs(e), axis=0), np.nanstd(e, axis=0)
        ),
    }
    return judge_function(
        answer,
        cases,
        lambda e: both(np.nanmean(e, axis=0), np.nanstd(e, axis=0)),
        mistakes,
        rtol=0.005,
        nan_hint="One NaN makes a whole mean NaN: leave the hidden samples out.",
    )


# ------------------------------------------------------------------ beat the score


def noise_by_steps(values: FloatArray) -> Any:
    """Estimate the noise from the steps between neighbours: the answer to beat."""
    return np.diff(values, axis=0).std(axis=0) / math.sqrt(2)


def _score_blind(answer: Any, seed: int) -> float:
    errors = []
    for number, action in enumerate(("walk", "run", "kick")):
        for i, k in enumerate((0.02, 0.1, 0.5)):
            rng = np.random.default_rng([seed, number, i])
            motion = synthesize(action, duration_s=2.0, rng=rng, name=action)
            moves = moving_channels(motion)
            values = angular_noise(motion, k, rng=rng).channels[:, moves]
            result = as_array(call_or_refuse(answer, values))
            if result is None or result.shape != (values.shape[1],):
                raise NotRight(
                    f"For values of shape {values.shape} return {values.shape[1]} deviations."
                )
            if not (result > 0).all():
                raise NotRight("A deviation must be above 0.")
            decibels = 20 * np.log10(result / (k * movement_std(motion)[moves]))
            errors.append(np.abs(decibels).mean())
    return float(np.mean(errors))


CONTEST = Contest("noise_gaps", "dB", _score_blind, noise_by_steps, goal=0.15)
