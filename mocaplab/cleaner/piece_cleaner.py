"""Clean one piece of a clip: to the model's joints and rate, through the network, and back."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from mocaplab.checkpoints import Checkpoint
from mocaplab.cleaner.clip_view import ClipView
from mocaplab.cleaner.network_runner import NetworkRunner, measure_scale
from mocaplab.cleaner.pieces import Piece
from mocaplab.cleaner.rate_matching import match_rates
from mocaplab.filters import gaussian_filter
from mocaplab.gap_fillers.filled import Filled, lines_std
from mocaplab.motion import BoolArray, FloatArray, Motion
from mocaplab.noise.gaps import hide
from mocaplab.skeletons.matching import SkeletonMatch


class PieceCleaner:
    """A clip on its way through the network.

    Parameters
    ----------
    checkpoint : Checkpoint
    filler : function that fills the gaps of a motion of the model's skeleton and rate
    match : SkeletonMatch
    view : ClipView, the clip
    """

    def __init__(
        self,
        checkpoint: Checkpoint,
        filler: Callable[[Motion], Filled],
        match: SkeletonMatch,
        view: ClipView,
    ):
        self.filler, self.match, self.view = filler, match, view
        self.rates = match_rates(view.motion.frame_time, checkpoint.frame_time)
        self.frame_time = view.motion.frame_time if self.rates.is_same else checkpoint.frame_time
        self.hidden = view.hidden & ~view.unseen  # what is never observed is at rest
        self.channels = match.to_model(view.channels)
        self.scale = measure_scale(self.channels, match.spread(self.hidden))
        self.runner = NetworkRunner(checkpoint, match.model)
        self.strangers = view.moving & ~match.known
        self.gaussian_s = checkpoint.gaussian_s

    def clean(
        self, piece: Piece, *, widths: bool
    ) -> tuple[FloatArray, FloatArray | None, FloatArray | None]:
        """Clean the frames of a piece.

        Returns
        -------
        channels : array, shape (n, C), continuous, of the kept frames
        std_deg : array, shape (n, C), expected errors of filled samples; None without gaps
        width_s : array, shape (n, C), or None if it was not asked for
        """
        here, match, rates = slice(piece.start, piece.stop), self.match, self.rates
        n_frames, factor = piece.stop - piece.start, rates.noise_factor
        motion, std_deg = self._fill(self._up(piece), piece)
        cleaned = self.runner.clean(motion, self.scale, factor)
        back = match.to_file(rates.down(cleaned, match.model, n_frames), self.view.channels[here])
        back[:, self.strangers] = self._smooth_strangers(here)
        changed = self.view.moving | self.hidden[here]
        channels = np.where(changed, back, self.view.channels[here])
        width_s = None
        if widths:
            dense = self.runner.widths_s(motion, self.scale, factor)
            width_s = match.spread_back(rates.down_nearest(dense, n_frames))
            width_s[:, self.strangers] = self.gaussian_s
            width_s[:, ~self.view.moving] = 0.0
            width_s = width_s[piece.kept]
        return channels[piece.kept], self._std_of_file(std_deg, piece), width_s

    def _up(self, piece: Piece) -> Motion:
        """Show a piece at the model's rate."""
        model, view = self.match.model, self.view
        noise_deg = self.scale.noise_deg * model.is_cleaned
        channels = self.channels[piece.start : piece.stop]
        dense = self.rates.up(channels, model, noise_deg, piece.start)
        return Motion(model, self.frame_time, dense, view.motion.name)

    def _fill(self, motion: Motion, piece: Piece) -> tuple[Motion, FloatArray | None]:
        """Fill the gaps of a piece at the model's rate; those of the root keep their lines."""
        hidden = self.match.spread(self._holes(piece)) & self.match.model.is_cleaned
        if not hidden.any():
            return motion, None
        dense = self.rates.up_mask(hidden, motion.n_frames)
        filled = self.filler(hide(motion, ~dense))
        return filled.motion, filled.std_deg

    def _holes(self, piece: Piece) -> BoolArray:
        """Return where a piece has gaps, shape (n, C of the file).

        Where a gap goes on beyond the piece, the piece ends on the line across that gap.
        """
        holes = self.hidden[piece.start : piece.stop].copy()
        if piece.start > 0:
            holes[0] = False
        if piece.stop < len(self.hidden):
            holes[-1] = False
        return holes

    def _smooth_strangers(self, here: slice) -> FloatArray:
        values = self.view.channels[here, self.strangers]
        return gaussian_filter(values, self.gaussian_s, self.view.motion.frame_time)

    def _std_of_file(self, std_deg: FloatArray | None, piece: Piece) -> FloatArray | None:
        """Bring expected errors back to the file's channels and frames."""
        if not self.view.hidden.any():
            return None
        result = np.zeros((piece.stop - piece.start, len(self.view.unseen)))
        if std_deg is not None:
            result = self.match.spread_back(self.rates.down_nearest(std_deg, len(result)))
        # A joint that the model does not know, or a frame that lies between those it sees.
        hidden = self.hidden[piece.start : piece.stop]
        untold = hidden & (result == 0)
        if untold.any():
            values = self.view.channels[piece.start : piece.stop]
            motion = replace(self.view.motion, channels=values)
            result = np.where(untold, lines_std(hide(motion, ~self._holes(piece))), result)
        result = np.where(hidden, result, 0.0)
        result[:, self.view.unseen] = np.inf
        return result[piece.kept]
