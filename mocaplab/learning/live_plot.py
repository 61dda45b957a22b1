"""A picture in a notebook that grows while a network learns."""

from __future__ import annotations

import time
from typing import Any, Protocol

import matplotlib.pyplot as plt

from mocaplab.plotting import plot_losses

try:
    from IPython.display import display
except ImportError as error:
    raise ImportError(
        "mocaplab.learning.live_plot needs IPython; run: pip install 'mocaplab[lab]'"
    ) from error


class _Losses(Protocol):
    losses: list[float]
    validation_losses: list[float]


class LossPlot:
    """Draw the losses again and again: ``train(clips, config, on_epoch=LossPlot())``.

    Parameters
    ----------
    every_s : float, seconds
        Shortest time between two pictures, so that drawing costs little of the training. The
        last epochs may be missing; :func:`mocaplab.plotting.plot_losses` shows them all.
    """

    def __init__(self, every_s: float = 2.0):
        self.every_s = every_s
        self._handle: Any = None
        self._last = -float("inf")

    def __call__(self, state: _Losses) -> None:
        """Draw the losses so far, unless the last picture is too new."""
        if time.monotonic() - self._last < self.every_s:
            return
        figure, ax = plt.subplots(figsize=(7, 3.2), layout="constrained")
        plot_losses(state.losses, state.validation_losses, ax=ax)
        if self._handle is None:
            self._handle = display(figure, display_id=True)  # type: ignore[no-untyped-call]
        else:
            self._handle.update(figure)
        plt.close(figure)  # or the notebook would show it once more
        self._last = time.monotonic()
