"""Show a motion to a model at the model's frame rate, and bring the result back.

A network trained at 120 frames per second knows what noise looks like there: each frame trembles
by itself. Of a noisy file with 30, interpolation makes slow waves of the same strength, which
look like movement and would be left in. So the frames between get noise as well, of the kind
that a recording at 120 would have had: only what is too fast for the file's own rate, and as
strong as the noise already there. The network then sees white noise, and takes it out together
with the rest. On the way down from a higher rate, what is too fast for the model's is smoothed.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from mocaplab.filters import gaussian_filter
from mocaplab.motion import BoolArray, FloatArray, IntArray, Motion, Skeleton
from mocaplab.resampling import nominal_fps, resample

SAME_RATE = 0.01
"""Rates that differ by less than this share are taken as equal: 119.88 and 120."""
CUT_S = 0.375
"""Times 1 / fps: the width of the Gaussian that halves what is at half the lower rate."""
LONGEST_PERIOD = 200
"""Frames after which the two time grids should meet again; otherwise they are not aligned."""

_BLOCK = 1024  # frames of noise drawn at once, so that each frame's noise depends on it alone
_SEED = 120


@dataclass(frozen=True)
class RateMatch:
    """The frame rates of a file and a model.

    Parameters
    ----------
    file_fps, model_fps : float, frames per second, freed of rounding
    """

    file_fps: float
    model_fps: float

    @property
    def is_same(self) -> bool:
        """Whether nothing has to be resampled."""
        return abs(self.file_fps / self.model_fps - 1) <= SAME_RATE

    @property
    def ratio(self) -> float:
        """Frames of the model for each frame of the file."""
        return 1.0 if self.is_same else self.model_fps / self.file_fps

    @property
    def noise_factor(self) -> float:
        """How strong the noise seems at the model's rate, for noise of 1 in the file.

        At a higher rate the same power is spread over ``ratio`` times as many frequencies, and
        interpolation by lines takes a third of it away. On the way to a lower rate a Gaussian
        takes away what is too fast for it.
        """
        if self.ratio >= 1:
            return max(1.0, float(np.sqrt(self.ratio * 2 / 3)))
        width = CUT_S / self.ratio  # frames of the file
        return min(1.0, float(np.sqrt(1 / (2 * np.sqrt(np.pi) * width))))

    @property
    def period(self) -> int:
        """After how many frames of the file its time grid meets the model's again."""
        return Fraction(self.ratio).limit_denominator(LONGEST_PERIOD).denominator

    def up(
        self, channels: FloatArray, skeleton: Skeleton, noise_deg: FloatArray, first: int
    ) -> FloatArray:
        """Show frames of the file at the model's rate.

        Parameters
        ----------
        channels : array, shape (n, C), continuous, without NaN
        skeleton : Skeleton of these channels
        noise_deg : array, shape (C,), how strong the file's noise is
        first : int, number of the first frame, a multiple of ``period``

        Returns
        -------
        array, shape (m, C), up to the last frame of the file or past it
        """
        if self.is_same:
            return channels
        if self.ratio < 1:  # what is too fast for the model's rate would fold into the rest
            widths_s = np.where(noise_deg > 0, CUT_S / self.model_fps, 0.0)
            channels = gaussian_filter(channels, widths_s, 1 / self.file_fps)
        beyond = int(np.ceil(1 / self.ratio)) if self._ends_early(len(channels)) else 0
        held = np.concatenate([channels, np.repeat(channels[-1:], beyond, axis=0)])
        dense = resample(Motion(skeleton, 1 / self.file_fps, held), self.model_fps).channels
        if self.ratio <= 1 or not noise_deg.any():
            return dense
        start = round(first * self.ratio)
        noise = _white_noise(start, start + len(dense), len(noise_deg))
        noise *= noise_deg * self.noise_factor
        slow = gaussian_filter(noise, CUT_S / self.file_fps, 1 / self.model_fps)
        return dense + noise - slow

    def _ends_early(self, n_frames: int) -> bool:
        """Tell whether the model's last frame would lie before the file's."""
        last = (n_frames - 1) * self.ratio
        return bool(last - np.floor(last + 1e-6) > 1e-6)

    def down(self, channels: FloatArray, skeleton: Skeleton, n_frames: int) -> FloatArray:
        """Bring frames of the model's rate, shape (m, C), back to the n of the file."""
        if self.is_same:
            return channels
        dense = Motion(skeleton, 1 / self.model_fps, channels)
        return resample(dense, self.file_fps).channels[:n_frames].copy()

    def between(self, n_frames: int, n_dense: int) -> tuple[IntArray, IntArray]:
        """Return the frames of the file before and after each frame of the model."""
        times = np.arange(n_dense) / self.ratio
        before = np.floor(times + 1e-6).astype(np.int64).clip(max=n_frames - 1)
        after = np.ceil(times - 1e-6).astype(np.int64).clip(max=n_frames - 1)
        return before, after

    def up_mask(self, hidden: BoolArray, n_dense: int) -> BoolArray:
        """Mark the model's frames that lie beside a marked frame of the file, shape (m, C)."""
        before, after = self.between(len(hidden), n_dense)
        marked: BoolArray = hidden[before] | hidden[after]
        return marked

    def down_nearest(self, values: FloatArray, n_frames: int) -> FloatArray:
        """Return values of the model's frames, shape (m, C), at the nearest ones of the file."""
        index = np.round(np.arange(n_frames) * self.ratio).astype(np.int64)
        return np.asarray(values[index.clip(max=len(values) - 1)])


def match_rates(file_frame_time: float, model_frame_time: float) -> RateMatch:
    """Compare two frame times, seconds."""
    return RateMatch(nominal_fps(1 / file_frame_time), nominal_fps(1 / model_frame_time))


def _white_noise(start: int, stop: int, n_channels: int) -> FloatArray:
    """Draw noise of deviation 1 for frames start to stop; the same frame, the same noise."""
    first, last = start // _BLOCK, (stop - 1) // _BLOCK
    blocks = [
        np.random.default_rng([_SEED, block]).normal(size=(_BLOCK, n_channels))
        for block in range(first, last + 1)
    ]
    skip = first * _BLOCK
    return np.asarray(np.concatenate(blocks)[start - skip : stop - skip])
