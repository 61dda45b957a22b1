"""Matplotlib pictures of motions and results. Functions take and return Axes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes

from mocaplab.comparison.bootstrap import Interval
from mocaplab.euler import align_to
from mocaplab.kinematics import forward_kinematics
from mocaplab.motion import Motion

COLORS = {
    "clean": "#000000",
    "observed": "#999999",
    "Gaussian": "#E69F00",
    "EBF": "#0072B2",
    "Blend": "#009E73",
}
"""One colour a role, out of Okabe and Ito's palette that colour-blind readers can tell apart."""

PALETTE = ("#0072B2", "#E69F00", "#009E73", "#CC79A7", "#56B4E9", "#D55E00")


def plot_channel(
    motions: Mapping[str, Motion],
    channel: str,
    *,
    ax: Axes | None = None,
    span_s: tuple[float, float] | None = None,
) -> Axes:
    """Draw one channel of several versions of a clip over time.

    Parameters
    ----------
    motions : label -> Motion, of one skeleton and length
        The first one decides which of the equivalent Euler angles are shown. Labels that
        begin with a name in ``COLORS`` get its colour.
    channel : str, such as ``"LeftLeg.Xrotation"``
    ax : Axes or None for a new figure
    span_s : (start, stop) in seconds, or None for the whole clip
    """
    ax = ax or plt.subplots(figsize=(9, 3.2), layout="constrained")[1]
    reference = next(iter(motions.values()))
    for i, (label, motion) in enumerate(motions.items()):
        observed = label.startswith("observed")
        ax.plot(
            motion.time_s,
            align_to(motion, reference).channel(channel),
            color=_color(label, i),
            label=label,
            linewidth=0.8 if observed else 1.8,
            linestyle="--" if label.startswith("clean") else "-",
            zorder=1 if observed else 3 if label.startswith("clean") else 2,
        )
    ax.set(xlabel="time, s", ylabel="angle, degrees", title=f"{reference.name}: {channel}")
    if span_s is not None:
        ax.set_xlim(span_s)
    ax.grid(alpha=0.3)
    ax.legend(loc="center left", bbox_to_anchor=(1.01, 0.5), frameon=False)
    return ax


def plot_errors(
    errors: Mapping[str, Sequence[float]], *, unit: str, ax: Axes | None = None
) -> Axes:
    """Draw the error of several methods: a bar for the mean, a dot for each repetition.

    Parameters
    ----------
    errors : method -> its errors
    unit : str, for the axis, such as ``"RMS error, degrees"``
    ax : Axes or None for a new figure
    """
    ax = ax or plt.subplots(figsize=(7, 0.5 + 0.45 * len(errors)), layout="constrained")[1]
    for i, (label, values) in enumerate(errors.items()):
        mean = float(np.mean(values))
        ax.barh(i, mean, color=_color(label, i), height=0.65, alpha=0.85)
        ax.plot(values, np.full(len(values), i), ".", color="black", markersize=4)
        ax.text(max(values), i, f"  {mean:.2f}", va="center")
    ax.set_yticks(range(len(errors)), list(errors))
    ax.invert_yaxis()
    ax.set_xlim(0, 1.15 * max(max(values) for values in errors.values()))
    ax.set_xlabel(unit)
    ax.spines[["top", "right"]].set_visible(False)
    return ax


def plot_losses(
    losses: Sequence[float], validation: Sequence[float] = (), *, ax: Axes | None = None
) -> Axes:
    """Draw the loss of every epoch of a training.

    Parameters
    ----------
    losses : list of float, one an epoch; see :func:`mocaplab.learning.lessons.batch_loss`
    validation : list of float, the same on the validation clips, if there are any
    ax : Axes or None for a new figure
    """
    ax = ax or plt.subplots(figsize=(7, 3.2), layout="constrained")[1]
    ax.plot(range(1, len(losses) + 1), losses, color=PALETTE[0], label="training clips")
    if len(validation):
        epochs = range(1, len(validation) + 1)
        ax.plot(epochs, validation, "--", color=PALETTE[1], label="validation clips")
        ax.legend()
    ax.set(xlabel="epoch", ylabel="loss, share of the movement", title="training", ylim=(0, None))
    return ax


