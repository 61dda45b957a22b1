"""What the interactive lab shows, computed without any widget."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mocaplab.cleaning import Cleaner
from mocaplab.corruption import CORRUPTIONS, corrupt
from mocaplab.datasets import Dataset
from mocaplab.gap_fillers.curves import lerp_gaps
from mocaplab.lab.gaussian import LOOK_AHEADS_S, WIDTHS_S, gaussian, squared_error_table
from mocaplab.measures.by_name import rms_all_deg
from mocaplab.motion import Corrupted, FloatArray, IntArray, Motion, moving_channels

NOISES = (
    "angular",
    "uniform",
    "biased",
    "wavering",
    "spatial",
    "sources",
    "spikes",
    "frozen",
    "swaps",
    "drift",
    "quantised",
)
"""The corruptions of the lab; gaps have a control of their own."""
MAX_GAP_S = 1.0
MAX_CLIP_S = 5.0
"""Of a longer clip, the lab shows only the beginning: a page must stay small."""
N_TUNING_CLIPS = 6


@dataclass(frozen=True)
class LabSettings:
    """What spoils which clip.

    Parameters
    ----------
    clip : str, the name of a clip of the data set
    noise : str, one of ``NOISES``
    amount : float, from 0 to :func:`max_amount`; its unit is in ``CORRUPTIONS``
    gap_s : float, seconds, from 0 to ``MAX_GAP_S``
        Length of one gap in each of three joints; 0 for none.
    """

    clip: str
    noise: str = "angular"
    amount: float = 0.5
    gap_s: float = 0.0

    def __post_init__(self) -> None:
        if self.noise not in NOISES:
            raise ValueError(f"expected a noise among {', '.join(NOISES)}; got {self.noise!r}")
        for name, value, largest in (
            ("amount", self.amount, max_amount(self.noise)),
            ("gap_s", self.gap_s, MAX_GAP_S),
        ):
            if not 0 <= value <= largest:
                raise ValueError(f"{name} must lie between 0 and {largest:g}, got {value}")

    @property
    def recipe(self) -> str:
        """The same as :func:`mocaplab.corruption.corrupt` reads it."""
        noise = f"{self.noise}:{self.amount:g}" if self.amount else "angular:0"
        return noise + (f"+long_gaps:{self.gap_s:g}" if self.gap_s else "")


def max_amount(noise: str) -> float:
    """Return the largest amount that the lab offers: twice the usual one."""
    return 2 * CORRUPTIONS[noise].amount


@dataclass(frozen=True, eq=False)
class Scene:
    """One clip, spoilt and cleaned by the networks, and all that a Gaussian could do.

    Parameters
    ----------
    settings : LabSettings
    corrupted : Corrupted
    filled : Motion
        What was observed, with straight lines across gaps.
    cleaned : dict of Motion, by ``"EBF"`` and ``"Blend"``
    sigma_s : array, shape (T, C), seconds
        The widths that EBF chose; 0 where nothing is smoothed.
    gaussian_rms : array, shape (look-aheads, widths), degrees
        RMS over all joint angles, for ``LOOK_AHEADS_S`` and ``WIDTHS_S``.
    tuned : array, shape (look-aheads,)
        For every look-ahead, which of the widths was best on other clips.
    """

    settings: LabSettings
    corrupted: Corrupted
    filled: Motion
    cleaned: dict[str, Motion]
    sigma_s: FloatArray
    gaussian_rms: FloatArray
    tuned: IntArray

    @cached_property
    def channels(self) -> IntArray:
        """Indices of the channels that move, which are those worth showing."""
        return np.flatnonzero(moving_channels(self.corrupted.clean))

    @property
    def tuned_sigma_s(self) -> float:
        """The width that was best on other clips, without a cut."""
        return float(WIDTHS_S[self.tuned[-1]])

    def gaussian(self, sigma_s: float, look_ahead_s: float | None = None) -> Motion:
        """Smooth what was observed; the root and what does not move stay as they are."""
        result, mask = self.filled.channels.copy(), self.corrupted.mask
        here = self.channels
        result[:, here] = gaussian(sigma_s, look_ahead_s).smooth(
            result[:, here], mask[:, here], self.filled.frame_time
        )
        return self.filled.with_channels(result)

    def methods(self, sigma_s: float, look_ahead_s: float | None = None) -> dict[str, Motion]:
        """Return every version of the clip that the lab compares.

        Parameters
        ----------
        sigma_s : float, seconds, the width of the Gaussian
        look_ahead_s : float or None, its look-ahead; the networks see the whole clip
        """
        tuned_s = float(WIDTHS_S[self.tuned[LOOK_AHEADS_S.index(look_ahead_s)]])
        return {
            "observed": self.filled,
            f"Gaussian {1000 * sigma_s:.0f} ms": self.gaussian(sigma_s, look_ahead_s),
            f"Gaussian tuned, {1000 * tuned_s:.0f} ms": self.gaussian(tuned_s, look_ahead_s),
            **self.cleaned,
        }

    def errors_deg(
        self, sigma_s: float, look_ahead_s: float | None = None, channel: str | None = None
    ) -> dict[str, float]:
        """Measure every method: RMS in degrees over one channel, or over all joint angles."""
        clean = self.corrupted.clean
        methods = self.methods(sigma_s, look_ahead_s)
        if channel is None:
            return {name: rms_all_deg(motion, clean) for name, motion in methods.items()}
        return {
            name: float(np.sqrt(np.mean((motion.channel(channel) - clean.channel(channel)) ** 2)))
            for name, motion in methods.items()
        }


class Laboratory:
    """Makes scenes from a data set, the same one for the same settings.

    Parameters
    ----------
    dataset : Dataset of at least two clips, of a skeleton that the shipped networks know
    """

    def __init__(self, dataset: Dataset):
        if len(dataset) < 2:
            raise ValueError(
                "the lab needs two clips or more: the Gaussian is tuned on clips that are not "
                f"shown; got {len(dataset)}"
            )
        self.dataset = dataset
        self.networks = {"EBF": Cleaner("ebf"), "Blend": Cleaner("blend")}
        chosen = np.linspace(0, len(dataset) - 1, N_TUNING_CLIPS).round().astype(int)
        self._tuning_clips = [dataset.clips[i] for i in np.unique(chosen)]
        self._tables: dict[str, dict[str, FloatArray]] = {}

    def scene(self, settings: LabSettings) -> Scene:
        """Spoil a clip and let every method clean it.

        Raises
        ------
        ValueError
            If there is no such clip, or a gap does not fit into a clip.
        """
        names = [clip.name for clip in self.dataset.clips]
        if settings.clip not in names:
            raise ValueError(f"no clip {settings.clip!r}; there are {', '.join(names)}")
        corrupted = self._spoil(self.dataset[settings.clip], settings.recipe)
        filled = lerp_gaps(corrupted.observed)
        cleaned = {
            name: network.denoise(corrupted.observed, corrupted.mask)
            for name, network in self.networks.items()
        }
        return Scene(
            settings,
            corrupted,
            filled,
            cleaned,
            self.networks["EBF"].predict_sigma_s(filled),
            _rms_table(corrupted),
            np.argmin(self._rms_on_others(settings), axis=1),
        )

    def _rms_on_others(self, settings: LabSettings) -> FloatArray:
        """Average the tables of the tuning clips, the shown one left out, as `tune` does."""
        if settings.recipe not in self._tables:
            self._tables[settings.recipe] = {
                clip.name: _rms_table(self._spoil(clip, settings.recipe))
                for clip in self._tuning_clips
            }
        tables = self._tables[settings.recipe]
        others = [table for name, table in tables.items() if name != settings.clip]
        mean: FloatArray = np.mean(others, axis=0)
        return mean

    def _spoil(self, clip: Motion, recipe: str) -> Corrupted:
        """Cut a clip and corrupt it, always in the same way."""
        frames = min(clip.n_frames, round(MAX_CLIP_S * clip.fps))
        return corrupt(clip.slice_frames(0, frames), recipe, rng=np.random.default_rng(1))


def _rms_table(clip: Corrupted) -> FloatArray:
    """Measure every Gaussian: RMS over all joint angles, (look-aheads, widths), degrees."""
    moving = moving_channels(clip.clean)
    values = lerp_gaps(clip.observed).channels[:, moving]
    table = squared_error_table(values, clip.clean.channels[:, moving], clip.clean.frame_time)
    rms: FloatArray = np.sqrt(table.sum(axis=2) / clip.clean.skeleton.is_cleaned.sum())
    return rms


def widest_channel(motion: Motion, channels: Sequence[int] | IntArray) -> str:
    """Return the label of the channel that moves most."""
    widest = int(np.argmax(motion.channels[:, channels].std(axis=0)))
    return motion.skeleton.channel_labels[int(channels[widest])]
