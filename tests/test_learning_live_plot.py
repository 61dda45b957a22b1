"""The growing picture of the losses."""

from types import SimpleNamespace

import matplotlib.pyplot as plt
import pytest

pytest.importorskip("IPython")

from mocaplab.learning import live_plot
from mocaplab.learning.live_plot import LossPlot
from mocaplab.plotting import plot_losses


def test_one_picture_is_updated_and_none_is_left_open(monkeypatch):
    shown = []
    handle = SimpleNamespace(update=lambda figure: shown.append(("update", figure)))

    def display(figure, display_id):
        shown.append(("display", figure))
        return handle

    monkeypatch.setattr(live_plot, "display", display)
    plot = LossPlot(every_s=0.0)
    for n in (1, 2, 3):
        losses = [1 / i for i in range(1, n + 1)]
        plot(SimpleNamespace(losses=losses, validation_losses=[]))
    assert [how for how, _ in shown] == ["display", "update", "update"]
    assert [len(figure.axes[0].lines[0].get_xdata()) for _, figure in shown] == [1, 2, 3]
    assert plt.get_fignums() == []


def test_pictures_keep_their_distance(monkeypatch):
    drawn = []
    monkeypatch.setattr(live_plot, "display", lambda figure, display_id: drawn.append(figure))
    plot = LossPlot(every_s=60.0)
    for _ in range(5):
        plot(SimpleNamespace(losses=[1.0], validation_losses=[]))
    assert len(drawn) == 1


def test_both_losses_are_drawn():
    ax = plot_losses([3.0, 2.0], [3.5, 2.5])
    assert [line.get_label() for line in ax.lines] == ["training clips", "validation clips"]
    assert list(ax.lines[1].get_ydata()) == [3.5, 2.5]
    assert ax.get_ylim()[0] == 0
    plt.close(ax.figure)
