"""Make the gap fillers that come with the package.

python -m data_tools.gap_models CLIPS -o mocaplab/data/gaps.safetensors
python -m data_tools.gap_models CLIPS --model ebd -o mocaplab/data/ebd.safetensors

The clips are split as ``mocaplab train`` splits them; the held-out ones are not looked at.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mocaplab.checkpoints import save_checkpoint
from mocaplab.comparison.network_methods import SHAPES, training_recipe
from mocaplab.datasets import Dataset, clip_digest, load_folder, split_holdout
from mocaplab.files import check_writable
from mocaplab.gap_fillers.files import save_filler
from mocaplab.gap_fillers.gaussian import GaussianFiller
from mocaplab.gap_fillers.gaussian_fit import fit_gaussian_filler
from mocaplab.gap_fillers.network import with_gap_errors
from mocaplab.motion import Corrupted, Motion
from mocaplab.training import train

ROUNDS = 30
"""So often are gaps drawn in every clip on which expected errors are measured."""


def main(arguments: list[str] | None = None) -> None:
    """Fit or train a gap filler and write it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("clips", help="folder of clean BVH files")
    parser.add_argument("-o", "--output", required=True, help="file to write")
    parser.add_argument("--model", choices=("gaussian", "ebd"), default="gaussian")
    parser.add_argument("--epochs", type=int, default=None, help="of EBD (default: 700)")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args(arguments)
    check_writable(options.output)
    training, _ = split_holdout(load_folder(options.clips), seed=options.seed)
    if options.model == "gaussian":
        save_filler(fit_to_motions(training.clips), options.output)
    else:
        _train_ebd(training, options.epochs, options.seed, options.output)
    print(f"wrote {options.output}")


def fit_to_motions(clips: Sequence[Motion]) -> GaussianFiller:
    """Fit a gap filler to clean clips of one skeleton, and note which these are."""
    pairs = [Corrupted(clip, clip, np.ones(clip.channels.shape, dtype=bool)) for clip in clips]
    seen = {clip.name: clip_digest(clip) for clip in clips}
    return replace(fit_gaussian_filler(pairs), trained_on=seen)


def _train_ebd(training: Dataset, epochs: int | None, seed: int, path: str) -> None:
    recipe = training_recipe("ebd", epochs, seed)
    checkpoint = train(training.clips, recipe, SHAPES["ebd"])
    # Its expected errors are those of a twin, on clips that the twin has not seen.
    most, rest = split_holdout(training, seed=seed)
    twin = train(most.clips, recipe, SHAPES["ebd"])
    rng = np.random.default_rng(seed)
    measured = with_gap_errors(twin, [*rest.clips] * ROUNDS, rng=rng).info["gap_errors"]
    info = {**checkpoint.info, "gap_errors": measured}
    save_checkpoint(replace(checkpoint, info=info), path)


if __name__ == "__main__":
    main()
