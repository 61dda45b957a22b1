"""The Wiener filter: the best linear estimate of the clean motion, learned from examples.

Cut a motion into short windows and describe a window by a few cosine (DCT) coefficients a
channel: a vector x. We observe y = x + n with noise n that has nothing to do with x. Of all
matrices A, the mean square error of A y is smallest for

    A = C_xy C_yy^-1 = C_x (C_x + C_n)^-1,

with the covariances C_x of clean windows and C_n of the noise (linear minimum mean square
error, Wiener 1949). It weighs what usually happens against how noisy the recording is. C_x
says two things at once: how smooth a channel is, and which channels move together, so a joint
is also cleaned by what all other joints do. For Gaussian x and n no estimator at all is better.

Neither covariance of a new clip is known. What we do about it:

- *Scale.* A channel of a clip is centred on its mean and divided by its own standard deviation.
  So C_x says how channels move together, not how far, and serves unfamiliar clips.
- *Noise.* Movement is smooth and noise is not, so third differences hold almost only noise
  (:func:`mocaplab.cosine_windows.estimate_noise_std`). No noise level is given from outside.
- *Shrinkage.* Correlations between channels that the training clips suggest are reduced by a
  share that is chosen on training clips which were not used to find them.
- *The clip's own habits* (empirical Bayes). The training covariance counts as ``PRIOR_WINDOWS``
  windows seen before; those of the clip itself, cleaned once, are added to them. This is a step
  of the EM algorithm.
- *Bursts.* A clip has quiet and violent moments. In each window, the covariance is g C_x with
  an unknown g. We take the estimates for several g, and average them with the probability that
  y gives to each (a Gaussian scale mixture; Portilla et al. 2003 use it for images).

- *Faster than the cosines.* What they cannot show is cleaned channel by channel, with the same
  formula for one number: signal power / (signal power + noise power), measured around a frame.

The last three make the whole filter adaptive; given covariance and g it is linear.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from mocaplab.cosine_windows import (
    BLOCK,
    N_COEFFICIENTS,
    CosineWindows,
    at_most,
    check_skeleton,
    estimate_noise_std,
    inner_split,
)
from mocaplab.filters import filter_motion, gaussian_filter
from mocaplab.motion import BoolArray, Corrupted, FloatArray, Motion, Skeleton, moving_channels
from mocaplab.tuning import mean_rms

PRIOR_WINDOWS = 50.0
"""How many windows of the clip itself weigh as much as all training clips."""
SCALES = (0.03, 0.1, 0.3, 1.0, 3.0, 10.0)
"""The values of g, how violent a window is, that are averaged."""
REST_S = 0.3
"""The time over which the power of what the cosines leave over is averaged, seconds."""
SAFETY = 1.5
"""How much stronger than noise that rest must be, so that chance does not let noise through."""
SHRINKAGES = (0.03, 0.1, 0.3)
"""The shares of the correlations between channels to remove, of which fitting chooses one."""


def wiener_estimate(
    observed: ArrayLike, signal_cov: ArrayLike, noise_var: ArrayLike
) -> tuple[FloatArray, FloatArray]:
    """Estimate vectors with mean 0 from noisy ones: C_x (C_x + C_n)^-1 y.

    Parameters
    ----------
    observed : array, shape (N, D), one vector a row
    signal_cov : array, shape (D, D)
    noise_var : array, shape (D,), all positive
        The noise of different entries is independent.

    Returns
    -------
    estimate : array, shape (N, D)
    error_cov : array, shape (D, D)
        The covariance of what is still wrong with an estimate.
    """
    signal_cov = np.asarray(signal_cov, dtype=np.float64)
    gain = np.linalg.solve(signal_cov + np.diag(np.asarray(noise_var)), signal_cov)  # A, transposed
    return np.asarray(observed) @ gain, signal_cov - signal_cov @ gain


def scale_mixture_estimate(
    observed: ArrayLike,
    signal_cov: ArrayLike,
    noise_var: ArrayLike,
    scales: Sequence[float] = SCALES,
) -> FloatArray:
    """Estimate as :func:`wiener_estimate`, where each row's covariance has an unknown scale.

    In the eigenvectors of the covariance (measured in noise) all entries are independent, so
    each scale needs a division only. All scales are equally likely before y is seen.

    Parameters
    ----------
    observed, signal_cov, noise_var : see :func:`wiener_estimate`
    scales : the values that g may have

    Returns
    -------
    array, shape (N, D)
    """
    noise_std = np.sqrt(np.asarray(noise_var, dtype=np.float64))
    whitened_cov = np.asarray(signal_cov) / np.outer(noise_std, noise_std)
    eigenvalues, vectors = np.linalg.eigh(whitened_cov)
    scaled = np.outer(scales, np.maximum(eigenvalues, 0.0))  # (G, D)
    observed = np.asarray(observed, dtype=np.float64)
    estimate = np.empty_like(observed)
    for start in range(0, len(observed), BLOCK):
        rows = slice(start, start + BLOCK)
        y = observed[rows] / noise_std @ vectors  # (N, D)
        log_p = -0.5 * (y**2 @ (1.0 / (scaled + 1.0)).T + np.log(scaled + 1.0).sum(axis=1))
        p = np.exp(log_p - log_p.max(axis=1, keepdims=True))
        gain = p / p.sum(axis=1, keepdims=True) @ (scaled / (scaled + 1.0))
        estimate[rows] = (gain * y) @ vectors.T * noise_std
    return estimate


class WienerDenoiser:
    """Wiener filter over windows and channels; made by :func:`fit_wiener`.

    Parameters
    ----------
    skeleton : Skeleton
    covariance : array, shape (A, K, A, K)
        Of the A cleaned channels (``Skeleton.is_cleaned``), K coefficients each, scaled.
    """

    def __init__(self, skeleton: Skeleton, covariance: FloatArray):
        self.skeleton = skeleton
        self.covariance = covariance

    def denoise(self, observed: Motion, mask: BoolArray) -> Motion:
        """Return the cleaned motion; see :class:`mocaplab.filters.Denoiser`.

        Raises
        ------
        ValueError
            If the motion has another skeleton than the training clips.
        """
        check_skeleton(self.skeleton, observed)
        return filter_motion(observed, lambda motion: self._smooth(motion, mask))

    def _smooth(self, motion: Motion, mask: BoolArray) -> FloatArray:
        moving = moving_channels(motion)
        result = motion.channels.copy()
        if motion.n_frames < 4 or not moving.any():
            return result  # too short to tell noise from movement
        values = motion.channels[:, moving]
        noise, mean = estimate_noise_std(values, mask[:, moving]), values.mean(axis=0)
        # Never less than a tenth of the noise: a channel may be nothing but noise.
        spread = np.sqrt(np.maximum(values.var(axis=0) - noise**2, 0.01 * noise**2))
        windows = CosineWindows(motion.n_frames, motion.frame_time)
        scaled = (values - mean) / spread
        y = windows.analyse(scaled)
        k = windows.basis.shape[1]
        # The 1e-6 keeps a channel without noise from dividing by 0.
        noise_var = np.repeat((noise / spread) ** 2 + 1e-6, k) / windows.length
        index = np.flatnonzero(moving[self.skeleton.is_cleaned])
        prior = self.covariance[index][:, :k, index, :k].reshape(y.shape[1], y.shape[1])
        covariance = _adapt(prior, y, noise_var, motion.n_frames / windows.length)
        x = scale_mixture_estimate(y, covariance, noise_var)
        rest = _clean_rest(scaled - windows.synthesise(y), noise / spread, windows, motion)
        result[:, moving] = (windows.synthesise(x) + rest) * spread + mean
        return result


def _clean_rest(
    rest: FloatArray, noise: FloatArray, windows: CosineWindows, motion: Motion
) -> FloatArray:
    """Keep of the fast rest, which the cosines cannot show, what is stronger than noise."""
    noise_share = 1.0 - windows.basis.shape[1] / windows.length
    power = gaussian_filter(rest**2, REST_S, motion.frame_time)
    noise_power = SAFETY * noise_share * noise**2
    kept: FloatArray = rest * np.maximum(1.0 - noise_power / np.maximum(power, 1e-12), 0.0)
    return kept


def _adapt(prior: FloatArray, y: FloatArray, noise_var: FloatArray, n_windows: float) -> FloatArray:
    """Mix the training covariance with that of the clip itself, counted without overlap."""
    estimate, error_cov = wiener_estimate(y, prior, noise_var)
    own = estimate.T @ estimate / len(y) + error_cov
    mixed: FloatArray = (PRIOR_WINDOWS * prior + n_windows * own) / (PRIOR_WINDOWS + n_windows)
    return mixed


def fit_wiener(clips: Sequence[Corrupted]) -> WienerDenoiser:
    """Learn how clean motions move from training clips.

    The shrinkage is chosen on every fifth clip, with a covariance from the others; then the
    covariance of all clips is taken. With fewer than 5 clips the middle shrinkage is used.

    Parameters
    ----------
    clips : Corrupted clips of one skeleton; never test clips

    Raises
    ------
    ValueError
        If there is no clip, skeletons differ, or nothing moves.
    """
    learn_from, set_aside = inner_split(clips)
    skeleton = clips[0].clean.skeleton
    moment = sum((_clip_moment(clip.clean) for clip in learn_from), _no_moment(skeleton))
    rest = sum((_clip_moment(clip.clean) for clip in set_aside), _no_moment(skeleton))
    if not (moment + rest).any():
        raise ValueError("fitting needs a training clip in which something moves, got none")
    shrinkage = SHRINKAGES[1]
    if set_aside and moment.any():
        tests = at_most(set_aside, 5)
        candidates = [WienerDenoiser(skeleton, _covariance(moment, s)) for s in SHRINKAGES]
        errors = [mean_rms(candidate, tests) for candidate in candidates]
        shrinkage = SHRINKAGES[int(np.argmin(errors))]
    return WienerDenoiser(skeleton, _covariance(moment + rest, shrinkage))


def _no_moment(skeleton: Skeleton) -> FloatArray:
    return np.zeros((int(skeleton.is_cleaned.sum()), N_COEFFICIENTS) * 2)


def _clip_moment(clean: Motion) -> FloatArray:
    """Sum the products of all pairs of scaled coefficients over a clean clip, (A, K, A, K)."""
    moving = moving_channels(clean)[clean.skeleton.is_cleaned]
    values = clean.channels[:, clean.skeleton.is_cleaned]
    values = (values - values.mean(axis=0)) * np.where(moving, 1 / (values.std(axis=0) + 1e-9), 0.0)
    windows = CosineWindows(clean.n_frames, clean.frame_time)
    k = windows.basis.shape[1]
    x = windows.analyse(values)
    moment = _no_moment(clean.skeleton)
    moment[:, :k, :, :k] = (x.T @ x).reshape(len(moving), k, len(moving), k)
    return moment


def _covariance(moment: FloatArray, shrinkage: float) -> FloatArray:
    """Make the covariance out of summed moments: each channel scaled to variance 1, shrunk."""
    n = len(moment)
    power = np.einsum("akak->a", moment)
    scale = np.where(power > 0, 1 / np.sqrt(np.where(power > 0, power, 1.0)), 0.0)
    covariance = moment * scale[:, None, None, None] * scale[:, None]
    own = np.einsum("aiaj->aij", covariance).copy()
    # A channel that never moved in training is assumed to move like an average one.
    own[power == 0] = own[power > 0].mean(axis=0)
    covariance *= 1 - shrinkage
    each = np.arange(n)
    covariance[each, :, each] = own
    return covariance
