"""Checks and data of the assignment ``bvh_kinematics``: see :mod:`mocaplab.assignments.grading`."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from mocaplab.assignments.contest import Contest, call_or_refuse
from mocaplab.assignments.grading import NotRight, student_rng
from mocaplab.assignments.judges import judge_function, judge_numbers
from mocaplab.bvh import save_bvh
from mocaplab.exercises.answers import as_array
from mocaplab.gap_fillers.curves import lerp_columns
from mocaplab.kinematics import forward_kinematics
from mocaplab.measures.positions import mpjpe_cm
from mocaplab.motion import FloatArray, Motion, Skeleton
from mocaplab.rotations import euler_to_matrix
from mocaplab.skeletons.units import cm_per_unit
from mocaplab.synthesis import synthesize

ASKED_JOINT, ASKED_FRAME = "RightHand", 2
N_KEYS = 12
_ORDERS = ("ZXY", "XYZ", "YZX", "ZYX", "YXZ", "XZY")
_PLACES = ("Xposition", "Yposition", "Zposition")


@dataclass(frozen=True)
class BvhWork:
    """A student's own file: one half of a small figure, each joint with an order of its own."""

    text: str
    motion: Motion


def draw_work(student: str) -> BvhWork:
    """Draw the file of a student."""
    rng = student_rng(student, "bvh_kinematics")
    offsets = np.array([[0, 0, 0], [0, 20, 0], [-14, 22, 0], [-28, 0, 0], [-24, 0, 0], [-9, -4, 0]])
    offsets = offsets + np.round(rng.uniform(-3, 3, offsets.shape), 1) * (offsets[:, :1] < 0)
    offsets[1, 1:] += np.round(rng.uniform(-2, 2, 2), 1)
    orders = [tuple(f"{axis}rotation" for axis in order) for order in rng.permutation(_ORDERS)]
    skeleton = Skeleton(
        joint_names=("Hips", "Chest", "RightArm", "RightForeArm", ASKED_JOINT, "RightLeg"),
        parents=np.array([-1, 0, 1, 2, 3, 0]),
        offsets=offsets,
        channel_names=((*_PLACES, *orders[0]), *orders[1:]),
        end_site_parents=np.array([4, 5]),
        end_site_offsets=np.round(rng.uniform(-8, -3, (2, 3)), 1),
    )
    n_frames = 6
    start, step = rng.uniform(-60, 60, skeleton.n_channels), rng.normal(0, 4, skeleton.n_channels)
    channels = np.round(start + step * np.arange(n_frames)[:, None], 1)
    channels[:, 1] += 95
    motion = Motion(skeleton, 1 / 40, channels, name=f"clip of {student}")
    return BvhWork(bvh_text(motion), motion)


