"""Euler angles of a stream, made continuous while they come in.

The rules are those of :mod:`mocaplab.euler`. Which branch a frame is in depends on frames
before it only, so a stream can follow it.
"""

from __future__ import annotations

import numpy as np

from mocaplab.euler import TREMBLING_DEG, alternate_euler, rotation_triples, wrap_degrees
from mocaplab.gap_fillers.curves import rest_values
from mocaplab.motion import BoolArray, FloatArray, Skeleton
from mocaplab.quaternions import (
    quaternion_inverse,
    quaternion_multiply,
    quaternion_to_rotation_vector,
)
from mocaplab.rotations import euler_to_quaternion

LEAST_LARGE_STEPS = 3
"""With fewer large steps no joint is said to tremble: the first frames may hold a switch."""


class ContinuousAngles:
    """Take frames as the file has them, give them without full turns and branch switches.

    Missing samples (NaN) hold the last value; a channel that was never seen is at rest. A joint
    with an angle that has stepped by more than ``TREMBLING_DEG`` in most frames so far is left as
    it comes (``LEAST_LARGE_STEPS`` at least); see :func:`mocaplab.euler.motion_continuity`.

    Parameters
    ----------
    skeleton : Skeleton
    """

    def __init__(self, skeleton: Skeleton):
        n_channels = skeleton.n_channels
        self.joint, self.is_rotation = skeleton.channel_joint, skeleton.is_rotation
        # The alternate triple of every joint at once: mirror * angles + half_turns.
        self.mirror, self.half_turns = np.ones(n_channels), np.zeros(n_channels)
        for _, columns, order in rotation_triples(skeleton):
            self.half_turns[columns] = alternate_euler(np.zeros(3), order)
            self.mirror[columns] = alternate_euler(np.ones(3), order) - self.half_turns[columns]
        self.n_steps = -1
        self.n_large_steps = np.zeros(n_channels)
        self.switched = np.zeros(n_channels, dtype=bool)
        self.turns = np.zeros(n_channels)
        self.raw = rest_values(skeleton)  # the last frame, gaps held
        self.continuous = self.raw  # the same made continuous

    def push(self, frame: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Follow one frame, shape (C,).

        Returns
        -------
        continuous, sign, offset : arrays, shape (C,)
            ``continuous = sign * frame + offset``; back it goes by ``sign * (continuous - offset)``
        """
        unseen = np.isnan(frame)
        raw = np.where(unseen, self.raw, frame)
        self.n_steps += 1
        if self.n_steps > 0:
            self._follow(raw, unseen)
        sign = np.where(self.switched, self.mirror, 1.0)
        offset = np.where(self.switched, self.half_turns, 0.0) + 360.0 * self.turns
        continuous = sign * raw + offset
        if self.n_steps > 0:
            continuous = np.where(unseen, self.continuous, continuous)
        self.raw, self.continuous = raw, continuous
        return continuous, sign, offset

    def _follow(self, raw: FloatArray, unseen: BoolArray) -> None:
        """Choose for each joint the branch, and for each angle the turns, nearest to the last."""
        other = self.mirror * raw + self.half_turns
        counts = self.is_rotation & ~unseen
        stay = np.where(counts, wrap_degrees(raw - self.continuous), 0.0)
        switch = np.where(counts, wrap_degrees(other - self.continuous), 0.0)
        nearer = self._of_joint(switch**2) < self._of_joint(stay**2)
        self.switched = np.where(self._of_joint(counts) > 0, nearer, self.switched)
        angles = np.where(self.switched, other, raw)
        turns = np.round((self.continuous - angles) / 360.0)
        self.turns = np.where(counts, turns, self.turns)
        self._leave_trembling(raw)

    def _leave_trembling(self, raw: FloatArray) -> None:
        steps = np.abs(wrap_degrees(raw - self.raw))
        self.n_large_steps += (steps > TREMBLING_DEG) & self.is_rotation
        usual = 2 * self.n_large_steps > self.n_steps
        left = self._of_joint(usual & (self.n_large_steps >= LEAST_LARGE_STEPS)) > 0
        self.switched = self.switched & ~left
        self.turns = np.where(left, 0.0, self.turns)

    def _of_joint(self, values: FloatArray | BoolArray) -> FloatArray:
        """Add up the values of each joint, and give every channel the sum of its joint."""
        return np.bincount(self.joint, weights=values).astype(np.float64)[self.joint]


class RootVelocity:
    """How fast the root turns, frame by frame.

    The same as :func:`mocaplab.measures.movement.root_angular_velocity`, one frame later: that one
    looks at the next frame, which a stream does not have yet. The first frame has 0.

    Parameters
    ----------
    skeleton : Skeleton
    frame_time : float, seconds
    """

    def __init__(self, skeleton: Skeleton, frame_time: float):
        columns = np.flatnonzero(skeleton.is_rotation & (skeleton.channel_joint == 0))
        self.columns, self.frame_time = columns, frame_time
        self.order = "".join(skeleton.channel_kind[c][0] for c in columns)
        self.last: FloatArray | None = None

    def push(self, frame: FloatArray) -> FloatArray:
        """Return the angular velocity up to this frame, shape (3,), radians per second."""
        if not self.order:
            return np.zeros(3)
        rotation = euler_to_quaternion(frame[self.columns], self.order)
        before = rotation if self.last is None else self.last
        self.last = rotation
        turn = quaternion_multiply(quaternion_inverse(before), rotation)
        return quaternion_to_rotation_vector(turn) / self.frame_time
