"""The cleaner: a noisy motion in, a clean motion out."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from tqdm.auto import tqdm

from mocaplab.checkpoints import SHIPPED, Checkpoint, load_checkpoint, shipped_checkpoint
from mocaplab.cleaner.clip_view import long_runs, view_clip
from mocaplab.cleaner.network_runner import NetworkRunner, measure_scale
from mocaplab.cleaner.piece_cleaner import PieceCleaner
from mocaplab.cleaner.pieces import cut
from mocaplab.gap_fillers.files import shipped_filler
from mocaplab.gap_fillers.filled import Filled, check_observed, fill_by_lines
from mocaplab.motion import BoolArray, FloatArray, Motion, Skeleton
from mocaplab.motion_model import load_motion_model
from mocaplab.networks import EBF
from mocaplab.noise.gaps import hide
from mocaplab.skeletons.as_json import skeleton_from_json
from mocaplab.skeletons.matching import SkeletonMatch, match_skeletons


@dataclass(frozen=True, eq=False)
class Cleaned:
    """A cleaned motion, and what the cleaner can say of it.

    Parameters
    ----------
    motion : Motion, without NaN
        Inside a gap that is left open: the line through its ends.
    left : array, shape (T, C), bool
        True inside gaps that are longer than ``max_gap_s`` and so were not filled.
    std_deg : array, shape (T, C), degrees
        Expected error of the filled samples; see :class:`mocaplab.gap_fillers.filled.Filled`. 0
        elsewhere.
    width_s : array, shape (T, C), seconds, or None
        How widely each sample was smoothed, where that was asked for.
    match : SkeletonMatch
        Which joint was taken for which of the model's.
    """

    motion: Motion
    left: BoolArray
    std_deg: FloatArray
    width_s: FloatArray | None
    match: SkeletonMatch


class Cleaner:
    """Clean motions with a network. Fits the :class:`mocaplab.filters.Denoiser` protocol.

    Gaps are filled, then the network cleans every joint angle. The motion may have another
    frame rate than the model, joints with other names, channels and orders
    (:func:`mocaplab.skeletons.matching.match_skeletons`), and any length: long clips are
    cleaned in pieces. A channel that moves, but never did in training, is smoothed with the
    single Gaussian width that was tuned on the training clips: the network knows nothing of
    it. The root, and channels that do not move, come out exactly as they went in.

    Parameters
    ----------
    model : Checkpoint, path of a model file, or the name of a model in the package
        ``"blend"`` is the best, ``"ebf"`` is the network of paper A.
    filler : function
        Takes a continuous motion of the model's skeleton and frame rate, with NaN inside gaps,
        and returns a :class:`mocaplab.gap_fillers.filled.Filled`. By default the one in the
        package, :func:`mocaplab.gap_fillers.files.shipped_filler`; straight lines for a model of
        other joints.
    max_gap_s : float, seconds, optional
        Longer gaps are not filled.
    """

    def __init__(
        self,
        model: Checkpoint | str | os.PathLike[str] = "blend",
        *,
        filler: Callable[[Motion], Filled] | None = None,
        max_gap_s: float | None = None,
    ):
        if model in SHIPPED:
            model = shipped_checkpoint(str(model))
        elif not isinstance(model, Checkpoint):
            model = load_checkpoint(model)
        if max_gap_s is not None and not max_gap_s >= 0:
            raise ValueError(f"the longest gap must be 0 seconds or more, got {max_gap_s}")
        self.checkpoint = model
        self.filler = filler
        self.max_gap_s = max_gap_s

    def clean(self, motion: Motion) -> Motion:
        """Clean a motion whose gaps, if any, are NaN; gaps that are left open stay NaN.

        Raises
        ------
        ValueError
            If the motion's joints cannot be matched with the model's, or no angle was observed.

        Warns
        -----
        mocaplab.gap_fillers.curves.GapWarning
            If a channel was never observed; it is left at rest.
        """
        cleaned = self.clean_in_detail(motion)
        return hide(cleaned.motion, ~cleaned.left) if cleaned.left.any() else cleaned.motion

    def denoise(self, observed: Motion, mask: BoolArray) -> Motion:
        """Return the cleaned motion; see :class:`mocaplab.filters.Denoiser`."""
        return self.clean_in_detail(observed).motion

    def clean_in_detail(
        self, motion: Motion, *, widths: bool = False, progress: bool = False
    ) -> Cleaned:
        """Clean a motion, and tell how.

        Parameters
        ----------
        motion : Motion; NaN inside gaps
        widths : bool
            Also tell how widely each sample was smoothed.
        progress : bool
            Show a progress bar for a clip that is cleaned in several pieces.

        Raises
        ------
        ValueError
            See :meth:`clean`.
        """
        match = self.match(motion)
        if np.isnan(motion.channels).any():
            check_observed(motion)
        view = view_clip(motion)
        job = PieceCleaner(self.checkpoint, self._filler(view.hidden), match, view)
        result = np.empty_like(view.channels)
        std_deg = np.broadcast_to(0.0, result.shape)  # takes no memory
        if view.hidden.any():
            std_deg = np.zeros_like(result)
        width_s = np.zeros_like(result) if widths else None
        seen = view.hidden[:, ~view.unseen]
        pieces = cut(np.any(seen, axis=1), job.rates.file_fps, job.rates.period)
        bar = tqdm(pieces, "cleaning", unit="piece", disable=not progress or len(pieces) == 1)
        for piece in bar:
            kept = slice(piece.first, piece.last)
            cleaned, std, width = job.clean(piece, widths=widths)
            result[kept] = view.restore(cleaned, kept)
            if std is not None:
                std_deg[kept] = std
            if width_s is not None:
                width_s[kept] = width
        left = long_runs(view.hidden, self.max_gap_s, motion.frame_time)
        if left.any():
            result = view.draw_lines(result, left)
            std_deg = np.where(left, 0.0, std_deg)
        return Cleaned(motion.with_channels(result), left, std_deg, width_s, match)

    def match(self, motion: Motion) -> SkeletonMatch:
        """Find the model's joints in a motion.

        Raises
        ------
        ValueError
            If that is not safe; the message says why, and how to train a model.
        """
        checkpoint, skeleton = self.checkpoint, motion.skeleton
        model = self._model_skeleton()
        if skeleton.channel_labels == checkpoint.channel_labels or model is None:
            checkpoint.require(skeleton, checkpoint.frame_time, motion.name)
            model = skeleton
        else:
            checkpoint.require(model, checkpoint.frame_time, motion.name)
        try:
            return match_skeletons(skeleton, model, checkpoint.constant)
        except ValueError as error:
            raise ValueError(
                f"{motion.name}: the model was trained for another skeleton: {error}. "
                f"Train one for yours with: mocaplab train FOLDER_OF_CLEAN_BVH -o model.safetensors"
            ) from None

    def predict_sigma_s(self, motion: Motion) -> FloatArray:
        """Predict how wide EBF smooths each angle in each frame.

        Parameters
        ----------
        motion : Motion
            Continuous, without NaN: :func:`mocaplab.euler.make_continuous`.

        Returns
        -------
        array, shape (T, C), seconds; 0 for channels that are not smoothed

        Raises
        ------
        ValueError
            If the model is not one that predicts widths, or was trained for another skeleton
            or frame rate.
        """
        self.checkpoint.require(motion.skeleton, motion.frame_time, motion.name)
        model = self.checkpoint.model
        if not isinstance(model, EBF) or model.config.kernel != "gaussian":
            raise ValueError(f"{type(model).__name__} predicts no widths of Gaussians")
        runner = NetworkRunner(self.checkpoint, motion.skeleton)
        scale = measure_scale(motion.channels, np.isnan(motion.channels))
        return runner.widths_s(motion, scale)

    def _filler(self, hidden: BoolArray) -> Callable[[Motion], Filled]:
        """Return what fills gaps; nothing is loaded where there are none."""
        if self.filler is None and hidden.any():
            shipped = shipped_filler()
            fits = shipped.channel_labels == self.checkpoint.channel_labels
            self.filler = shipped.fill if fits else fill_by_lines
        return self.filler or fill_by_lines

    def _model_skeleton(self) -> Skeleton | None:
        """Return the skeleton that the model was trained on; None for an older model file."""
        if "skeleton" in self.checkpoint.info:
            return skeleton_from_json(self.checkpoint.info["skeleton"])
        embedded = load_motion_model().skeleton
        ours = embedded.channel_labels == self.checkpoint.channel_labels
        return embedded if ours else None