def bvh_text(motion: Motion) -> str:
    """Return what a BVH file of the motion holds."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "clip.bvh"
        save_bvh(motion, path)
        return path.read_text()


def _chain(skeleton: Skeleton, joint: str) -> list[int]:
    """List the joints from the root to this one."""
    chain = [skeleton.joint_names.index(joint)]
    while chain[0] != 0:
        chain.insert(0, int(skeleton.parents[chain[0]]))
    return chain


# ------------------------------------------------------------------ 1: the rest pose


def check_rest(answer: Any, work: BvhWork) -> str:
    """Check where the hand is if nothing is turned and the root stands where frame 2 puts it."""
    skeleton, frames = work.motion.skeleton, work.motion.channels
    chain = _chain(skeleton, ASKED_JOINT)
    bones = skeleton.offsets[chain[1:]].sum(axis=0)
    root = frames[ASKED_FRAME, :3]
    mistakes = {
        "That is the OFFSET of the hand alone: it counts from its parent. Add the OFFSETs of all "
        "joints on the way from the root.": skeleton.offsets[chain[-1]],
        "You added the OFFSETs, but the root does not stand at (0, 0, 0): add the first three "
        "numbers of the frame.": bones,
        "You added the hand's own OFFSET to the root. The joints between them count too.": root
        + skeleton.offsets[chain[-1]],
        "That is the root's place in the line before. Frames count from 0.": bones + frames[1, :3],
        "That is the root's place in the line after. Frames count from 0.": bones + frames[3, :3],
        "That is the End Site, not the joint: its last OFFSET is one too many.": bones
        + root
        + skeleton.end_site_offsets[0],
        "That is where the hand really is in this frame. Here nothing shall be "
        "turned.": forward_kinematics(work.motion)[0][ASKED_FRAME, chain[-1]],
    }
    return judge_numbers(answer, bones + root, mistakes, atol=0.051, rtol=0)


# ------------------------------------------------------------------ 2: the numbers of a file


def check_read(answer: Any, work: BvhWork) -> str:
    """Check a function that reads the numbers of the MOTION part out of a file's text."""
    tabs = work.motion.with_channels(work.motion.channels[:3] * 1e-7)
    cases = {
        "your file": (work.text,),
        "a file with tabs, blank lines and numbers such as 1e-06": (
            re.sub(r"(?<=\d) (?=[-\d])", "\t", bvh_text(tabs)) + "\n\n",
        ),
        "a file of one frame": (bvh_text(work.motion.slice_frames(4, 5)),),
    }

    def right(text: str) -> Any:
        lines = [line.split() for line in text.split("MOTION")[1].splitlines() if line.strip()]
        return np.array(lines[2:], dtype=np.float64)

    def with_heads(text: str) -> Any:
        heads = [[float(line.split()[-1])] for line in text.split("MOTION")[1].split("\n")[1:3]]
        return np.concatenate([np.ravel(heads), right(text).ravel()])

    mistakes = {
        "The first frame is missing. After the line Frame Time: the numbers begin at "
        "once.": lambda text: right(text)[1:],
        "The last frame is missing. Does the file end with an empty line?": lambda text: right(
            text
        )[:-1],
        "Your array is turned over: one row for each frame, one column for each channel, "
        "(frames, channels).": lambda text: right(text).T,
        "These are all numbers in one row. Give one row for each frame.": lambda text: right(
            text
        ).ravel(),
        "The numbers of frames and the frame time are no channels: they stand before the first "
        "frame.": with_heads,
        "You left out the root's position. All channels count.": lambda text: right(text)[:, 3:],
    }
    return judge_function(answer, cases, right, mistakes)


# ------------------------------------------------------------------ 3: forward kinematics


def check_position(answer: Any, work: BvhWork) -> str:
    """Check a function (motion, joint, frame) that returns where a joint is in the world."""
    motion = work.motion
    cases = {
        f"{joint}, frame {frame}": (motion, joint, frame)
        for joint, frame in (("Chest", 1), (ASKED_JOINT, 3), ("RightLeg", 0), ("Hips", 5))
    }

    def right(motion: Motion, joint: str, frame: int) -> Any:
        positions, _ = forward_kinematics(motion)
        return positions[frame, motion.skeleton.joint_names.index(joint)]

    mistakes = {
        "You added the OFFSETs as they stand in the file. Turn each one by the joints above "
        "it.": lambda *a: _walk(*a, turn=False),
        "You turn each OFFSET by the joint's own rotation too. A joint turns what hangs on it, "
        "not itself: use the orientation of its parent.": lambda *a: _walk(*a, own=True),
        "The matrices are multiplied in the wrong order: the root's stands on the "
        "left.": lambda *a: _walk(*a, reverse=True),
        "You turn each OFFSET by its parent's rotation alone. All joints above it turn it "
        "too.": lambda *a: _walk(*a, local=True),
        "You left out where the root stands.": lambda *a: _walk(*a, root=False),
        "Every joint has its own Euler order: read motion.skeleton.channel_names.": lambda *a: (
            _walk(*a, order="ZXY")
        ),
        "These are the Euler angles taken in the order X, Y, Z. The file's order "
        "counts.": lambda *a: _walk(*a, order="XYZ"),
        "Your matrices got radians where they want degrees.": lambda *a: _walk(
            *a, factor=np.pi / 180
        ),
        "Your matrices got degrees where they want radians.": lambda *a: _walk(
            *a, factor=180 / np.pi
        ),
    }
    return judge_function(answer, cases, right, mistakes, rtol=1e-4, atol=1e-3)


def _walk(
    motion: Motion,
    joint: str,
    frame: int,
    *,
    turn: bool = True,
    own: bool = False,
    reverse: bool = False,
    local: bool = False,
    root: bool = True,
    order: str = "",
    factor: float = 1.0,
) -> Any:
    """Walk from the root to a joint, with the mistakes that were asked for."""
    skeleton, values = motion.skeleton, motion.channels[frame]
    position = values[:3] * root
    orientation = np.eye(3)
    for number in _chain(skeleton, joint):
        columns = (skeleton.channel_joint == number) & skeleton.is_rotation
        letters = "".join(kind[0] for kind in skeleton.channel_names[number] if "rot" in kind)
        matrix = euler_to_matrix(factor * values[columns], order or letters)
        after = matrix @ orientation if reverse else matrix if local else orientation @ matrix
        if number:
            axes = after if own else orientation
            position = position + (axes if turn else np.eye(3)) @ skeleton.offsets[number]
        orientation = after
    return position


