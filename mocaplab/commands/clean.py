"""What ``mocaplab clean`` does."""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

from mocaplab.commands.option_types import add_model, add_output, seconds

SUMMARY = "clean a noisy BVH file, or a folder of them"
DETAILS = (
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
    "  mocaplab clean my_clips -o my_clips_cleaned"
)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what can be set."""
    parser.add_argument("file", metavar="IN", help="a BVH file, or a folder of them")
    add_output(parser, "OUT", "the cleaned file or folder")
    parser.add_argument(
        "--gaps",
        metavar="LIST.csv",
        help="where samples are missing, which a BVH file cannot say: a table with the columns "
        "channel, first_frame, last_frame; a joint's name stands for all its angles",
    )
    parser.add_argument(
        "--detect",
        action="store_true",
        help="look for frozen frames and single-frame spikes, and fill them like gaps",
    )
    parser.add_argument(
        "--max-gap",
        type=seconds,
        metavar="SECONDS",
        help="do not fill longer gaps: a line is drawn across them, and OUT.gaps.csv lists them",
    )
    parser.add_argument(
        "--report",
        action="store_true",
        help="write OUT.html beside the output, one page with pictures of what was done and why",
    )
    add_model(parser)


def run(options: argparse.Namespace) -> None:
    """Clean a file or a folder, and say what was done."""
    from mocaplab.cleaner.folder import clean_folder
    from mocaplab.cleaner.one_file import CleanSettings, clean_file, gaps_path, report_path

    settings = CleanSettings(
        options.model or "blend", options.detect, options.max_gap, options.report
    )
    source, output = Path(options.file), Path(options.output)
    if source.is_dir():
        if options.gaps:
            raise ValueError("--gaps lists the gaps of one file; clean that file by itself")
        clean_folder(source, output, settings)
        return
    start = time.perf_counter()
    cleaner = settings.cleaner()
    summary = clean_file(source, output, settings, cleaner, gaps=options.gaps, progress=True)
    print(summary)
    print(f"took      {time.perf_counter() - start:.1f} s{_peak_memory()}")
    print(f"wrote     {output}")
    if summary.n_left:
        print(f"wrote     {gaps_path(output)}, which lists the gaps that were left open")
    if options.report:
        print(f"wrote     {report_path(output)}, the report: open it in a browser")


def _peak_memory() -> str:
    """Say how much memory was taken at most, where the system tells."""
    try:
        import resource
    except ImportError:  # Windows
        return ""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return f", {peak / (2**20 if sys.platform == 'darwin' else 2**10):,.0f} MB of memory at most"
