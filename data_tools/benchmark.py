"""Write the corrupted benchmark that paper A promised: every clip, noisy and with gaps.

    python -m data_tools.benchmark embedded -o benchmark
    python -m data_tools.benchmark cmu -o benchmark --repetitions 5 --seed 0
    python -m data_tools.benchmark embedded -o benchmark --only noise_0.5 gaps
    python -m data_tools.benchmark --verify benchmark cmu

The folder holds one ``CORRUPTION/CLIP_rN.npz`` for every clip, corruption and repetition,
with ``observed`` (T, C, degrees and file units, NaN in gaps) and ``mask`` (T, C, True =
observed), and ``manifest.json``: parameters, seeds, versions, a digest of every clean clip
and the SHA-256 of every file. Clean clips are named there and not copied. An interrupted
run goes on where it stopped when the same command is given again. What a clip cannot have,
such as a gap longer than itself, is left out, and the manifest says why. The embedded
clips take some 0.1 GB for each corruption. Spatial noise takes seconds for each file, hours
for all; --only writes some of the corruptions.

The noise of a file depends on the seed, the clip's digest, the corruption's name and the
repetition, and on nothing else: further clips or corruptions leave it as it is. The same
seed gives the same bytes with the same versions of numpy and mocaplab.
"""

from __future__ import annotations

import argparse
import json
import platform
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

from data_tools.corruptions import MANIFEST, RECIPES, corrupted_to_bytes, read_manifest
from data_tools.fetching import sha256
from mocaplab import __version__
from mocaplab.corruption import corrupt, snr_db
from mocaplab.datasets import Dataset, clip_digest, load_dataset
from mocaplab.files import write_atomically
from mocaplab.motion import Motion
from mocaplab.noise.draws import draw_seed
from mocaplab.noise.gaps import hidden_share

FORMAT = 2
ONLY = f"corruptions to write, of {', '.join(RECIPES)} (default: all)"
DTYPES = ("float32", "float64")


def settings(
    dataset: Dataset, seed: int, repetitions: int, dtype: str, names: Sequence[str]
) -> dict[str, Any]:
    """Describe a benchmark: everything that its files depend on."""
    return {
        "format": FORMAT,
        "seed": seed,
        "repetitions": repetitions,
        "dtype": dtype,
        "versions": {
            "mocaplab": __version__,
            "numpy": np.__version__,
            "python": ".".join(platform.python_version_tuple()[:2]),
        },
        "corruptions": {name: RECIPES[name] for name in names},
        "channels": list(dataset.skeleton.channel_labels),
        "clips": {
            clip.name: {
                "digest": clip_digest(clip),
                "action": action,
                "frames": clip.n_frames,
                "frame_time_s": clip.frame_time,
            }
            for clip, action in zip(dataset.clips, dataset.actions, strict=True)
        },
    }


def jobs(
    dataset: Dataset, repetitions: int, names: Sequence[str]
) -> Iterator[tuple[Motion, str, int, str]]:
    """List what to write: clip, corruption, repetition and the file's path in the folder."""
    for name in names:
        for clip in dataset.clips:
            for repetition in range(repetitions):
                yield clip, name, repetition, f"{name}/{clip.name}_r{repetition}.npz"


def write_benchmark(
    dataset: Dataset,
    folder: Path,
    *,
    seed: int,
    repetitions: int = 5,
    dtype: str = "float32",
    names: Sequence[str] = tuple(RECIPES),
) -> dict[str, Any]:
    """Write the benchmark of a data set, or what is missing of it.

    Returns
    -------
    dict, the manifest

    Raises
    ------
    ValueError
        If the folder holds a benchmark with other settings, or repetitions is below 1.
    """
    if repetitions < 1 or seed < 0 or dtype not in DTYPES:
        raise ValueError(
            f"expected at least one repetition, a seed of 0 or more and a dtype of "
            f"{' or '.join(DTYPES)}, got {repetitions}, {seed} and {dtype}"
        )
    manifest = settings(dataset, seed, repetitions, dtype, names)
    known = _known_files(folder, manifest)
    for name in names:
        (folder / name).mkdir(parents=True, exist_ok=True)
    todo = list(jobs(dataset, repetitions, names))
    files = {path: known[path] for *_, path in todo if path in known}  # by path
    left_out: dict[str, str] = {}  # path -> reason
    try:
        for clip, name, repetition, path in tqdm(todo, unit="file", disable=None):
            if path in files and _sha256(folder / path) == files[path]["sha256"]:
                continue
            entropy = draw_seed(seed, manifest["clips"][clip.name]["digest"], name, repetition)
            try:
                corrupted = corrupt(clip, RECIPES[name], rng=np.random.default_rng(entropy))
            except ValueError as error:
                left_out[path] = str(error)
                continue
            write_atomically(folder / path, corrupted_to_bytes(corrupted, dtype))
            files[path] = {
                "clip": clip.name,
                "corruption": name,
                "repetition": repetition,
                "rng": entropy,
                "hidden_share": round(hidden_share(corrupted.observed), 6),
                "snr_db": _finite(snr_db(corrupted)),
                "sha256": _sha256(folder / path),
            }
    finally:  # an interrupted run leaves a manifest of what it wrote
        complete = len(files) + len(left_out) == len(todo)
        manifest |= {"complete": complete, "files": files, "left_out": left_out}
        write_atomically(folder / MANIFEST, json.dumps(manifest, indent=1) + "\n")
    return manifest


