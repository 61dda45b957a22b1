"""The fuser: two noisy recordings of one movement in, one better motion out."""

from __future__ import annotations

import os
from dataclasses import dataclass

import numpy as np
import torch

from mocaplab.measures.angles import check_complete
from mocaplab.measures.movement import jitter
from mocaplab.motion import BoolArray, FloatArray, IntArray, Motion, Skeleton, moving_channels
from mocaplab.poses import motion_to_quaternions
from mocaplab.quaternions import align_hemisphere
from mocaplab.rotation_channels import write_angles
from mocaplab.two_sources.model_files import SourceModel, load_source_model, shipped_source_model
from mocaplab.two_sources.robust import RobustFusion
from mocaplab.two_sources.time_offset import Offset, common_frames, find_offset

CHUNK_FRAMES = 2000
"""Frames that go through the network at once, so that long files take no more memory."""
MARGIN_FRAMES = 120
"""Frames on each side of a chunk that the network sees too, and that are not kept."""

LEAST_ERROR_RAD = 1e-3
"""Error expected of joints that move in neither recording."""


@dataclass(frozen=True, eq=False)
class FusionReport:
    """What fusing did."""

    offset: Offset
    n_frames: int  # that both recordings have
    trust_a: float  # mean share of trust in the first one, over joints that move and frames
    apart_deg: float  # mean angle between the two
    jitter_a: float  # file length units per second cubed
    jitter_b: float
    jitter_fused: float
    corrected: bool  # whether the network knows this skeleton's poses

    def __str__(self) -> str:
        lines = [
            f"offset    {_tell_offset(self.offset)}",
            f"frames    {self.n_frames} that both have",
            f"apart     {self.apart_deg:.2f} degrees a joint on average",
            f"trust     {self.trust_a:.0%} in A, {1 - self.trust_a:.0%} in B",
            f"jitter    A {self.jitter_a:,.0f}  B {self.jitter_b:,.0f}  fused "
            f"{self.jitter_fused:,.0f} units/s^3",
        ]
        if not self.corrected:
            lines.append(
                "note      the network was trained on another skeleton: the two are weighed and "
                "smoothed, but poses are not corrected"
            )
        return "\n".join(lines)


def _tell_offset(offset: Offset) -> str:
    if not offset.frames:
        told = "none"
    else:
        order = "later" if offset.frames > 0 else "earlier"
        told = (
            f"{abs(offset.seconds):.3f} s ({abs(offset.frames)} frames): what A shows comes "
            f"{order} in B"
        )
    found = "as given" if np.isnan(offset.correlation) else f"correlation {offset.correlation:.2f}"
    return f"{told}, {found}"


