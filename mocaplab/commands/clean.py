"""What ``mocaplab clean`` does; cli.py reads the options."""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path


def clean(options: argparse.Namespace) -> None:
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
