"""Checks for the exercises of notebook 07, the interactive lab; see :mod:`mocaplab.exercises`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from mocaplab.exercises.answers import NOT_YET, NOTHING, as_number, call, known, not_a_number, short
from mocaplab.lab.gaussian import LOOK_AHEADS_S, WIDTHS_S, squared_error_table
from mocaplab.lab.model import NOISES, Laboratory, LabSettings, Scene, max_amount
from mocaplab.motion import FloatArray

TOLERANCE = 0.02
ALLOWANCE = 0.05
LEAD = 0.05
"""By which share of its error the Gaussian must be better, so that it is no tie."""


def check_channel_sigma(answer: Any, scene: Scene, channel: str) -> str:
    """Check a width in seconds: within ``TOLERANCE`` of the smallest error of this channel."""
    if answer is None:
        return NOT_YET
    width_s = as_number(answer)
    if width_s is None:
        return not_a_number(answer)
    errors = _errors_over_width(scene, channel)
    best, fps = float(WIDTHS_S[errors.argmin()]), scene.filled.fps
    if 0 < width_s < 0.5:
        mine = float(np.interp(width_s, WIDTHS_S, errors))
        if mine <= (1 + TOLERANCE) * errors.min():
            return f"Right: {mine:.2f} degrees. No Gaussian leaves less than {errors.min():.2f}."
        if np.isclose(width_s, scene.tuned_sigma_s, rtol=0.02):
            return (
                "That is the width tuned for all angles, on other clips. It is a good guess, and "
                "this angle has a better one: look at its own error curve."
            )
        if np.isclose(width_s, 1 / best / 1000, rtol=0.1):
            return "You turned seconds and milliseconds over: divide by 1000."
        more = width_s < best
        return (
            f"{mine:.2f} degrees, {100 * (mine / errors.min() - 1):.0f} % above the best. "
            f"{'Noise is left: go up' if more else 'The movement is blurred: go down'}."
        )
    if width_s <= 0:
        return "A width of 0 or less smooths nothing. Take one above 0."
    hints = {
        1000 * best: "That is in milliseconds, as the lab shows it. The answer is in seconds.",
        best * fps: "That is in frames. Divide by the frames per second.",
    }
    return known(width_s, hints, rel_tol=0.15) or (
        f"{width_s:g} seconds would average over most of the clip. Which unit did you use?"
    )


def _errors_over_width(scene: Scene, channel: str) -> FloatArray:
    """Return the RMS of the whole Gaussian at every width, one channel, degrees."""
    values, clean = (
        motion.channel(channel)[:, None] for motion in (scene.filled, scene.corrupted.clean)
    )
    table = squared_error_table(values, clean, scene.filled.frame_time)
    errors: FloatArray = np.sqrt(table[-1, :, 0])
    return errors


def check_gaussian_wins(
    answer: Any, laboratory: Laboratory, clip: str, shown: Sequence[str] = ()
) -> str:
    """Check (noise, channel): the tuned Gaussian is better there than EBF and than Blend.

    Noises in ``shown`` do not count: the notebook has given them away.
    """
    if answer is None:
        return NOT_YET
    if isinstance(answer, str) or not isinstance(answer, Sequence) or len(answer) != 2:
        return 'Give two names, such as ("uniform", "LeftHand.Xrotation").'
    noise, channel = answer
    if channel in NOISES:
        return "The noise comes first, then the channel."
    if noise not in NOISES:
        return f"There is no noise {short(noise)}. There are {', '.join(NOISES)}."
    if noise in shown:
        return f"The table above shows what {noise} does. Take a noise that is not in it."
    scene = laboratory.scene(LabSettings(clip, noise, max_amount(noise) / 2))
    labels = [scene.filled.skeleton.channel_labels[c] for c in scene.channels]
    if channel not in labels:
        if channel in scene.filled.skeleton.joint_names:
            return f"{channel} is a joint. Name one of its channels too: {channel}.Xrotation."
        if channel in scene.filled.skeleton.channel_labels:
            return f"{channel} is not cleaned: it does not move, or belongs to the root."
        return f"There is no channel {short(channel)}. The lab's menus show their names."
    errors = scene.errors_deg(scene.tuned_sigma_s, channel=channel)
    tuned = next(error for name, error in errors.items() if "tuned" in name)
    ebf, blend = errors["EBF"], errors["Blend"]
    figures = f"Gaussian {tuned:.2f}, EBF {ebf:.2f}, Blend {blend:.2f} degrees"
    network = min(ebf, blend)
    if network >= (1 + LEAD) * tuned:
        return f"Right: {figures}. Where a network met nothing like it, a simple filter can win."
    if tuned <= (1 + LEAD) * network:
        return f"Nearly a tie: {figures}. Find a lead of at least {100 * LEAD:.0f} %."
    if tuned < ebf:
        return f"Half way: {figures}. The Gaussian beats EBF, but Blend is better here."
    if tuned < blend:
        return f"Half way: {figures}. The Gaussian beats Blend, but EBF is better here."
    return (
        f"Both networks are better here: {figures}. They learned from angular noise of all "
        "strengths. Which noises look quite unlike that?"
    )


def check_least_smoothing(answer: Any, scene: Scene, channel: str) -> str:
    """Check a time in seconds: EBF's width of the channel is there among its narrowest 5 %."""
    if answer is None:
        return NOT_YET
    seconds = as_number(answer)
    if seconds is None:
        return not_a_number(answer)
    motion = scene.filled
    widths = scene.sigma_s[:, motion.skeleton.channel_index(channel)]
    if not 0 <= seconds <= motion.duration_s:
        best = int(widths.argmin())
        if seconds == int(seconds) and 0 <= seconds < motion.n_frames:
            near = abs(seconds - best) < 10
            return "That is a frame. Times frame_time, it is in seconds." + (
                "" if near else " And it is not the right one yet."
            )
        return f"The clip lasts from 0 to {motion.duration_s:.2f} seconds."
    mine = float(np.interp(seconds, motion.time_s, widths))
    if mine <= np.quantile(widths, 0.05):
        return f"Right: EBF smooths with {1000 * mine:.0f} ms there, and hardly ever with less."
    if mine >= np.quantile(widths, 0.9):
        return f"There it smooths most, with {1000 * mine:.0f} ms: bright is wide. Look for dark."
    everything = np.where(scene.sigma_s > 0, scene.sigma_s, np.inf).min(axis=1)
    if abs(seconds - motion.time_s[everything.argmin()]) < 0.02:
        return f"That is the narrowest width of all joints. Look at the row of {channel} alone."
    return (
        f"{1000 * mine:.0f} ms at {seconds:.2f} s. There are narrower ones: take the smallest "
        "number of this column of scene.sigma_s."
    )


