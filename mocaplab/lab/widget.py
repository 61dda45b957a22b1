"""The interactive lab: move sliders, and see what noise and smoothing do to a motion.

This file is the shell. What is shown is computed in :mod:`mocaplab.lab.model` and drawn in
the browser by ``static/lab.js``, which also plays in saved pages.
"""

from __future__ import annotations

import asyncio
from typing import Any

import anywidget
import numpy as np
import traitlets

from mocaplab.datasets import Dataset
from mocaplab.lab.data import describe_scene, scene_signals
from mocaplab.lab.gaussian import LOOK_AHEADS_S, WIDTHS_S
from mocaplab.lab.model import Laboratory, LabSettings, Scene, widest_channel
from mocaplab.lab.picture import still_html
from mocaplab.packing import javascript, pack_steps, page_html
from mocaplab.player_data import player_data
from mocaplab.widgets import PLAYER_FILES

FILES = (*PLAYER_FILES, "lab_math", "lab_charts", "lab")
HEIGHT = 250
BODY_COLOURS = {
    "light": ["#999999", "#009E73", None],
    "dark": ["#9a9a9a", "#20C997", None],
}
"""Of the skeletons: observed, Blend and clean, as their curves have them in lab_charts.js."""


class Lab(anywidget.AnyWidget):
    """An interactive lab over a data set; shows itself as the last line of a cell.

    Sliders for the Gaussian, the channel and the time answer at once: the browser computes
    them. Another clip, noise or gap is computed here, beside the kernel's main path, and the
    old picture stays until the new one is there.

    Parameters
    ----------
    dataset : Dataset, see :class:`mocaplab.lab.model.Laboratory`
    clip : str, the name of the first clip to show; by default the first one
    channel : str, such as ``"LeftLeg.Xrotation"``; by default the one that moves most

    Attributes
    ----------
    sigma_s : float, seconds
        Width of the Gaussian. It snaps to the nearest of ``WIDTHS_S``.
    look_ahead_s : float or None
        One of ``LOOK_AHEADS_S``; None lets the Gaussian see the whole clip.
    channel : str
    frame : int
    scene : Scene
        What is shown, to compute with.
    """

    _esm = javascript(*FILES) + "\nexport default { render: renderLab };"
    _meta = traitlets.Dict().tag(sync=True)
    _packed = traitlets.Bytes().tag(sync=True)
    _player_packed = traitlets.Bytes().tag(sync=True)
    sigma_s = traitlets.Float(float(WIDTHS_S[0])).tag(sync=True)
    look_ahead_s = traitlets.Float(None, allow_none=True).tag(sync=True)
    channel = traitlets.Unicode().tag(sync=True)
    frame = traitlets.Int(0).tag(sync=True)

    def __init__(self, dataset: Dataset, clip: str | None = None, channel: str | None = None):
        self.laboratory = Laboratory(dataset)
        self._wish: LabSettings | None = None
        self._task: asyncio.Task[None] | None = None
        self.scene = self.laboratory.scene(LabSettings(clip or dataset.clips[0].name))
        super().__init__()
        self._show(self.scene)
        self.sigma_s = self.scene.tuned_sigma_s
        if channel is not None:
            self.channel = channel
        self.on_msg(self._hear)

    @property
    def settings(self) -> LabSettings:
        """What spoils which clip, as it is shown now."""
        return self.scene.settings

    def set_scene(self, **changes: Any) -> None:
        """Change the clip, the noise or the gaps, and wait for it.

        Parameters
        ----------
        **changes : any of clip, noise, amount, gap_s, as in ``LabSettings``
        """
        self._show(self.laboratory.scene(self._changed(changes)))

    def errors_deg(self, channel: str | None = None) -> dict[str, float]:
        """Measure every method with the Gaussian as it is set; see :class:`Scene`."""
        return self.scene.errors_deg(self.sigma_s, self.look_ahead_s, channel)

    def _changed(self, changes: dict[str, Any]) -> LabSettings:
        return LabSettings(**{**vars(self.settings), **changes})

    def _hear(self, _: Any, content: dict[str, Any], buffers: Any) -> None:
        """Take a wish from the browser: compute it in a thread if a kernel's loop is running."""
        try:
            self._wish = self._changed(content["wish"])
        except (TypeError, ValueError) as error:
            self.send({"error": str(error)})
            return
        try:
            loop = asyncio.get_running_loop()
        except RuntimeError:  # no kernel
            self._finish(*_tried(self.laboratory, self._wish))
            return
        if self._task is None or self._task.done():
            self._task = loop.create_task(self._follow_wishes())

    async def _follow_wishes(self) -> None:
        """Compute the last wish; wishes that were overtaken meanwhile are dropped."""
        done = None
        while done != self._wish:
            done = self._wish
            assert done is not None
            loop = asyncio.get_running_loop()
            result = await loop.run_in_executor(None, _tried, self.laboratory, done)
            if done == self._wish:
                self._finish(*result)

    def _finish(self, scene: Scene | None, problem: str) -> None:
        if scene is None:
            self.send({"error": problem})
        else:
            self._show(scene)

    def _show(self, scene: Scene) -> None:
        self.scene = scene
        clean = scene.corrupted.clean
        labels = [clean.skeleton.channel_labels[c] for c in scene.channels]
        with self.hold_sync():
            if self.channel not in labels:
                self.channel = widest_channel(clean, scene.channels)
            self.frame = min(self.frame, clean.n_frames - 1)
            bodies = [scene.filled, scene.cleaned["Blend"], clean]
            player, self._player_packed = player_data(
                bodies, ["observed", "Blend", "clean"], HEIGHT, strip=False, **BODY_COLOURS
            )
            self._packed = pack_steps(scene_signals(scene))
            self._meta = {**describe_scene(scene, self.laboratory.dataset), "player": player}

    @traitlets.validate("sigma_s")
    def _check_sigma(self, proposal: Any) -> float:
        sigma_s = proposal["value"]
        if not 0 < sigma_s < 1:
            raise traitlets.TraitError(f"sigma_s is in seconds, over 0 and below 1; got {sigma_s}")
        return float(WIDTHS_S[np.argmin(np.abs(WIDTHS_S - sigma_s))])

    @traitlets.validate("look_ahead_s")
    def _check_look_ahead(self, proposal: Any) -> float | None:
        seconds: float | None = proposal["value"]
        if seconds is None:
            return None
        known = [s for s in LOOK_AHEADS_S if s is not None]
        if not 0 <= seconds <= known[-1]:
            raise traitlets.TraitError(
                f"look_ahead_s lies between 0 and {known[-1]} seconds, or is None; got {seconds}"
            )
        return min(known, key=lambda s: abs(s - seconds))

    @traitlets.validate("channel")
    def _check_channel(self, proposal: Any) -> str:
        label = str(proposal["value"])
        skeleton = self.scene.filled.skeleton
        if label not in [skeleton.channel_labels[c] for c in self.scene.channels]:
            raise traitlets.TraitError(
                f"expected a channel that moves in this clip, such as "
                f"{skeleton.channel_labels[self.scene.channels[0]]}; got {label!r}"
            )
        return label

    @traitlets.validate("frame")
    def _check_frame(self, proposal: Any) -> int:
        frame, n_frames = int(proposal["value"]), self.scene.filled.n_frames
        if not 0 <= frame < n_frames:
            raise traitlets.TraitError(f"frame must lie between 0 and {n_frames - 1}, got {frame}")
        return frame

    def __repr__(self) -> str:
        return f"Lab({self.settings.clip}, {self.settings.recipe})"

    def to_html(self) -> str:
        """Return HTML that works with no kernel; there, the clip and the noise stay."""
        start = {name: getattr(self, name) for name in _STATE}
        still = still_html(self.scene, self.channel, self.sigma_s, self.look_ahead_s)
        packed = [self._packed, self._player_packed]
        return page_html("lab", FILES, "mountLabs", {**self._meta, "start": start}, packed, still)

    def _repr_mimebundle_(self, **kwargs: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        data, metadata = super()._repr_mimebundle_(**kwargs) or ({}, {})
        return {**data, "text/html": self.to_html()}, metadata


_STATE = ("sigma_s", "look_ahead_s", "channel", "frame")


def _tried(laboratory: Laboratory, settings: LabSettings) -> tuple[Scene | None, str]:
    """Compute a scene, or say why there is none."""
    try:
        return laboratory.scene(settings), ""
    except ValueError as error:
        return None, str(error)
