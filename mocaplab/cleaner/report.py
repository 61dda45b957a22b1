"""One page about a cleaned file: what was done, where, and why. It needs no network."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from mocaplab import html_page
from mocaplab.cleaner.fault_detection import Faults
from mocaplab.cleaner.pictures import draw_channel, draw_widths, most_changed
from mocaplab.cleaner.summary import CleaningReport
from mocaplab.cleaning import Cleaned
from mocaplab.doctor import diagnose
from mocaplab.files import write_atomically
from mocaplab.findings import summarize
from mocaplab.html_page import bullets, heading, note, paragraph, table
from mocaplab.measures.feet import foot_skate_cm_s
from mocaplab.motion import Motion
from mocaplab.motion_model import CM_PER_UNIT

MOST_FRAMES = 20_000
"""Feet and findings are looked at in this many frames at most, to need little memory."""


def write_report(
    before: Motion,
    after: Motion,
    cleaned: Cleaned,
    faults: Faults | None,
    summary: CleaningReport,
    path: Path,
) -> None:
    """Write a page of HTML with pictures inside.

    Parameters
    ----------
    before, after : Motion, without NaN, as the files have them
    cleaned : Cleaned, with widths
    faults : Faults or None, what was detected
    summary : CleaningReport
    path : Path of the page

    Raises
    ------
    OSError
        If it cannot be written.
    """
    sections = [
        heading(f"What was done to {before.name}", 1),
        paragraph(
            f"{before.n_frames} frames at {before.fps:.4g} per second "
            f"({before.duration_s:.1f} s), {before.skeleton.n_joints} joints."
        ),
        _numbers(before, after, summary),
        _repairs(before, cleaned, faults, summary),
        _curves(before, after, cleaned),
        _widths(before, cleaned),
        _gaps(before, cleaned),
    ]
    write_atomically(path, html_page.page(f"{before.name}, cleaned", sections))


def _numbers(before: Motion, after: Motion, summary: CleaningReport) -> str:
    """Return a table of jitter and foot skate, before and after."""
    rows = [
        [
            "Jitter, the mean jerk of the joints, units/s³",
            f"{summary.jitter_before:,.0f}",
            f"{summary.jitter_after:,.0f}",
        ]
    ]
    skates = foot_skates(before, after)
    feet = "Foot skate, how fast standing feet slide, cm/s"
    if skates is not None:
        rows.append([feet, *(f"{skate:.1f}" for skate in skates)])
    changed = (
        f"{summary.n_changed} of {summary.n_channels} channels were changed, by "
        f"{summary.rms_change_deg:.2f} degrees RMS; the most, {summary.largest_change_deg:.1f} "
        f"degrees, at {summary.largest_channel} in frame {summary.largest_frame}. The root and "
        f"what does not move are as before."
    )
    about_feet = (
        "A foot stands where it does so in the cleaned motion. Lengths are taken for CMU units "
        f"({CM_PER_UNIT:.2f} cm); for a file in other units, compare before and after only."
        if skates is not None
        else "Foot skate is not told: there are no joints LeftToeBase and RightToeBase with an "
        "End Site, or no foot ever stands."
    )
    return (
        heading("Before and after")
        + table(["", "before", "after"], rows)
        + paragraph(changed)
        + note(about_feet)
    )


def foot_skates(before: Motion, after: Motion) -> tuple[float, float] | None:
    """Return foot skate before and after, cm/s; None for a skeleton without feet.

    Where a foot stands is read from the cleaned motion.
    """
    first, last = (motion.slice_frames(0, MOST_FRAMES) for motion in (before, after))
    try:
        skates = [foot_skate_cm_s(m, last, cm_per_unit=CM_PER_UNIT) for m in (first, last)]
    except ValueError:  # no feet, or too few frames
        return None
    return None if np.isnan(skates).any() else (skates[0], skates[1])


def _repairs(
    before: Motion, cleaned: Cleaned, faults: Faults | None, summary: CleaningReport
) -> str:
    """Return lists of what was repaired, what was refused, and what is odd in the file."""
    done = []
    if summary.n_filled:
        done.append(
            f"{summary.n_filled} samples inside {summary.n_gaps} gaps were filled, the longest "
            f"gap of {summary.longest_gap_s:.2f} s."
        )
    if faults is not None:
        done.append(
            f"{summary.n_frozen} frozen frames and {summary.n_spikes} spikes were found, and "
            f"filled like gaps."
        )
    done += [f"{line[:1].upper()}{line[1:]}." for line in summary.matched]
    refused = []
    if summary.n_left:
        refused.append(
            f"{summary.n_left} gaps are too long and were left open: a line is drawn there."
        )
    if cleaned.match.unknown_joints:
        refused.append("The network did not clean the joints that the model does not know.")
    unseen = np.isinf(cleaned.std_deg).all(axis=0)
    if unseen.any():
        labels = [before.skeleton.channel_labels[c] for c in np.flatnonzero(unseen)]
        refused.append(f"Never observed, so left at rest: {', '.join(labels)}.")
    odd = summarize(diagnose(before.slice_frames(0, MOST_FRAMES)))
    if before.n_frames > MOST_FRAMES:
        odd.append(f"only the first {MOST_FRAMES} frames were looked at for this list and for feet")
    return (
        heading("What was repaired")
        + bullets(done or ["There were no gaps to fill."])
        + heading("What was refused")
        + bullets(refused or ["Nothing."])
        + heading("What is odd in the file")
        + bullets(odd or ["Nothing to mention."])
        + note("Full turns and branch switches are undone for cleaning, and put back after it.")
    )


def _curves(before: Motion, after: Motion, cleaned: Cleaned) -> str:
    labels = most_changed(before, after)
    if not labels:
        return heading("The joints that changed most") + paragraph("Nothing was changed.")
    figure = Figure(figsize=(8, 2.6 * len(labels)), layout="constrained")
    axes = figure.subplots(len(labels), 1, squeeze=False)[:, 0]
    for ax, label in zip(axes, labels, strict=True):
        draw_channel(ax, before, after, cleaned, label)
    text = (
        "Grey: the file as it came. Blue: cleaned. An orange band is a filled gap and how far it "
        "may be off (two standard deviations); a hatched one was left open."
    )
    return (
        heading("The joints that changed most")
        + paragraph(text)
        + _picture(figure, f"Angles over time, before and after: {', '.join(labels)}")
    )


def _widths(before: Motion, cleaned: Cleaned) -> str:
    title = heading("Why was this smoothed?")
    width_s = cleaned.width_s
    if width_s is None or not np.isfinite(width_s).all():
        return title + paragraph("This kind of network does not tell how widely it smooths.")
    if not width_s.any():
        return title + paragraph("Nothing was smoothed.")
    figure = Figure(figsize=(8, 6), layout="constrained")
    draw_widths(figure.subplots(), before, width_s)
    text = (
        "How widely the network smoothed each joint at each moment, in milliseconds: the mean over "
        "its angles. Bright is wide: there it saw noise and little movement. Dark is narrow: there "
        "it saw movement that a wide filter would have cut off, or little noise."
    )
    return title + paragraph(text) + _picture(figure, "Heat map of widths, joints over time")


def _gaps(before: Motion, cleaned: Cleaned) -> str:
    """Return a table of the joints whose gaps were filled, the least certain first."""
    filled = (cleaned.std_deg > 0) & np.isfinite(cleaned.std_deg)
    if not filled.any():
        return ""
    joint = before.skeleton.channel_joint
    rows = []
    for j in np.unique(joint[filled.any(axis=0)]):
        columns = joint == j
        errors = cleaned.std_deg[:, columns][filled[:, columns]]
        rows.append((float(errors.max()), float(np.median(errors)), len(errors), j))
    rows.sort(reverse=True)
    lines = [
        [before.skeleton.joint_names[j], str(n), f"{usual:.1f}", f"{worst:.1f}"]
        for worst, usual, n, j in rows
    ]
    return (
        heading("How sure are the filled gaps?")
        + paragraph(
            "The error to be expected, one standard deviation. Where it is larger than you can "
            "accept, look at the joint, or leave such gaps open with --max-gap."
        )
        + table(["joint", "filled samples", "usually, degrees", "at worst"], lines)
    )


def _picture(figure: Figure, alt: str) -> str:
    data = io.BytesIO()
    figure.savefig(data, format="png", dpi=130)
    return html_page.picture(data.getvalue(), alt)
