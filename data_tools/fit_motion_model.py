"""Fit the statistical motion model that ``mocaplab.synthesis`` draws motions from.

The model holds no recording, only statistics of a folder of CMU clips:

* walk, run: each channel as a Fourier series over the gait cycle, and the principal
  components of the series' coefficients across clips, as in Troje (2002),
  "Decomposing biological motion", Journal of Vision 2(5):2;
* jump, kick: each channel as a cosine series over a window around the event, after a
  time warp that brings the landmarks together, and the first two components across clips;
* the recorded range and the mean angular acceleration of each channel, and the skeleton.

Clips that would spoil a mean are left out by rule: a gait clip whose lower foot
rises or sinks by more than 20 cm (stairs), that turns by more than 30 degrees or whose
path is 5 percent longer than a straight line; a jump clip with more than one flight.
"""

from __future__ import annotations

import argparse
import csv
import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from safetensors.numpy import save

from mocaplab.bvh import load_bvh
from mocaplab.files import write_atomically
from mocaplab.kinematics import forward_kinematics
from mocaplab.motion import CONSTANT_STD_DEG, FloatArray, Motion, Skeleton
from mocaplab.rotations import alternate_euler, make_continuous, rotation_triples, wrap_degrees
from mocaplab.synthesis import (
    CM_PER_UNIT,
    FRAME_TIME,
    MODEL_FILE,
    cosine_basis,
    foot_heights,
    fourier_basis,
    turn_root,
)

N_HARMONICS = 8  # of the gait cycle: 7 Hz in a walk, 11 Hz in a run
N_COSINES = 48  # half periods over a window of about 2 s: 11 Hz
N_COMPONENTS = {"walk": 8, "run": 3, "jump": 2, "kick": 2}
WINDOW_S = {"jump": (1.0, 0.8), "kick": (1.05, 0.95)}  # before the first, after the last landmark
MAX_RISE_CM, MAX_TURN_DEG, MAX_DETOUR = 20.0, 30.0, 1.05
FLIGHT_CM = 8.0
SHORT_LEVER, SPIN_DEG = 2.0, 110.0

Arrays = dict[str, np.ndarray]


def common_branch(motion: Motion, reference: FloatArray) -> Motion:
    """Describe a clip by the Euler branch and turn nearest to a reference pose.

    Parameters
    ----------
    motion : Motion, continuous
    reference : array, shape (C,), degrees

    Returns
    -------
    Motion
        The same poses. One choice is made for each joint and the whole clip, so the
        channels stay continuous.
    """
    channels = motion.channels.copy()
    for _, columns, order in rotation_triples(motion.skeleton):
        angles = channels[:, columns]
        # The branch with the middle angle between -90 and 90 is the one that clips share; the
        # nearest to the reference is not: a bent elbow lies between both.
        if np.median(np.abs(wrap_degrees(angles[:, 1]))) > 90.0:
            angles = alternate_euler(angles, order)
        turns = np.round((reference[columns] - np.median(angles, axis=0)) / 360.0)
        channels[:, columns] = angles + 360.0 * turns
    return motion.with_channels(channels)


def hold_spinning(motion: Motion) -> Motion:
    """Hold thumbs and fingers that spin at their median: few markers hold them.

    A joint is held when it reaches less than ``SHORT_LEVER`` units and one of its angles
    spans more than ``SPIN_DEG`` within the clip, which no such joint can do.
    """
    skeleton = motion.skeleton
    short = lever_arms(skeleton)[skeleton.channel_joint] < SHORT_LEVER
    spins = short & skeleton.is_rotation & (np.ptp(motion.channels, axis=0) > SPIN_DEG)
    held = np.isin(skeleton.channel_joint, skeleton.channel_joint[spins])
    return motion.with_channels(np.where(held, np.median(motion.channels, axis=0), motion.channels))


