"""A Gaussian that tunes itself on the noisy clip: no training clips, and no clean one.

How can a filter be judged without the truth? For white noise of known variance n, Stein found that
the mean squared error of the filtered signal y is estimated without bias by

    mean((y - x)^2) + 2 n w - n,

where x is the noisy signal and w the weight that the filter gives to a sample in its own place. The
first term alone would choose no smoothing at all; the second is the price of following the noise.

Source: C. Stein, "Estimation of the mean of a multivariate normal distribution", The Annals of
Statistics 9 (1981). It is usually called SURE, Stein's unbiased risk estimate.
"""

from __future__ import annotations

import numpy as np

from mocaplab.cosine_windows import estimate_noise_std
from mocaplab.filters import Smoother, gaussian_filter
from mocaplab.motion import BoolArray, FloatArray
from mocaplab.tuning import SIGMA_GRID_S


class SelfTunedGaussian(Smoother):
    """One Gaussian a channel, whose width has the smallest estimated error on the clip itself.

    The noise is taken for white and is measured in the clip. Of the widths in ``SIGMA_GRID_S``
    each channel gets its own. Samples inside gaps have no say.
    """

    def smooth(self, values: FloatArray, mask: BoolArray, frame_time: float) -> FloatArray:
        """Return the smoothed channels; see :class:`mocaplab.filters.Smoother`."""
        variance = estimate_noise_std(values, mask) ** 2
        smoothed = values.copy()
        least = np.full(values.shape[1], np.inf)
        for sigma_s in SIGMA_GRID_S:
            candidate = gaussian_filter(values, sigma_s, frame_time)
            risk = estimated_risk(
                values, candidate, mask, variance, own_weight(sigma_s, frame_time, len(values))
            )
            better = risk < least
            smoothed[:, better], least[better] = candidate[:, better], risk[better]
        return smoothed


def own_weight(sigma_s: float, frame_time: float, n_frames: int) -> float:
    """Return the weight that a Gaussian gives to a sample in its own place, 0 to 1.

    It is the mean over the frames of a clip: near the ends, where the clip is continued by its
    mirror image, a sample is counted twice.
    """
    radius = int(np.ceil(4 * sigma_s / frame_time))
    impulse = np.zeros((4 * radius + 1, 1))
    impulse[2 * radius] = 1.0
    kernel = gaussian_filter(impulse, sigma_s, frame_time)[2 * radius :, 0]  # from its middle on
    return float(kernel[0] + 2.0 / n_frames * kernel[1 : 2 * n_frames : 2].sum())


def estimated_risk(
    noisy: FloatArray,
    smoothed: FloatArray,
    mask: BoolArray,
    variance: FloatArray,
    own: float,
) -> FloatArray:
    """Estimate the mean squared error of each smoothed channel, without the clean one.

    Parameters
    ----------
    noisy, smoothed : arrays, shape (T, C), degrees
    mask : array, shape (T, C), bool; True where a sample was observed
    variance : array, shape (C,), degrees squared, of the noise
    own : float, the weight that the filter gives to a sample in its own place

    Returns
    -------
    array, shape (C,), degrees squared
    """
    squares = np.where(mask, (smoothed - noisy) ** 2, 0.0).sum(axis=0)
    residual = squares / np.maximum(mask.sum(axis=0), 1)
    return np.asarray(residual + (2.0 * own - 1.0) * variance)
