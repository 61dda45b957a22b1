"""Run a trained network on a motion that it was made for: its skeleton, its frame rate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from mocaplab.blend import Blend
from mocaplab.checkpoints import Checkpoint
from mocaplab.estimate_bank import MIDDLE, SIGMAS, noise_std
from mocaplab.filters import gaussian_filter
from mocaplab.measures.movement import root_angular_velocity
from mocaplab.motion import CONSTANT_STD_DEG, BoolArray, FloatArray, Motion, Skeleton
from mocaplab.networks import EBF
from mocaplab.normalization import standardize


@dataclass(frozen=True, eq=False)
class ClipScale:
    """What the network is told of the whole clip, whatever piece of it is cleaned.

    Parameters
    ----------
    mean, std : array, shape (C,), degrees
    noise : array, shape (C,)
        How strong the noise is, in units of ``std``.
    """

    mean: FloatArray
    std: FloatArray
    noise: FloatArray

    @property
    def noise_deg(self) -> FloatArray:
        """How strong the noise is, degrees; 0 for channels that do not move, shape (C,)."""
        return np.where(self.std >= CONSTANT_STD_DEG, self.noise * self.std, 0.0)


def measure_scale(channels: FloatArray, hidden: BoolArray) -> ClipScale:
    """Measure a clip, channel by channel.

    Parameters
    ----------
    channels : array, shape (T, C), continuous, without NaN
    hidden : array, shape (T, C), bool
        Samples that were filled: too smooth to tell the noise from.
    """
    mean, std = channels.mean(axis=0), channels.std(axis=0)
    # In two steps, since each alone would need several times the memory of the clip.
    pose = torch.empty(1, *channels.shape)
    for column in range(channels.shape[1]):
        pose[0, :, column] = torch.from_numpy(
            standardize(channels[:, column], mean[column], std[column])
        )
    noise = noise_std(pose)[0].double().numpy()
    for column in np.flatnonzero(hidden.any(axis=0) & (std >= CONSTANT_STD_DEG)).tolist():
        seen = pose[:, torch.from_numpy(~hidden[:, column]), column, None]
        noise[column] = float(noise_std(seen)[0, 0])
    return ClipScale(mean, std, noise)


class NetworkRunner:
    """A network with what it takes to apply it.

    Parameters
    ----------
    checkpoint : Checkpoint
    skeleton : Skeleton, with the channels of the model
    """

    def __init__(self, checkpoint: Checkpoint, skeleton: Skeleton):
        self.checkpoint = checkpoint
        self.columns = checkpoint.columns(skeleton)

    def clean(self, motion: Motion, scale: ClipScale, noise_factor: float = 1.0) -> FloatArray:
        """Return cleaned channels, shape (T, C).

        Parameters
        ----------
        motion : Motion
            Of the model's channels and frame rate, continuous, without NaN.
        scale : ClipScale
        noise_factor : float
            How much stronger the noise seems than it was measured: see
            :attr:`mocaplab.cleaner.rate_matching.RateMatch.noise_factor`.
        """
        inputs = self._inputs(motion, scale, noise_factor)
        with torch.no_grad():
            change = self.checkpoint.model(*inputs) - inputs[0]
        result = motion.channels.copy()
        # Adding the change to the angles keeps the digits that float32 has no room for.
        result[:, self.columns] += change[0].numpy() * scale.std[self.columns]
        unknown = self._smoothed_by_gaussian(motion.skeleton, scale)
        result[:, unknown] = gaussian_filter(
            motion.channels[:, unknown], self.checkpoint.gaussian_s, motion.frame_time
        )
        return result

    def widths_s(self, motion: Motion, scale: ClipScale, noise_factor: float = 1.0) -> FloatArray:
        """Return how widely each angle is smoothed in each frame, shape (T, C), seconds.

        For EBF with Gaussians these are its widths. For Blend it is the mean of the widths of
        what it mixes, weighted as it mixes them: the pose as it came has width 0, and the
        linear estimate counts like the Gaussian with which Blend compares it. 0 where nothing
        is smoothed; NaN for a network that neither smooths by Gaussians nor mixes.
        """
        model = self.checkpoint.model
        inputs = self._inputs(motion, scale, noise_factor)
        with torch.no_grad():
            if isinstance(model, Blend):
                widths = torch.tensor([0.0, *SIGMAS, SIGMAS[MIDDLE - 1]])
                frames = (model.weights(*inputs) @ widths)[0].numpy()
            elif isinstance(model, EBF) and model.config.kernel == "gaussian":
                frames = model.predict(*inputs)[0][0].numpy()
            else:
                frames = np.full(inputs[0].shape[1:], np.nan)
        result = np.zeros_like(motion.channels)
        result[:, self.columns] = frames * motion.frame_time
        result[:, self._smoothed_by_gaussian(motion.skeleton, scale)] = self.checkpoint.gaussian_s
        result[:, ~self._moving(motion.skeleton, scale)] = 0.0
        return result

    def _inputs(self, motion: Motion, scale: ClipScale, noise_factor: float) -> list[Tensor]:
        """Return pose and velocity of the root as a batch of one; for Blend the noise, too."""
        pose = standardize(motion.channels, scale.mean, scale.std)[:, self.columns]
        inputs = [torch.from_numpy(x).float()[None] for x in (pose, root_angular_velocity(motion))]
        if isinstance(self.checkpoint.model, Blend):
            still = scale.std < CONSTANT_STD_DEG
            noise = np.where(still, 1.0, scale.noise * noise_factor)[self.columns]
            inputs.append(torch.from_numpy(noise).float()[None])
        return inputs

    def _moving(self, skeleton: Skeleton, scale: ClipScale) -> BoolArray:
        return (scale.std >= CONSTANT_STD_DEG) & skeleton.is_cleaned

    def _smoothed_by_gaussian(self, skeleton: Skeleton, scale: ClipScale) -> BoolArray:
        """Tell which channels move here and never did in training, shape (C,)."""
        return self.checkpoint.constant & self._moving(skeleton, scale)
