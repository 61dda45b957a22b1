"""Which joint of a file is which joint of a model, where it is safe to say.

Files name the same joints in other orders, with prefixes, in other letters, and turn them
about the same axes in another order. All that is translated without a loss, and back. What
would change its meaning is refused: a joint in another place of the tree, another rest pose.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mocaplab.euler import align_euler, continuity
from mocaplab.gap_fillers.curves import rest_values
from mocaplab.motion import BoolArray, FloatArray, IntArray, Scalar, Skeleton
from mocaplab.rotations import euler_to_matrix, matrix_to_euler
from mocaplab.skeletons.rest_pose import ancestors, check_rest_poses

REST_TOLERANCE_DEG = 15.0
"""How far a bone may point from where the model's bone points at rest."""

EXTREMITY = re.compile("finger|thumb|index|middle|ring|pinky|little|toe|nub|end$")
"""Names of joints that a file may lack; the rest of the body hardly depends on them."""

_BLOCK = 4096  # frames converted at once, to need little memory


@dataclass(frozen=True, eq=False)
class SkeletonMatch:
    """The joints that a file and a model have in common; see :func:`match_skeletons`.

    Parameters
    ----------
    file, model : Skeleton
    pairs : dict from joints of the file to joints of the model
    copied : array, shape (n, 2)
        Channels that mean the same: column of the file, column of the model.
    turned : list of (columns of the file, their order, columns of the model, their order)
        Joints with three rotations in different orders.
    """

    file: Skeleton
    model: Skeleton
    pairs: dict[int, int]
    copied: IntArray
    turned: list[tuple[list[int], str, list[int], str]]

    @property
    def is_identity(self) -> bool:
        """Whether both have the same channels in the same order."""
        return self.file.channel_labels == self.model.channel_labels

    @property
    def known(self) -> BoolArray:
        """The file's channels that the model has too, shape (C of the file,)."""
        known = np.zeros(self.file.n_channels, dtype=bool)
        known[self.copied[:, 0]] = True
        for columns, *_ in self.turned:
            known[columns] = True
        return known

    @property
    def unknown_joints(self) -> list[str]:
        """Joints of the file that turn and that the model does not have."""
        lost = self.file.is_cleaned & ~self.known
        return [self.file.joint_names[j] for j in np.unique(self.file.channel_joint[lost])]

    @property
    def missing_joints(self) -> list[str]:
        """Joints of the model that the file does not have."""
        there = set(self.pairs.values())
        return [name for j, name in enumerate(self.model.joint_names) if j not in there]

    def to_model(self, channels: FloatArray) -> FloatArray:
        """Translate the file's channels into the model's.

        Parameters
        ----------
        channels : array, shape (T, C of the file), continuous, without NaN

        Returns
        -------
        array, shape (T, C of the model), continuous; joints that the file lacks are at rest
        """
        if self.is_identity:
            return channels
        result = np.tile(rest_values(self.model), (len(channels), 1))
        result[:, self.copied[:, 1]] = channels[:, self.copied[:, 0]]
        for here, order, there, other_order in self.turned:
            angles = _convert(channels[:, here], order, other_order)
            sign, offset = continuity(angles, other_order)
            result[:, there] = sign * angles + offset
        return result

    def to_file(self, channels: FloatArray, reference: FloatArray) -> FloatArray:
        """Translate the model's channels back into the file's.

        Parameters
        ----------
        channels : array, shape (T, C of the model)
        reference : array, shape (T, C of the file)
            What is nowhere in the model is taken from here, and of the Euler triples of a
            rotation the one that is nearest to it.

        Returns
        -------
        array, shape (T, C of the file)
        """
        if self.is_identity:
            return channels
        result = reference.copy()
        result[:, self.copied[:, 0]] = channels[:, self.copied[:, 1]]
        for here, order, there, other_order in self.turned:
            angles = _convert(channels[:, there], other_order, order)
            result[:, here] = align_euler(angles, reference[:, here], order)
        return result

    def spread(self, of_file: NDArray[Scalar]) -> NDArray[Scalar]:
        """Tell of each channel of the model what is told of those of the file, such as a gap.

        Parameters
        ----------
        of_file : array, shape (T, C of the file)

        Returns
        -------
        array, shape (T, C of the model)
            The largest of its three for a joint whose angles were converted.
        """
        return self._spread(of_file, self.model.n_channels, here=0, there=1)

    def spread_back(self, of_model: NDArray[Scalar]) -> NDArray[Scalar]:
        """Do what :meth:`spread` does, from the model to the file."""
        return self._spread(of_model, self.file.n_channels, here=1, there=0)

    def _spread(
        self, values: NDArray[Scalar], n_channels: int, here: int, there: int
    ) -> NDArray[Scalar]:
        if self.is_identity:
            return values
        result: NDArray[Scalar] = np.zeros((len(values), n_channels), dtype=values.dtype)
        result[:, self.copied[:, there]] = values[:, self.copied[:, here]]
        for file_columns, _, model_columns, _ in self.turned:
            columns = (file_columns, model_columns)
            result[:, columns[there]] = values[:, columns[here]].max(axis=1, keepdims=True)
        return result

    def describe(self) -> list[str]:
        """Say in plain lines what was matched with what; nothing for equal skeletons."""
        if self.is_identity:
            return []
        named = [
            f"{self.file.joint_names[f]} = {self.model.joint_names[m]}"
            for f, m in self.pairs.items()
            if self.file.joint_names[f] != self.model.joint_names[m]
        ]
        lines = [f"{len(self.pairs)} joints are matched by name with those of the model"]
        if named:
            lines.append("names: " + ", ".join(named))
        if self.turned:
            orders = sorted({f"{order} -> {other}" for _, order, _, other in self.turned})
            lines.append(f"{len(self.turned)} joints are converted: {', '.join(orders)}")
        if self.missing_joints:
            lines.append("not in the file: " + ", ".join(self.missing_joints))
        if self.unknown_joints:
            names = ", ".join(self.unknown_joints)
            lines.append(f"unknown to the model, smoothed with one Gaussian: {names}")
        return lines