def load_clips(folder: Path) -> dict[str, list[Motion]]:
    """Read the clips that ``clips.csv`` lists, continuous and on one Euler branch.

    Parameters
    ----------
    folder : path of the folder with ``clips.csv`` (columns clip, action) and the BVH files

    Returns
    -------
    dict from action (of the four that are fitted) to motions, in the order of the list
    """
    clips: dict[str, list[Motion]] = {action: [] for action in N_COMPONENTS}
    reference: FloatArray | None = None
    with open(folder / "clips.csv", newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["action"] in clips]
    for row in sorted(rows, key=lambda row: (row["action"] != "walk", row["clip"])):
        motion = make_continuous(load_bvh(folder / f"{row['clip']}.bvh"))
        if reference is None:
            reference = np.median(motion.channels, axis=0)
        clips[row["action"]].append(hold_spinning(common_branch(motion, reference)))
    return clips


def is_plain_gait(motion: Motion) -> bool:
    """Tell whether a clip is walking or running straight on, on a level floor."""
    heights_cm = foot_heights(motion).min(axis=1) * CM_PER_UNIT
    if np.ptp(heights_cm) > MAX_RISE_CM:
        return False
    forward = forward_kinematics(motion)[1][:, 0, :, 2]
    heading = np.unwrap(np.arctan2(forward[:, 0], forward[:, 2]))
    path = motion.channels[:, [0, 2]]
    length = np.linalg.norm(np.diff(path, axis=0), axis=1).sum()
    straight = np.linalg.norm(path[-1] - path[0])
    return bool(np.degrees(np.ptp(heading)) < MAX_TURN_DEG and length < MAX_DETOUR * straight)


def travel_direction(motion: Motion) -> float:
    """Direction from the first to the last frame, radians from +z towards +x."""
    x, z = motion.channels[-1, [0, 2]] - motion.channels[0, [0, 2]]
    return float(np.arctan2(x, z))


def facing_direction(motion: Motion, landmarks: list[int]) -> float:
    """Mean direction that the hips face between the first and the last landmark."""
    forward = forward_kinematics(motion)[1][landmarks[0] : landmarks[-1], 0, :, 2].mean(axis=0)
    return float(np.arctan2(forward[0], forward[2]))


def kick_direction(motion: Motion, landmarks: list[int]) -> float:
    """Direction that the kicking foot moves around the ball contact."""
    foot = forward_kinematics(motion)[0][:, motion.skeleton.joint_names.index("RightFoot")]
    x, _, z = foot[landmarks[1] + 4] - foot[landmarks[1] - 4]
    return float(np.arctan2(x, z))


def features(motion: Motion, moving: np.ndarray, direction_rad: float, floor: float) -> FloatArray:
    """Heading-free description of every frame.

    Parameters
    ----------
    motion : Motion
    moving : array, shape (C,), bool, the rotation channels to keep
    direction_rad : float, the direction of travel, measured from +z towards +x
    floor : float, file length units

    Returns
    -------
    array, shape (T, F)
        The moving angles in degrees, then the root's height, and its path to the side
        and forward in file length units.
    """
    turned = turn_root(motion, -direction_rad).channels
    cosine, sine = np.cos(direction_rad), np.sin(direction_rad)
    x, z = motion.channels[:, 0], motion.channels[:, 2]
    root = [motion.channels[:, 1] - floor, x * cosine - z * sine, x * sine + z * cosine]
    return np.concatenate([turned[:, moving], np.stack(root, axis=1)], axis=1)


def gait_phase(motion: Motion, direction_rad: float) -> FloatArray:
    """Phase of the gait cycle, in cycles: whole when the left foot passes the right one.

    Returns
    -------
    array, shape (T,)
    """
    positions = forward_kinematics(motion)[0]
    names = motion.skeleton.joint_names
    apart = positions[:, names.index("LeftFoot")] - positions[:, names.index("RightFoot")]
    ahead = apart[:, 0] * np.sin(direction_rad) + apart[:, 2] * np.cos(direction_rad)
    ahead -= (np.percentile(ahead, 98) + np.percentile(ahead, 2)) / 2
    at = np.flatnonzero(np.diff(np.signbit(ahead)))
    at = at[np.concatenate([[True], np.diff(at) > 20])]  # no step is shorter than 1/6 s
    frame = at + ahead[at] / (ahead[at] - ahead[at + 1])
    halves = np.arange(len(at)) / 2 + (0.0 if ahead[at[0] + 1] > 0 else 0.5)
    # Straight lines between passings, and the mean rate before the first and after the last.
    rate = (halves[-1] - halves[0]) / (frame[-1] - frame[0])
    t = np.arange(motion.n_frames)
    phase = np.interp(t, frame, halves)
    return np.asarray(phase + rate * (np.minimum(t - frame[0], 0) + np.maximum(t - frame[-1], 0)))


