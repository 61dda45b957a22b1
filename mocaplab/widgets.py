"""A 3D skeleton player for notebooks, which also plays in saved pages.

The drawing is done in the browser, by ``static/player.js``; this file prepares the
positions and keeps the frame, the speed and the playing state in step with Python. The lab
of sliders and curves is in :mod:`mocaplab.lab.widget`.
"""

from __future__ import annotations

import base64
import html
from collections.abc import Sequence
from typing import Any

import numpy as np

from mocaplab.motion import Motion
from mocaplab.packing import javascript, page_html
from mocaplab.player_data import body_points, player_data

try:
    import anywidget
    import traitlets
except ImportError as error:
    raise ImportError(
        f"mocaplab.widgets needs {error.name}, which is not installed; "
        "run: pip install 'mocaplab[lab]'"
    ) from error

MAX_MOTIONS = 4
_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7")  # Okabe and Ito; as in player.js
PLAYER_FILES = ("common", "charts", "player")
"""The files of ``static/`` that the player is made of, in this order."""
_JAVASCRIPT = javascript(*PLAYER_FILES)


class SkeletonPlayer(anywidget.AnyWidget):
    """A player of one to four motions, drawn over each other; see `play`.

    Attributes
    ----------
    frame : int
        The frame that is shown, counted in the motions' own frames from 0. Set it to
        move the picture; read it to know where the reader stopped.
    playing : bool
    speed : float
        1 is real time. The player offers 0.25, 0.5, 1 and 2.
    picked : str
        The joint that the reader clicked; its height over time shows below the picture,
        and its trail, if trails are on. Empty for none.
    labels : tuple of str
    n_frames : int
        Frames of the longest motion.
    step : int
        Every step-th frame is sent to the browser.
    precision : float, file length units
        No coordinate on the screen is further than this from forward kinematics.
    """

    _esm = _JAVASCRIPT + "\nexport default { render };"
    _meta = traitlets.Dict().tag(sync=True)
    _packed = traitlets.Bytes().tag(sync=True)
    frame = traitlets.Int(0).tag(sync=True)
    playing = traitlets.Bool(False).tag(sync=True)
    speed = traitlets.Float(1.0, min=0.01, max=100.0).tag(sync=True)
    picked = traitlets.Unicode("").tag(sync=True)

    def __init__(self, motions: tuple[Motion, ...], labels: tuple[str, ...], height: int) -> None:
        self.labels = labels
        self._motions = motions
        meta, packed = player_data(motions, labels, height)
        self.n_frames, self.step, self.precision = meta["frames"], meta["step"], meta["scale"] / 2
        super().__init__(_meta=meta, _packed=packed)

    @traitlets.validate("frame")
    def _check_frame(self, proposal: Any) -> int:
        frame = int(proposal["value"])
        if not 0 <= frame < self.n_frames:
            raise traitlets.TraitError(
                f"frame must lie between 0 and {self.n_frames - 1}, got {frame}"
            )
        return frame

    @traitlets.validate("picked")
    def _check_picked(self, proposal: Any) -> str:
        name = str(proposal["value"])
        if name and not any(name in motion.skeleton.joint_names for motion in self._motions):
            raise traitlets.TraitError(f"picked must be the name of a joint or '', got {name!r}")
        return name

    def __repr__(self) -> str:
        n = len(self.labels)
        return f"SkeletonPlayer({n} motion{'s' * (n > 1)}, {self.n_frames} frames)"

    def to_html(self) -> str:
        """Return HTML that plays with no kernel and no network.

        The same motions, labels and height give the same text. Where scripts may not
        run (a notebook that is not trusted yet), a row of still poses shows instead.
        """
        return page_html(
            "player", PLAYER_FILES, "mountAll", self._meta, [self._packed], self._still_html()
        )

    def _still_html(self) -> str:
        """Draw five poses of every motion as a picture that needs no script."""
        size = self._meta["size"]
        positions = [body_points(motion)[:: self.step] for motion in self._motions]
        width, height = 500, 130
        scale = 0.8 * height / size
        paths = []
        for values, motion, colour in zip(positions, self._meta["motions"], _COLOURS, strict=False):
            bones = np.array(motion["bones"]).reshape(-1, 2)
            for i, frame in enumerate(np.linspace(0, len(positions[0]) - 1, 5).astype(int)):
                pose = values[min(frame, len(values) - 1)]
                root = positions[0][frame, 0]
                x = width * (i + 0.5) / 5 + scale * ((pose - root) @ (0.76, 0.0, -0.64))
                y = height / 2 - scale * (pose[:, 1] - self._meta["middle"])
                d = "".join(f"M{x[a]:.0f} {y[a]:.0f}L{x[b]:.0f} {y[b]:.0f}" for a, b in bones)
                paths.append(f'<path d="{d}" stroke="{colour}"/>')
        svg = (
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" '
            f'fill="none" stroke-width="2">{"".join(paths)}</svg>'
        )
        picture = base64.b64encode(svg.encode()).decode()
        names = html.escape(", ".join(self.labels))
        return (
            f'<img alt="Five poses of {names}" src="data:image/svg+xml;base64,{picture}">'
            "<br><em>A still picture. Run the cell to play it in 3D.</em>"
        )

    def _repr_mimebundle_(self, **kwargs: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        # A front end that cannot show widgets, or a page without their state, takes the HTML.
        data, metadata = super()._repr_mimebundle_(**kwargs) or ({}, {})
        return {**data, "text/html": self.to_html()}, metadata


def play(
    *motions: Motion, labels: Sequence[str] | None = None, height: int = 400
) -> SkeletonPlayer:
    """Show motions as moving 3D skeletons, drawn over each other.

    The camera follows the root of the first motion, and Y is up. A motion that is
    shorter than the others stays in its last pose. Above 60 frames a second only every
    second (third, ...) frame is shown, never an average: noise looks as it is. Two
    skeletons of 31 joints and 400 shown frames add 140 to 170 kB to a notebook.

    Parameters
    ----------
    *motions : one to four Motion
        Of one frame rate; skeletons and lengths may differ. NaN is refused.
    labels : sequence of str, one a motion; by default the motions' names
    height : int, pixels of the picture

    Returns
    -------
    SkeletonPlayer
        Shows itself as the last line of a cell.

    Raises
    ------
    ValueError
        If there are no motions or more than four, their frame times differ, a sample is
        NaN, or there is not one label a motion.
    """
    if not 1 <= len(motions) <= MAX_MOTIONS:
        raise ValueError(f"expected 1 to {MAX_MOTIONS} motions, got {len(motions)}")
    for i, motion in enumerate(motions):
        if not isinstance(motion, Motion):
            raise ValueError(
                f"expected motions, as in play(clean, noisy); got a {type(motion).__name__}"
            )
        if not np.isclose(motion.frame_time, motions[0].frame_time, rtol=1e-3, atol=0):
            raise ValueError(
                f"expected one frame time, {motions[0].frame_time} s as in the first motion; "
                f"got {motion.frame_time} s in motion {i + 1}"
            )
        missing = np.argwhere(np.isnan(motion.channels))
        if len(missing):
            frame, channel = missing[0]
            raise ValueError(
                f"expected no gaps, got NaN in motion {i + 1} at frame {frame}, channel "
                f"{motion.skeleton.channel_labels[channel]}; fill the gaps first"
            )
    if labels is None:
        labels = [motion.name or f"motion {i + 1}" for i, motion in enumerate(motions)]
        if len(set(labels)) < len(labels):
            labels = [f"{label} ({i + 1})" for i, label in enumerate(labels)]
    if isinstance(labels, str) or len(labels) != len(motions):
        raise ValueError(f"expected {len(motions)} labels, one a motion; got {labels!r}")
    if height < 100:
        raise ValueError(f"expected a height of at least 100 pixels, got {height}")
    return SkeletonPlayer(motions, tuple(map(str, labels)), int(height))
