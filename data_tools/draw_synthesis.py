"""Draw recorded and synthetic motions one above the other, as stick figures from the side."""

from __future__ import annotations

import argparse
import csv
from collections.abc import Sequence
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes

from mocaplab.bvh import load_bvh
from mocaplab.kinematics import end_site_positions, forward_kinematics
from mocaplab.measures.movement import foot_heights
from mocaplab.motion import Motion
from mocaplab.synthesis import ACTIONS, synthesize

SPAN_S = {"walk": 1.3, "jog": 1.0, "run": 0.9, "jump": 1.4, "kick": 1.2}
N_POSES = 7
LEFT, RIGHT, TRUNK = "tab:red", "tab:blue", "0.25"


def most_lively(motion: Motion, action: str, span_s: float) -> Motion:
    """Cut out the part that shows the action: around the highest foot, else the middle."""
    n = min(round(span_s / motion.frame_time) + 1, motion.n_frames)
    middle = motion.n_frames // 2
    heights = foot_heights(motion)
    if action == "jump":
        middle = int(heights.min(axis=1).argmax())
    if action == "kick":
        foot = forward_kinematics(motion)[0][:, motion.skeleton.joint_names.index("RightFoot")]
        middle = int(np.linalg.norm(np.diff(foot, axis=0), axis=1).argmax())
    first = int(np.clip(middle - n // 2, 0, motion.n_frames - n))
    return motion.slice_frames(first, first + n)


def draw_poses(axes: Axes, motion: Motion) -> None:
    """Draw poses spread evenly over a motion, seen from its right side.

    A motion that stays in place would draw its poses on top of each other; so every pose
    is moved to the right of the one before by at least a body's width, and the time is
    written below.
    """
    positions, _ = forward_kinematics(motion)
    sites = end_site_positions(motion)
    skeleton = motion.skeleton
    floor = float(np.percentile(foot_heights(motion).min(axis=1), 10))
    travel = positions[-1, 0] - positions[0, 0]
    angle = np.arctan2(travel[0], travel[2]) if np.hypot(travel[0], travel[2]) > 3 else 0.0
    along = np.array([np.sin(angle), 0.0, np.cos(angle)])
    place, before = 0.0, positions[0, 0] @ along
    for frame in np.linspace(0, motion.n_frames - 1, N_POSES).round().astype(int):
        now = positions[frame, 0] @ along
        place += max(now - before, 11.0) if frame else 0.0
        before = now
        bones = [
            (skeleton.joint_names[child], positions[frame, parent], positions[frame, child])
            for child, parent in enumerate(skeleton.parents.tolist())
            if parent >= 0
        ]
        bones += [
            (skeleton.joint_names[parent], positions[frame, parent], sites[frame, i])
            for i, parent in enumerate(skeleton.end_site_parents.tolist())
        ]
        # The far (left) side first, so that the near side covers it.
        for name, start, end in sorted(bones, key=lambda bone: bone[0].startswith("R")):
            colour = LEFT if name[0] == "L" and name != "LowerBack" else TRUNK
            colour = RIGHT if name.startswith("R") else colour
            xs = [place + start @ along - now, place + end @ along - now]
            axes.plot(
                xs,
                [start[1] - floor, end[1] - floor],
                color=colour,
                linewidth=1.6,
                solid_capstyle="round",
            )
        axes.text(place, -2.8, f"{frame * motion.frame_time:.2f} s", ha="center", fontsize=6)
    axes.axhline(0.0, color="0.6", linewidth=0.8, zorder=0)
    axes.set_aspect("equal")
    axes.set_ylim(-4.0, 38.0)
    axes.axis("off")


def draw_all(folder: Path, output: Path, seed: int = 0) -> None:
    """Draw the whole figure: for each action the recorded clip above, synthetic below."""
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    with open(folder / "clips.csv", newline="") as file:
        clips = {row["action"]: row["clip"] for row in reversed(list(csv.DictReader(file)))}
    figure, axes = plt.subplots(4, 3, figsize=(18, 11), layout="constrained")
    for column, action in enumerate(ACTIONS):
        # Two bands, the three gaits and then the rest; in each the recording is above.
        above, below = axes[2 * (column // 3) : 2 * (column // 3) + 2, column % 3]
        rng = np.random.default_rng([seed, column])
        drawn = synthesize(action, duration_s=3.0, rng=rng)
        if action in clips:
            recorded = load_bvh(folder / f"{clips[action]}.bvh")
            draw_poses(above, most_lively(recorded, action, SPAN_S[action]))
            above.set_title(f"{action}: recorded ({clips[action]})", fontsize=11)
        else:
            above.text(0.5, 0.5, f"{action}: no recording at hand", ha="center", fontsize=11)
        draw_poses(below, most_lively(drawn, action, SPAN_S[action]))
        below.set_title(f"{action}: synthetic", fontsize=11)
    for empty in axes.flat:
        empty.axis("off")
    figure.suptitle("Seen from the right; right limbs blue, left limbs red")
    output.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(output, dpi=70)
    plt.close(figure)


def main(arguments: Sequence[str] | None = None) -> None:
    """Read the command line and draw."""
    parser = argparse.ArgumentParser(
        prog="python -m data_tools.draw_synthesis",
        description="Draw recorded clips and synthetic ones side by side, as stick figures.",
    )
    parser.add_argument(
        "--data", type=Path, required=True, help="folder with clips.csv and the BVH files"
    )
    parser.add_argument("-o", "--output", type=Path, required=True, help="picture to write (PNG)")
    parser.add_argument("--seed", type=int, default=0, help="another seed, other motions")
    options = parser.parse_args(arguments)
    draw_all(options.data, options.output, options.seed)


if __name__ == "__main__":
    main()
