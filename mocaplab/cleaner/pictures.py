"""The pictures of the page about a cleaned file."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FixedLocator

from mocaplab.cleaning import Cleaned
from mocaplab.euler import align_to, wrap_degrees
from mocaplab.motion import Motion
from mocaplab.plotting import COLORS, PALETTE

N_CURVES = 4
SPAN_S = 8.0
"""A longer clip is shown around its largest change, seconds; more would be a grey block."""
N_COLUMNS = 600
"""Columns of the heat map at most."""


def most_changed(before: Motion, after: Motion) -> list[str]:
    """Name the channels that changed most, one a joint.

    Returns
    -------
    list of at most ``N_CURVES`` labels; empty if nothing changed
    """
    skeleton = before.skeleton
    change = wrap_degrees(after.channels - before.channels) * skeleton.is_cleaned
    size = np.sqrt(np.mean(change**2, axis=0))
    labels: list[str] = []
    joints: set[int] = set()
    for channel in np.argsort(-size):
        joint = int(skeleton.channel_joint[channel])
        if size[channel] > 0 and joint not in joints and len(labels) < N_CURVES:
            labels.append(skeleton.channel_labels[channel])
            joints.add(joint)
    return labels


def draw_channel(ax: Axes, before: Motion, after: Motion, cleaned: Cleaned, label: str) -> None:
    """Draw one channel before and after, and its gaps, around the largest change."""
    channel = before.skeleton.channel_index(label)
    change = np.abs(wrap_degrees(after.channels[:, channel] - before.channels[:, channel]))
    n_shown = min(before.n_frames, max(2, round(SPAN_S / before.frame_time)))
    start = int(np.clip(np.argmax(change) - n_shown // 2, 0, before.n_frames - n_shown))
    here = slice(start, start + n_shown)
    was, now = before.slice_frames(start, here.stop), after.slice_frames(start, here.stop)
    time = before.time_s[here]
    old, new = align_to(was, now).channel(label), now.channel(label)
    ax.plot(time, old, color=COLORS["observed"], linewidth=0.8, label="before")
    ax.plot(time, new, color=COLORS["EBF"], linewidth=1.6, label="after")
    std = cleaned.std_deg[here, channel]
    filled = (std > 0) & np.isfinite(std)
    spread = np.where(filled, 2 * std, np.nan)
    ax.fill_between(time, new - spread, new + spread, color=PALETTE[1], alpha=0.5, linewidth=0)
    low, high = min(old.min(), new.min()), max(old.max(), new.max())
    left = cleaned.left[here, channel]
    ax.fill_between(time, low, high, where=left, facecolor="none", edgecolor="#777777", hatch="//")
    ax.set(title=label, xlabel="time, s", ylabel="degrees")
    ax.margins(x=0)
    ax.grid(alpha=0.3)
    ax.legend(loc="upper right", fontsize="small")


def draw_widths(ax: Axes, motion: Motion, width_s: np.ndarray) -> None:
    """Draw how widely each joint was smoothed over time, in milliseconds.

    Parameters
    ----------
    ax : Axes
    motion : Motion
    width_s : array, shape (T, C), seconds
    """
    joint = motion.skeleton.channel_joint
    smoothed = width_s.any(axis=0)
    joints = np.unique(joint[smoothed])
    edges = np.linspace(0, motion.n_frames, min(N_COLUMNS, motion.n_frames) + 1).astype(int)[:-1]
    counts = np.diff(np.append(edges, motion.n_frames))
    rows = [
        np.add.reduceat(width_s[:, smoothed & (joint == j)].mean(axis=1), edges) / counts
        for j in joints
    ]
    end = motion.n_frames * motion.frame_time
    image = ax.imshow(
        1000 * np.array(rows),
        aspect="auto",
        interpolation="nearest",
        cmap="viridis",
        vmin=0,
        extent=(0, end, len(joints) - 0.5, -0.5),
    )
    ax.yaxis.set_major_locator(FixedLocator(range(len(joints))))
    ax.set_yticklabels([motion.skeleton.joint_names[j] for j in joints], fontsize=7)
    ax.set_xlabel("time, s")
    figure = ax.figure
    figure.colorbar(image, ax=ax, label="width of smoothing, ms")
