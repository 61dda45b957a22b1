"""Pictures: the right curves, labels and units, and nothing left open."""

import matplotlib
import matplotlib.pyplot as plt
import numpy as np
import pytest

from mocaplab.plotting import COLORS, plot_channel, plot_errors, plot_skeleton

matplotlib.use("Agg")


@pytest.fixture(autouse=True)
def close_figures():
    yield
    plt.close("all")


def test_channel_curves_show_the_values_with_units(walk):
    channel = "LeftLeg.Xrotation"
    wrapped = walk.with_channels(walk.channels + 360.0 * walk.skeleton.is_rotation)
    ax = plot_channel({"clean": walk, "observed": wrapped}, channel, span_s=(0, 1))
    for line in ax.lines:
        np.testing.assert_allclose(line.get_ydata(), walk.channel(channel), atol=1e-9)
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("time, s", "angle, degrees")
    assert [t.get_text() for t in ax.get_legend().get_texts()] == ["clean", "observed"]
    assert ax.lines[0].get_color() == COLORS["clean"]
    assert ax.get_xlim() == (0, 1)


def test_unknown_channel_suggests_others(walk):
    with pytest.raises(ValueError, match=r"nearest names are.*LeftLeg\.Zrotation"):
        plot_channel({"clean": walk}, "LeftLeg.Wrotation")


def test_error_bars_have_the_length_of_the_mean():
    ax = plot_errors({"noisy": [3.0, 5.0], "EBF": [1.0]}, unit="RMS error, degrees")
    assert [bar.get_width() for bar in ax.patches] == [4.0, 1.0]
    assert ax.get_xlabel() == "RMS error, degrees"
    assert [t.get_text() for t in ax.get_yticklabels()] == ["noisy", "EBF"]


def test_skeleton_has_a_line_for_every_bone(walk):
    ax = plot_skeleton(walk, [0, 30, 60], spacing=10.0)
    assert len(ax.lines) == 3 * 30
    figure = plt.figure()
    assert plot_skeleton(walk, [0], ax=figure.add_subplot()).figure is figure
