"""The three types that flow through the library: Skeleton, Motion, Corrupted.

All are frozen and their arrays are read-only: a function that changes a motion
returns a new one. Letters in shapes: T frames, J joints, C channels, E end sites.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from difflib import get_close_matches
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int64]
Scalar = TypeVar("Scalar", bound=np.generic)

CHANNEL_NAMES = (
    "Xposition",
    "Yposition",
    "Zposition",
    "Xrotation",
    "Yrotation",
    "Zrotation",
)
CONSTANT_STD_DEG = 1e-3
"""A channel that varies less than this is constant; files carry 1e-7 of jitter."""


def _frozen(values: ArrayLike, dtype: type[Scalar]) -> NDArray[Scalar]:
    """Return a read-only array: a copy, unless the array is already read-only for everybody."""
    if isinstance(values, np.ndarray) and values.dtype == dtype:
        owned = values.base is None and values.flags.c_contiguous
        if owned and not values.flags.writeable:
            return values
    array: NDArray[Scalar] = np.array(values, dtype=dtype)
    array.flags.writeable = False
    return array


@dataclass(frozen=True, eq=False)
class Skeleton:
    """A tree of joints and the channels that move it, as the file lists them.

    Parameters
    ----------
    joint_names : tuple of str, length J
        Unique names, every parent before its children.
    parents : array, shape (J,)
        Index of each joint's parent; -1 for the root, which is joint 0.
    offsets : array, shape (J, 3), file length units
        Position of each joint relative to its parent when nothing is rotated.
    channel_names : tuple of J tuples of str
        The channels of each joint, in file order, such as ``"Zrotation"``.
    end_site_parents : array, shape (E,)
        The joint that each End Site hangs on.
    end_site_offsets : array, shape (E, 3), file length units

    Raises
    ------
    ValueError
        If shapes disagree, a name comes twice, a parent follows its child, an offset
        is not finite, there is no channel, or one that is not in ``CHANNEL_NAMES``.
    """

    joint_names: tuple[str, ...]
    parents: IntArray
    offsets: FloatArray
    channel_names: tuple[tuple[str, ...], ...]
    end_site_parents: IntArray
    end_site_offsets: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "joint_names", tuple(self.joint_names))
        object.__setattr__(self, "channel_names", tuple(map(tuple, self.channel_names)))
        for field in ("parents", "end_site_parents"):
            object.__setattr__(self, field, _frozen(getattr(self, field), np.int64))
        for field in ("offsets", "end_site_offsets"):
            object.__setattr__(self, field, _frozen(getattr(self, field), np.float64))
        n = len(self.joint_names)
        if n == 0:
            raise ValueError("a skeleton needs at least one joint")
        if len(set(self.joint_names)) != n:
            twice = next(name for name in self.joint_names if self.joint_names.count(name) > 1)
            raise ValueError(f"joint names must be unique, got {twice!r} more than once")
        if self.parents.shape != (n,) or self.offsets.shape != (n, 3):
            raise ValueError(
                f"{n} joints need parents of shape ({n},) and offsets of shape ({n}, 3), "
                f"got {self.parents.shape} and {self.offsets.shape}"
            )
        if self.parents[0] != -1 or not np.all(
            (self.parents[1:] >= 0) & (self.parents[1:] < np.arange(1, n))
        ):
            raise ValueError("joint 0 must be the root (parent -1) and parents precede children")
        e = self.end_site_parents.size
        if self.end_site_parents.shape != (e,) or self.end_site_offsets.shape != (e, 3):
            raise ValueError(
                f"{e} end sites need parents of shape ({e},) and offsets of shape ({e}, 3), "
                f"got {self.end_site_parents.shape} and {self.end_site_offsets.shape}"
            )
        if not (np.isfinite(self.offsets).all() and np.isfinite(self.end_site_offsets).all()):
            raise ValueError("offsets must be finite numbers")
        if not np.all((self.end_site_parents >= 0) & (self.end_site_parents < n)):
            raise ValueError(f"end_site_parents must lie between 0 and {n - 1}")
        if len(self.channel_names) != n:
            raise ValueError(f"channel_names must list {n} joints, got {len(self.channel_names)}")
        for name, channels in zip(self.joint_names, self.channel_names, strict=True):
            unknown = [c for c in channels if c not in CHANNEL_NAMES]
            if unknown or len(set(channels)) != len(channels):
                raise ValueError(f"joint {name!r} has unknown or repeated channels: {channels}")
        if not any(self.channel_names):
            raise ValueError("a skeleton needs at least one channel")

    @property
    def n_joints(self) -> int:
        """Number of joints J, End Sites not counted."""
        return len(self.joint_names)

    @property
    def n_channels(self) -> int:
        """Number of channels C, which is the width of a motion's frame."""
        return len(self.channel_joint)

    @cached_property
    def channel_joint(self) -> IntArray:
        """The joint of every channel, shape (C,)."""
        counts = [len(channels) for channels in self.channel_names]
        return _frozen(np.repeat(np.arange(self.n_joints), counts), np.int64)

    @cached_property
    def channel_kind(self) -> tuple[str, ...]:
        """The kind of every channel, such as ``"Zrotation"``, length C."""
        return tuple(kind for channels in self.channel_names for kind in channels)

    @cached_property
    def channel_labels(self) -> tuple[str, ...]:
        """A name for every channel, such as ``"LeftLeg.Xrotation"``, length C."""
        return tuple(
            f"{self.joint_names[j]}.{kind}"
            for j, kind in zip(self.channel_joint, self.channel_kind, strict=True)
        )

    @cached_property
    def is_rotation(self) -> BoolArray:
        """True for the channels that hold an angle, shape (C,)."""
        return _frozen([kind.endswith("rotation") for kind in self.channel_kind], np.bool_)

    @cached_property
    def is_cleaned(self) -> BoolArray:
        """True for the channels that noise and cleaning touch, shape (C,).

        These are the angles of every joint but the root: both the root's path and
        its heading are assumed clean (paper A, section 4).
        """
        return _frozen(self.is_rotation & (self.channel_joint > 0), np.bool_)

    def channel_index(self, label: str) -> int:
        """Return the index of a channel such as ``"LeftLeg.Xrotation"``.

        Raises
        ------
        ValueError
            If there is no such channel; the message names the nearest ones.
        """
        if label in self.channel_labels:
            return self.channel_labels.index(label)
        near = get_close_matches(label, self.channel_labels, cutoff=0.0)
        raise ValueError(f"no channel {label!r}; the nearest names are {', '.join(near)}")

    def same_as(self, other: Skeleton) -> bool:
        """Tell whether joints, parents and channels agree (bone lengths may differ)."""
        return (
            self.joint_names == other.joint_names
            and self.channel_names == other.channel_names
            and np.array_equal(self.parents, other.parents)
        )


