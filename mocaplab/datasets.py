"""Clips, named data sets, splits, and the batches that training draws from them."""

from __future__ import annotations

import csv
import hashlib
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mocaplab.bvh import load_bvh
from mocaplab.euler import make_continuous
from mocaplab.motion import Motion, Skeleton


@dataclass(frozen=True, eq=False)
class Dataset:
    """Clean clips of one skeleton and the action that each one shows.

    Parameters
    ----------
    name : str
    clips : tuple of Motion, continuous (no wraps, no branch switches)
    actions : tuple of str, one a clip, such as ``"walk"``
    """

    name: str
    clips: tuple[Motion, ...]
    actions: tuple[str, ...]

    def __post_init__(self) -> None:
        if not self.clips or len(self.clips) != len(self.actions):
            raise ValueError(
                f"data set {self.name!r} needs clips and one action for each, got "
                f"{len(self.clips)} clips and {len(self.actions)} actions"
            )
        names = [clip.name for clip in self.clips]
        if len(set(names)) < len(names):
            twice = next(name for name in names if names.count(name) > 1)
            raise ValueError(f"clips of a data set need different names, got {twice!r} twice")
        for clip in self.clips:
            if not clip.skeleton.same_as(self.skeleton):
                raise ValueError(
                    f"all clips of a data set must share one skeleton, but {clip.name!r} has "
                    f"other joints or channels than {self.clips[0].name!r}"
                )
            if abs(clip.frame_time / self.clips[0].frame_time - 1) > 1e-2:
                raise ValueError(
                    f"all clips of a data set must share one frame rate, but {clip.name!r} has "
                    f"{clip.fps:.4g} fps and {self.clips[0].name!r} has {self.clips[0].fps:.4g}"
                )

    def __len__(self) -> int:
        return len(self.clips)

    @property
    def skeleton(self) -> Skeleton:
        """The skeleton of the first clip; the others have the same joints and channels."""
        return self.clips[0].skeleton

    def __getitem__(self, name: str) -> Motion:
        """Return the clip of this name."""
        for clip in self.clips:
            if clip.name == name:
                return clip
        raise KeyError(f"no clip {name!r} in data set {self.name!r}")

    def select(self, indices: Sequence[int], name: str) -> Dataset:
        """Return some of the clips as a data set of its own."""
        return Dataset(
            name,
            tuple(self.clips[i] for i in indices),
            tuple(self.actions[i] for i in indices),
        )


def load_folder(folder: str | os.PathLike[str], name: str = "") -> Dataset:
    """Read all BVH files of a folder.

    A ``clips.csv`` with the columns clip and action says what each clip shows; without
    it, the file name does (``walk_03.bvh`` is a walk).

    Raises
    ------
    ValueError
        If there is no BVH file, a file is broken, or skeletons or frame rates differ.
    OSError
        If the folder cannot be read.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise NotADirectoryError(f"{folder} is not a folder")
    paths = sorted(p for p in folder.iterdir() if p.suffix.lower() == ".bvh" and p.is_file())
    if not paths:
        raise ValueError(f"no .bvh file in {folder}")
    actions = _read_actions(folder / "clips.csv")
    clips = tuple(make_continuous(load_bvh(path)) for path in paths)
    return Dataset(
        name or folder.name,
        clips,
        tuple(actions.get(clip.name, clip.name.rsplit("_", 1)[0]) for clip in clips),
    )


def _read_actions(path: Path) -> dict[str, str]:
    """Read which action each clip shows: clip name -> action."""
    if not path.exists():
        return {}
    try:
        with open(path, newline="", encoding="utf-8") as file:
            actions = {row["clip"]: row["action"] for row in csv.DictReader(file)}
    except (KeyError, UnicodeDecodeError, csv.Error):
        raise ValueError(f"{path}: expected UTF-8 text with the columns clip and action") from None
    if not all(actions.values()):
        raise ValueError(f"{path}: every clip needs an action")
    return actions


def load_dataset(name: str, path: str | os.PathLike[str] | None = None) -> Dataset:
    """Load a data set by name.

    Parameters
    ----------
    name : "embedded" or "cmu"
        "embedded" is drawn from the statistical motion model in the package: 100 clips
        in paper A's mix, no file needed. "cmu" reads real clips from ``path``.
    path : folder of BVH files, for "cmu"

    Returns
    -------
    Dataset
    """
    if name == "embedded":
        from mocaplab.synthesis import embedded_clips

        pairs = embedded_clips()
        return Dataset("embedded", tuple(m for m, _ in pairs), tuple(a for _, a in pairs))
    if name == "cmu":
        if path is None:
            raise ValueError('load_dataset("cmu", path) needs the folder of the BVH files')
        return load_folder(path, "cmu")
    raise ValueError(f"the data sets are 'embedded' and 'cmu', got {name!r}")


def clip_digest(clip: Motion) -> str:
    """Return twelve letters that tell this clip from any other, whatever its name."""
    return hashlib.sha256(clip.channels.tobytes()).hexdigest()[:12]


def split_holdout(
    dataset: Dataset, share: float = 0.14, *, seed: int = 0
) -> tuple[Dataset, Dataset]:
    """Keep a share of the clips of every action for testing.

    Parameters
    ----------
    dataset : Dataset
    share : float between 0 and 1; of each action at least one clip is held out, as
        long as one is left to train on
    seed : int

    Returns
    -------
    train, test : Dataset
    """
    if not 0 < share < 1:
        raise ValueError(f"the share held out must lie between 0 and 1, got {share}")
    rng = np.random.default_rng(seed)
    test: list[int] = []
    actions = dataset.actions
    if len(set(actions)) == len(actions):  # names tell no actions: all clips are one group
        actions = ("clip",) * len(actions)
    for action in sorted(set(actions)):
        of_action = [i for i, a in enumerate(actions) if a == action]
        n = min(max(1, round(share * len(of_action))), len(of_action) - 1)
        test += rng.permutation(of_action)[:n].tolist()
    train = sorted(set(range(len(dataset))) - set(test))
    if not test:
        raise ValueError("holding clips out for a test needs at least two clips, got one")
    return dataset.select(train, "train"), dataset.select(sorted(test), "test")