def check_look_ahead(answer: Any, scene: Scene) -> str:
    """Check ``f(rms, look_aheads_s)``: the shortest one within ``ALLOWANCE`` of the last row."""
    if answer is None:
        return NOT_YET
    seconds = list(LOOK_AHEADS_S)
    # A made-up table too: no constant is right for both, nor a rule that takes the best row.
    made_up = np.array([[9.0, 7, 8], [5, 4.3, 4.15], [5, 4.1, 6], [5, 3.9, 6], [6, 4, 7]])
    cases = [(scene.gaussian_rms, seconds), (made_up, [0.0, 0.02, 0.05, 0.2, None])]
    found = []
    for table, aheads in cases:
        result, problem = call(answer, table.copy(), list(aheads))
        if problem:
            return problem
        if result is None:
            return NOTHING
        row = _first_good(table.min(axis=1))
        got = as_number(result)
        if got is None:
            return f"Your function must return one look-ahead in seconds, not {short(result)}."
        right = aheads[row]
        if right is None or not np.isclose(got, right):
            return _wrong_look_ahead(got, table, aheads, row)
        found.append(1000 * got)
    return f"Right: {found[0]:.0f} ms are enough here, and your rule holds on another table too."


def _first_good(best: FloatArray) -> int:
    return int(np.argmax(best <= (1 + ALLOWANCE) * best[-1]))


def _wrong_look_ahead(
    got: float, table: FloatArray, aheads: Sequence[float | None], row: int
) -> str:
    """Say what an answer for one table may have come from."""
    best = table.min(axis=1)
    right = aheads[row] or 0.0
    strict = aheads[int(np.argmax(best <= (1 + ALLOWANCE) * best.min()))]
    one_width = table[:, int(np.argmin(table[-1]))]
    at_one_width = aheads[_first_good(one_width)]
    if np.isclose(got, 1000 * right):
        return "That is in milliseconds. The look-aheads come in seconds; return one of them."
    if got == row:
        return "That is the place of the look-ahead in the list. Return the look-ahead itself."
    if np.isclose(got, best[row]):
        return "That is the error. Return the look-ahead that has it."
    if aheads[int(best.argmin())] is not None and np.isclose(got, aheads[int(best.argmin())] or 0):
        return "That look-ahead has the smallest error. A shorter one is good enough: within 5 %."
    if strict is not None and np.isclose(got, strict):
        return "You compare with the smallest error of all. Compare with the last row: no cut."
    if at_one_width is not None and np.isclose(got, at_one_width):
        return (
            "You kept one width for all look-aheads. Each look-ahead may have its own best width: "
            "take the minimum of every row first."
        )
    if got > right:
        return f"{got:g} s works, but a shorter look-ahead is still within 5 %."
    return f"With {got:g} s the error is more than 5 % above that without a cut."
