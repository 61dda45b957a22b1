"""All error measures in one place, by name, with their units.

No measure tells all. Each sees something that another one misses: a trembling hand adds
little to the RMS, a sliding foot little to the joint positions, and a filter that is too
strong scores well on both and takes the force out of a kick. What each one is stands where
it is defined: :mod:`mocaplab.measures.angles`, :mod:`mocaplab.measures.gaps`,
:mod:`mocaplab.measures.positions` and :mod:`mocaplab.measures.feet`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from mocaplab.measures.angles import (
    euler_mae_rad,
    geodesic_deg,
    harm_deg,
    quaternion_l1,
    rms_all_deg,
    rms_moving_deg,
)
from mocaplab.measures.feet import foot_skate_cm_s, ground_penetration_cm
from mocaplab.measures.gaps import GAP_EDGES_S, GapBin, gap_rms_by_length, gap_rms_deg
from mocaplab.measures.positions import (
    acceleration_error_cm_s2,
    bone_length_change_percent,
    jitter_cm_s3,
    mpjpe_cm,
    pa_mpjpe_cm,
    peak_speed_loss_percent,
    procrustes_align,
)
from mocaplab.motion import Corrupted, Motion
from mocaplab.skeletons.units import cm_per_unit

__all__ = [
    "GAP_MEASURES",
    "MEASURES",
    "GapBin",
    "Measure",
    "acceleration_error_cm_s2",
    "bone_length_change_percent",
    "euler_mae_rad",
    "find_measure",
    "foot_skate_cm_s",
    "gap_rms_by_length",
    "gap_rms_deg",
    "geodesic_deg",
    "ground_penetration_cm",
    "harm_deg",
    "jitter_cm_s3",
    "mpjpe_cm",
    "pa_mpjpe_cm",
    "peak_speed_loss_percent",
    "procrustes_align",
    "quaternion_l1",
    "rms_all_deg",
    "rms_moving_deg",
]


@dataclass(frozen=True)
class Measure:
    """A measure as tables use it."""

    score: Callable[[Motion, Corrupted], float]  # of what a method made of a corrupted clip
    unit: str  # empty for a number without a unit
    title: str  # for the heading of a table
    lower_is_better: bool = True  # if not, the clean motion's own value is best


def _centimetres(measure: Callable[..., float]) -> Callable[[Motion, Corrupted], float]:
    """Let a measure of positions find the length unit of the clip by itself."""
    return lambda cleaned, clip: measure(
        cleaned, clip.clean, cm_per_unit=cm_per_unit(clip.clean.skeleton)
    )


def _jitter(cleaned: Motion, clip: Corrupted) -> float:
    return jitter_cm_s3(cleaned, cm_per_unit=cm_per_unit(clip.clean.skeleton))


def _harm(cleaned: Motion, clip: Corrupted) -> float:
    """Harm is known only where the input was clean; it is NaN for any other clip."""
    was_clean = np.array_equal(clip.observed.channels, clip.clean.channels)
    return harm_deg(cleaned, clip.clean) if was_clean else np.nan


def _gap_of_length(shortest_s: float, longest_s: float) -> Measure:
    """Make the measure of the gaps of about one length."""

    def score(cleaned: Motion, clip: Corrupted) -> float:
        edges = (shortest_s, longest_s)
        return gap_rms_by_length(cleaned, clip.clean, clip.mask, edges)[0].rms_deg

    lengths = f"{shortest_s:g} to {longest_s:g} s" if longest_s < np.inf else f"{shortest_s:g} s up"
    return Measure(score, "deg", f"RMS over the hidden angles in gaps of {lengths}, degrees")


GAP_MEASURES = {
    f"gap_rms_from_{low:g}_s_deg": _gap_of_length(low, high) for low, high in pairwise(GAP_EDGES_S)
}
"""The error inside short and long gaps apart, by name, such as ``"gap_rms_from_0.5_s_deg"``."""


MEASURES: dict[str, Measure] = {
    "rms_all_deg": Measure(
        lambda cleaned, clip: rms_all_deg(cleaned, clip.clean),
        "deg",
        "RMS over all joint angles, degrees",
    ),
    "rms_moving_deg": Measure(
        lambda cleaned, clip: rms_moving_deg(cleaned, clip.clean),
        "deg",
        "RMS over the angles that move, degrees",
    ),
    "geodesic_deg": Measure(
        lambda cleaned, clip: geodesic_deg(cleaned, clip.clean),
        "deg",
        "Mean geodesic angle error over the joints that move, degrees",
    ),
    "quaternion_l1": Measure(
        lambda cleaned, clip: quaternion_l1(cleaned, clip.clean),
        "",
        "L1 distance between quaternions, summed over joints",
    ),
    "euler_mae_rad": Measure(
        lambda cleaned, clip: euler_mae_rad(cleaned, clip.clean),
        "rad",
        "Absolute difference of wrapped Euler angles, summed over joints, radians",
    ),
    "gap_rms_deg": Measure(
        lambda cleaned, clip: gap_rms_deg(cleaned, clip.clean, clip.mask),
        "deg",
        "RMS over the hidden angles, degrees",
    ),
    "harm_deg": Measure(_harm, "deg", "RMS change of an input that was clean, degrees"),
    "mpjpe_cm": Measure(_centimetres(mpjpe_cm), "cm", "Mean joint position error, cm"),
    "pa_mpjpe_cm": Measure(
        _centimetres(pa_mpjpe_cm), "cm", "Mean joint position error, each pose fitted, cm"
    ),
    "acceleration_error_cm_s2": Measure(
        _centimetres(acceleration_error_cm_s2), "cm/s^2", "Mean joint acceleration error, cm/s^2"
    ),
    "jitter_cm_s3": Measure(_jitter, "cm/s^3", "Mean joint jerk, cm/s^3", lower_is_better=False),
    "peak_speed_loss_percent": Measure(
        _centimetres(peak_speed_loss_percent),
        "%",
        "Peak speed lost at the fastest joint, percent",
        lower_is_better=False,
    ),
    "foot_skate_cm_s": Measure(
        _centimetres(foot_skate_cm_s), "cm/s", "Slide of standing feet, cm/s"
    ),
    "ground_penetration_cm": Measure(
        _centimetres(ground_penetration_cm), "cm", "Mean depth of the feet in the ground, cm"
    ),
} | GAP_MEASURES
"""Every measure of a cleaned motion. Bone lengths have no place here: angles never change them."""


def find_measure(name: str) -> Measure:
    """Return a measure of ``MEASURES``.

    Raises
    ------
    ValueError
        If there is no such name; the message lists those there are.
    """
    if name not in MEASURES:
        raise ValueError(f"no measure {name!r}; there are {', '.join(MEASURES)}")
    return MEASURES[name]
