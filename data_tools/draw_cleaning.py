"""Draw the picture that opens the README and notebook 00: noise in, clean motion out.

python -m data_tools.draw_cleaning -o notebooks/images/cleaning.png
"""

from __future__ import annotations

import argparse

import matplotlib.pyplot as plt
import numpy as np

from mocaplab.cleaning import Cleaner
from mocaplab.corruption import corrupt
from mocaplab.datasets import load_dataset
from mocaplab.plotting import COLORS, plot_channel, plot_skeleton


def main() -> None:
    """Draw one embedded walk before and after cleaning."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("-o", "--output", required=True, metavar="FILE.png")
    options = parser.parse_args()

    clean = load_dataset("embedded")["walk_05"]
    noisy = corrupt(clean, "angular:0.5", rng=np.random.default_rng(1))
    cleaned = Cleaner("ebf").clean(noisy.observed)

    figure, axes = plt.subplots(3, 1, figsize=(9, 5), height_ratios=[3, 2, 2], layout="constrained")
    curves = {"observed": noisy.observed, "EBF": cleaned, "clean": clean}
    plot_channel(curves, "LeftLeg.Xrotation", ax=axes[0], span_s=(0.5, 3.0))
    axes[0].set_title("left knee of a walk with 0.5 noise")
    frames = range(60, 361, 25)
    for ax, label in zip(axes[1:], ("observed", "EBF"), strict=True):
        plot_skeleton(curves[label], frames, ax=ax, color=COLORS[label], spacing=12)
        ax.set_title(label, loc="left", fontsize="medium")
    figure.savefig(options.output, dpi=110)


if __name__ == "__main__":
    main()
