"""Example-based denoising: keep the motion near what clean examples span, ignore outliers.

After H. Lou and J. Chai, "Example-based human motion denoising", IEEE Transactions on
Visualization and Computer Graphics 16(5), 2010. Paper A compares with it. We could read the
abstract and what others say about the method, not the full text.

*From the paper (its abstract).* Filter bases are learned from clean motion. A noisy motion is
filtered by minimising an objective with two terms: the distance to the noisy input, measured
robustly so that outliers count little; and how well the result keeps the patterns in space and
time of the examples. From paper A: the bases come from a few clean samples, filter weights and
clean motion are found together, and bases for each type of motion work best.

*Our reading.* The bases are those of multichannel singular spectrum analysis: windows of all
channels are the rows of a matrix; the eigenvectors of its covariance with the largest
eigenvalues are the bases, as many as hold a given share of the energy. With noisy samples y,
clean ones x, a window x_w of them, bases B and weights c_w, we minimise

    sum rho((y - x) / noise)  +  strength * sum |(x_w - B c_w) / misfit|^2,

where rho is the Lorentzian, noise the deviation of the noise of a channel, estimated from the
signal itself, and misfit how far clean examples are from the bases (scaled to how much the
channel moves in this clip). Iteratively reweighted
least squares: given x, the weights are c_w = B' x_w; given those and the Lorentzian's weight of
each sample, x is a weighted mean of the sample and of the overlapping windows B c_w.

*What could not be known, and is our choice.* The length of the windows; the energy and the
strength, which are chosen on training clips; the solver; angles are centred on the mean of the
clip; windows are written in a few cosines a channel, so that bases fit every frame rate; the
bases come from all training clips together, because nobody tells the type of a new motion.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mocaplab.cosine_windows import (
    N_COEFFICIENTS,
    CosineWindows,
    at_most,
    check_skeleton,
    estimate_noise_std,
    inner_split,
)
from mocaplab.filters import filter_motion
from mocaplab.motion import (
    CONSTANT_STD_DEG,
    BoolArray,
    Corrupted,
    FloatArray,
    Motion,
    Skeleton,
    moving_channels,
)
from mocaplab.tuning import mean_rms

ENERGIES = (0.99, 0.997, 0.999, 0.9997)
"""The shares of the examples' energy that the bases may hold, of which fitting chooses one."""
STRENGTHS = (0.01, 0.03, 0.1, 0.3)
"""The factors on the second term that fitting chooses from. Clean clips are further from bases
of other clips than those clips themselves, so less than 1 may be best."""
OUTLIER_STD = 2.385
"""Residuals beyond so many noise deviations lose their weight: 95 % as good as least squares
if the noise is Gaussian (Holland and Welsch 1977). Not tuned: training without outliers would
switch the robustness off."""
ITERATIONS = 16
PIECE_FRAMES = 4096
"""Long clips are cleaned in pieces of so many frames, so that memory stays bounded."""


def learn_bases(second_moment: FloatArray, energy: float) -> FloatArray:
    """Find the orthonormal directions that hold most of the energy of some vectors.

    Parameters
    ----------
    second_moment : array, shape (D, D)
        The mean of the products of all pairs of entries, over windows.
    energy : float in (0, 1]

    Returns
    -------
    array, shape (D, m), as few columns as reach the energy
    """
    values, vectors = np.linalg.eigh(second_moment)
    share = np.cumsum(values[::-1]) / values.sum()
    m = int(np.searchsorted(share, energy * (1 - 1e-12))) + 1
    return vectors[:, ::-1][:, :m]


def lorentzian_weight(residual: FloatArray) -> FloatArray:
    """Return how much a sample counts, 1 at residual 0, for residuals in noise deviations."""
    weight: FloatArray = 1.0 / (1.0 + (residual / OUTLIER_STD) ** 2)
    return weight


def robust_projection(
    values: FloatArray,
    bases: FloatArray,
    stiffness: FloatArray,
    noise_std: FloatArray,
    frame_time: float,
) -> FloatArray:
    """Minimise the objective by iteratively reweighted least squares.

    Parameters
    ----------
    values : array, shape (T, C)
        Noisy, centred on 0.
    bases : array, shape (C * K, m), orthonormal columns
    stiffness : array, shape (C,)
        The weight of the second term where that of a trusted sample is 1.
    noise_std : array, shape (C,)
    frame_time : float, seconds

    Returns
    -------
    array, shape (T, C)
    """
    windows = CosineWindows(len(values), frame_time)
    result = values
    for _ in range(ITERATIONS):
        weights = windows.analyse(result) @ bases
        spanned = windows.synthesise(weights @ bases.T)
        trust = lorentzian_weight((values - result) / noise_std)
        result = (trust * values + stiffness * spanned) / (trust + stiffness)
    return result