def _convert(angles: FloatArray, order: str, other_order: str) -> FloatArray:
    """Tell the same rotations in another Euler order, shape (T, 3)."""
    result = np.empty_like(angles)
    for start in range(0, len(angles), _BLOCK):
        block = slice(start, start + _BLOCK)
        result[block] = matrix_to_euler(euler_to_matrix(angles[block], order), other_order)
    return result


def match_skeletons(file: Skeleton, model: Skeleton, constant: BoolArray) -> SkeletonMatch:
    """Match the joints of a file with those that a model knows, by their names.

    Case, blanks, and prefixes such as ``mixamorig:`` and ``Character1_`` do not count. The file
    may have more joints at the ends of limbs, may lack fingers, toes and joints that never move,
    and may have the channels of a joint in another order.

    Parameters
    ----------
    file, model : Skeleton
    constant : array, shape (C of the model,), bool
        Channels that never moved when the model was trained.

    Raises
    ------
    ValueError
        If something else is different; it says what.
    """
    if file.channel_labels == model.channel_labels:
        everything = np.tile(np.arange(file.n_channels)[:, None], (1, 2))
        return SkeletonMatch(file, model, {j: j for j in range(file.n_joints)}, everything, [])
    names = _plain_names(model)
    pairs = {joint: names[name] for name, joint in _plain_names(file).items() if name in names}
    pairs = dict(sorted(pairs.items()))
    _check_missing(file, model, pairs, constant)
    _check_tree(file, model, pairs)
    check_rest_poses(file, model, {m: f for f, m in pairs.items()}, REST_TOLERANCE_DEG)
    copied, turned = [], []
    for here, there in pairs.items():
        ours, theirs = _channels(file, here), _channels(model, there)
        copied += [(ours[k], theirs[k]) for k in ours if k in theirs and "position" in k]
        turns, their_turns = ([k for k in c if "rotation" in k] for c in (ours, theirs))
        order, other_order = ("".join(k[0] for k in t) for t in (turns, their_turns))
        if order == other_order or (len(order) == 1 and order in other_order):
            copied += [(ours[k], theirs[k]) for k in turns]
        elif len(order) == len(other_order) == 3:
            columns = [ours[k] for k in turns], [theirs[k] for k in their_turns]
            turned.append((columns[0], order, columns[1], other_order))
    return SkeletonMatch(file, model, pairs, np.array(copied, dtype=np.int64), turned)


def _plain_names(skeleton: Skeleton) -> dict[str, int]:
    """Return the joint of each name without prefix, in small letters; ambiguous ones left out."""
    names = [name.rsplit(":", 1)[-1] for name in skeleton.joint_names]
    prefix = names[0][: names[0].find("_") + 1]  # Character1_Hips, Character1_Spine, ...
    shared = len(prefix) if all(name.startswith(prefix) for name in names) else 0
    plain = [re.sub("[^a-z0-9]", "", name[shared:].lower()) for name in names]
    return {name: joint for joint, name in enumerate(plain) if plain.count(name) == 1}


def _channels(skeleton: Skeleton, joint: int) -> dict[str, int]:
    """Return the column of each channel of a joint, in file order."""
    first = int(np.searchsorted(skeleton.channel_joint, joint))
    return {kind: first + i for i, kind in enumerate(skeleton.channel_names[joint])}


def _check_missing(
    file: Skeleton, model: Skeleton, pairs: dict[int, int], constant: BoolArray
) -> None:
    """Refuse a file that lacks a joint on which others depend."""
    if pairs.get(0) != 0:
        raise ValueError(
            f"its root is {file.joint_names[0]}, that of the model {model.joint_names[0]}"
        )
    moved = set(model.channel_joint[~constant & model.is_cleaned].tolist())
    followed = {a for m in pairs.values() for a in ancestors(model, m)}  # something hangs on it
    lost = [
        name
        for joint, name in enumerate(model.joint_names)
        if joint in moved - set(pairs.values())
        and (joint in followed or not EXTREMITY.search(name.lower()))
    ]
    if lost:
        more = f" and {len(lost) - 4} more" if len(lost) > 4 else ""
        raise ValueError(f"it has no joint {', '.join(lost[:4])}{more}")


def _check_tree(file: Skeleton, model: Skeleton, pairs: dict[int, int]) -> None:
    """Refuse a file whose joints hang on other joints than in the model."""
    for here, there in pairs.items():
        chain, model_chain = ancestors(file, here)[1:], ancestors(model, there)[1:]
        above = next((joint for joint in chain if joint in pairs), None)
        expected = next((joint for joint in model_chain if joint in pairs.values()), None)
        name = file.joint_names[here]
        if (None if above is None else pairs[above]) != expected:
            raise ValueError(
                f"its {name} hangs on {file.joint_names[chain[0]]}, that of the model on "
                f"{model.joint_names[model_chain[0]]}"
            )
        between = chain[: chain.index(above)] if above is not None else []
        between = [joint for joint in between if file.is_cleaned[file.channel_joint == joint].any()]
        if between:
            raise ValueError(
                f"it has {file.joint_names[between[0]]} between {file.joint_names[chain[-1]]} and "
                f"{name}, which the model does not know"
            )