@dataclass(frozen=True, eq=False)
class Motion:
    """A skeleton and its channels over time, exactly as the file says.

    Parameters
    ----------
    skeleton : Skeleton
    frame_time : float, seconds
    channels : array, shape (T, C), float64
        Degrees for rotations, file length units for positions, in file channel
        order. NaN marks a sample that was not observed; infinity is refused.
    name : str
        A name for titles and messages; a file's name without its ending.

    Raises
    ------
    ValueError
        If the shape does not fit the skeleton, there is no frame, the frame time is
        not positive, or a value is infinite.
    """

    skeleton: Skeleton
    frame_time: float
    channels: FloatArray
    name: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "channels", _frozen(self.channels, np.float64))
        object.__setattr__(self, "frame_time", float(self.frame_time))
        expected = f"(T, {self.skeleton.n_channels}) with T > 0"
        shape = self.channels.shape
        if len(shape) != 2 or shape[1] != self.skeleton.n_channels or shape[0] == 0:
            raise ValueError(f"motion {self.name!r}: channels must be {expected}, got {shape}")
        if not 1e-9 <= self.frame_time < np.inf:
            raise ValueError(
                f"motion {self.name!r}: frame time must be positive, got {self.frame_time}"
            )
        if np.isinf(self.channels).any():
            frame, channel = np.argwhere(np.isinf(self.channels))[0]
            raise ValueError(
                f"motion {self.name!r}: {self.skeleton.channel_labels[channel]} is infinite "
                f"in frame {frame}"
            )

    @property
    def n_frames(self) -> int:
        """Number of frames T."""
        return len(self.channels)

    @property
    def fps(self) -> float:
        """Frames per second."""
        return 1.0 / self.frame_time

    @property
    def duration_s(self) -> float:
        """Time from the first frame to the last, in seconds."""
        return (self.n_frames - 1) * self.frame_time

    @property
    def time_s(self) -> FloatArray:
        """The time of every frame, shape (T,), seconds."""
        return np.arange(self.n_frames, dtype=np.float64) * self.frame_time

    def channel(self, label: str) -> FloatArray:
        """Return one channel over time, shape (T,), such as ``"LeftLeg.Xrotation"``."""
        return self.channels[:, self.skeleton.channel_index(label)]

    def with_channels(self, channels: ArrayLike) -> Motion:
        """Return the same motion with other values, shape (T, C)."""
        return replace(self, channels=np.asarray(channels, dtype=np.float64))

    def slice_frames(self, start: int, stop: int) -> Motion:
        """Return the frames from start up to, not including, stop."""
        return replace(self, channels=self.channels[start:stop])


@dataclass(frozen=True, eq=False)
class Corrupted:
    """A clean motion and what a bad capture of it would have recorded.

    Parameters
    ----------
    clean : Motion
    observed : Motion
        The same clip with noise; NaN where a sample is hidden.
    mask : array, shape (T, C), bool
        True where a sample was observed, False inside a gap.

    Raises
    ------
    ValueError
        If shapes differ, or the mask and the NaNs of ``observed`` disagree.
    """

    clean: Motion
    observed: Motion
    mask: BoolArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "mask", _frozen(self.mask, np.bool_))
        shapes = self.clean.channels.shape, self.observed.channels.shape, self.mask.shape
        if len(set(shapes)) != 1:
            raise ValueError(f"clean, observed and mask must have one shape, got {shapes}")
        disagree = np.isnan(self.observed.channels) == self.mask
        if disagree.any():
            frame, channel = np.argwhere(disagree)[0]
            label = self.clean.skeleton.channel_labels[channel]
            raise ValueError(f"mask and NaN disagree at frame {frame}, channel {label}")


def moving_channels(motion: Motion) -> BoolArray:
    """Tell which of the cleaned channels move at all, shape (C,).

    A channel moves if its standard deviation over the clip is at least
    ``CONSTANT_STD_DEG``. Fingers and collars of many files do not.
    """
    values = motion.channels
    observed = ~np.isnan(values)
    count = np.maximum(observed.sum(axis=0), 1)
    mean = np.where(observed, values, 0.0).sum(axis=0) / count
    variance = np.where(observed, (values - mean) ** 2, 0.0).sum(axis=0) / count
    moving: BoolArray = np.sqrt(variance) >= CONSTANT_STD_DEG
    return moving & motion.skeleton.is_cleaned
