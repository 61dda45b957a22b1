"""Clips, named data sets, splits, and the batches that training draws from them."""

from __future__ import annotations

import csv
import hashlib
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mocaplab.bvh import load_bvh
from mocaplab.euler import make_continuous
from mocaplab.motion import FloatArray, IntArray, Motion, Skeleton, moving_channels
from mocaplab.movement import root_angular_velocity


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


@dataclass(frozen=True, eq=False)
class Batch:
    """Equally long pieces of several clips. B pieces, T frames, C channels."""

    observed: FloatArray  # (B, T, C), degrees, with noise
    clean: FloatArray  # (B, T, C), degrees
    mean: FloatArray  # (B, 1, C), degrees, of the whole clip that each piece is from
    std: FloatArray  # (B, 1, C), degrees, of that whole clip with its noise
    root_velocity: FloatArray  # (B, T, 3), radians per second
    weight: FloatArray  # (B, T): 1 for frames that the loss counts, 0 in margins


class Windows:
    """Draws training batches: noisy pieces of clean clips.

    A piece has a margin on each side in which the loss does not count, because there the
    filter and the LSTM see less than they would in a whole clip. Margins at a real end of
    a clip do count.

    Parameters
    ----------
    clips : list of Motion, continuous, without NaN
    n_frames : int, frames a piece, margins included
    margin : int, frames
    """

    def __init__(self, clips: Sequence[Motion], n_frames: int, margin: int):
        if n_frames <= 2 * margin:
            raise ValueError(f"a piece of {n_frames} frames is all margin ({margin} a side)")
        self.n_frames, self.margin = n_frames, margin
        self.channels, self.velocities, self.lengths = [], [], []
        for clip in clips:
            # A clip shorter than a piece is played back and forth until it is long enough.
            missing = ((0, max(0, n_frames - clip.n_frames)), (0, 0))
            self.channels.append(np.pad(clip.channels, missing, mode="symmetric"))
            played = clip.with_channels(self.channels[-1])
            self.velocities.append(root_angular_velocity(played))
            self.lengths.append(len(self.channels[-1]))
        self.means = [clip.channels.mean(axis=0) for clip in clips]
        self.scales = [clip.channels.std(axis=0) * moving_channels(clip) for clip in clips]

    def batches(
        self,
        n_pieces: int,
        k_range: tuple[float, float],
        speed_range: tuple[float, float] = (1.0, 1.0),
        *,
        rng: np.random.Generator,
    ) -> Iterator[Batch]:
        """Yield one epoch: as many pieces as it takes to see every frame once on average.

        Parameters
        ----------
        n_pieces : int, pieces a batch
        k_range : (low, high); the noise amount of each piece is uniform between them
        speed_range : (low, high); each piece is played faster or slower by a factor between
            them, so that the network meets speeds that nobody recorded
        rng : numpy.random.Generator
        """
        n_counted = self.n_frames - 2 * self.margin
        n_batches = max(1, round(sum(self.lengths) / (n_counted * n_pieces)))
        share = np.array(self.lengths) / sum(self.lengths)
        for _ in range(n_batches):
            which = rng.choice(len(share), n_pieces, p=share)
            speeds = np.exp(rng.uniform(np.log(speed_range[0]), np.log(speed_range[1]), n_pieces))
            yield self._batch(which, speeds, k_range, rng)

    def _batch(
        self,
        which: IntArray,
        speeds: FloatArray,
        k_range: tuple[float, float],
        rng: np.random.Generator,
    ) -> Batch:
        steps = self.n_frames - 1
        final = np.array([self.lengths[i] - 1 for i in which])
        speeds = np.minimum(speeds, final / steps)  # no faster than the clip is long
        last = final - speeds * steps
        # Reaching beyond the ends by a margin, so that the ends come up often enough.
        starts = np.clip(rng.uniform(-self.margin, last + self.margin), 0, last)
        starts = np.where(speeds == 1, starts.round(), starts)  # then no interpolation
        pieces = [
            self._piece(i, start + speed * np.arange(self.n_frames), speed)
            for i, start, speed in zip(which, starts, speeds, strict=True)
        ]
        clean = np.stack([channels for channels, _ in pieces])
        k = rng.uniform(*k_range, size=(len(which), 1, 1))
        scale = np.stack([self.scales[i] for i in which])[:, None]
        weight = np.ones((len(which), self.n_frames))
        weight[starts > 0, : self.margin] = 0
        weight[starts < last, -self.margin :] = 0
        return Batch(
            observed=clean + rng.normal(size=clean.shape) * k * scale,
            clean=clean,
            mean=np.stack([self.means[i] for i in which])[:, None],
            std=scale * np.sqrt(1 + k**2),
            root_velocity=np.stack([velocity for _, velocity in pieces]),
            weight=weight,
        )

    def _piece(self, clip: int, frames: FloatArray, speed: float) -> tuple[FloatArray, FloatArray]:
        """Read a clip at frames that may lie between its own."""
        before = np.minimum(frames.astype(int), self.lengths[clip] - 1)
        after = np.minimum(before + 1, self.lengths[clip] - 1)
        part = (frames - before)[:, None]
        channels, velocity = self.channels[clip], self.velocities[clip]
        return (
            (1 - part) * channels[before] + part * channels[after],
            speed * ((1 - part) * velocity[before] + part * velocity[after]),
        )
