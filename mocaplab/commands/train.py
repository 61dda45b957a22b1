"""What ``mocaplab train`` does."""

from __future__ import annotations

import argparse
from pathlib import Path

from mocaplab.commands.evaluate import print_scores
from mocaplab.commands.option_types import add_output, count, seed
from mocaplab.datasets import load_folder, split_holdout
from mocaplab.files import check_writable

SUMMARY = "train a cleaner on a folder of clean BVH files"
DETAILS = (
    "All files must share one skeleton and frame rate. An interrupted training goes on\n"
    "where it stopped when the same command is given again.\n\n"
    "example:\n  mocaplab train my_clips -o my_model.safetensors\n"
    "  mocaplab clean noisy.bvh -o clean.bvh --model my_model.safetensors"
)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what can be set."""
    parser.add_argument("folder", metavar="FOLDER", help="folder of clean .bvh files")
    add_output(parser, "MODEL", "the trained model, a .safetensors file")
    parser.add_argument(
        "--network",
        choices=("blend", "ebf"),
        default="blend",
        help="blend is the best, ebf the network of the paper (default: %(default)s)",
    )
    parser.add_argument(
        "--epochs",
        type=count,
        help="passes over the clips (default: 20 for blend, 200 for ebf, more for few clips)",
    )
    parser.add_argument(
        "--seed", type=seed, default=0, help="the same seed gives the same model (default: 0)"
    )
    parser.add_argument(
        "--holdout",
        type=float,
        default=0.14,
        metavar="SHARE",
        help="share of the clips kept for the final test, 0 for none (default: %(default)s)",
    )


def run(options: argparse.Namespace) -> None:
    """Train a model, then test it on the clips held out."""
    from mocaplab.checkpoints import save_checkpoint
    from mocaplab.cleaning import Cleaner
    from mocaplab.comparison.network_methods import SHAPES, enough_epochs, training_recipe
    from mocaplab.training import train

    check_writable(options.output)
    dataset = load_folder(options.folder)
    test = None
    training = dataset
    if options.holdout:
        training, test = split_holdout(dataset, options.holdout, seed=options.seed)
    frames = sum(clip.n_frames for clip in training.clips)
    print(f"training on {len(training)} clips ({frames} frames) of {options.folder}")
    epochs = options.epochs or enough_epochs(options.network, frames)
    config = training_recipe(options.network, epochs, options.seed)
    shape = SHAPES[options.network]
    state_path = Path(f"{options.output}.part")
    if state_path.exists():
        print(f"going on from {state_path}")
    checkpoint = train(training.clips, config, shape, state_path=state_path)
    save_checkpoint(checkpoint, options.output)
    state_path.unlink()
    print(f"wrote {options.output}")
    if test is not None:
        print(f"test on the {len(test)} clips held out, noise 0.5:\n")
        print_scores(test, [Cleaner(checkpoint)], noise="angular:0.5", seed=options.seed, repeats=5)