def fit_cycle(motion: Motion, moving: np.ndarray, direction: float) -> tuple[FloatArray, float]:
    """Fourier coefficients of one walk or run.

    Returns
    -------
    coefficients : array, shape (2 * N_HARMONICS + 1, F)
        The last two features are velocities to the side and forward, units per second.
    frequency : float, cycles per second
    """
    floor = float(np.percentile(foot_heights(motion).min(axis=1), 20))
    values = features(motion, moving, direction, floor)
    values[:, -2:] = np.gradient(values[:, -2:], motion.frame_time, axis=0)
    phase = gait_phase(motion, direction)
    # A straight trend is fitted beside the series and dropped: a clip that leans over
    # slowly must not show as a first harmonic.
    trend = np.linspace(-1.0, 1.0, motion.n_frames)[:, None]
    basis = np.concatenate([fourier_basis(phase, N_HARMONICS), trend], axis=1)
    ridge = 1e-3 * motion.n_frames * np.eye(basis.shape[1])
    ridge[0, 0] = 0.0
    solution = np.linalg.solve(basis.T @ basis + ridge, basis.T @ values)
    return solution[:-1], float((phase[-1] - phase[0]) / motion.duration_s)


def jump_landmarks(motion: Motion) -> list[int] | None:
    """Frames of crouch, take-off, landing and lowest point after it; None if not one jump."""
    low = foot_heights(motion).min(axis=1)
    airborne = (low - np.median(low)) * CM_PER_UNIT > FLIGHT_CM
    edges = np.flatnonzero(np.diff(airborne.astype(int)))
    if len(edges) != 2:
        return None
    up, down = edges.tolist()
    height = motion.channels[:, 1]
    return [int(height[:up].argmin()), up, down, down + int(height[down : down + 60].argmin())]


def kick_landmarks(motion: Motion) -> list[int]:
    """Frames of backswing, ball contact and follow-through of the right foot."""
    names = motion.skeleton.joint_names
    foot = forward_kinematics(motion)[0][:, names.index("RightFoot")]
    contact = int(np.linalg.norm(np.diff(foot, axis=0), axis=1).argmax())
    back = max(contact - 40, 0)
    after = contact + 5
    return [
        back + int(foot[back:contact, 1].argmax()),
        contact,
        after + int(foot[after : after + 40, 1].argmax()),
    ]


def fit_window(
    motion: Motion, moving: np.ndarray, landmarks: list[int], knots_s: FloatArray, direction: float
) -> FloatArray:
    """Cosine coefficients of one jump or kick, warped so that landmarks fall on the knots.

    Parameters
    ----------
    knots_s : array, shape (n,), seconds
        Start of the window, the landmarks, end of the window.

    Returns
    -------
    array, shape (N_COSINES, F)
        The last two features are velocities to the side and forward, units per second.
    """
    from scipy.interpolate import CubicSpline, PchipInterpolator

    before, after = knots_s[1], knots_s[-1] - knots_s[-2]
    first, last = landmarks[0] - before / FRAME_TIME, landmarks[-1] + after / FRAME_TIME
    time_s = np.arange(0.0, knots_s[-1], FRAME_TIME)
    frame = PchipInterpolator(knots_s, [first, *landmarks, last])(time_s)
    frame = frame.clip(0, motion.n_frames - 1)  # a clip that ends early holds its last pose
    floor = float(np.median(foot_heights(motion).min(axis=1)))
    values = CubicSpline(np.arange(motion.n_frames), features(motion, moving, direction, floor))(
        frame
    )
    values[:, -2:] = np.gradient(values[:, -2:], FRAME_TIME, axis=0)
    basis = cosine_basis(time_s / knots_s[-1], N_COSINES)
    return np.asarray(np.linalg.solve(basis.T @ basis, basis.T @ values))


