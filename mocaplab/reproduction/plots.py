"""Plots in the paper's form: the same axes, so that the two can be laid side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator, MaxNLocator

from mocaplab.comparison.bootstrap import Interval
from mocaplab.motion import FloatArray
from mocaplab.plotting import PALETTE

RMS_AXIS = "RMS error over all joints, degrees"
STYLES = {
    # The paper's methods have full lines, those that it did not try have dashed ones.
    "ebf": ("#D55E00", "-"),  # red, as in the paper's figures
    "gaussian_58": ("#0072B2", "-"),
    "gaussian_125": ("#56B4E9", "-"),
    "ebd_denoiser": ("#009E73", "-"),
    "example_based": ("#CC79A7", "-"),
    "bf": ("#0072B2", "-"),
    "nn": ("#009E73", "-"),
    "ebf_bias": ("#D55E00", "-"),
    "ebd_ebf": ("#009E73", "-"),
    "gaussian_tuned": ("#000000", "--"),
    "gaussian_tuned_channel": ("#000000", ":"),
    "wiener": ("#E69F00", "--"),
    "blend": ("#E69F00", ":"),
    "lowrank": ("#CC79A7", "--"),
    "gap_gaussian": ("#E69F00", "--"),
}


def style_of(method: str, number: int) -> tuple[str, str]:
    """Return colour and line of a method; others get one by their number."""
    name = method.rstrip("+").partition("@")[0]
    return STYLES.get(name, (PALETTE[number % len(PALETTE)], "-"))


def plot_by_motion(
    lines: Mapping[str, tuple[FloatArray, str, str]],
    actions: Sequence[str],
    ax: Axes,
    *,
    log: bool = False,
) -> None:
    """Draw errors over the number of the motion, grouped by action (figures 5 to 9).

    Parameters
    ----------
    lines : label -> (errors, one a motion; colour; line)
    actions : the action of each motion, in groups
    ax : Axes
    log : bool
        A logarithmic axis of errors, for lines so far apart that the highest flattens the others.
    """
    numbers = np.arange(len(actions))
    for label, (errors, color, line) in lines.items():
        ax.plot(numbers, errors, line, color=color, marker=".", linewidth=1.2, label=label)
    for action in dict.fromkeys(actions):
        here = [i for i, a in enumerate(actions) if a == action]
        if here[0]:
            ax.axvline(here[0] - 0.5, color="#999999", linewidth=0.6)
        ax.annotate(
            action,
            (float(np.mean(here)), 1.0),
            xycoords=ax.get_xaxis_transform(),
            xytext=(0, 3),  # above the frame of the axes
            textcoords="offset points",
            ha="center",
        )
    if log:
        ax.set_yscale("log")
        ax.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        ax.yaxis.set_major_formatter("{x:g}")
        ax.yaxis.set_minor_formatter("")
    else:
        ax.set_ylim(0, None)
    ax.xaxis.set_major_locator(MaxNLocator(integer=True))
    ax.set(xlabel="motion", ylabel=f"{RMS_AXIS}{' (log scale)' if log else ''}")
    ax.legend(fontsize="x-small", loc="upper left", bbox_to_anchor=(0.0, -0.18), ncols=2)


def plot_by_frame(lines: Mapping[str, tuple[FloatArray, str, str]], title: str, ax: Axes) -> None:
    """Draw errors over the frames of one motion (Figure 4)."""
    for label, (errors, color, line) in lines.items():
        ax.plot(errors, line, color=color, linewidth=0.9, label=label)
    ax.set_ylim(0, None)
    ax.set(xlabel="frame", ylabel="RMS error, degrees", title=title)


def plot_kernels(kernels: FloatArray, title: str, ax: Axes) -> None:
    """Draw the predicted kernels of some frames of a motion, a curve each (Figure 3)."""
    taps = np.arange(kernels.shape[1]) - kernels.shape[1] // 2
    colors = plt.get_cmap("viridis")(np.linspace(0, 0.9, len(kernels)))
    for kernel, color in zip(kernels, colors, strict=True):
        ax.plot(taps, kernel, color=color, linewidth=0.8)
    ax.set(xlabel="time, frames", ylabel="weight", title=title)
    ax.set_ylim(0, None)


def plot_bars(values: Mapping[str, Interval], unit: str, ax: Axes) -> None:
    """Draw a bar with an interval for each of several numbers."""
    for i, (value, low, high) in enumerate(values.values()):
        ax.barh(i, value, color=PALETTE[i % len(PALETTE)], height=0.65)
        ax.errorbar(value, i, xerr=[[value - low], [high - value]], color="black", capsize=3)
        ax.text(high, i, f"  {value:.2f}", va="center", fontsize="small")
    ax.set_yticks(range(len(values)), list(values))
    ax.invert_yaxis()
    ax.margins(x=0.15)
    ax.set_xlim(0, None)
    ax.set_xlabel(unit)


def plot_points(
    series: Mapping[str, tuple[Sequence[float], Sequence[Interval], str, str]],
    xlabel: str,
    ylabel: str,
    ax: Axes,
) -> None:
    """Draw means with intervals over some amount: label -> (amounts, means, colour, line)."""
    for label, (amounts, means, color, line) in series.items():
        values = np.array(means)
        spread = np.abs(values[:, 1:].T - values[:, 0])
        ax.errorbar(
            amounts, values[:, 0], spread, fmt=f"o{line}", color=color, capsize=3, label=label
        )
    ax.set_ylim(0, None)
    ax.set(xlabel=xlabel, ylabel=ylabel)
    ax.legend(fontsize="small")


def plot_claims(claims: Mapping[str, tuple[float, Interval]], ax: Axes) -> None:
    """Draw ratios of the paper beside ours with their intervals.

    Parameters
    ----------
    claims : text -> (the paper's ratio, our ratio)
    ax : Axes
    """
    for i, (paper, (value, low, high)) in enumerate(claims.values()):
        ax.errorbar(
            value, i, xerr=[[value - low], [high - value]], fmt="o", color="#0072B2", capsize=3,
            label="ours, with its 95 % interval" if i == 0 else None,
        )  # fmt: skip
        ax.plot(paper, i, "D", color="#D55E00", fillstyle="none", label="" if i else "the paper's")
    ax.axvline(1.0, color="black", linewidth=0.8, linestyle="--")
    ax.set_yticks(range(len(claims)), list(claims))
    ax.invert_yaxis()
    ax.set_xlim(0, None)
    ax.set_xlabel("ratio of two errors; 1 is no difference")
    ax.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, frameon=False)