class ExampleBasedDenoiser:
    """Robust filtering near the span of examples; made by :func:`fit_example_based`.

    Parameters
    ----------
    skeleton : Skeleton
    bases : array, shape (A, K, m)
        Orthonormal bases of the A cleaned channels (``Skeleton.is_cleaned``).
    misfit : array, shape (A,)
        How far clean examples are from the bases (root mean square), as a share of the movement
        of the channel; infinite if it never moved in the examples, and it is not cleaned then.
    strength : float
    """

    def __init__(self, skeleton: Skeleton, bases: FloatArray, misfit: FloatArray, strength: float):
        self.skeleton = skeleton
        self.bases = bases
        self.misfit = misfit
        self.strength = strength

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
        cleaned = self.skeleton.is_cleaned
        result = motion.channels.copy()
        if motion.n_frames < 4 or not moving_channels(motion).any():
            return result  # too short to tell noise from movement
        values = motion.channels[:, cleaned]
        noise, mean = estimate_noise_std(values, mask[:, cleaned]), values.mean(axis=0)
        noise = np.maximum(noise, 1e-6)  # degrees; a channel without noise has no outliers
        spread = np.maximum(values.std(axis=0), noise)
        stiffness = self.strength * (noise / (self.misfit * spread)) ** 2
        margin = 2 * CosineWindows(motion.n_frames, motion.frame_time).length
        for start in range(0, motion.n_frames, PIECE_FRAMES):
            first, stop = max(start - margin, 0), start + PIECE_FRAMES
            piece = values[first : stop + margin] - mean
            k = min(N_COEFFICIENTS, CosineWindows(len(piece), motion.frame_time).basis.shape[1])
            bases = _cut_bases(self.bases, k)
            smooth = robust_projection(piece, bases, stiffness, noise, motion.frame_time)
            result[start:stop, cleaned] = (smooth + mean)[start - first :][:PIECE_FRAMES]
        return result


def _cut_bases(bases: FloatArray, k: int) -> FloatArray:
    """Keep the first k cosines of each channel; orthonormal again if any were cut."""
    flat = bases[:, :k].reshape(-1, bases.shape[2])
    if k == bases.shape[1]:
        return flat
    vectors, values, _ = np.linalg.svd(flat, full_matrices=False)
    cut: FloatArray = vectors[:, values > 1e-3]  # what the lost cosines alone spanned is gone
    return cut


def fit_example_based(clips: Sequence[Corrupted]) -> ExampleBasedDenoiser:
    """Learn filter bases from the clean side of training clips.

    Energy and strength are chosen on every fifth clip, with bases from the others; then the
    bases are learned from all. With fewer than 5 clips they are chosen on the clips themselves.

    Parameters
    ----------
    clips : Corrupted clips of one skeleton; never test clips

    Raises
    ------
    ValueError
        If there is no clip, skeletons differ, or nothing moves.
    """
    learn_from, set_aside = inner_split(clips)
    tests = at_most(set_aside or clips, 5)
    skeleton = clips[0].clean.skeleton
    second_moment = _second_moment(learn_from)
    if not second_moment.any():
        raise ValueError("fitting needs a training clip in which something moves, got none")
    candidates = []
    for energy in ENERGIES:
        bases, misfit = _bases_and_misfit(second_moment, energy)
        for strength in STRENGTHS:
            denoiser = ExampleBasedDenoiser(skeleton, bases, misfit, strength)
            candidates.append((mean_rms(denoiser, tests), energy, strength))
    _, energy, strength = min(candidates)
    bases, misfit = _bases_and_misfit(_second_moment(clips), energy)
    return ExampleBasedDenoiser(skeleton, bases, misfit, strength)


def _second_moment(clips: Sequence[Corrupted]) -> FloatArray:
    """Average the products of all pairs of coefficients over the windows of clean clips."""
    cleaned = clips[0].clean.skeleton.is_cleaned
    n, n_windows = int(cleaned.sum()), 0
    total = np.zeros((n, N_COEFFICIENTS) * 2)
    for clip in clips:
        values = clip.clean.channels[:, cleaned]
        windows = CosineWindows(len(values), clip.clean.frame_time)
        k = windows.basis.shape[1]
        rows = windows.analyse(values - values.mean(axis=0))
        total[:, :k, :, :k] += (rows.T @ rows).reshape(n, k, n, k)
        n_windows += len(rows)
    return total.reshape(n * N_COEFFICIENTS, -1) / n_windows


def _bases_and_misfit(second_moment: FloatArray, energy: float) -> tuple[FloatArray, FloatArray]:
    """Learn bases, shape (A, K, m), and how far their own examples are from them, (A,)."""
    bases = learn_bases(second_moment, energy)
    held = np.einsum("dm,dm->d", second_moment @ bases, bases)  # of each coefficient's square
    missed = (np.diag(second_moment) - held).reshape(-1, N_COEFFICIENTS).sum(axis=1)
    power = np.diag(second_moment).reshape(-1, N_COEFFICIENTS).sum(axis=1)
    moved = power > CONSTANT_STD_DEG**2
    share = np.maximum(missed, 0.0) / np.where(moved, power, 1.0)
    misfit = np.where(moved, np.sqrt(np.maximum(share, 1e-4)), np.inf)
    return bases.reshape(-1, N_COEFFICIENTS, bases.shape[1]), misfit