def plot_intervals(estimates: Mapping[str, Interval], *, unit: str, ax: Axes | None = None) -> Axes:
    """Draw the mean error of several methods with its interval, the smallest on top.

    Parameters
    ----------
    estimates : method -> Interval
    unit : str, for the axis, such as ``"RMS error, degrees"``
    ax : Axes or None for a new figure
    """
    ax = ax or plt.subplots(figsize=(7, 1 + 0.35 * len(estimates)), layout="constrained")[1]
    ranked = sorted(estimates, key=lambda label: estimates[label].value)
    for i, label in enumerate(ranked):
        value, low, high = estimates[label]
        oracle = label.startswith("oracle")  # a bound, not a method
        ax.errorbar(
            value,
            i,
            xerr=[[value - low], [high - value]],
            fmt="o",
            markerfacecolor="white" if oracle else None,
            color=COLORS["observed"] if oracle else _color(label, 0),
            capsize=3,
        )
        ax.text(high, i, f"  {value:.2f}", va="center", fontsize="small")
    ax.set_yticks(range(len(ranked)), ranked)
    ax.invert_yaxis()
    ax.set_xlim(0, 1.15 * max(interval.high for interval in estimates.values()))
    ax.set_xlabel(unit)
    ax.grid(axis="x", alpha=0.3)
    ax.spines[["top", "right"]].set_visible(False)
    return ax


def plot_cost(
    estimates: Mapping[str, Interval],
    frames_per_second: Mapping[str, float],
    *,
    unit: str,
    ax: Axes | None = None,
) -> Axes:
    """Draw error over speed: the best methods are at the bottom right.

    Parameters
    ----------
    estimates : method -> Interval
    frames_per_second : method -> how many frames it cleans in a second; a log axis
    unit : str, for the axis of the error
    ax : Axes or None for a new figure
    """
    ax = ax or plt.subplots(figsize=(8, 5), layout="constrained")[1]
    ranked = sorted(estimates, key=lambda label: estimates[label].value)
    for i, label in enumerate(ranked):
        value, low, high = estimates[label]
        color = PALETTE[i % len(PALETTE)]
        ax.errorbar(
            frames_per_second[label],
            value,
            yerr=[[value - low], [high - value]],
            fmt="osD^vP"[i // len(PALETTE) % 6],
            color=color,
            capsize=3,
            label=f"{value:.2f}  {label}",
        )
    speeds = np.log10([frames_per_second[label] for label in ranked])
    ax.set_xscale("log")  # whole decades, or an axis of one speed alone would have no number
    ax.set_xlim(10 ** np.floor(speeds.min() - 0.1), 10 ** np.ceil(speeds.max() + 0.1))
    ax.xaxis.set_major_formatter("{x:,g}")
    ax.set_ylim(bottom=0)
    ax.set(xlabel="frames cleaned in a second", ylabel=unit)
    ax.grid(alpha=0.3)
    ax.legend(loc="center left", bbox_to_anchor=(1.01, 0.5), frameon=False)
    return ax


def plot_skeleton(
    motion: Motion,
    frames: Sequence[int],
    *,
    ax: Axes | None = None,
    color: str = COLORS["EBF"],
    spacing: float | None = None,
) -> Axes:
    """Draw a motion as a row of stick figures, seen from the side of its path.

    Parameters
    ----------
    motion : Motion
    frames : list of int, the frames to draw
    ax : Axes or None for a new figure
    color : str
    spacing : float or None, file length units between neighbouring figures
        None leaves every figure where the root really is.
    """
    ax = ax or plt.subplots(figsize=(10, 3), layout="constrained")[1]
    positions, _ = forward_kinematics(motion)
    path = positions[-1, 0] - positions[0, 0]
    across = np.array([path[0], path[2]]) / (np.hypot(path[0], path[2]) or 1.0)
    for i, frame in enumerate(frames):
        forward = positions[frame][:, [0, 2]] @ across
        if spacing is not None:
            forward = forward - forward[0] + i * spacing
        for joint, parent in enumerate(motion.skeleton.parents.tolist()):
            if parent >= 0:
                bone = [parent, joint]
                ax.plot(forward[bone], positions[frame, bone, 1], color=color, linewidth=1.6)
    ax.set_aspect("equal")
    ax.axis("off")
    return ax


def _color(label: str, index: int) -> str:
    for role, color in COLORS.items():
        if label.startswith(role):
            return color
    return PALETTE[index % len(PALETTE)]
