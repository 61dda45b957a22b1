"""Compare ways to fill gaps and then to clean, by the length of the gap.

python -m data_tools.gap_table CLIPS -o FOLDER

On the clips that the shipped models have not seen: gaps of 1 to 600 frames at 120 frames per
second, in single channels and in all channels of a joint, without noise and with 0.5 noise. The
error is counted inside gaps alone. In each clip gaps and noise are drawn several times, since a
single gap may lie where it is easy or hard. Writes gaps.csv and gaps.png, and prints a table of the
means over clips with 95 % intervals (bootstrap over clips).
"""

from __future__ import annotations

import argparse
import csv
import io
from collections.abc import Callable, Sequence
from itertools import product
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from tqdm.auto import tqdm

from mocaplab.cleaning import Cleaner
from mocaplab.commands.option_types import count
from mocaplab.comparison.bootstrap import mean_intervals
from mocaplab.datasets import Dataset, load_folder, split_holdout
from mocaplab.files import write_atomically
from mocaplab.filters import filter_motion, gaussian_filter
from mocaplab.gap_fillers.curves import pchip_gaps
from mocaplab.gap_fillers.files import shipped_filler
from mocaplab.gap_fillers.filled import Filled, fill_by_lines
from mocaplab.gap_fillers.lowrank import fit_lowrank_gaps
from mocaplab.gap_fillers.network import NetworkFiller
from mocaplab.gap_fillers.pca import fit_pca_gaps
from mocaplab.measures.gaps import gap_rms_deg, shares_within
from mocaplab.motion import BoolArray, Corrupted, Motion, moving_channels
from mocaplab.noise.angular import angular_noise
from mocaplab.noise.gaps import hide
from mocaplab.plotting import PALETTE

FRAMES = (1, 4, 15, 30, 60, 120, 240, 600)
NOISES = (0.0, 0.5)
KINDS = ("single channels", "whole joints")
GAPS_A_CLIP = 4
OURS = "conditional Gaussian"
Fill = Callable[[Motion], Motion]
Row = dict[str, str | float]


def draw_gaps(
    motion: Motion, frames: int, kind: str, *, rng: np.random.Generator
) -> BoolArray | None:
    """Hide one run of frames in each of a few channels or joints; None if the clip is too short.

    Only channels that move are hidden, so that every error counted is one of filling.
    """
    if motion.n_frames < frames + 10:
        return None
    moving = moving_channels(motion)
    joint = motion.skeleton.channel_joint
    groups = np.arange(len(moving)) if kind == KINDS[0] else joint
    mask = np.ones(motion.channels.shape, dtype=bool)
    for group in rng.choice(np.unique(groups[moving]), GAPS_A_CLIP, replace=False):
        start = rng.integers(1, motion.n_frames - frames)
        mask[start : start + frames, (groups == group) & moving] = False
    return mask


def fillers(training: Dataset) -> dict[str, Callable[[Motion], Motion | Filled]]:
    """Return every filler by name; those that learn have seen the training clips alone."""
    pairs = [Corrupted(c, c, np.ones(c.channels.shape, dtype=bool)) for c in training.clips]
    return {
        "lines": fill_by_lines,
        "PCHIP": pchip_gaps,
        "PCA": fit_pca_gaps(pairs),
        "low rank": fit_lowrank_gaps(pairs),
        "EBD": NetworkFiller().fill,
        OURS: shipped_filler().fill,
    }


def cleaners() -> dict[str, tuple[str, Callable[[Motion], Motion]]]:
    """Return what is compared with noise: name -> (filler, what cleans the filled motion)."""
    ebf, blend = Cleaner("ebf"), Cleaner("blend")
    width_s = ebf.checkpoint.gaussian_s

    def gaussian(motion: Motion) -> Motion:
        return filter_motion(motion, lambda m: gaussian_filter(m.channels, width_s, m.frame_time))

    return {
        "lines + Gaussian": ("lines", gaussian),
        "lines + EBF": ("lines", ebf.clean),
        "PCHIP + EBF": ("PCHIP", ebf.clean),
        "PCA + EBF": ("PCA", ebf.clean),
        "low rank + EBF": ("low rank", ebf.clean),
        "EBD + EBF": ("EBD", ebf.clean),
        "EBD + Blend": ("EBD", blend.clean),
        f"{OURS} + EBF": (OURS, ebf.clean),
        f"{OURS} + Blend": (OURS, blend.clean),
    }


def measure(
    training: Dataset, test: Dataset, lengths: Sequence[int], draws: int, seed: int
) -> list[Row]:
    """Run everything on every test clip; a row for each clip, case, draw and pipeline."""
    fill, clean = fillers(training), cleaners()
    cases = list(product(KINDS, NOISES, lengths, range(draws)))
    rows: list[Row] = []
    for kind, k, frames, drawn in tqdm(cases, desc="gaps", unit="case"):
        for index, clip in enumerate(test.clips):
            case_seed = [seed, KINDS.index(kind), round(10 * k), frames, index, drawn]
            rng = np.random.default_rng(case_seed)
            mask = draw_gaps(clip, frames, kind, rng=rng)
            if mask is None:
                continue
            observed = hide(angular_noise(clip, k, rng=rng), mask)
            filled = {name: run(observed) for name, run in fill.items()}
            case: Row = {"clip": clip.name, "gaps": kind, "noise": k, "frames": frames}
            case["draw"] = drawn
            for name, result in filled.items():
                rows.append({**case, "pipeline": name, **_score(result, clip, mask)})
            for name, (filler, cleaner) in clean.items() if k else ():
                result = filled[filler]
                motion = result.motion if isinstance(result, Filled) else result
                rows.append({**case, "pipeline": name, **_score(cleaner(motion), clip, mask)})
    return rows


