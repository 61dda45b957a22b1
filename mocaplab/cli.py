"""The command line: mocaplab clean, fuse, corrupt, train, evaluate, reproduce, info."""

from __future__ import annotations

import argparse
import io
import os
import sys
import warnings
from collections.abc import Sequence

from mocaplab import __version__
from mocaplab.commands import clean, corrupt, evaluate, fuse, info, reproduce, train
from mocaplab.gap_fillers.curves import GapWarning

COMMANDS = {
    "clean": clean,
    "fuse": fuse,
    "corrupt": corrupt,
    "train": train,
    "evaluate": evaluate,
    "reproduce": reproduce,
    "info": info,
}

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
    for name, command in COMMANDS.items():
        summary = command.SUMMARY
        subparser = subparsers.add_parser(
            name,
            help=summary,
            description=f"{summary[0].upper()}{summary[1:]}.",
            epilog=command.DETAILS,
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        command.add_options(subparser)
        subparser.set_defaults(run=command.run)
    return parser