def lever_arms(skeleton: Skeleton) -> FloatArray:
    """Reach of every joint, shape (J,), file length units.

    It is the distance to the farthest End Site below the joint, with nothing rotated.
    """
    positions = skeleton.offsets.copy()
    for joint, parent in enumerate(skeleton.parents.tolist()[1:], start=1):
        positions[joint] += positions[parent]
    reach = np.zeros(skeleton.n_joints)
    for parent, offset in zip(skeleton.end_site_parents, skeleton.end_site_offsets, strict=True):
        tip, joint = positions[parent] + offset, int(parent)
        while joint >= 0:
            reach[joint] = max(reach[joint], np.linalg.norm(tip - positions[joint]))
            joint = int(skeleton.parents[joint])
    return reach


def principal_components(
    samples: FloatArray, levers: FloatArray, n_components: int
) -> tuple[Arrays, FloatArray]:
    """Mean, components and spread of coefficient arrays.

    Parameters
    ----------
    samples : array, shape (N, K, F)
    levers : array, shape (F - 3,), file length units

    Returns
    -------
    dict of mean (K, F), components (n, K, F), std (n,)
    scores : array, shape (N, n)
    """
    # Thumbs and fingers spin in some clips, because few markers hold them. Coefficients far
    # from the median are pulled in, by 5 degrees (or units) at least before it counts as far.
    middle = np.median(samples, axis=0)
    far = 5.0 + 4.0 * np.median(np.abs(samples - middle), axis=0)
    samples = np.clip(samples, middle - far, middle + far)
    # Features count by how far they move the body: an angle by its lever arm, the height
    # fully, a velocity for a fifth of a second. All in degrees times units.
    weight = np.concatenate([levers, np.degrees([1.0, 0.2, 0.2])])
    mean = samples.mean(axis=0)
    flat = ((samples - mean) * weight).reshape(len(samples), -1)
    rows = np.linalg.svd(flat, full_matrices=False)[2][:n_components]
    # The sign of a component is arbitrary; its largest entry is made positive.
    rows *= np.sign(np.take_along_axis(rows, np.abs(rows).argmax(axis=1)[:, None], axis=1))
    scores = flat @ rows.T
    components = rows.reshape(-1, *mean.shape) / weight
    return {"mean": mean, "components": components, "std": scores.std(axis=0, ddof=1)}, scores


def recorded_statistics(clips: Sequence[Motion], directions: Sequence[float]) -> Arrays:
    """Range and typical acceleration of every channel, and the headings."""
    from scipy.ndimage import gaussian_filter1d

    # Half a percent at each end is left out of the range, and what is above about 11 Hz out
    # of the acceleration: both are capture noise, of thumbs and toes most of all.
    ranges = np.array([np.percentile(clip.channels, [0.5, 99.5], axis=0) for clip in clips])
    smooth = [gaussian_filter1d(clip.channels, 2.0, axis=0) for clip in clips]
    squares = [np.mean((np.diff(x, n=2, axis=0) / FRAME_TIME**2) ** 2, axis=0) for x in smooth]
    return {
        "limits": np.stack([ranges[:, 0].min(axis=0), ranges[:, 1].max(axis=0)]),
        "acceleration": np.sqrt(np.median(squares, axis=0)),
        "heading": np.array([np.mean(directions), np.std(directions)]),
    }


def fit_gait(clips: Sequence[Motion], moving: np.ndarray, n_components: int) -> Arrays:
    """All statistics of the walks or the runs."""
    levers = lever_arms(clips[0].skeleton)[clips[0].skeleton.channel_joint[moving]]
    directions = [travel_direction(clip) for clip in clips]
    fits = [fit_cycle(clip, moving, at) for clip, at in zip(clips, directions, strict=True)]
    arrays, scores = principal_components(np.array([fit[0] for fit in fits]), levers, n_components)
    # A long stride is a slow one: the rate follows the scores, which are uncorrelated.
    log_rates = np.log([fit[1] for fit in fits])
    slopes = (log_rates - log_rates.mean()) @ scores / (scores**2).sum(axis=0)
    arrays["log_rate"] = np.concatenate([[log_rates.mean()], slopes])
    return arrays | recorded_statistics(clips, directions) | {"knots_s": np.empty(0)}