def _finite(decibels: float) -> float | None:
    """Round for the manifest; None without any noise, because JSON knows no infinity."""
    return round(decibels, 3) if np.isfinite(decibels) else None


def _known_files(folder: Path, manifest: dict[str, Any]) -> dict[str, Any]:
    """Read what an earlier run wrote, and refuse one with other settings."""
    if not (folder / MANIFEST).exists():
        return {}
    there = read_manifest(folder)
    differ = [key for key in manifest if there.get(key) != manifest[key]]
    if differ:
        raise ValueError(
            f"{folder} holds a benchmark that differs in {', '.join(differ)}; choose another "
            f"folder, or take this one away"
        )
    files: dict[str, Any] = there["files"]
    return files


def _sha256(path: Path) -> str | None:
    """Return the SHA-256 of a file, None if there is no file."""
    return sha256(path) if path.is_file() else None


def verify(folder: Path, dataset: Dataset | None = None) -> list[str]:
    """Compare every file with the manifest, and the clean clips if they are given.

    Returns
    -------
    list of str, one for everything that is wrong
    """
    manifest = read_manifest(folder)
    whole = manifest.get("complete") and manifest["files"]
    wrong = [] if whole else ["not complete: give the same command again"]
    for path, file in manifest["files"].items():
        digest = _sha256(folder / path)
        if digest != file["sha256"]:
            wrong.append(f"{path}: expected SHA-256 {file['sha256']}, got {digest or 'no file'}")
    found = {p.relative_to(folder).as_posix() for p in folder.glob("*/*.npz")}
    wrong += [f"{path}: not in the manifest" for path in sorted(found - set(manifest["files"]))]
    if dataset is not None:
        digests = {clip.name: clip_digest(clip) for clip in dataset.clips}
        for name, clip in manifest["clips"].items():
            if digests.get(name) != clip["digest"]:
                wrong.append(f"clip {name}: expected {clip['digest']}, got {digests.get(name)}")
    return wrong


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line: 0 done, 1 a check failed, 2 refused, 130 stopped."""
    parser = argparse.ArgumentParser(
        prog="python -m data_tools.benchmark", description=(__doc__ or "").splitlines()[0]
    )
    add = parser.add_argument
    add("source", nargs="?", help="embedded, or a folder of clean BVH files")
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument("-o", "--output", type=Path, metavar="OUT", help="folder to write to")
    what.add_argument("--verify", type=Path, metavar="OUT", help="check a folder")
    add("--only", nargs="+", choices=RECIPES, default=list(RECIPES), metavar="NAME", help=ONLY)
    add("--repetitions", type=int, default=5, help="default: 5")
    add("--seed", type=int, default=0, help="default: 0")
    add("--dtype", choices=DTYPES, default="float32", help="default: float32")
    options = parser.parse_args(arguments)
    if options.output and not options.source:
        parser.error("say which clips: embedded, or a folder of clean BVH files")
    try:
        return _run(options)
    except (ValueError, OSError) as error:
        print(f"data_tools.benchmark: error: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("stopped; the same command goes on from here", file=sys.stderr)
        return 130


def _load(source: str) -> Dataset:
    return load_dataset("embedded") if source == "embedded" else load_dataset("cmu", source)


def _run(options: argparse.Namespace) -> int:
    dataset = _load(options.source) if options.source else None
    if options.verify or dataset is None:
        wrong = verify(options.verify, dataset)
        print("\n".join(wrong) or f"{options.verify}: every file is as it was written")
        return 1 if wrong else 0
    manifest = write_benchmark(
        dataset,
        options.output,
        seed=options.seed,
        repetitions=options.repetitions,
        dtype=options.dtype,
        names=options.only,
    )
    for name in options.only:
        shares = [f["hidden_share"] for f in manifest["files"].values() if f["corruption"] == name]
        print(f"{name:20} {len(shares)} files, {sum(shares) / max(len(shares), 1):.2%} hidden")
    for path, reason in manifest["left_out"].items():
        print(f"left out {path}: {reason}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