def _score(result: Motion | Filled, clip: Motion, mask: BoolArray) -> Row:
    """Return the error inside gaps, and how often it is within 1 and 2 expected errors."""
    if isinstance(result, Motion):
        return {"rms_deg": gap_rms_deg(result, clip, mask), "within_1": "", "within_2": ""}
    error = (result.motion.channels - clip.channels)[~mask]
    one, two = shares_within(error, result.std_deg[~mask])
    rms_deg = gap_rms_deg(result.motion, clip, mask)
    return {"rms_deg": rms_deg, "within_1": one, "within_2": two}


def print_table(rows: list[Row], lengths: Sequence[int], seed: int) -> None:
    """Print means over clips of the RMS error inside gaps, and the coverage."""
    for kinds in (*((kind,) for kind in KINDS), KINDS):
        for k in NOISES:
            here = [row for row in rows if row["gaps"] in kinds and row["noise"] == k]
            if not here:
                continue
            print(f"\nGaps in {' and '.join(kinds)}, {k:g} noise:", end=" ")
            print("RMS inside gaps, degrees (95 % interval)\n")
            names = list(dict.fromkeys(str(row["pipeline"]) for row in here))
            print(f"| {'frames':29s} |" + "".join(f"{n:>20d} |" for n in lengths))
            print(f"|{'-' * 31}|" + f"{'-' * 20}:|" * len(lengths))
            for name in names:
                cells = [_cell(here, name, n, seed) for n in lengths]
                print(f"| {name:29s} |" + "".join(f"{cell:>20s} |" for cell in cells))
    print("\nShare of errors within 1 and 2 expected errors (0.68 and 0.95 for a normal one)\n")
    for name in ("lines", "EBD", OURS):
        for k in NOISES:
            mine = [r for r in rows if r["pipeline"] == name and r["noise"] == k]
            cells = []
            for n in lengths:
                both = [(r["within_1"], r["within_2"]) for r in mine if r["frames"] == n]
                one, two = np.mean(np.array(both, dtype=np.float64), axis=0) if both else (0, 0)
                cells.append(f"{one:.2f} {two:.2f}")
            print(f"{name:22s} noise {k:<4g}" + "  ".join(cells))


def _values(rows: list[Row], name: str, frames: int) -> list[float]:
    """Return the error of every clip, the mean over what was drawn in it."""
    clips: dict[str, list[float]] = {}
    for r in rows:
        if r["pipeline"] == name and r["frames"] == frames:
            clips.setdefault(str(r["clip"]), []).append(float(r["rms_deg"]))
    return [float(np.mean(errors)) for errors in clips.values()]


def _cell(rows: list[Row], name: str, frames: int, seed: int) -> str:
    values = _values(rows, name, frames)
    if not values:
        return "-"
    interval = mean_intervals([values], rng=np.random.default_rng(seed))[0]
    return f"{interval.value:.2f} ({interval.low:.2f}-{interval.high:.2f})"


def draw(rows: list[Row], lengths: Sequence[int], path: Path) -> None:
    """Draw the error against the length of the gap."""
    alone = ("lines", "PCHIP", "PCA", "low rank", "EBD", OURS)
    then = ("lines + Gaussian", "lines + EBF", "PCA + EBF", "EBD + EBF")
    shown = alone, (*then, f"{OURS} + EBF", f"{OURS} + Blend")
    figure, axes = plt.subplots(2, 2, figsize=(11, 8), sharex=True, layout="constrained")
    for row, kind in zip(axes, KINDS, strict=True):
        for ax, k, names in zip(row, NOISES, shown, strict=True):
            here = [r for r in rows if r["gaps"] == kind and r["noise"] == k]
            for name, color, marker in zip(names, PALETTE, "os^vDP", strict=True):
                means = [np.mean(v) if (v := _values(here, name, n)) else np.nan for n in lengths]
                ax.plot(lengths, means, color=color, marker=marker, label=name)
            ax.set(xscale="log", yscale="log", title=f"{kind}, {k:g} noise")
            ax.set(xlabel="length of the gap, frames (1/120 s)", ylabel="RMS in gaps, degrees")
            ax.legend(fontsize="small")
    figure.savefig(path, dpi=110)
    plt.close(figure)


def main(arguments: list[str] | None = None) -> None:
    """Measure, print and draw."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("clips", help="folder of clean BVH files")
    parser.add_argument("-o", "--output", required=True, metavar="FOLDER")
    parser.add_argument("--frames", type=int, nargs="+", default=FRAMES, help="lengths of gaps")
    parser.add_argument("--draws", type=count, default=5, help="of gaps in each clip (default: 5)")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args(arguments)
    folder = Path(options.output)
    folder.mkdir(parents=True, exist_ok=True)
    training, test = split_holdout(load_folder(options.clips))
    rows = measure(training, test, options.frames, options.draws, options.seed)
    if not rows:
        raise ValueError(f"every test clip is shorter than {min(options.frames)} frames and 10")
    table = io.StringIO()
    writer = csv.DictWriter(table, rows[0], lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    write_atomically(folder / "gaps.csv", table.getvalue())
    print_table(rows, options.frames, options.seed)
    draw(rows, options.frames, folder / "gaps.png")


if __name__ == "__main__":
    main()
