"""Options that several commands have, and how their numbers are read."""

from __future__ import annotations

import argparse


def minutes(text: str) -> float:
    """Read a number of minutes above 0."""
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"must be minutes above 0, got {text!r}")
    return value


def seed(text: str) -> int:
    """Read a whole number that a random generator takes."""
    if not text.isdecimal() or int(text) >= 2**32:
        raise argparse.ArgumentTypeError(f"must be a whole number below 2^32, got {text!r}")
    return int(text)


def count(text: str) -> int:
    """Read a whole number above 0."""
    if not text.isdecimal() or int(text) == 0:
        raise argparse.ArgumentTypeError(f"must be a whole number above 0, got {text!r}")
    return int(text)


def seconds(text: str) -> float:
    """Read a time of 0 seconds or more."""
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not 0 <= value < float("inf"):
        raise argparse.ArgumentTypeError(f"must be seconds, 0 or more, got {text!r}")
    return value


def add_output(parser: argparse.ArgumentParser, metavar: str, text: str) -> None:
    """Add the option that says where the result goes."""
    parser.add_argument("-o", "--output", required=True, metavar=metavar, help=text)


def add_seed(parser: argparse.ArgumentParser) -> None:
    """Add the seed of the noise."""
    parser.add_argument(
        "--seed", type=seed, default=0, help="the same seed gives the same noise (default: 0)"
    )


def add_model(parser: argparse.ArgumentParser) -> None:
    """Add the choice of a model."""
    parser.add_argument(
        "--model",
        metavar="MODEL",
        help="a model made by mocaplab train, or one that comes along: blend (default), the "
        "best, or ebf, that of the paper",
    )
