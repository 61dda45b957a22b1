"""Spatial noise: errors of joint positions, in centimetres (paper A, section 4).

It stands for markers that are found in the wrong place. Noise on positions alone would
stretch the bones, so angles are sought that come nearest to the noisy positions
(:mod:`mocaplab.inverse_kinematics`): the bones keep their lengths.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from mocaplab.inverse_kinematics import descendants, solve_angles
from mocaplab.kinematics import forward_kinematics
from mocaplab.motion import BoolArray, FloatArray, Motion, Skeleton, moving_channels
from mocaplab.skeletons import units

END_FACTOR = 2.0
"""How many times larger the noise of wrists and ankles is; paper A gives no number."""

EXPECTED_TURN_RAD = 0.25
"""The pull is the noise over this: angles rather stay within about 15 degrees of the clean."""

CALIBRATION_FRAMES = 128  # enough to find out how much noise each joint needs
CALIBRATION_ROUNDS = 4
MAX_SCALE = 4.0
"""No joint is drawn more than this times the noise it shall have."""

_ENDS = re.compile(
    r"(^|[^a-z])(left|right|l|r)[ _.-]?(hand|wrist|foot|ankle)$|"
    r"(^|[^a-z])(hand|wrist|foot|ankle)[ _.-]?(left|right|l|r)$",
    re.IGNORECASE,
)


def joints_that_move(motion: Motion) -> BoolArray:
    """Tell which joints the angles that move can bring to another place, shape (J,).

    The root cannot move, nor can what is fixed to it, such as the hip joints of most files.
    """
    skeleton = motion.skeleton
    turning = np.unique(skeleton.channel_joint[moving_channels(motion)])
    below_turning = descendants(skeleton)[turning].any(axis=0)
    moves = below_turning & has_own_place(skeleton)
    for joint, parent in enumerate(skeleton.parents.tolist()):
        moves[joint] |= parent >= 0 and moves[parent]
    return moves


def has_own_place(skeleton: Skeleton) -> BoolArray:
    """Tell which joints do not lie on their parent, as some do in many files; shape (J,)."""
    lengths = np.linalg.norm(skeleton.offsets, axis=1)
    own: BoolArray = lengths > 1e-6 * lengths.max()
    own[skeleton.channel_joint[~skeleton.is_rotation]] = True
    return own


def end_joints(skeleton: Skeleton) -> list[str]:
    """Find the wrists and ankles by their names.

    Looked for are hand, wrist, foot or ankle with left, right, l or r before or after it,
    such as ``LeftHand``, ``rFoot`` or ``hand_l``; a joint is its bone's upper end, so the
    hand's is the wrist.

    Raises
    ------
    ValueError
        If not exactly four joints are called so.
    """
    found = [name for name in skeleton.joint_names if _ENDS.search(name)]
    if len(found) != 4:
        raise ValueError(
            f"expected two wrists and two ankles among the joints (names such as LeftHand, "
            f"rFoot or ankle_l), got {found or 'none'}; pass their names as ends"
        )
    return found


def spatial_noise(
    motion: Motion,
    std_cm: float,
    *,
    rng: np.random.Generator,
    cm_per_unit: float | None = None,
) -> Motion:
    """Add Gaussian noise to the positions of the joints and find angles that fit.

    Every joint that can move (:func:`joints_that_move`) gets the same noise. The bones
    absorb a part of it, because no joint can leave the sphere about its parent. So more
    noise is drawn than asked for, as much as each joint needs to be off by ``std_cm`` in the
    end (root mean square over the clip, along each axis), up to ``MAX_SCALE`` times as much.
    Over all joints this comes true within 3 %; of single joints, within 20 % up to 1 cm.

    Where positions hardly tell an angle, as the twist of a stretched limb, the optimum may be
    anywhere, and the angle would spin from frame to frame. A pull towards the clean angles,
    which grows with the noise (``EXPECTED_TURN_RAD``), prevents it.

    Only the angles that move change, and of these only those that some joint's position
    depends on. End Sites are not joints and get no noise, so the angles of the last joints
    (toes, head, fingers) stay clean. The shorter a bone, the more its angles tremble.

    Parameters
    ----------
    motion : Motion, without NaN
    std_cm : float in [0, 10], centimetres
        Paper A has 0.1, 0.5, 1 and 3.
    rng : numpy.random.Generator
    cm_per_unit : float, optional
        Centimetres in one file unit; by default :func:`mocaplab.skeletons.units.cm_per_unit` finds
        it.

    Raises
    ------
    ValueError
        If the amount is out of range, the unit cannot be told, or a sample is NaN.
    """
    return _noisy(motion, std_cm, np.ones(motion.skeleton.n_joints), cm_per_unit, rng)


def spatial_noise_ends(
    motion: Motion,
    std_cm: float,
    *,
    rng: np.random.Generator,
    cm_per_unit: float | None = None,
    ends: Sequence[str] | None = None,
) -> Motion:
    """Add spatial noise that is larger at the wrists and ankles.

    These move fast and are tracked worse (paper A, section 4). Their noise is ``END_FACTOR``
    times ``std_cm``; that of all other joints is ``std_cm``. See :func:`spatial_noise`.

    Parameters
    ----------
    motion, std_cm, rng, cm_per_unit
        As for :func:`spatial_noise`.
    ends : sequence of str, optional
        Names of the wrists and ankles; by default :func:`end_joints` finds them.

    Raises
    ------
    ValueError
        As for :func:`spatial_noise`, or if the wrists and ankles are not found.
    """
    skeleton = motion.skeleton
    names = end_joints(skeleton) if ends is None else list(ends)
    unknown = [name for name in names if name not in skeleton.joint_names]
    if unknown:
        raise ValueError(f"motion {motion.name!r} has no joint {unknown[0]!r}")
    factors = np.where(np.isin(skeleton.joint_names, names), END_FACTOR, 1.0)
    return _noisy(motion, std_cm, factors, cm_per_unit, rng)


def _noisy(
    motion: Motion,
    std_cm: float,
    factors: FloatArray,
    cm_per_unit: float | None,
    rng: np.random.Generator,
) -> Motion:
    """Add noise of ``factors * std_cm`` to the joints; see :func:`spatial_noise`."""
    if not 0 <= std_cm <= 10:
        raise ValueError(f"the spatial noise must lie in [0, 10] cm, got {std_cm}")
    unit_cm = units.cm_per_unit(motion.skeleton) if cm_per_unit is None else cm_per_unit
    if not 0 < unit_cm < np.inf:
        raise ValueError(f"expected a positive number of centimetres in a unit, got {unit_cm}")
    draw = rng.normal(size=(motion.n_frames, motion.skeleton.n_joints, 3))
    own, moves = has_own_place(motion.skeleton), joints_that_move(motion)
    if std_cm == 0 or not moves.any():
        return motion
    # A joint on its parent is the same point: it counts once, or it would count more.
    counted = own & moves
    pull = std_cm / unit_cm / EXPECTED_TURN_RAD
    moving = moving_channels(motion)

    def move(some: Motion, noise: FloatArray) -> tuple[Motion, FloatArray]:
        """Solve for the noisy positions; also returns how far the joints really went."""
        before = forward_kinematics(some)[0]
        solved, _ = solve_angles(
            some, before + noise, weights=counted, channels=moving, pull=pull, tolerance=1e-5
        )
        return solved, forward_kinematics(solved)[0] - before

    asked = (factors * std_cm / unit_cm)[:, None]
    scale = asked
    every = -(-motion.n_frames // CALIBRATION_FRAMES)
    some = motion.with_channels(motion.channels[::every])
    for _ in range(CALIBRATION_ROUNDS):
        _, went = move(some, draw[::every] * scale)
        realised = np.sqrt(np.mean(went**2, axis=(0, 2)))[:, None]
        scale = scale * asked / np.maximum(realised, asked / MAX_SCALE)
        scale = np.minimum(scale, MAX_SCALE * asked)
    return move(motion, draw * scale)[0]
