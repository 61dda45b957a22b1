"""Wrong answers that students really give, planted to prove that each loses its points.

A wrong answer is the solution with one text in it replaced, or, where ``old`` is empty, another
solution. The first of every exercise together make the sample submission "wrong-1", the second
"wrong-2", and so on.
"""

from __future__ import annotations

from typing import NamedTuple


class WrongAnswer(NamedTuple):
    """A wrong answer to an exercise."""

    exercise: str  # the name of the cell that it stands in
    old: str
    new: str
    hint: str  # a part of what the check says to it
    points: float = 0.0  # what it is worth all the same


WRONG_ANSWERS: dict[str, list[WrongAnswer]] = {}

WRONG_ANSWERS["bvh_kinematics"] = [
    WrongAnswer(
        "rest", "", "hand_at_rest = work.motion.skeleton.offsets[4]", "OFFSET of the hand alone"
    ),
    WrongAnswer("rest", "channels[2, :3].copy()", "channels[1, :3].copy()", "the line before"),
    WrongAnswer("rest", "work.motion.channels[2, :3].copy()", "np.zeros(3)", "does not stand at"),
    WrongAnswer(
        "rest", "", "hand_at_rest = forward_kinematics(work.motion)[0][2, 4]", "nothing shall be"
    ),
    WrongAnswer("read", '.split("\\n")[1:]', '.split("\\n")[2:]', "first frame is missing"),
    WrongAnswer("read", "if line.strip()])", "if line.strip()]).T", "turned over"),
    WrongAnswer("read", "if line.strip()])", "if line.strip()]).ravel()", "in one row"),
    WrongAnswer("read", "line.split()]", 'line.split(" ")]', "ValueError"),
    WrongAnswer(
        "position", "+ orientation @ skeleton.offsets", "+ skeleton.offsets", "Turn each one"
    ),
    WrongAnswer(
        "position",
        "orientation @ euler_to_matrix(angles, order)",
        "euler_to_matrix(angles, order) @ orientation",
        "in the wrong order",
    ),
    WrongAnswer(
        "position", "(angles, order)", '(angles, "ZXY")', "its own Euler order"
    ),
    WrongAnswer(
        "position",
        "euler_to_matrix(angles, order)",
        "euler_to_matrix(np.radians(angles), order)",
        "radians where they want degrees",
    ),
    WrongAnswer("speed", " / frame_time", "", "in one frame"),
    WrongAnswer("speed", " / frame_time", " * frame_time", "You multiplied"),
    WrongAnswer("speed", "steps.max(axis=0)", "steps.mean(axis=0)", "mean speed"),
    WrongAnswer(
        "keys", "", "return np.arange(0, 2 * n, 2)", "Not beaten"
    ),
    WrongAnswer("keys", "", "return range(motion.n_frames)", "12 are allowed"),
    WrongAnswer("keys", "", "return np.linspace(0, 1, n)", "whole numbers"),
]  # fmt: skip
