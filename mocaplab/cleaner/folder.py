"""Clean all files of a folder, on all cores, and go on after a stop.

The output folder has the same subfolders as the input folder, and a small file that says with
which settings it was made. A file is skipped if its output is there and not older than it; with
other settings, the whole folder is refused. So a folder never holds a mixture, and no file
that somebody else put there is overwritten.
"""

from __future__ import annotations

import json
import sys
import warnings
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import BrokenExecutor, as_completed
from dataclasses import asdict
from functools import lru_cache
from pathlib import Path

import numpy as np
from tqdm.auto import tqdm

from mocaplab.cleaner.one_file import CleanSettings, clean_file
from mocaplab.cleaner.summary import CleaningReport
from mocaplab.cleaning import Cleaner
from mocaplab.files import write_atomically
from mocaplab.worker_processes import count_cores, worker_processes

MANIFEST = "mocaplab-clean.json"
"""The file in the output folder that holds the settings."""


def clean_folder(folder: Path, output: Path, settings: CleanSettings) -> None:
    """Clean every BVH file in a folder and its subfolders, and say how it went.

    Parameters
    ----------
    folder : Path
    output : Path, made if it is not there
    settings : CleanSettings

    Raises
    ------
    ValueError
        If there is nothing to clean, two files would have the same output, the output folder
        is not ours or was made with other settings; and in the end, if a file failed.
    OSError
        If the output folder cannot be written.
    """
    files = find_files(folder, output)
    prepare_output(output, files, settings)
    todo = {source: target for source, target in files.items() if not is_done(source, target)}
    done = len(files) - len(todo)
    summaries: list[CleaningReport] = []
    failed: dict[Path, str] = {}
    with tqdm(total=len(files), initial=done, desc="cleaning", unit="file") as bar:
        for source, outcome, notes in _run(todo, settings):
            if isinstance(outcome, str):
                failed[source] = outcome
                notes = [*notes, f"failed: {source}: {outcome}"]
            else:
                summaries.append(outcome)
            for note in notes:
                bar.write(note, file=sys.stderr)
            bar.update()
    if done:
        print(f"skipped   {done} files that were cleaned before")
    print(_summarize(len(files), summaries))
    print(f"wrote     {output}")
    if failed:
        names = ", ".join(str(path.relative_to(folder)) for path in failed)
        raise ValueError(
            f"{len(failed)} of {len(files)} files could not be cleaned: {names}; the reasons are "
            f"above, and the same command tries them again"
        )


def find_files(folder: Path, output: Path) -> dict[Path, Path]:
    """Find the BVH files of a folder and the output of each.

    Raises
    ------
    ValueError
        See :func:`clean_folder`.
    """
    if output.resolve() == folder.resolve():
        raise ValueError(f"the output folder must be another than {folder}, which it would spoil")
    inside = output.resolve()
    found = sorted(
        path
        for path in folder.rglob("*")
        if path.suffix.lower() == ".bvh" and path.is_file() and inside not in path.resolve().parents
    )
    if not found:
        raise ValueError(f"there are no .bvh files in {folder} or its subfolders")
    files = {path: output / path.relative_to(folder) for path in found}
    # The page and the table of gaps have the name without .bvh; some disks ignore case.
    names = Counter(str(target.with_suffix("")).lower() for target in files.values())
    clash = [str(path) for path, target in files.items() if names[_plain(target)] > 1]
    if clash:
        raise ValueError(f"these files would have the same output: {', '.join(clash)}; rename one")
    return files


def _plain(target: Path) -> str:
    return str(target.with_suffix("")).lower()


def prepare_output(output: Path, files: dict[Path, Path], settings: CleanSettings) -> None:
    """Make the output folder and its subfolders, and note the settings there.

    Raises
    ------
    ValueError, OSError
        See :func:`clean_folder`.
    """
    text = json.dumps({**asdict(settings), "model": settings.model_digest()}, indent=1) + "\n"
    manifest = output / MANIFEST
    if manifest.exists():
        if manifest.read_text(encoding="utf-8") != text:
            raise ValueError(
                f"{output} was cleaned with other settings or another model; choose another "
                f"folder, or take it away"
            )
    elif any(target.exists() for target in files.values()):
        raise ValueError(
            f"{output} has files of the same names that this command did not make (there is no "
            f"{MANIFEST}); choose another folder"
        )
    for parent in {output, *(target.parent for target in files.values())}:
        parent.mkdir(parents=True, exist_ok=True)
    write_atomically(manifest, text)


def is_done(source: Path, target: Path) -> bool:
    """Tell whether an output is there and not older than its input."""
    return target.exists() and target.stat().st_mtime >= source.stat().st_mtime


Outcome = CleaningReport | str
"""A summary, or why a file could not be cleaned."""


def _run(
    todo: dict[Path, Path], settings: CleanSettings
) -> Iterator[tuple[Path, Outcome, list[str]]]:
    """Clean files in parallel; yield each with its outcome and notes when it is done."""
    if not todo:
        return
    with worker_processes(min(count_cores(), len(todo))) as executor:
        jobs = {
            executor.submit(clean_in_worker, source, target, settings): source
            for source, target in todo.items()
        }
        for job in as_completed(jobs):
            try:
                outcome, notes = job.result()
            except BrokenExecutor:
                outcome, notes = "a worker process died; was there too little memory?", []
            yield jobs[job], outcome, notes


def clean_in_worker(
    source: Path, target: Path, settings: CleanSettings
) -> tuple[Outcome, list[str]]:
    """Clean a file; return what was done or why it failed, and what the library warned of."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            outcome: Outcome = clean_file(source, target, settings, _cleaner(settings))
        except (ValueError, OSError, FloatingPointError, MemoryError) as error:
            outcome = " ".join(str(error).split()) or type(error).__name__
    return outcome, [f"{source}: {' '.join(str(w.message).split())}" for w in caught]


@lru_cache(maxsize=1)
def _cleaner(settings: CleanSettings) -> Cleaner:
    """Load the model once in each process."""
    return settings.cleaner()


def _summarize(n_files: int, summaries: list[CleaningReport]) -> str:
    """Say what was done to all files together."""
    lines = [f"cleaned   {len(summaries)} of {n_files} files"]
    if summaries:
        jitter = 100 * float(np.median([summary.jitter_change for summary in summaries]))
        filled = sum(summary.n_filled for summary in summaries)
        left = sum(summary.n_left for summary in summaries)
        lines.append(f"jitter    {jitter:+.0f} % in the median file")
        lines.append(f"filled    {filled} samples inside gaps; {left} gaps were left open")
    return "\n".join(lines)
