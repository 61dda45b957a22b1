"""Draw the picture that opens notebook 01: a BVH file, one of its angles, the moving skeleton.

python -m data_tools.draw_bvh_kinematics -o notebooks/images/bvh_kinematics.png
"""

from __future__ import annotations

import argparse
from dataclasses import replace

import matplotlib.pyplot as plt

from mocaplab.bvh_hierarchy import hierarchy_lines
from mocaplab.datasets import load_dataset
from mocaplab.euler import make_continuous
from mocaplab.motion import Motion
from mocaplab.plotting import COLORS, plot_skeleton
from mocaplab.poses import motion_to_quaternions, quaternions_to_channels


def main() -> None:
    """Draw one embedded walk, written in an Euler order that makes its arms jump."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("-o", "--output", required=True, metavar="FILE.png")
    options = parser.parse_args()

    walk = in_order_xzy(load_dataset("embedded")["walk_38"])
    joined = make_continuous(walk)

    figure, (left, middle, right) = plt.subplots(
        1, 3, figsize=(10, 3.4), width_ratios=[3, 4, 4], layout="constrained"
    )
    numbers = [" ".join(f"{value:.4g}" for value in row[:4]) + " ..." for row in walk.channels[:3]]
    lines = [*hierarchy_lines(walk.skeleton)[:11], "  ...", "MOTION", "Frames: 429", *numbers]
    text = "\n".join(line.replace("\t", "  ")[:34] for line in lines)
    left.text(0, 1, text, va="top", family="monospace", fontsize=8)
    left.set_title("text", loc="left")
    left.axis("off")

    label = "LeftArm.Xrotation"
    middle.plot(walk.time_s, walk.channel(label), color="#D55E00", label="in the file")
    middle.plot(joined.time_s, joined.channel(label), "--", color="black", label="joined up")
    middle.set_title("numbers", loc="left")
    middle.set(xlabel="time, s", ylabel=f"{label}, degrees", ylim=(-190, 430))
    middle.legend(loc="upper left", ncols=2, fontsize="small")
    middle.grid(alpha=0.3)

    plot_skeleton(walk, range(30, 420, 75), ax=right, color=COLORS["EBF"], spacing=10)
    right.set_title("motion", loc="left")
    figure.savefig(options.output, dpi=100)


def in_order_xzy(motion: Motion) -> Motion:
    """Write the same poses in the Euler order XZY, as another program might."""
    kinds = tuple(f"{axis}rotation" for axis in "XZY")
    names = tuple(
        (*(kind for kind in of_joint if kind.endswith("position")), *kinds)
        for of_joint in motion.skeleton.channel_names
    )
    skeleton = replace(motion.skeleton, channel_names=names)
    channels = motion.channels.copy()
    channels[:, skeleton.is_rotation] = quaternions_to_channels(
        motion_to_quaternions(motion), skeleton
    )
    return Motion(skeleton, motion.frame_time, channels, motion.name)


if __name__ == "__main__":
    main()
