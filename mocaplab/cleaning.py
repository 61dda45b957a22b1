"""The cleaner: a noisy motion in, a clean motion out."""

from __future__ import annotations

import os
from dataclasses import dataclass
from importlib.resources import as_file, files

import numpy as np
import torch

from mocaplab.checkpoints import Checkpoint, load_checkpoint
from mocaplab.filters import filter_motion, gaussian_filter
from mocaplab.gap_filling import lerp_gaps
from mocaplab.motion import BoolArray, FloatArray, Motion, moving_channels
from mocaplab.movement import jitter, root_angular_velocity
from mocaplab.networks import EBF
from mocaplab.normalization import standardize

SHIPPED = ("ebf", "blend")
"""The models that come with the package, trained on CMU clips of 31 joints."""


def shipped_checkpoint(name: str) -> Checkpoint:
    """Load a model that comes with the package; ``name`` is one of ``SHIPPED``."""
    with as_file(files("mocaplab") / "data" / f"{name}.safetensors") as path:
        return load_checkpoint(path)


class Cleaner:
    """Clean motions with a network. Fits the :class:`mocaplab.filters.Denoiser` protocol.

    Gaps are filled by straight lines, then the network cleans every joint angle. A channel
    that never moved in the training clips, but moves here, is smoothed with the single
    Gaussian width that was tuned on them: the network knows nothing of it. The root, and
    channels that do not move, come out exactly as they went in.

    Parameters
    ----------
    model : Checkpoint, path of a model file, or the name of a model in the package
        ``"blend"`` is the best, ``"ebf"`` is the network of paper A.
    """

    def __init__(self, model: Checkpoint | str | os.PathLike[str] = "blend"):
        if model in SHIPPED:
            model = shipped_checkpoint(str(model))
        elif not isinstance(model, Checkpoint):
            model = load_checkpoint(model)
        self.checkpoint = model

    def clean(self, motion: Motion) -> Motion:
        """Clean a motion whose gaps, if any, are NaN.

        Raises
        ------
        ValueError
            If the model was trained for another skeleton or frame rate.

        Warns
        -----
        mocaplab.gap_filling.GapWarning
            If a channel was never observed; it is left at rest.
        """
        return self.denoise(motion, ~np.isnan(motion.channels))

    def denoise(self, observed: Motion, mask: BoolArray) -> Motion:
        """Return the cleaned motion; see :class:`mocaplab.filters.Denoiser`."""
        self.checkpoint.require(observed.skeleton, observed.frame_time, observed.name)
        return filter_motion(observed, self._smooth)

    def predict_sigma_s(self, motion: Motion) -> FloatArray:
        """Predict how wide each angle is smoothed in each frame.

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
            If the model is not one that predicts widths, or was trained for another skeleton.
        """
        self.checkpoint.require(motion.skeleton, motion.frame_time, motion.name)
        model = self.checkpoint.model
        if not isinstance(model, EBF) or model.config.kernel != "gaussian":
            raise ValueError(f"{type(model).__name__} predicts no widths of Gaussians")
        inputs, _ = self._inputs(motion)
        with torch.no_grad():
            sigma, _ = model.predict(*inputs)
        result = np.zeros_like(motion.channels)
        result[:, self.checkpoint.columns(motion.skeleton)] = sigma[0].numpy() * motion.frame_time
        result[:, self.checkpoint.constant] = self.checkpoint.gaussian_s
        result[:, ~moving_channels(motion)] = 0.0
        return result

    def _inputs(self, motion: Motion) -> tuple[list[torch.Tensor], FloatArray]:
        """Return the pose and the root's velocity as a batch of one, and the pose's scale."""
        columns = self.checkpoint.columns(motion.skeleton)
        mean, std = motion.channels.mean(axis=0), motion.channels.std(axis=0)
        pose = standardize(motion.channels, mean, std)[:, columns]
        inputs = [torch.from_numpy(x).float()[None] for x in (pose, root_angular_velocity(motion))]
        return inputs, std[columns]

    def _smooth(self, motion: Motion) -> FloatArray:
        """Clean a continuous motion without gaps."""
        inputs, scale = self._inputs(motion)
        with torch.no_grad():
            change = self.checkpoint.model(*inputs) - inputs[0]
        result = motion.channels.copy()
        # Adding the change to the angles keeps the digits that float32 has no room for.
        result[:, self.checkpoint.columns(motion.skeleton)] += change[0].numpy() * scale
        unknown = self.checkpoint.constant & moving_channels(motion)
        width_s = self.checkpoint.gaussian_s
        result[:, unknown] = gaussian_filter(
            motion.channels[:, unknown], width_s, motion.frame_time
        )
        return result


@dataclass(frozen=True)
class CleaningReport:
    """What cleaning did to a motion."""

    n_channels: int
    n_changed: int  # channels with at least one changed sample
    n_filled: int  # samples that were inside gaps
    jitter_before: float  # file length units per second cubed, gaps filled by lerp
    jitter_after: float
    rms_change_deg: float  # over the changed channels
    largest_change_deg: float
    largest_channel: str  # where the largest change was made
    largest_frame: int

    def __str__(self) -> str:
        if not self.n_changed:
            return "nothing was changed"
        fewer = 100 * (1 - self.jitter_after / self.jitter_before) if self.jitter_before else 0
        lines = [
            f"jitter (mean joint jerk)  before {self.jitter_before:,.0f}  "
            f"after {self.jitter_after:,.0f} units/s^3  ({-fewer:+.0f} %)",
            f"changed   {self.n_changed} of {self.n_channels} channels, "
            f"by {self.rms_change_deg:.2f} degrees RMS",
            f"largest   {self.largest_change_deg:.1f} degrees at {self.largest_channel}, "
            f"frame {self.largest_frame}",
            f"as before {self.n_channels - self.n_changed} channels: the root and those that "
            f"do not move",
        ]
        if self.jitter_after > self.jitter_before:
            lines.append(
                "note      jitter rose: the file was clean, or its joints trembled together with "
                "the root, which is left as it is"
            )
        if self.n_filled:
            lines.append(f"filled    {self.n_filled} samples inside gaps")
        return "\n".join(lines)


def report_changes(before: Motion, after: Motion) -> CleaningReport:
    """Compare a motion before and after cleaning.

    Parameters
    ----------
    before, after : Motion
        Of one skeleton and length; ``before`` may have NaN.
    """
    gaps = np.isnan(before.channels)
    filled = lerp_gaps(before)
    change = np.abs(after.channels - filled.channels)
    changed = change.any(axis=0)
    frame, channel = np.unravel_index(np.argmax(change), change.shape)
    return CleaningReport(
        n_channels=before.skeleton.n_channels,
        n_changed=int(changed.sum()),
        n_filled=int(gaps.sum()),
        jitter_before=jitter(filled),
        jitter_after=jitter(after),
        rms_change_deg=float(np.sqrt(np.mean(change[:, changed] ** 2))) if changed.any() else 0.0,
        largest_change_deg=float(change[frame, channel]),
        largest_channel=before.skeleton.channel_labels[channel],
        largest_frame=int(frame),
    )
