"""Checks for the exercises of notebook 01, about BVH files, Euler angles and their traps.

As in :mod:`mocaplab.exercises`: a check takes the student's answer and returns a sentence.
None means that the exercise has not been tried yet. Nothing here fails on a strange answer.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mocaplab.euler import alternate_euler, continuity, wrap_degrees
from mocaplab.exercises.answers import (
    NOT_YET,
    NOTHING,
    as_array,
    as_number,
    call,
    not_a_number,
    short,
)
from mocaplab.kinematics import end_site_positions, forward_kinematics
from mocaplab.motion import FloatArray, Motion
from mocaplab.rotations import axis_angle_to_matrix, euler_to_matrix

MYSTERY_KINDS = ("full turn", "branch switch", "real jump")
_MYSTERY = {
    "LeftUpLeg": "real jump",
    "Neck": "full turn",
    "RightArm": "branch switch",
    "RightUpLeg": "real jump",
}
_MYSTERY_FRAME = 150


def check_channel_value(answer: Any, motion: Motion, channel: str, frame: int) -> str:
    """Check a number that was read by eye out of the lines of a BVH file."""
    if answer is None:
        return NOT_YET
    number = as_number(answer)
    if number is None:
        return not_a_number(answer)
    skeleton = motion.skeleton
    asked = skeleton.channel_index(channel)
    if np.isclose(number, motion.channels[frame, asked]):
        return f"Right: {number:g} is {channel} in frame {frame}, number {asked + 1} of the line."
    at = np.flatnonzero(np.isclose(motion.channels[frame], number))
    if len(at):
        found = skeleton.channel_labels[at[0]]
        if skeleton.channel_joint[at[0]] == skeleton.channel_joint[asked]:
            return (
                f"The joint is right, but {number:g} is its {found.split('.')[1]}. Every joint "
                f"has an order of its own: read its CHANNELS line once more."
            )
        return (
            f"{number:g} is {found}. Count along the CHANNELS lines from the top: "
            f"six numbers for the root, then three for each joint."
        )
    if np.isclose(motion.channels[:, asked], number).any():
        return f"That is the right column, but not frame {frame}. Frames count from 0."
    if np.isclose(motion.channels, number).any():
        return f"{number:g} stands in another frame. Frames count from 0: frame 0 is the first."
    return f"{number:g} stands in no frame of the file. Copy the number as it is, in degrees."


def check_rotation(answer: Any) -> str:
    """Check a function that turns three Euler angles and their order into a matrix."""
    angles = np.array([40.0, -25.0, 70.0])
    if answer is None:
        return NOT_YET
    got = {}
    for order in ("ZXY", "XYZ", "YZX"):
        result = _result(answer, (angles.copy(), order), (3, 3))
        if isinstance(result, str):
            return result
        got[order] = result
    if all(np.allclose(got[o], euler_to_matrix(angles, o), atol=1e-6) for o in got):
        return "Right: your matrices are those of the library for ZXY, XYZ and YZX."
    wrong: dict[str, str] = {
        "radians": "NumPy's sine and cosine want radians, and you gave them degrees.",
        "radians twice": "Your angles are far too small. Were they turned into radians twice?",
        "reversed": "The order of the product is the other way round: the first letter's matrix "
        "stands on the left.",
        "alphabet": "You gave the first angle to X, the second to Y, the third to Z. The first "
        "angle belongs to the first letter of the order.",
        "always ZXY": "Right for ZXY alone. Use the order that your function is given.",
        "always XYZ": "Right for XYZ alone. Use the order that your function is given.",
        "sign": "Each turn goes the wrong way round. Where does the minus sign stand?",
        "transposed": "Your matrix is the transpose: it turns back. Look at the minus signs.",
        "elementwise": "In NumPy * multiplies entry by entry. The product of matrices is @.",
    }
    for name, hint in wrong.items():
        if all(np.allclose(got[o], _wrong_rotation(angles, o)[name], atol=1e-6) for o in got):
            return hint
    if not all(np.allclose(m @ m.T, np.eye(3), atol=1e-6) for m in got.values()):
        return "That is no rotation: its columns should have length 1 and stand at right angles."
    return "A rotation, but not this one. Test each factor by itself: order ZXY, angles (90, 0, 0)."


def _wrong_rotation(angles: FloatArray, order: str) -> dict[str, FloatArray]:
    """Return the matrices that the typical mistakes lead to."""
    by_axis = np.array([angles["XYZ".index(axis)] for axis in order])
    factors = [
        axis_angle_to_matrix(axis, np.radians(angle))
        for axis, angle in zip(order, angles, strict=True)
    ]
    return {
        "radians": euler_to_matrix(np.degrees(angles), order),
        "radians twice": euler_to_matrix(np.radians(angles), order),
        "reversed": euler_to_matrix(angles[::-1], order[::-1]),
        "alphabet": euler_to_matrix(by_axis, order),
        "always ZXY": euler_to_matrix(angles, "ZXY"),
        "always XYZ": euler_to_matrix(angles, "XYZ"),
        "sign": euler_to_matrix(-angles, order),
        "transposed": euler_to_matrix(angles, order).T,
        "elementwise": factors[0] * factors[1] * factors[2],
    }


def check_end_sites(answer: Any, motion: Motion) -> str:
    """Check a function that places the End Sites of every frame."""
    if answer is None:
        return NOT_YET
    skeleton = motion.skeleton
    positions, turns = forward_kinematics(motion)
    truth = end_site_positions(motion)
    result = _result(answer, (positions.copy(), turns.copy(), skeleton), truth.shape)
    if isinstance(result, str):
        return result
    if np.allclose(result, truth, atol=1e-6):
        return f"Right: all {truth.shape[1]} End Sites are where the library puts them."
    at = skeleton.end_site_parents
    offsets = skeleton.end_site_offsets[..., None]
    turned = (turns[:, at] @ offsets)[..., 0]
    above = np.maximum(skeleton.parents[at], 0)
    first = np.arange(len(at))
    wrong = {
        "You added the offsets as they stand in the file. Turn each one first, with the "
        "orientation of the joint that it hangs on.": positions[:, at] + offsets[..., 0],
        "These are the turned offsets alone. Add the position of the joint.": turned,
        "These are the joints themselves. Add the turned offset.": positions[:, at],
        "You turned the offsets backwards: matrix @ offset, with the matrix on the "
        "left.": positions[:, at] + (np.swapaxes(turns[:, at], -1, -2) @ offsets)[..., 0],
        "You took the orientation of the joint one further up. An End Site hangs on its "
        "parent, and goes where that joint turns.": positions[:, at]
        + (turns[:, above] @ offsets)[..., 0],
        "You took joints 0, 1, 2, ... The joint that each End Site hangs on is in "
        "skeleton.end_site_parents.": positions[:, first] + (turns[:, first] @ offsets)[..., 0],
    }
    for hint, values in wrong.items():
        if np.allclose(result, values, atol=1e-6):
            return hint
    off = float(np.linalg.norm(result - truth, axis=-1).max())
    return f"Not yet: an End Site is {off:.2f} units from its place. Position, plus turned offset."


def check_unwrap(answer: Any) -> str:
    """Check a function that removes the jumps of full turns from a curve."""
    if answer is None:
        return NOT_YET
    turning = np.linspace(0, 1100, 111)  # three turns up, and then the same way down
    for true in (turning, -turning):
        wrapped = wrap_degrees(true)
        result = _result(answer, (wrapped.copy(),), true.shape)
        if isinstance(result, str):
            return result
        turns = (result - true) / 360
        if np.allclose(turns, np.round(turns[0]), atol=1e-6):
            continue
        if true is not turning:
            return "Right while the angle grows. Now let it also turn the other way round."
        steps = np.diff(wrapped, prepend=wrapped[0])
        once = wrapped - 360 * np.sign(steps) * (np.abs(steps) > 180)
        wrong = {
            "Nothing has changed. A step of over 180 degrees must become a short one.": wrapped,
            "np.unwrap counts in radians unless you say period=360.": np.unwrap(wrapped),
            "Right form, wrong unit: give the curve back in degrees.": np.radians(true),
            "Modulo 360 only moves the jump to another place. Add full turns that build "
            "up.": wrapped % 360,
            "You mended the one frame after each jump. All later frames need the turn "
            "too: np.cumsum builds it up.": once,
            "That goes the other way: after a jump from 180 down to -180, add 360.": wrapped
            - (true - wrapped),
            "Without their sign, angles lose their direction.": np.abs(wrapped),
        }
        for hint, values in wrong.items():
            if np.allclose(result, values, atol=1e-6):
                return hint
        step = float(np.abs(np.diff(result)).max())
        return f"Not yet: your curve still takes a step of {step:.0f} degrees; it should be 10."
    return "Right: no jump is left, whichever way the joint turns."


def mystery_clip(walk: Motion) -> tuple[Motion, int]:
    """Let four joints of a walk jump in one frame; return the clip and the frame."""
    channels = walk.channels.copy()
    shifts = {"LeftUpLeg": [120, 0, 120], "Neck": [0, 0, -360], "RightUpLeg": [0, -150, 0]}
    for joint, shift in shifts.items():
        channels[_MYSTERY_FRAME:, _columns(walk, joint)] += shift
    arm = _columns(walk, "RightArm")  # in the embedded clips, of order ZYX
    channels[_MYSTERY_FRAME:, arm] = alternate_euler(channels[_MYSTERY_FRAME:, arm], "ZYX")
    return Motion(walk.skeleton, walk.frame_time, channels, name="mystery"), _MYSTERY_FRAME


def check_mystery(answer: Any) -> str:
    """Check what the four jumps of :func:`mystery_clip` are, by joint."""
    if answer is None:
        return NOT_YET
    if not isinstance(answer, dict) or not answer:
        return 'Give a dictionary, such as {"Neck": "real jump", ...}.'
    missing = [joint for joint in _MYSTERY if joint not in answer]
    if missing:
        return f"Nothing is said about {missing[0]} yet."
    kinds = {joint: answer[joint] for joint in _MYSTERY}
    strange = [short(a) for a in kinds.values() if not isinstance(a, str) or a not in MYSTERY_KINDS]
    if strange:
        return f"I do not know {strange[0]}. Each answer is one of: {', '.join(MYSTERY_KINDS)}."
    wrong = [joint for joint, kind in _MYSTERY.items() if kinds[joint] != kind]
    if not wrong:
        return "Right: two jumps are real, and two are only written otherwise."
    hints = {
        ("real jump", "branch switch"): "Two channels jump together, as in a branch switch. "
        "But is the middle angle b now 180 - b? Compare the matrices.",
        ("real jump", "full turn"): "A full turn is a step of 360 degrees, and this one is not.",
        ("full turn", "real jump"): "How far apart are the two matrices?",
        ("full turn", "branch switch"): "Only one channel jumps. How far?",
        ("branch switch", "real jump"): "How far apart are the two matrices?",
        ("branch switch", "full turn"): "Do the channels step by 360 degrees, or by 180?",
    }
    hint = hints[_MYSTERY[wrong[0]], kinds[wrong[0]]]
    return f"{len(_MYSTERY) - len(wrong)} of {len(_MYSTERY)} are right. Look at {wrong[0]}: {hint}"


def check_switches(answer: Any, angles_deg: ArrayLike, order: str) -> str:
    """Check a function that finds the frames where Euler angles switch their branch."""
    if answer is None:
        return NOT_YET
    angles = np.asarray(angles_deg, dtype=np.float64)
    result = _result(answer, (angles.copy(), order), None)
    if isinstance(result, str):
        return result
    middle_sign = continuity(angles, order)[0][:, 1]
    truth = np.flatnonzero(np.diff(middle_sign)) + 1
    if result.shape in ((len(angles),), (len(angles) - 1,)) and np.isin(result, (0, 1)).all():
        return "You give one value for every frame. Give the frames: np.flatnonzero finds them."
    if result.ndim != 1:
        return "Give a list of frames. How many there are is not enough."
    if np.array_equal(np.sort(result), truth):
        return f"Right: {len(truth)} switches, in the frames that the library finds."
    if np.array_equal(np.sort(result) + 1, truth):
        return "Each of your frames is one too early: np.diff gives the step to the NEXT frame."
    jumps = np.flatnonzero((np.abs(np.diff(angles, axis=0)) > 90).any(axis=1)) + 1
    plain, other = angles, alternate_euler(angles, order)
    unwrapped = np.linalg.norm(np.diff(plain, axis=0), axis=1) > np.linalg.norm(
        other[1:] - plain[:-1], axis=1
    )
    if np.array_equal(result, jumps) or np.array_equal(result, np.flatnonzero(unwrapped) + 1):
        return "You also count steps of 360 degrees. Wrap each difference before you measure it."
    more = "too many" if len(result) > len(truth) else "too few" if len(result) < len(truth) else ""
    return (
        f"You found {len(result)} frames{', ' + more if more else ', but not the right ones'}. "
        f"A switch is where the other triple of a frame lies nearer to the frame before."
    )


def _columns(motion: Motion, joint: str) -> list[int]:
    skeleton = motion.skeleton
    of_joint = skeleton.channel_joint == skeleton.joint_names.index(joint)
    return np.flatnonzero(of_joint & skeleton.is_rotation).tolist()


def _result(
    function: Any, arguments: Sequence[Any], shape: tuple[int, ...] | None
) -> FloatArray | str:
    """Call the student's function: an array of the right shape, or a sentence of what is wrong."""
    value, problem = call(function, *arguments)
    if problem:
        return problem
    if value is None:
        return NOTHING
    result = as_array(value)
    if result is None or not np.isfinite(result).all():
        return "Your function should return finite numbers, in an array or a list."
    if shape is not None and result.shape != shape:
        return f"Your function returns an array of shape {result.shape}; it should be {shape}."
    return result
