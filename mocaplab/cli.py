"""The command line: mocaplab clean, fuse, corrupt, train, evaluate, reproduce, info."""

from __future__ import annotations

import argparse
import io
import os
import sys
import warnings
from collections.abc import Callable, Sequence

from mocaplab import __version__
from mocaplab.commands import clean as clean_command
from mocaplab.commands import commands
from mocaplab.commands import evaluate as evaluate_command
from mocaplab.commands import reproduce as reproduce_command
from mocaplab.corruption import corruption_table
from mocaplab.gap_fillers.curves import GapWarning
from mocaplab.splits import KINDS

_EXAMPLES = """\
examples:
  mocaplab clean noisy.bvh -o clean.bvh       clean a file with the trained network
  mocaplab clean my_clips -o cleaned          clean all files of a folder
  mocaplab fuse one.bvh two.bvh -o fused.bvh  make one good file of two recordings
  mocaplab info walk.bvh                      what is in a file
  mocaplab corrupt walk.bvh --noise 0.5 --seed 1 -o noisy.bvh
  mocaplab evaluate --reference walk.bvh noisy.bvh clean.bvh
  mocaplab train my_clips -o my_model.safetensors

"mocaplab COMMAND --help" explains a command.
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code: 0 done, 2 refused, 130 stopped."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")  # a terminal that cannot show a name's letters
    parser = _parser()
    options = parser.parse_args(arguments)
    try:
        with warnings.catch_warnings():
            _print_warnings_as_notes(options.command)
            options.run(options)
        sys.stdout.flush()
    except BrokenPipeError:  # the reader of our output, such as head, has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except (ValueError, OSError, FloatingPointError) as error:
        print(f"mocaplab {options.command}: error: {_one_line(error)}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print(f"mocaplab {options.command}: stopped", file=sys.stderr)
        return 130
    return 0


def _print_warnings_as_notes(command: str) -> None:
    """Show what the library warns of as a plain line, and the same line only once."""
    shown = set()

    def show(message: Warning | str, *_: object, **__: object) -> None:
        note = " ".join(str(message).split())
        if note not in shown:
            print(f"mocaplab {command}: note: {note}", file=sys.stderr)
        shown.add(note)

    warnings.simplefilter("always", GapWarning)
    warnings.showwarning = show


def _one_line(error: Exception) -> str:
    if isinstance(error, OSError) and error.strerror and error.filename:
        return f"{error.filename}: {error.strerror}"
    return " ".join(str(error).split())


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="mocaplab",
        description="Clean motion capture files, and learn how it is done.",
        epilog=_EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"mocaplab {__version__}")
    subparsers = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")

    def add(
        run: Callable[[argparse.Namespace], None], summary: str, epilog: str
    ) -> argparse.ArgumentParser:
        command = subparsers.add_parser(
            run.__name__,
            help=summary,
            description=f"{summary[0].upper()}{summary[1:]}.",
            epilog=epilog,
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        command.set_defaults(run=run)
        return command

    _add_clean_options(
        add(
            clean_command.clean,
            "clean a noisy BVH file, or a folder of them",
            "The root, joints that do not move, the hierarchy, the channel order, the frame time\n"
            "and the number of frames come out exactly as they went in. Any frame rate and any\n"
            "length will do. Joints are matched with the model's by their names, and what was\n"
            "matched is printed.\n\n"
            "A folder is cleaned with its subfolders, on all cores. A bad file does not stop the\n"
            "others, and is named at the end. After a stop, the same command goes on: files whose\n"
            "output is there and not older are skipped.\n\n"
            "examples:\n"
            "  mocaplab clean noisy.bvh -o clean.bvh\n"
            "  mocaplab clean noisy.bvh -o clean.bvh --report      and open clean.html\n"
            "  mocaplab clean noisy.bvh -o clean.bvh --detect      frozen frames and spikes, too\n"
            "  mocaplab clean holed.bvh -o full.bvh --gaps holed.gaps.csv --max-gap 1\n"
            "  mocaplab clean my_clips -o my_clips_cleaned",
        )
    )

    _add_fuse_options(
        add(
            commands.fuse,
            "fuse two recordings of one movement into a better one",
            "Both files must have the same joints, channels and frame rate. They may have begun\n"
            "up to a second apart: the offset is found and printed. The result has the frames\n"
            "that both have, and the root's path of A.\n\n"
            "example:\n  mocaplab fuse one.bvh two.bvh -o fused.bvh",
        )
    )

    corrupt = add(
        commands.corrupt,
        "add noise or gaps to a clean BVH file, to have something to clean",
        "A RECIPE is NAME:AMOUNT, or several joined by +, such as angular:0.5+gaps:0.001.\n"
        "Without an amount it has the one below; a number alone is angular noise.\n\n"
        f"{corruption_table()}\n\n"
        "Where a sample is hidden, the file holds the value before it, and OUT.gaps.csv\n"
        "lists the gaps.\n\n"
        "examples:\n  mocaplab corrupt walk.bvh --noise 0.5 --seed 1 -o noisy.bvh\n"
        "  mocaplab corrupt walk.bvh --noise angular:0.1+joint_gaps -o holed.bvh",
    )
    corrupt.add_argument("file", metavar="IN.bvh", help="a clean file")
    _add_output(corrupt, "OUT.bvh", "the noisy file")
    corrupt.add_argument(
        "--noise",
        default="angular:0.5",
        metavar="RECIPE",
        help="what is done to the file (default: %(default)s, which is 6 dB)",
    )
    _add_seed(corrupt)

    train = add(
        commands.train,
        "train a cleaner on a folder of clean BVH files",
        "All files must share one skeleton and frame rate. An interrupted training goes on\n"
        "where it stopped when the same command is given again.\n\n"
        "example:\n  mocaplab train my_clips -o my_model.safetensors\n"
        "  mocaplab clean noisy.bvh -o clean.bvh --model my_model.safetensors",
    )
    train.add_argument("folder", metavar="FOLDER", help="folder of clean .bvh files")
    _add_output(train, "MODEL", "the trained model, a .safetensors file")
    train.add_argument(
        "--network",
        choices=("blend", "ebf"),
        default="blend",
        help="blend is the best, ebf the network of the paper (default: %(default)s)",
    )
    train.add_argument(
        "--epochs",
        type=_count,
        help="passes over the clips (default: 20 for blend, 200 for ebf, more for few clips)",
    )
    train.add_argument(
        "--seed", type=_seed, default=0, help="the same seed gives the same model (default: 0)"
    )
    train.add_argument(
        "--holdout",
        type=float,
        default=0.14,
        metavar="SHARE",
        help="share of the clips kept for the final test, 0 for none (default: %(default)s)",
    )

    evaluate = add(
        evaluate_command.evaluate,
        "measure how well cleaning works: one model, or all methods on holdouts",
        "With clean clips, noise is added, a model and tuned Gaussian filters clean it, and the\n"
        "table shows the error that is left. With --reference, the given files are compared with\n"
        "a clean one. With --data, every method is fitted on a part of the clips and tested on\n"
        "another, with 95 % intervals from a bootstrap over clips. A comparison that was stopped\n"
        "goes on when the same command is given again.\n\n"
        "examples:\n"
        "  mocaplab evaluate my_clips --noise 0.5\n"
        "  mocaplab evaluate --reference walk.bvh noisy.bvh clean.bvh\n"
        "  mocaplab evaluate --data my_clips --methods all --noise all -o results",
    )
    _add_evaluate_options(evaluate)

    _add_reproduce_options(
        add(
            reproduce_command.reproduce,
            "redo the papers' figures within a budget of minutes, and judge every claim",
            "The budget decides how many holdouts, repetitions, epochs and clips there are, after\n"
            "a step of training has been measured; every figure says what it was made with. Each\n"
            "comes as CSV, as a picture with the paper's axes, and with a paragraph of what\n"
            "agrees and what does not; report.md has them all and the table of claims. What was\n"
            "stopped goes on when the same command is given again.\n\n"
            "examples:\n"
            "  mocaplab reproduce --list\n"
            "  mocaplab reproduce 8 --budget 10\n"
            "  mocaplab reproduce all --data my_clips --budget 60 -o my_reproduction",
        )
    )

    info = add(commands.info, "tell what is in a BVH file", "example:\n  mocaplab info walk.bvh")
    info.add_argument("file", metavar="FILE.bvh")
    return parser


def _add_clean_options(clean: argparse.ArgumentParser) -> None:
    clean.add_argument("file", metavar="IN", help="a BVH file, or a folder of them")
    _add_output(clean, "OUT", "the cleaned file or folder")
    clean.add_argument(
        "--gaps",
        metavar="LIST.csv",
        help="where samples are missing, which a BVH file cannot say: a table with the columns "
        "channel, first_frame, last_frame; a joint's name stands for all its angles",
    )
    clean.add_argument(
        "--detect",
        action="store_true",
        help="look for frozen frames and single-frame spikes, and fill them like gaps",
    )
    clean.add_argument(
        "--max-gap",
        type=_seconds,
        metavar="SECONDS",
        help="do not fill longer gaps: a line is drawn across them, and OUT.gaps.csv lists them",
    )
    clean.add_argument(
        "--report",
        action="store_true",
        help="write OUT.html beside the output, one page with pictures of what was done and why",
    )
    _add_model(clean)


def _add_fuse_options(fuse: argparse.ArgumentParser) -> None:
    fuse.add_argument("first", metavar="A.bvh", help="a recording")
    fuse.add_argument("second", metavar="B.bvh", help="another recording of the same movement")
    _add_output(fuse, "OUT.bvh", "the fused file")
    fuse.add_argument(
        "--offset",
        type=float,
        metavar="SECONDS",
        help="how much later B shows the same moment (default: found by cross-correlation)",
    )
    fuse.add_argument("--model", metavar="MODEL", help="a fusion model (default: the shipped one)")


def _add_evaluate_options(evaluate: argparse.ArgumentParser) -> None:
    add = evaluate.add_argument
    add("paths", nargs="*", metavar="PATH", help="BVH files, or one folder of clean BVH files")
    add("--reference", metavar="CLEAN.bvh", help="compare the files with this clean one")
    add("--repeats", type=_count, default=5, help="times that fresh noise is drawn (default: 5)")
    add("--all-clips", action="store_true", help="also score clips the model was trained on")
    add(
        "--noise",
        default="angular:0.5",
        metavar="RECIPES",
        help="recipes of mocaplab corrupt; with --data several with commas between, or all: paper "
        "A's angular:0.1, 0.5 and 0.9, spatial:0.5, and every other corruption with its usual "
        "amount (default: %(default)s)",
    )
    _add_seed(evaluate)
    _add_model(evaluate)
    add = evaluate.add_argument_group("comparison of methods").add_argument
    add("--data", metavar="FOLDER", help="clean BVH files, or embedded for the made-up clips")
    add(
        "--methods",
        metavar="NAMES",
        help="names with commas between, or all (default): all but those that train a network, "
        "which must be named, and oracle, a bound that sees the clean signal; a wrong name shows "
        "the list",
    )
    add(
        "--split",
        choices=KINDS,
        help="paper: holdouts in the paper's mix of actions (default); subject: and nobody is "
        "on both sides; action: leave one action out",
    )
    add("--holdouts", type=_count, metavar="N", help="holdouts that share no clip (default: 5)")
    add("-o", "--output", metavar="FOLDER", help="for rows, tables, plots (default: evaluation)")
    add(
        "--epochs",
        type=_count,
        metavar="N",
        help="training of networks (default: 200, blend 20)",
    )
    add("--workers", type=_count, metavar="N", help="processes (default: one a core)")
    add("--scheduler", metavar="ADDRESS", help="run on a Dask cluster, such as tcp://host:8786")


def _add_reproduce_options(reproduce: argparse.ArgumentParser) -> None:
    add = reproduce.add_argument
    add("figures", nargs="*", metavar="FIGURE", help="3, 4, ... as --list names them, or all")
    add("--list", action="store_true", help="explain all figures, and do nothing else")
    add(
        "--data",
        default="embedded",
        metavar="FOLDER",
        help="clean BVH files (default: %(default)s, the made-up clips)",
    )
    add("--budget", type=_minutes, metavar="MINUTES", help="5 is a smoke test, 10000 all of it")
    add("-o", "--output", metavar="FOLDER", help="for all files (default: reproduction)")
    _add_seed(reproduce)
    add("--workers", type=_count, metavar="N", help="processes (default: one a core)")
    add(
        "--models",
        metavar="FOLDER",
        help="the folder models of mocaplab evaluate --data --methods ebf,blend of the same clips "
        "and seed: its fully trained networks stand for EBF and Blend where they can",
    )


def _minutes(text: str) -> float:
    """Read a number of minutes above 0."""
    try:
        minutes = float(text)
    except ValueError:
        minutes = 0.0
    if not 0 < minutes < float("inf"):
        raise argparse.ArgumentTypeError(f"must be minutes above 0, got {text!r}")
    return minutes


def _seed(text: str) -> int:
    """Read a whole number that a random generator takes."""
    if not text.isdecimal() or int(text) >= 2**32:
        raise argparse.ArgumentTypeError(f"must be a whole number below 2^32, got {text!r}")
    return int(text)


def _count(text: str) -> int:
    """Read a whole number above 0."""
    if not text.isdecimal() or int(text) == 0:
        raise argparse.ArgumentTypeError(f"must be a whole number above 0, got {text!r}")
    return int(text)


def _seconds(text: str) -> float:
    """Read a time of 0 seconds or more."""
    try:
        seconds = float(text)
    except ValueError:
        seconds = -1.0
    if not 0 <= seconds < float("inf"):
        raise argparse.ArgumentTypeError(f"must be seconds, 0 or more, got {text!r}")
    return seconds


def _add_output(parser: argparse.ArgumentParser, metavar: str, text: str) -> None:
    parser.add_argument("-o", "--output", required=True, metavar=metavar, help=text)


def _add_seed(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--seed", type=_seed, default=0, help="the same seed gives the same noise (default: 0)"
    )


def _add_model(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--model",
        metavar="MODEL",
        help="a model made by mocaplab train, or one that comes along: blend (default), the "
        "best, or ebf, that of the paper",
    )
