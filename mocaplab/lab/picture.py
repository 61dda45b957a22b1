"""The lab as a still picture, for pages where no script may run."""

from __future__ import annotations

import base64
import html
import io

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mocaplab.lab.gaussian import LOOK_AHEADS_S, WIDTHS_S
from mocaplab.lab.model import Scene
from mocaplab.plotting import COLORS, plot_channel, plot_errors

_ALT = (
    "Four pictures. Top: an angle over time, clean, observed and cleaned by three methods. "
    "Middle: the error of the Gaussian over its width, and the error of each method. Bottom: "
    "how widely EBF smooths each joint over time."
)


def draw_lab(
    scene: Scene, channel: str, sigma_s: float, look_ahead_s: float | None = None
) -> Figure:
    """Draw curves, errors and the map of widths; the figure belongs to no window.

    Parameters
    ----------
    scene : Scene
    channel : str, such as ``"LeftLeg.Xrotation"``
    sigma_s : float, seconds
    look_ahead_s : float or None, one of ``LOOK_AHEADS_S``
    """
    figure = Figure(figsize=(10, 9), layout="constrained")
    axes = figure.subplot_mosaic([["curves"] * 2, ["widths", "bars"], ["map"] * 2])
    versions = {"observed": scene.filled, "Gaussian": scene.gaussian(sigma_s, look_ahead_s)}
    versions |= {**scene.cleaned, "clean": scene.corrupted.clean}
    plot_channel(versions, channel, ax=axes["curves"])
    draw_error_curve(axes["widths"], scene, sigma_s, look_ahead_s)
    errors = scene.errors_deg(sigma_s, look_ahead_s)
    plot_errors(
        {name: [error] for name, error in errors.items()},
        unit="RMS error over all joint angles, degrees",
        ax=axes["bars"],
    )
    draw_widths(axes["map"], scene)
    return figure


def draw_error_curve(
    ax: Axes, scene: Scene, sigma_s: float, look_ahead_s: float | None = None
) -> None:
    """Draw the error of the Gaussian over its width, and where the networks stand."""
    row = LOOK_AHEADS_S.index(look_ahead_s)
    curve, errors = scene.gaussian_rms[row], scene.errors_deg(sigma_s, look_ahead_s)
    ax.plot(1000 * WIDTHS_S, curve, color=COLORS["Gaussian"], label="Gaussian")
    ax.plot(1000 * sigma_s, np.interp(sigma_s, WIDTHS_S, curve), "o", color=COLORS["Gaussian"])
    tuned_ms = 1000 * WIDTHS_S[scene.tuned[row]]
    ax.axvline(tuned_ms, color="black", linestyle=":", label="tuned on other clips")
    for name, style in (("EBF", "--"), ("Blend", "-.")):
        ax.axhline(errors[name], color=COLORS[name], linestyle=style, label=name)
    ax.set_xscale("log", base=2)
    ax.xaxis.set_major_formatter("{x:g}")
    ax.set_ylim(0, 1.5 * curve.max() or None)  # room for the legend
    ax.set(xlabel="width sigma, ms", ylabel="RMS error, all joint angles, degrees")
    ax.legend(loc="upper center", ncols=2, frameon=False, fontsize="small")


def joint_widths(scene: Scene) -> tuple[list[str], np.ndarray]:
    """Average the widths of EBF over each joint's moving channels.

    Returns
    -------
    joints : list of str, the N joints that move
    widths : array, shape (T, N), seconds
    """
    skeleton = scene.filled.skeleton
    joint = skeleton.channel_joint[scene.channels]
    moving = np.unique(joint)
    widths = [scene.sigma_s[:, scene.channels[joint == j]].mean(axis=1) for j in moving]
    return [skeleton.joint_names[j] for j in moving], np.stack(widths, axis=1)


def draw_widths(ax: Axes, scene: Scene) -> None:
    """Draw how widely EBF smooths each joint over time."""
    joints, widths = joint_widths(scene)
    image = ax.imshow(
        1000 * widths.T,
        aspect="auto",
        interpolation="nearest",
        cmap="cividis",
        vmin=0,
        vmax=1000 * float(np.percentile(widths, 99)) or 1.0,
        extent=(0, scene.filled.duration_s, len(joints) - 0.5, -0.5),
    )
    ax.set_yticks(range(len(joints)), joints, fontsize=7)
    ax.set(xlabel="time, s", title="how widely EBF smooths")
    ax.figure.colorbar(image, ax=ax, label="sigma, ms")


def still_html(
    scene: Scene, channel: str, sigma_s: float, look_ahead_s: float | None = None
) -> str:
    """Return :func:`draw_lab` as HTML that needs no script."""
    buffer = io.BytesIO()
    draw_lab(scene, channel, sigma_s, look_ahead_s).savefig(buffer, format="png", dpi=70)
    data = base64.b64encode(buffer.getvalue()).decode()
    return (
        f'<img alt="{html.escape(_ALT)}" src="data:image/png;base64,{data}">'
        "<br><em>A still picture. Run the cell to move the sliders.</em>"
    )
