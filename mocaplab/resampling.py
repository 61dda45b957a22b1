"""Change the frame rate of a motion, on the same time grid.

Frame k of the result is what the motion shows at time k / fps, from the first frame up to
the last: 121 frames at 120 fps last one second, and so become 31 at 30 fps, not 30.

Nothing is smoothed. Going down from 120 to 30 fps keeps every fourth frame as it is, so
noise above 15 Hz folds into the frequencies below. Human motion holds little up there, so
clean clips lose nothing; a noisy one should go through a filter of :mod:`mocaplab.filters`
first. The choice of the filter is the user's, and a resampler that made it in silence would
change samples that it was only asked to move.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mocaplab.euler import align_euler, channels_of_order, wrap_degrees
from mocaplab.motion import FloatArray, IntArray, Motion
from mocaplab.quaternions import slerp
from mocaplab.rotations import euler_to_quaternion, quaternion_to_euler

HEADER_ROUNDING = 5e-5
"""Relative error of a frame time with four digits, such as 0.008333 for 120 fps."""

ON_GRID = 1e-6
"""A time within this share of a frame is the frame's own."""

LOCKED_DEG = 1e-7
"""Nearer to gimbal lock than this, only a sum of the first and third angle is known."""


def nominal_fps(fps: float, tolerance: float = HEADER_ROUNDING) -> float:
    """Undo the rounding of a frame rate that came from a file's frame time.

    A header with 0.0083333 means 120 fps, not 120.00048: over a thousand frames the
    difference would move samples off the time grid.

    Parameters
    ----------
    fps : float, frames per second
    tolerance : float, relative

    Returns
    -------
    float
        The nearest whole number, or the nearest 1000/1001 of one (29.97 is 30000/1001, the
        rate of NTSC video), if it is that near; otherwise fps itself.
    """
    for unit in (1.0, 1000 / 1001):
        rate = round(fps / unit) * unit
        if abs(fps - rate) <= tolerance * rate:
            return rate
    return fps


def sample_times(n_frames: int, source_fps: float, fps: float) -> FloatArray:
    """List the times of the frames of a new rate, counted in frames of the old one.

    Returns
    -------
    array, shape (T',)
        From 0 to at most n_frames - 1; whole numbers where the two grids meet.
    """
    ratio = source_fps / fps
    count = int(np.floor((n_frames - 1) / ratio + ON_GRID / max(ratio, 1.0))) + 1
    times = np.arange(count) * ratio
    whole = np.round(times)
    return np.where(np.abs(times - whole) <= ON_GRID, whole, times)


def resample(motion: Motion, fps: float) -> Motion:
    """Show a motion at another frame rate; the first frame stays at time 0.

    Parameters
    ----------
    motion : Motion
        Its own rate is its frame time, freed of rounding (:func:`nominal_fps`).
    fps : float, frames per second, above 0; any ratio, up or down

    Returns
    -------
    Motion
        The last frame lies at the end of the motion or less than a frame before it.

        - A frame that falls on a frame of the source is that frame, bit for bit.
        - Between two frames, joints with three rotations turn evenly the shorter way round
          (slerp); positions and joints with one or two rotations change linearly, angles
          across -180 degrees the shorter way.
        - Of all Euler triples of a rotation, the one nearest to the source's is written: the
          result is continuous where the source is. A source with full turns or branch
          switches keeps them: use :func:`mocaplab.euler.make_continuous` before.
        - A sample between an observed and a missing one (NaN) is missing; of a joint with
          three rotations, all three are missing if one is.
        - There is no low-pass filter (see above).

    Raises
    ------
    ValueError
        If fps is not above 0, or beyond all use.
    """
    if not 0 < fps <= 1e6 or fps * motion.duration_s > 1e9 or fps < 1e-6:
        raise ValueError(
            f"motion {motion.name!r}: expected fps above 0 and at most a million, got {fps}"
        )
    fps = nominal_fps(fps, 2e-6)  # tells 29.97 from 30000/1001, and nothing else
    times = sample_times(motion.n_frames, nominal_fps(motion.fps), fps)
    before = np.floor(times).astype(np.int64)
    share = times - before
    channels = motion.channels[before]
    between = np.flatnonzero(share > 0)  # the rest is copied
    if len(between):
        channels[between] = _between(motion, before[between], share[between, None])
    return replace(motion, frame_time=1.0 / fps, channels=channels)


def _between(motion: Motion, before: IntArray, share: FloatArray) -> FloatArray:
    """Interpolate from frames ``before`` to the next ones; share, shape (n, 1), in (0, 1)."""
    start, end = motion.channels[before], motion.channels[before + 1]
    turning = motion.skeleton.is_rotation
    values = start + share * (end - start)
    values[:, turning] = _shorter_way(start[:, turning], end[:, turning], share)
    for order, (_, columns) in channels_of_order(motion.skeleton).items():
        if len(order) == 3:
            values[:, columns] = _slerp_euler(
                start[:, columns], end[:, columns], share[:, None], order
            )
    return values


def _shorter_way(start: FloatArray, end: FloatArray, share: FloatArray) -> FloatArray:
    """Change angles linearly, starting from the nearer end's number of full turns."""
    step = wrap_degrees(end - start)
    return np.where(share <= 0.5, start + share * step, end - (1 - share) * step)


def _slerp_euler(start: FloatArray, end: FloatArray, share: FloatArray, order: str) -> FloatArray:
    """Turn evenly between Euler triples, shape (n, joints, 3); share, shape (n, 1, 1)."""
    turned = slerp(
        euler_to_quaternion(start, order), euler_to_quaternion(end, order), share[..., 0]
    )
    angles = quaternion_to_euler(turned, order)
    # What the triple would be if Euler angles could be interpolated: near enough to tell
    # the right branch and the right number of turns, in terms of the nearer frame.
    forth = start + share * (align_euler(end, start, order) - start)
    back = end + (1 - share) * (align_euler(start, end, order) - end)
    reference = np.where(share <= 0.5, forth, back)
    return align_euler(_split_lock(angles, reference, order), reference, order)


def _split_lock(angles: FloatArray, reference: FloatArray, order: str) -> FloatArray:
    """At gimbal lock, split the turn between the first and third angle as the reference does.

    There, with a middle angle of 90 degrees, first + third (or first - third, depending on
    the order of the axes) is all that a rotation tells, and :func:`quaternion_to_euler`
    calls the third angle 0. A file that rests at 90 degrees would jump at every new frame.
    """
    first, middle, third = np.moveaxis(angles, -1, 0)
    sign = 1.0 if order in ("XYZ", "YZX", "ZXY") else -1.0
    sign_of_third = sign * np.sign(middle)
    off = wrap_degrees(first - reference[..., 0] + sign_of_third * (third - reference[..., 2]))
    split = np.stack(
        [reference[..., 0] + off / 2, middle, reference[..., 2] + sign_of_third * off / 2], axis=-1
    )
    locked = 90.0 - np.abs(middle) < LOCKED_DEG
    return np.where(locked[..., None], split, angles)
