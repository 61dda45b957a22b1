"""What cleaning did to a motion, in numbers and plain words."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mocaplab.cleaner.fault_detection import Faults
from mocaplab.cleaning import Cleaned
from mocaplab.gap_fillers.curves import lerp_gaps
from mocaplab.measures.movement import jitter
from mocaplab.motion import BoolArray, Motion


@dataclass(frozen=True)
class CleaningReport:
    """What cleaning did to a motion."""

    n_channels: int
    n_changed: int  # channels with at least one changed sample
    jitter_before: float  # file length units per second cubed, gaps filled by lerp
    jitter_after: float
    rms_change_deg: float  # over the changed channels
    largest_change_deg: float
    largest_channel: str  # where the largest change was made
    largest_frame: int
    n_filled: int = 0  # samples that were inside gaps, and were filled
    n_gaps: int = 0
    longest_gap_s: float = 0.0
    usual_error_deg: float = 0.0  # expected errors of filled samples: the median
    worst_error_deg: float = 0.0  # and the largest
    n_left: int = 0  # gaps that were left open
    n_frozen: int = 0  # frames that repeated the one before, detected
    n_spikes: int = 0  # single samples far off, detected
    matched: tuple[str, ...] = ()  # how the file's joints were taken for the model's

    @property
    def jitter_change(self) -> float:
        """By what share jitter changed: -0.5 for half of it."""
        return self.jitter_after / self.jitter_before - 1 if self.jitter_before else 0.0

    def __str__(self) -> str:
        return "\n".join([*self.repairs(), *self.changes()])

    def repairs(self) -> list[str]:
        """Say what was repaired, and what was not."""
        lines = [f"matched   {line}" for line in self.matched]
        if self.n_frozen or self.n_spikes:
            lines.append(
                f"found     {self.n_frozen} frozen frames and {self.n_spikes} spikes, "
                f"and treated them as gaps"
            )
        if self.n_filled:
            error = ""
            if self.worst_error_deg:
                error = (
                    f"; expect an error of {self.usual_error_deg:.1f} degrees, at worst "
                    f"{self.worst_error_deg:.1f}"
                )
            lines.append(
                f"filled    {self.n_filled} samples inside {self.n_gaps} gaps, the longest of "
                f"{self.longest_gap_s:.2f} s{error}"
            )
        if self.n_left:
            lines.append(f"left open {self.n_left} gaps that are too long: only a line is there")
        return lines

    def changes(self) -> list[str]:
        """Say how much was changed."""
        if not self.n_changed:
            return ["nothing was changed"]
        lines = [
            f"jitter    before {self.jitter_before:,.0f}  after {self.jitter_after:,.0f} "
            f"units/s^3  ({100 * self.jitter_change:+.0f} %; jitter is the mean joint jerk)",
            f"changed   {self.n_changed} of {self.n_channels} channels, "
            f"by {self.rms_change_deg:.2f} degrees RMS",
            f"largest   {self.largest_change_deg:.1f} degrees at {self.largest_channel}, "
            f"frame {self.largest_frame}",
            f"as before {self.n_channels - self.n_changed} channels: the root and those that "
            f"do not move",
        ]
        if self.jitter_after > self.jitter_before:
            lines.append(
                "note      jitter rose: the file was clean, or its joints trembled together with "
                "the root, which is left as it is"
            )
        return lines


def report_changes(
    before: Motion, after: Motion, cleaned: Cleaned | None = None, faults: Faults | None = None
) -> CleaningReport:
    """Compare a motion before and after cleaning.

    Parameters
    ----------
    before, after : Motion
        Of one skeleton and length; ``before`` may have NaN.
    cleaned : Cleaned, optional
        What the cleaner says of its work.
    faults : Faults, optional
        What was detected, hidden and filled.
    """
    missing = np.isnan(before.channels)
    change = np.abs(after.channels - lerp_gaps(before).channels)
    changed = change.any(axis=0)
    frame, channel = np.unravel_index(np.argmax(change), change.shape)
    filled = missing if cleaned is None else cleaned.std_deg > 0
    left = np.zeros_like(missing) if cleaned is None else cleaned.left
    errors = cleaned.std_deg[filled] if cleaned is not None else np.array([])
    errors = errors[np.isfinite(errors)]  # infinite where a channel was never observed
    n_gaps, longest = count_runs(filled)
    return CleaningReport(
        n_channels=before.skeleton.n_channels,
        n_changed=int(changed.sum()),
        jitter_before=jitter(lerp_gaps(before)),
        jitter_after=jitter(after),
        rms_change_deg=float(np.sqrt(np.mean(change[:, changed] ** 2))) if changed.any() else 0.0,
        largest_change_deg=float(change[frame, channel]),
        largest_channel=before.skeleton.channel_labels[channel],
        largest_frame=int(frame),
        n_filled=int(filled.sum()),
        n_gaps=n_gaps,
        longest_gap_s=longest * before.frame_time,
        usual_error_deg=float(np.median(errors)) if len(errors) else 0.0,
        worst_error_deg=float(errors.max()) if len(errors) else 0.0,
        n_left=count_runs(left)[0],
        n_frozen=int(faults.frozen.sum()) if faults else 0,
        n_spikes=int(faults.spikes.sum()) if faults else 0,
        matched=tuple(cleaned.match.describe()) if cleaned else (),
    )


def count_runs(marked: BoolArray) -> tuple[int, int]:
    """Count the runs of True down the columns of (T, C), and the frames of the longest."""
    if not marked.any():
        return 0, 0
    edge = np.zeros((1, marked.shape[1]), dtype=np.int8)
    steps = np.diff(marked.astype(np.int8), axis=0, prepend=edge, append=edge).T
    starts, ends = np.flatnonzero(steps == 1), np.flatnonzero(steps == -1)
    return len(starts), int((ends - starts).max())
