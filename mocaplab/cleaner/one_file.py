"""Clean one file: read it, find and fill gaps, clean, write the result and what goes with it."""

from __future__ import annotations

import hashlib
import os
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path

from mocaplab.bvh import load_bvh, round_changes, save_bvh
from mocaplab.checkpoints import SHIPPED, shipped_file
from mocaplab.cleaner.fault_detection import Faults, detect_faults
from mocaplab.cleaner.summary import CleaningReport, report_changes
from mocaplab.cleaning import Cleaner
from mocaplab.files import check_writable
from mocaplab.noise.gaps import hide, load_gaps, save_gaps


@dataclass(frozen=True)
class CleanSettings:
    """How files are cleaned.

    Parameters
    ----------
    model : str, a name in :data:`mocaplab.checkpoints.SHIPPED` or the path of a model file
    detect : bool, look for frozen frames and spikes
    max_gap_s : float, seconds, or None: longer gaps are left open
    report : bool, write a page about what was done
    """

    model: str = "blend"
    detect: bool = False
    max_gap_s: float | None = None
    report: bool = False

    def cleaner(self) -> Cleaner:
        """Load the model."""
        return Cleaner(self.model, max_gap_s=self.max_gap_s)

    def model_digest(self) -> str:
        """Return a text that tells this model from any other."""
        shipped = self.model in SHIPPED
        with shipped_file(self.model) if shipped else nullcontext(Path(self.model)) as path:
            return hashlib.sha256(path.read_bytes()).hexdigest()[:16]


def report_path(output: Path) -> Path:
    """Return where the page about a cleaned file goes."""
    return output.with_suffix(".html")


def gaps_path(output: Path) -> Path:
    """Return where the list of gaps that were left open goes."""
    return output.with_suffix(".gaps.csv")


def clean_file(
    source: str | os.PathLike[str],
    output: Path,
    settings: CleanSettings,
    cleaner: Cleaner,
    *,
    gaps: str | os.PathLike[str] | None = None,
    progress: bool = False,
) -> CleaningReport:
    """Clean a BVH file.

    The cleaned file is written last: when it is there, all is there.

    Parameters
    ----------
    source : path of a BVH file
    output : path of the cleaned one; the page about it and a list of gaps left open go beside it
    settings : CleanSettings
    cleaner : Cleaner, made by ``settings``
    gaps : path of a table of gaps, optional; see :func:`mocaplab.noise.gaps.load_gaps`
    progress : bool, show a progress bar for a long file

    Raises
    ------
    ValueError, OSError
        If the file cannot be read or cleaned, or the output not be written.
    """
    check_output(source, output, settings, gaps)
    motion = load_bvh(source)
    observed = motion if gaps is None else hide(motion, load_gaps(gaps, motion))
    faults: Faults | None = None
    if settings.detect:
        faults = detect_faults(observed)
        observed = hide(observed, ~faults.hidden(observed))
    cleaned = cleaner.clean_in_detail(observed, widths=settings.report, progress=progress)
    del observed
    after = round_changes(motion, cleaned.motion)
    summary = report_changes(motion, after, cleaned, faults)
    if settings.report:
        from mocaplab.cleaner.report import write_report

        write_report(motion, after, cleaned, faults, summary, report_path(output))
    if cleaned.left.any() or gaps_path(output).exists():  # an older list would be wrong
        save_gaps(~cleaned.left, motion.skeleton, gaps_path(output))
    save_bvh(after, output)
    return summary


def check_output(
    source: str | os.PathLike[str],
    output: Path,
    settings: CleanSettings,
    gaps: str | os.PathLike[str] | None,
) -> None:
    """Refuse outputs that cannot be written, or that would destroy what is read.

    Raises
    ------
    ValueError, OSError
    """
    written = [output, *([report_path(output)] if settings.report else []), gaps_path(output)]
    for path in written:
        check_writable(path)
        for read in (source, gaps):
            if read is not None and path.exists() and os.path.samefile(path, read):
                raise ValueError(f"{path} would be written over what is read; choose another name")