# ------------------------------------------------------------------ 4: top speed


def check_top_speed(answer: Any, work: BvhWork) -> str:
    """Check a function (positions, frame_time) that returns the top speed of every joint."""
    positions, _ = forward_kinematics(work.motion)
    cases: dict[str, tuple[Any, ...]] = {
        "your clip": (positions, work.motion.frame_time),
        "a clip of 2 joints at 120 frames per second": (positions[:, 2:4] * 2, 1 / 120),
    }

    def steps(positions: FloatArray) -> Any:
        return np.linalg.norm(np.diff(positions, axis=0), axis=-1)

    def by_steps(positions: FloatArray, frame_time: float) -> Any:
        return steps(positions).max(axis=0) / frame_time

    def by_gradient(positions: FloatArray, frame_time: float) -> Any:
        velocity = np.gradient(positions, frame_time, axis=0)
        return np.linalg.norm(velocity, axis=-1).max(axis=0)

    def by_centred_steps(positions: FloatArray, frame_time: float) -> Any:
        velocity = (positions[2:] - positions[:-2]) / (2 * frame_time)
        return np.linalg.norm(velocity, axis=-1).max(axis=0)

    mistakes = {
        "That is the way in one frame. Divide by the seconds that a frame lasts.": lambda p, dt: (
            steps(p).max(axis=0)
        ),
        "You multiplied by the frame time. Speed is way divided by time.": lambda p, dt: (
            steps(p).max(axis=0) * dt
        ),
        "That is the mean speed. The highest one was asked for.": lambda p, dt: (
            steps(p).mean(axis=0) / dt
        ),
        "That is one number for the whole body. Give one for each joint: take the largest over "
        "the frames, axis 0.": lambda p, dt: steps(p).max() / dt,
        "That is the speed along one axis. The length of the velocity counts x, y and z: the root "
        "of the sum of their squares.": lambda p, dt: (
            np.abs(np.diff(p, axis=0)).max(axis=(0, 2)) / dt
        ),
        "You added the speeds along x, y and z. Square them, add, take the root.": lambda p, dt: (
            np.abs(np.diff(p, axis=0)).sum(axis=-1).max(axis=0) / dt
        ),
        "That is the speed in every frame. Give the highest one of each joint.": lambda p, dt: (
            steps(p) / dt
        ),
    }
    return judge_function(
        answer, cases, (by_steps, by_gradient, by_centred_steps), mistakes, rtol=1e-4
    )


# ------------------------------------------------------------------ beat the score


def even_keys(motion: Motion, n: int) -> Sequence[int]:
    """Choose n frames, evenly spaced: the answer to beat."""
    return [int(f) for f in np.linspace(0, motion.n_frames - 1, n).round()]


def error_between_keys_cm(motion: Motion, frames: Sequence[int]) -> float:
    """Keep some frames of a motion, draw straight lines between them, and measure the error.

    Parameters
    ----------
    motion : Motion, continuous
    frames : the frames that are kept

    Returns
    -------
    float, centimetres, mean over joints and frames
    """
    kept = np.full_like(motion.channels, np.nan)
    kept[list(frames)] = motion.channels[list(frames)]
    between = motion.with_channels(lerp_columns(kept))
    return mpjpe_cm(between, motion, cm_per_unit=cm_per_unit(motion.skeleton))


def _score_keys(answer: Any, seed: int) -> float:
    errors = []
    for number, action in enumerate(("walk", "jump", "kick")):
        rng = np.random.default_rng([seed, number])
        motion = synthesize(action, duration_s=2.0, rng=rng, name=action)
        frames = as_array(call_or_refuse(answer, motion, N_KEYS))
        if frames is None or frames.ndim != 1 or not np.all(frames == np.round(frames)):
            raise NotRight("Return a list of frames, whole numbers.")
        if len(frames) > N_KEYS:
            raise NotRight(f"Your function keeps {len(frames)} frames; {N_KEYS} are allowed.")
        if not len(frames) or frames.min() < 0 or frames.max() >= motion.n_frames:
            raise NotRight("Frames count from 0 to motion.n_frames - 1.")
        errors.append(error_between_keys_cm(motion, frames.astype(int).tolist()))
    return float(np.mean(errors))


CONTEST = Contest("bvh_kinematics", "cm", _score_keys, even_keys, goal=0.92)
