"""Fetch clips of the CMU motion capture database.

    python -m data_tools.download cmu                        100 clips in paper A's mix
    python -m data_tools.download cmu --actions walk run --limit 5
    python -m data_tools.download cmu --source asfamc --to my_clips

The clips come from a public mirror of the BVH conversion, or from CMU's own pages in
ASF/AMC form. Every clip goes through ``data_tools.prepare``. The folder then holds

- one BVH file a clip and ``clips.csv``: ``load_dataset("cmu", folder)`` reads it as it is;
- ``other_rates/``: clips that are not at 120 fps, as a data set shares one rate;
- ``raw/``: the files as they came, and ``checksums.json``: their SHA-256 when first fetched.

The same command again goes on where an earlier one stopped. A file takes its name only
when it is whole, and it is used only when its checksum is still that of the first time.

The data used is from mocap.cs.cmu.edu, which was created with funding from NSF EIA-0196217.
CMU asks not to crawl its pages: keep the pause between two files, and fetch what you need.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from urllib.parse import urlsplit

from tqdm import tqdm

from data_tools.catalogue import PAPER_MIX, Trial, choose, load_catalogue
from data_tools.fetching import ClipFolder, FetchError, Manners, OfflineError, fetch
from data_tools.prepare import Prepared, prepare
from mocaplab.bvh import load_bvh
from mocaplab.motion import Motion

BASE_URLS = {
    "bvh": "https://raw.githubusercontent.com/una-dinosauria/cmu-mocap/master/data",
    "asfamc": "http://mocap.cs.cmu.edu/subjects",
}
PAUSE_S = {"bvh": 0.2, "asfamc": 1.0}
MAX_UNREACHED = 3
"""So many clips in a row that reach no server: then it is the connection, not the clip."""


def trial_urls(trial: Trial, source: str, base_url: str) -> list[str]:
    """List the files of a trial: one BVH file, or the skeleton (ASF) and the motion (AMC)."""
    base, subject = base_url.rstrip("/"), f"{trial.subject:02d}"
    if source == "bvh":
        return [f"{base}/{trial.subject:03d}/{trial.clip}.bvh"]
    return [f"{base}/{subject}/{subject}.asf", f"{base}/{subject}/{trial.clip}.amc"]


def read_raw(paths: Sequence[Path]) -> Motion:
    """Read what was fetched of one trial: a BVH file, or an ASF and an AMC file.

    Raises
    ------
    ValueError
        If a file is not what its ending says.
    """
    if len(paths) == 1:
        return load_bvh(paths[0])
    from data_tools.asfamc import convert

    skeleton, motion = paths
    return convert(skeleton, motion)


def get_trial(
    trial: Trial, source: str, base_url: str, folder: ClipFolder, manners: Manners
) -> Prepared:
    """Fetch, read, prepare and keep one trial.

    Raises
    ------
    FetchError
        If a file cannot be fetched, or is not what it should be. Nothing of it is kept.
    """
    raw = []
    for url in trial_urls(trial, source, base_url):
        path = folder.raw / urlsplit(url).path.rsplit("/", 1)[-1]
        folder.checksums[path.name] = fetch(url, path, folder.checksums.get(path.name), manners)
        folder.save()
        raw.append(path)
    try:
        prepared = prepare(read_raw(raw), trial.action)
    except ValueError as error:
        for path in raw:  # next time it may be better; a wrong page must not be kept
            path.unlink()
            folder.checksums.pop(path.name)
        folder.save()
        raise FetchError(
            f"{trial.clip}: not a motion: {error}; run again to fetch it anew"
        ) from None
    folder.keep(trial, prepared)
    return prepared


def download(
    trials: Sequence[Trial], source: str, base_url: str, folder: ClipFolder, manners: Manners
) -> dict[str, str]:
    """Get all trials that the folder does not hold yet.

    Returns
    -------
    dict from clip to what went wrong with it; empty if all are there
    """
    failed: dict[str, str] = {}
    missing = [trial for trial in trials if not folder.holds(trial)]
    unreached, reached = 0, False
    with tqdm(missing, unit="clip", disable=None) as bar:
        for i, trial in enumerate(bar):
            bar.set_postfix_str(trial.clip)
            try:
                prepared = get_trial(trial, source, base_url, folder, manners)
            except OfflineError as error:
                failed[trial.clip] = str(error)
                unreached += 1
                if unreached == MAX_UNREACHED or not reached:
                    return failed | {t.clip: "not tried" for t in missing[i + 1 :]}
                continue
            except FetchError as error:
                failed[trial.clip] = str(error)
            else:
                for note in prepared.notes:
                    bar.write(f"{trial.clip}: {note}", file=sys.stdout)
            unreached, reached = 0, True
    return failed


def report(trials: Sequence[Trial], failed: dict[str, str], source: str, folder: Path) -> str:
    """Sum up: what is there, what is missing and why, and what to do next."""
    there = f"{len(trials) - len(failed)} of {len(trials)} clips are in {folder}"
    if not failed:
        return f'{there}; read them with load_dataset("cmu", "{folder}")'
    lines = [f"{clip}: {why}" for clip, why in failed.items() if why != "not tried"]
    if untried := list(failed.values()).count("not tried"):
        lines.append(f"{untried} further clips: not tried")
    lines += [there + "; the same command again fetches only what is missing"]
    if "not tried" in failed.values() or any(": not reached" in why for why in failed.values()):
        other = "asfamc" if source == "bvh" else "bvh"
        lines += [
            "The server cannot be reached. Is this computer online? If so, try the other source",
            f"(--source {other} --to another_folder), or do without recordings:",
            'load_dataset("embedded") needs no file and no network.',
        ]
    return "\n".join(lines)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line: 0 all clips are there, 1 some are not, 2 refused, 130 stopped."""
    options = _parser().parse_args(arguments)
    mix = {action: PAPER_MIX[action] for action in options.actions or PAPER_MIX}
    listed = load_catalogue()
    if options.all:
        mix = {action: sum(t.action == action for t in listed) for action in mix}
    if options.limit is not None:
        mix = {action: min(n, options.limit) for action, n in mix.items()}
    trials = choose(listed, mix)
    source, target = options.source, Path(options.to)
    pause_s = PAUSE_S[source] if options.pause is None else options.pause
    manners = Manners(pause_s=pause_s, wait_s=options.wait, timeout_s=options.timeout)
    try:
        folder = ClipFolder(target, source)
        try:
            failed = download(
                trials, source, options.base_url or BASE_URLS[source], folder, manners
            )
        finally:
            folder.write_list()
    except (ValueError, OSError, ImportError) as error:
        hint = "; install mocaplab[data] first" if isinstance(error, ImportError) else ""
        print(f"data_tools.download: error: {error}{hint}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("stopped; the same command goes on from here", file=sys.stderr)
        return 130
    print(report(trials, failed, source, target), file=sys.stderr if failed else sys.stdout)
    return 1 if failed else 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m data_tools.download",
        description=(__doc__ or "").splitlines()[0],
        epilog="\n".join((__doc__ or "").splitlines()[1:]),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add = parser.add_argument
    add("database", choices=["cmu"], help="the only one there is")
    add("--source", choices=list(BASE_URLS), default="bvh", help="default: %(default)s")
    add("--to", default="cmu", metavar="DIR", help="folder (default: %(default)s)")
    add("--actions", nargs="+", choices=list(PAPER_MIX), help="only these (default: all five)")
    add("--limit", type=_count, metavar="N", help="at most N clips of every action")
    add("--all", action="store_true", help="all that the catalogue lists, not only the mix")
    add("--base-url", type=_url, metavar="URL", help="another server with the same layout")
    add("--pause", type=_seconds, metavar="S", help="seconds between files (0.2; asfamc 1)")
    add("--wait", type=_seconds, default=2.0, metavar="S", help="before a second try (default: 2)")
    add("--timeout", type=_some_seconds, default=30.0, metavar="S", help="of silence (default: 30)")
    return parser


def _count(text: str) -> int:
    if not text.isdecimal() or int(text) == 0:
        raise argparse.ArgumentTypeError(f"must be a whole number above 0, got {text!r}")
    return int(text)


def _seconds(text: str) -> float:
    try:
        seconds = float(text)
    except ValueError:
        seconds = -1.0
    if not 0 <= seconds < 3600:
        raise argparse.ArgumentTypeError(f"must be seconds from 0 to 3600, got {text!r}")
    return seconds


def _some_seconds(text: str) -> float:
    if _seconds(text) == 0:
        raise argparse.ArgumentTypeError("must be above 0 seconds")
    return _seconds(text)


def _url(text: str) -> str:
    parts = urlsplit(text)
    if parts.scheme not in ("http", "https") or not parts.netloc:
        raise argparse.ArgumentTypeError(f"must begin with http:// or https://, got {text!r}")
    return text


if __name__ == "__main__":
    raise SystemExit(main())