def fit_event(
    clips: Sequence[Motion], landmarks: Sequence[list[int]], moving: np.ndarray, action: str
) -> Arrays:
    """All statistics of the jumps or the kicks."""
    levers = lever_arms(clips[0].skeleton)[clips[0].skeleton.channel_joint[moving]]
    direction = facing_direction if action == "jump" else kick_direction
    directions = [direction(clip, at) for clip, at in zip(clips, landmarks, strict=True)]
    steps = np.mean([np.diff(at) for at in landmarks], axis=0) * FRAME_TIME
    knots = np.cumsum([0.0, WINDOW_S[action][0], *steps, WINDOW_S[action][1]])
    samples = [
        fit_window(clip, moving, at, knots, angle)
        for clip, at, angle in zip(clips, landmarks, directions, strict=True)
    ]
    arrays, scores = principal_components(np.array(samples), levers, N_COMPONENTS[action])
    arrays |= {"knots_s": knots, "log_rate": np.zeros(1 + scores.shape[1])}
    return arrays | recorded_statistics(clips, directions)


def fit_model(folder: Path) -> tuple[Arrays, dict[str, str]]:
    """Fit the whole model on a folder of clips.

    Returns
    -------
    arrays : dict of float32, int64 and bool arrays
    metadata : dict of str, for the header of the file

    Raises
    ------
    ValueError
        If too few clips of an action can be used.
    """
    clips = load_clips(folder)
    for action in ("walk", "run"):
        clips[action] = [clip for clip in clips[action] if is_plain_gait(clip)]
    marks = {"kick": [kick_landmarks(clip) for clip in clips["kick"]]}
    jumps = [(clip, jump_landmarks(clip)) for clip in clips["jump"]]
    clips["jump"] = [clip for clip, at in jumps if at is not None]
    marks["jump"] = [at for _, at in jumps if at is not None]
    for action, used in clips.items():
        if len(used) <= N_COMPONENTS[action]:
            need = N_COMPONENTS[action]
            raise ValueError(f"{folder}: expected over {need} usable {action}s, got {len(used)}")
    every = [clip for used in clips.values() for clip in used]
    skeleton = every[0].skeleton
    varies = [clip.channels.std(axis=0) > CONSTANT_STD_DEG for clip in every]
    moving = skeleton.is_rotation & np.any(varies, axis=0)
    arrays: Arrays = {
        "offsets": skeleton.offsets,
        "end_site_offsets": skeleton.end_site_offsets,
        "rest": np.mean([clip.channels.mean(axis=0) for clip in every], axis=0),
    }
    for action, used in clips.items():
        fitted = (
            fit_event(used, marks[action], moving, action)
            if action in marks
            else fit_gait(used, moving, N_COMPONENTS[action])
        )
        arrays |= {f"{action}.{key}": value for key, value in fitted.items()}
    arrays = {key: np.ascontiguousarray(value, np.float32) for key, value in arrays.items()}
    arrays |= {"parents": skeleton.parents, "end_site_parents": skeleton.end_site_parents}
    arrays["moving"] = moving
    header = {
        "joint_names": skeleton.joint_names,
        "channel_names": skeleton.channel_names,
        "clips": {action: [clip.name for clip in used] for action, used in clips.items()},
        "source": "Statistics of clips from mocap.cs.cmu.edu; the database was created with "
        "funding from NSF EIA-0196217.",
    }
    return arrays, {"model": json.dumps(header)}


def main(arguments: Sequence[str] | None = None) -> None:
    """Fit the model and write it."""
    parser = argparse.ArgumentParser(
        prog="python -m data_tools.fit_motion_model",
        description="Fit the motion model behind the embedded data set on a folder of CMU clips.",
    )
    parser.add_argument("folder", type=Path, help="folder with clips.csv and the BVH files")
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        default=MODEL_FILE,
        help="file to write (default: the model inside the package)",
    )
    options = parser.parse_args(arguments)
    arrays, metadata = fit_model(options.folder)
    options.output.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(options.output, save(arrays, metadata))
    used = json.loads(metadata["model"])["clips"]
    counts = ", ".join(f"{len(names)} {action}" for action, names in used.items())
    print(f"{options.output}: {options.output.stat().st_size / 1000:.0f} kB, from {counts}")


if __name__ == "__main__":
    main()
