"""What a job of a comparison returns, what that depends on, and the file that keeps it.

The rows of a job depend on the clips, the seed, the recipe, the method and the versions
of the libraries, and on nothing else. All of that is its fingerprint.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

from mocaplab import __version__
from mocaplab.comparison.job import Job
from mocaplab.comparison.methods import part_network
from mocaplab.datasets import Dataset, clip_digest
from mocaplab.files import write_atomically

Result = dict[str, Any]
"""What a job returns: fingerprint, fit_s (seconds), notes (what the method warned of), and
rows, one a clip and repetition."""


def versions() -> dict[str, str]:
    """Tell the versions of the libraries that numbers may depend on."""
    return {"mocaplab": __version__} | {name: version(name) for name in ("numpy", "scipy", "torch")}


def fingerprint(dataset: Dataset, job: Job) -> dict[str, Any]:
    """Tell all that the rows of a job depend on."""
    found = {
        "versions": versions(),
        "corruption": job.corruption,
        "method": job.method,
        "measures": list(job.measures),
        "seed": job.seed,
        "repetitions": job.repetitions,
        "epochs": job.epochs if part_network(job.method) else None,
        "training clips": _digest(dataset, job.split.train),
        "test clips": _digest(dataset, job.split.test),
    }
    return found | ({"detail": True} if job.detail else {})


def _digest(dataset: Dataset, indices: Sequence[int]) -> str:
    """Make one digest of some clips: their samples, names, actions, bones and frame times."""
    digest = hashlib.sha256()
    for i in indices:
        clip = dataset.clips[i]
        names = [clip.name, dataset.actions[i], *clip.skeleton.channel_labels]
        digest.update(json.dumps([names, clip.frame_time, clip_digest(clip)]).encode())
        digest.update(clip.skeleton.offsets.tobytes())
    return digest.hexdigest()[:16]


def save_result(path: Path, result: Result) -> None:
    """Write what a job returned; nobody ever sees half of the file."""
    write_atomically(path, json.dumps(result, indent=0) + "\n")


def load_result(path: Path, expected: Mapping[str, Any]) -> Result | None:
    """Read what the same job returned earlier.

    Parameters
    ----------
    path : file that :func:`save_result` wrote
    expected : the job's fingerprint

    Returns
    -------
    dict, or None if there is no such file

    Raises
    ------
    ValueError
        If the file is of another job, or cannot be read.
    """
    try:
        result: Result = json.loads(path.read_text(encoding="utf-8"))
        found = result["fingerprint"]
        rows = result["rows"]
        differ = [
            f"{key} ({found[key]}, now {now})" for key, now in expected.items() if found[key] != now
        ]
        whole = all(set(expected["measures"]) <= set(row) for row in rows) and len(rows) > 0
    except FileNotFoundError:
        return None
    except (ValueError, KeyError, TypeError):
        raise ValueError(
            f"{path}: expected the rows of a comparison, got something else; "
            "remove the file, and it is made anew"
        ) from None
    if differ:
        raise ValueError(
            f"{path} was made with other settings: {', '.join(differ)}; choose "
            "another output folder, or take this one away"
        )
    if not whole:
        raise ValueError(f"{path}: rows lack measures; remove the file, and it is made anew")
    return result