class Fuser:
    """Fuse two recordings with a trained RobustFusion.

    Each joint's rotation is the weighted, smoothed mean of the two. The root's path and joints
    that move in neither are those of the first: two cameras seldom share one origin.

    Parameters
    ----------
    model : SourceModel, path of a model file, or None for the one in the package

    Raises
    ------
    ValueError
        If the model is of another kind.
    """

    def __init__(self, model: SourceModel | str | os.PathLike[str] | None = None):
        if model is None:
            model = shipped_source_model("fusion")
        elif not isinstance(model, SourceModel):
            model = load_source_model(model)
        if not isinstance(model.network, RobustFusion):
            kind = type(model.network).__name__
            raise ValueError(f"expected a model of the kind RobustFusion, got {kind}")
        self.model, self.network = model, model.network

    def fuse(
        self, a: Motion, b: Motion, offset_s: float | None = None
    ) -> tuple[Motion, FusionReport]:
        """Fuse two recordings of one movement.

        Parameters
        ----------
        a, b : Motion
            Of one skeleton and frame rate, without NaN.
        offset_s : float or None, seconds
            How much later b shows the same moment. None finds it, up to a second.

        Returns
        -------
        fused : Motion, the frames that both have, in the skeleton of a
        report : FusionReport

        Raises
        ------
        ValueError
            If skeletons or frame rates differ, there are gaps, or no offset fits.
        """
        check_sources(a, b)
        p, q = motion_to_quaternions(a), motion_to_quaternions(b)
        if offset_s is None:
            offset = find_offset(p, q, a.frame_time)
        else:
            offset = _given_offset(offset_s, a.frame_time)
        here, there = common_frames(len(p), len(q), offset.frames)
        a, b = a.slice_frames(here.start, here.stop), b.slice_frames(there.start, there.stop)
        p, q = align_hemisphere(p[here]), align_hemisphere(q[there])
        moves = moving_channels(a) | moving_channels(b) | _root_turns(a.skeleton)
        joints = np.unique(a.skeleton.channel_joint[moves])
        turned, trust = self._fuse_rotations(p, q, a.skeleton, joints, a.frame_time)
        fused = write_angles(turned, a, moves)
        cosine = np.abs(np.sum(p * q, axis=-1))[:, joints].clip(0, 1)
        return fused, FusionReport(
            offset=offset,
            n_frames=len(p),
            trust_a=float(trust.mean()),
            apart_deg=float(np.degrees(2 * np.arccos(cosine)).mean()),
            jitter_a=jitter(a),
            jitter_b=jitter(b),
            jitter_fused=jitter(fused),
            corrected=self.knows(a.skeleton),
        )

    def knows(self, skeleton: Skeleton) -> bool:
        """Tell whether a skeleton has all the joints that the network was trained on."""
        return set(self.model.segments) <= set(skeleton.joint_names)

    def _fuse_rotations(
        self, p: FloatArray, q: FloatArray, skeleton: Skeleton, joints: IntArray, frame_time: float
    ) -> tuple[FloatArray, FloatArray]:
        """Return fused rotations, (T, J, 4), and the share of trust in the first, (T, joints)."""
        fused, trusts = p.copy(), np.empty((len(p), len(joints)))
        names = skeleton.joint_names
        known = self.knows(skeleton)
        pose = [names.index(name) for name in self.model.segments] if known else []
        for start in range(0, len(p), CHUNK_FRAMES):
            stop = min(start + CHUNK_FRAMES, len(p))
            first, last = max(0, start - MARGIN_FRAMES), min(len(p), stop + MARGIN_FRAMES)
            kept = slice(start - first, stop - first)
            a, b = (torch.from_numpy(x[first:last][:, joints]).float()[None] for x in (p, q))
            with torch.no_grad():
                trust, sigma_s, error_rad = self.network.judge_sources(a, b)
                blended = self.network.blend(a, b, trust, sigma_s / frame_time)
                fused[start:stop, joints] = blended[0, kept].double().numpy()
                trusts[start:stop] = (trust[..., 0] / trust.sum(dim=-1))[0, kept].numpy()
                if known:
                    error = np.full(p[start:stop].shape[:-1], LEAST_ERROR_RAD)
                    error[:, joints] = error_rad[0, kept].numpy()
                    whole, unsure = fused[start:stop, pose], error[:, pose]
                    inputs = [torch.from_numpy(x).float()[None] for x in (whole, unsure)]
                    fused[start:stop, pose] = self.network.correct(*inputs)[0].double().numpy()
        fused /= np.linalg.norm(fused, axis=-1, keepdims=True)
        return fused, trusts


def _given_offset(offset_s: float, frame_time: float) -> Offset:
    """Take over the offset that the user says; its correlation is not known."""
    if not abs(offset_s) < 1e6:
        raise ValueError(f"expected an offset in seconds, got {offset_s}")
    return Offset(round(offset_s / frame_time), offset_s, np.nan)


def check_sources(a: Motion, b: Motion) -> None:
    """Refuse two motions that cannot be recordings of one movement on one skeleton.

    Raises
    ------
    ValueError
        The message says what differs and what to do.
    """
    if not a.skeleton.same_as(b.skeleton):
        ours, theirs = set(a.skeleton.channel_labels), set(b.skeleton.channel_labels)
        differ = sorted(ours ^ theirs)
        detail = f"; {differ[0]} is in one of them only" if differ else "; their order differs"
        raise ValueError(
            f"expected two files with the same joints and channels, got {a.name!r} "
            f"({a.skeleton.n_channels} channels) and {b.name!r} "
            f"({b.skeleton.n_channels} channels){detail}"
        )
    if abs(b.frame_time / a.frame_time - 1) > 0.001:
        raise ValueError(
            f"expected two files of one frame rate, got {a.fps:.4g} frames per second in "
            f"{a.name!r} and {b.fps:.4g} in {b.name!r}; resample one of them"
        )
    check_complete(a)
    check_complete(b)


def _root_turns(skeleton: Skeleton) -> BoolArray:
    """Tell which channels turn the root, shape (C,)."""
    turns: BoolArray = skeleton.is_rotation & (skeleton.channel_joint == 0)
    return turns
