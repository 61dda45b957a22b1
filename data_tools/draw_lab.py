"""Draw the picture that opens notebook 07: errors over sigma, and the widths that EBF chose.

python -m data_tools.draw_lab -o notebooks/images/lab.png
"""

from __future__ import annotations

import argparse

from matplotlib.figure import Figure

from mocaplab.datasets import load_dataset
from mocaplab.lab.model import Laboratory, LabSettings
from mocaplab.lab.picture import draw_error_curve, draw_widths


def main() -> None:
    """Draw one embedded walk with 0.5 noise."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("-o", "--output", required=True, metavar="FILE.png")
    options = parser.parse_args()

    scene = Laboratory(load_dataset("embedded")).scene(LabSettings("walk_05"))
    figure = Figure(figsize=(10, 3.6), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(2, 3))
    draw_error_curve(left, scene, scene.tuned_sigma_s)
    draw_widths(right, scene)
    figure.savefig(options.output, dpi=80)


if __name__ == "__main__":
    main()
