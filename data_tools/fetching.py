"""Fetch one file politely, and keep a folder of prepared clips with checksums."""

from __future__ import annotations

import csv
import hashlib
import io
import json
import time
from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime, timezone
from email.utils import parsedate_to_datetime
from pathlib import Path
from typing import Any

from data_tools.catalogue import Trial
from data_tools.prepare import Prepared
from mocaplab import __version__
from mocaplab.bvh import save_bvh
from mocaplab.files import write_atomically

MAX_WAIT_S = 120.0
"""A server that asks for a longer wait than this is left in peace."""


class FetchError(Exception):
    """A file could not be fetched; the message says why and what to do next."""


class OfflineError(FetchError):
    """No server was reached."""


@dataclass(frozen=True)
class Manners:
    """How to treat a server.

    Parameters
    ----------
    pause_s : float, the pause after every file
    tries : int, how often to ask for one file
    wait_s : float, the wait before the second try; it doubles with every further one
    timeout_s : float, how long a server may be silent
    sleep : function that waits
    """

    pause_s: float = 0.2
    tries: int = 4
    wait_s: float = 2.0
    timeout_s: float = 30.0
    sleep: Callable[[float], None] = time.sleep


def sha256(path: Path) -> str:
    """Return the SHA-256 of a file, in hexadecimal."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def fetch(url: str, path: Path, known: str | None, manners: Manners) -> str:
    """Fetch a file unless it is there, whole and unchanged.

    Parameters
    ----------
    url : str
    path : path of the file
    known : SHA-256 of the file when it was first fetched, or None
    manners : Manners

    Returns
    -------
    str, the SHA-256

    Raises
    ------
    FetchError
        If it cannot be fetched, or has changed. No part of it is left under its name.
    """
    if path.exists():
        if known is not None and sha256(path) == known:
            return known
        path.unlink()  # damaged, or from where nobody knows
    for attempt in range(manners.tries):
        error, wait_s = _try_once(url, path, known, manners.timeout_s)
        if error is None:
            manners.sleep(manners.pause_s)
            return sha256(path)
        if wait_s is None or attempt + 1 == manners.tries:
            raise error
        if wait_s > MAX_WAIT_S:
            raise FetchError(f"{url}: the server asks to come back in {wait_s:.0f} s; do so")
        manners.sleep(max(wait_s, manners.wait_s * 2**attempt))
    raise ValueError(f"expected at least one try, got {manners.tries}")


def _try_once(
    url: str, path: Path, known: str | None, timeout_s: float
) -> tuple[FetchError | None, float | None]:
    """Ask for a file once. Return what went wrong, and the least wait before a next try."""
    import pooch
    import requests

    pooch.get_logger().setLevel("WARNING")
    agent = {"User-Agent": f"mocaplab/{__version__} (data_tools.download)"}
    try:
        pooch.retrieve(
            url,
            known_hash=None if known is None else f"sha256:{known}",
            fname=path.name,
            path=path.parent,
            downloader=pooch.HTTPDownloader(timeout=timeout_s, headers=agent),
        )
    except requests.HTTPError as error:
        response = error.response
        if response is None:
            return FetchError(f"{url}: the server says {error}"), None
        problem = FetchError(f"{url}: the server says {response.status_code} {response.reason}")
        may_pass = response.status_code == 429 or response.status_code >= 500
        return problem, _retry_after(response.headers) if may_pass else None
    except requests.Timeout:
        return FetchError(f"{url}: no answer in {timeout_s:g} s; try again later"), 0.0
    except requests.RequestException as error:
        if isinstance(error, requests.ConnectionError) and hasattr(error.args[0], "reason"):
            return OfflineError(f"{url}: not reached ({error.args[0].reason})"), 0.0
        return FetchError(f"{url}: the connection broke off; try again later"), 0.0
    except ValueError:  # pooch compared the checksums
        return FetchError(
            f"{url}: expected the file of the first time (SHA-256 {known}), got another; if you "
            f"trust the new one, take {path.name} out of checksums.json and run again"
        ), None
    return None, None


def _retry_after(headers: Any) -> float:
    """Read how long a server asks to wait: seconds, or a date."""
    text = str(headers.get("Retry-After", "")).strip()
    if text.isdecimal():
        return float(text)
    try:
        moment = parsedate_to_datetime(text)
    except ValueError:
        return 0.0
    if moment.tzinfo is None:
        moment = moment.replace(tzinfo=timezone.utc)
    return max(0.0, (moment - datetime.now(timezone.utc)).total_seconds())


class ClipFolder:
    """A folder of prepared clips, and what ``checksums.json`` says about them.

    Parameters
    ----------
    path : path of the folder; it is made if need be
    source : str, where its clips come from

    Raises
    ------
    ValueError
        If the folder holds clips of another source: their skeletons differ.
    """

    def __init__(self, path: Path, source: str):
        self.path, self.raw = path, path / "raw"
        self.record = path / "checksums.json"
        self.source = source
        self.checksums: dict[str, str] = {}
        self.clips: dict[str, dict[str, Any]] = {}
        self.raw.mkdir(parents=True, exist_ok=True)
        if self.record.exists():
            self._read()

    def _read(self) -> None:
        try:
            record = json.loads(self.record.read_text(encoding="utf-8"))
            source, checksums, clips = record["source"], record["files"], record["clips"]
            if not (isinstance(checksums, dict) and isinstance(clips, dict)):
                raise TypeError
        except (ValueError, KeyError, TypeError):
            raise ValueError(
                f"{self.record}: expected JSON with source, files and clips; take the file away "
                f"to fetch everything anew"
            ) from None
        if source != self.source:
            raise ValueError(
                f"{self.path} holds clips from {source}, whose skeleton differs from that of "
                f"{self.source}; choose another folder with --to"
            )
        self.checksums, self.clips = checksums, clips

    def save(self) -> None:
        """Write ``checksums.json``."""
        record = {"source": self.source, "files": self.checksums, "clips": self.clips}
        write_atomically(self.record, json.dumps(record, indent=1, sort_keys=True) + "\n")

    def holds(self, trial: Trial) -> bool:
        """Tell whether the prepared clip is there and unchanged."""
        clip = self.clips.get(trial.clip)
        if clip is None or not (self.path / clip["file"]).exists():
            return False
        return bool(sha256(self.path / clip["file"]) == clip["sha256"])

    def keep(self, trial: Trial, prepared: Prepared) -> None:
        """Write a prepared clip, and what is known about it."""
        file = Path("" if prepared.is_usual else "other_rates") / f"{trial.clip}.bvh"
        (self.path / file).parent.mkdir(exist_ok=True)
        save_bvh(prepared.motion, self.path / file)
        self.clips[trial.clip] = {
            "file": file.as_posix(),
            "sha256": sha256(self.path / file),
            "subject": trial.subject,
            "action": trial.action,
            "frames": prepared.motion.n_frames,
            "changes": list(prepared.notes),
        }
        self.save()

    def write_list(self) -> None:
        """Write ``clips.csv``, which ``mocaplab.datasets.load_dataset`` reads."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(["clip", "action", "frames", "subject"])
        for name, clip in sorted(self.clips.items()):
            if (self.path / f"{name}.bvh").exists():
                writer.writerow([name, clip["action"], clip["frames"], clip["subject"]])
        write_atomically(self.path / "clips.csv", text.getvalue())
