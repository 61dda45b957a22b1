"""Checks for the exercises in the notebooks: they answer at once, with a hint.

Each check takes the student's answer and returns a sentence. None means that the
exercise has not been tried yet.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mocaplab.exercises.answers import NOT_YET, NOTHING, as_array, as_number, call, short
from mocaplab.filters import gaussian_filter
from mocaplab.measures.by_name import rms_all_deg, rms_moving_deg
from mocaplab.motion import Corrupted, FloatArray


def check_noisiest_joint(answer: Any, clip: Corrupted) -> str:
    """Check which joint has the largest noise, RMS over its channels."""
    if answer is None:
        return NOT_YET
    skeleton = clip.clean.skeleton
    if not isinstance(answer, str) or answer not in skeleton.joint_names:
        return f"There is no joint {short(answer)}. The names are in clean.skeleton.joint_names."
    noise = clip.observed.channels - clip.clean.channels
    rms = {
        name: float(np.sqrt(np.mean(noise[:, skeleton.channel_joint == j] ** 2)))
        for j, name in enumerate(skeleton.joint_names)
    }
    ranking = sorted(rms, key=lambda name: rms[name], reverse=True)
    place = ranking.index(answer) + 1
    if place == 1:
        return f"Right: {answer} has {rms[answer]:.1f} degrees of noise, more than any other joint."
    if place == 2:
        return f"Almost: {answer} has the second most noise; one joint has a little more."
    if rms[answer] == 0:
        return f"{answer} got no noise at all. Noise grows with movement: which joint moves most?"
    return (
        f"{answer} is number {place} of {len(ranking)}. Noise is 0.5 times the spread of each "
        f"angle, so look for the joint that swings through the widest angles."
    )


def check_rms(answer: Any, clip: Corrupted) -> str:
    """Check a hand-made RMS over all joint angles but the root's."""
    if answer is None:
        return NOT_YET
    a, b = clip.observed, clip.clean
    if not callable(answer):
        return "Give the function itself: def my_rms(motion, clean): and no call of it."
    result, problem = call(answer, a, b)
    if problem or result is None:
        return problem or NOTHING
    numbers = as_array(result)
    if numbers is not None and numbers.size > 1:
        return (
            f"Your function returns {numbers.size} numbers, not one. Take the mean over "
            f"frames and channels together."
        )
    got = as_number(result)
    if got is None:
        return f"Your function returns {short(result)}, not one finite number."
    right = rms_all_deg(a, b)
    error = a.channels - b.channels
    joints = error[:, a.skeleton.is_cleaned]
    if np.isclose(got, right, rtol=1e-6):
        return f"Right: {got:.3f} degrees, the same as the library's rms_all_deg."
    known = {
        float(np.mean(joints**2)): "That is the mean square. Take the square root.",
        float(np.mean(np.abs(joints))): "That is the mean absolute error. Square before the mean.",
        float(np.mean(joints)): "That is the plain mean: plus and minus cancel. Square first.",
        float(np.sqrt(np.sum(joints**2))): "That is the root of the sum. Divide by the number "
        "of samples: take the mean.",
        float(np.sqrt(np.mean(error**2))): "You counted the root's 6 channels too. They are "
        "clean and hide the error: use clean.skeleton.is_cleaned to pick the others.",
        float(np.mean(np.sqrt(np.mean(joints**2, axis=0)))): "That is the mean of one RMS a "
        "channel. Take one mean over all samples before the root.",
        float(np.std(joints)): "That is the standard deviation: it takes the mean error away "
        "first. An RMS error does not.",
        rms_moving_deg(a, b): "You counted only the channels that move. This exercise wants all "
        "joint angles, as in the paper.",
    }
    for value, hint in known.items():
        if np.isclose(got, value, rtol=1e-6):
            return hint
    return f"You got {got:.6g}. Subtract, square, take the mean, take the square root."


def check_gaussian_width(answer_s: Any, clip: Corrupted) -> str:
    """Check a hand-tuned Gaussian width: within 2 % of the smallest error there is."""
    if answer_s is None:
        return NOT_YET
    width_s = as_number(answer_s)
    if width_s is None:
        return f"A width is a number of seconds, such as 0.05, not {short(answer_s)}."
    if width_s >= 1:
        return (
            f"{width_s:g} is in seconds, so you would average over the whole clip. If you meant "
            f"frames, divide by {clip.clean.fps:.0f}; if you meant milliseconds, by 1000."
        )
    if width_s <= 0:
        return "A width of 0 or less does not smooth at all. Try something above 0."
    widths = np.geomspace(0.004, 0.3, 60)
    errors = [_gaussian_error(clip, s) for s in widths]
    best = min(errors)
    mine = _gaussian_error(clip, width_s)
    if mine <= 1.02 * best:
        return f"Right: {mine:.3f} degrees. No single width gets below {best:.3f} on this clip."
    wider = width_s < widths[np.argmin(errors)]
    return (
        f"{mine:.3f} degrees, {100 * (mine / best - 1):.0f} % above the best. "
        f"{'Too little smoothing is left in noise' if wider else 'Too much smoothing is blur'}: "
        f"go {'up' if wider else 'down'}."
    )


def _gaussian_error(clip: Corrupted, sigma_s: float) -> float:
    smooth: FloatArray = gaussian_filter(clip.observed.channels, sigma_s, clip.clean.frame_time)
    return rms_all_deg(clip.observed.with_channels(smooth), clip.clean)
