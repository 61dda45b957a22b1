"""Every method that cleans a motion, by name: what the comparisons run over.

A further method is one more line in ``METHODS``. Networks, which take minutes to train and
need torch, have only their names here. A ``fit`` sees training clips only, and
what it returns never sees a clean motion.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

from mocaplab.filters import Denoiser, GapFiller, GaussianDenoiser, Untouched
from mocaplab.gap_fillers.curves import pchip_gaps, spline_gaps
from mocaplab.kalman import fit_kalman
from mocaplab.motion import Corrupted
from mocaplab.smoothers import (
    Butterworth,
    fit_butterworth,
    fit_median_gaussian,
    fit_one_euro,
    fit_savgol,
)
from mocaplab.stein import SelfTunedGaussian
from mocaplab.tuning import tune_gaussian

Fit = Callable[[Sequence[Corrupted]], Denoiser]


@dataclass(frozen=True)
class Method:
    """A way to clean motions.

    Parameters
    ----------
    name : str
        For the command line and for files.
    label : str
        For titles and tables.
    fit : function
        Takes the training clips, a list of Corrupted, and returns a Denoiser.
    """

    name: str
    label: str
    fit: Fit


def _untuned(denoiser: Denoiser) -> Fit:
    return lambda clips: denoiser


def _fit_wiener(clips: Sequence[Corrupted]) -> Denoiser:
    from mocaplab.wiener import fit_wiener

    return fit_wiener(clips)


def _fit_example_based(clips: Sequence[Corrupted]) -> Denoiser:
    from mocaplab.example_based import fit_example_based

    return fit_example_based(clips)


def _fit_pca(clips: Sequence[Corrupted]) -> Denoiser:
    from mocaplab.gap_fillers.pca import fit_pca_gaps

    return GapFiller(fit_pca_gaps(clips))


def _fit_lowrank(clips: Sequence[Corrupted]) -> Denoiser:
    from mocaplab.gap_fillers.lowrank import fit_lowrank_gaps

    return GapFiller(fit_lowrank_gaps(clips))


def _fit_gap_gaussian(clips: Sequence[Corrupted]) -> Denoiser:
    from mocaplab.gap_fillers.gaussian_fit import fit_gaussian_filler

    return GapFiller(fit_gaussian_filler(clips))


METHODS: dict[str, Method] = {
    method.name: method
    for method in (
        # These fill gaps and smooth nothing.
        Method("noisy", "observed, gaps by lines", _untuned(Untouched())),
        Method("pchip", "gaps by PCHIP", _untuned(GapFiller(pchip_gaps))),
        Method("spline", "gaps by a spline", _untuned(GapFiller(spline_gaps))),
        Method("pca", "gaps by PCA", _fit_pca),
        Method("lowrank", "gaps by low rank and Kalman", _fit_lowrank),
        Method("gap_gaussian", "gaps by a conditional Gaussian", _fit_gap_gaussian),
        # All others fill gaps by straight lines.
        Method("gaussian_58", "Gaussian 58 ms", _untuned(GaussianDenoiser(0.058))),
        Method("gaussian_125", "Gaussian 125 ms", _untuned(GaussianDenoiser(0.125))),
        Method(
            "gaussian_tuned",
            "Gaussian tuned",
            lambda clips: GaussianDenoiser(tune_gaussian(clips)[0]),
        ),
        Method(
            "gaussian_tuned_channel",
            "Gaussian tuned per channel",
            lambda clips: GaussianDenoiser(tune_gaussian(clips)[1]),
        ),
        Method("gaussian_self", "Gaussian self-tuned per channel", _untuned(SelfTunedGaussian())),
        Method("savgol", "Savitzky-Golay", fit_savgol),
        Method("butterworth", "Butterworth tuned", fit_butterworth),
        Method(
            "butterworth_channel",
            "Butterworth tuned per channel",
            partial(fit_butterworth, per_channel=True),
        ),
        Method("butterworth_6hz", "Butterworth 6 Hz", _untuned(Butterworth(6.0))),
        Method("median_gaussian", "median and Gaussian", fit_median_gaussian),
        Method("one_euro", "One-Euro (causal)", fit_one_euro),
        Method("kalman", "Kalman smoother", fit_kalman),
        Method(
            "kalman_channel", "Kalman smoother per channel", partial(fit_kalman, per_channel=True)
        ),
        Method("wiener", "Wiener", _fit_wiener),
        Method("example_based", "example-based (Lou and Chai)", _fit_example_based),
    )
}
"""All methods but the networks, by name."""


NETWORK_LABELS = {
    "ebf": "EBF",
    "ebf_bias": "EBF with bias",
    "ebf_free": "EBF, free kernels",
    "bf": "BF (no encoder)",
    "nn": "NN (dense layers)",
    "ebd_denoiser": "EBD as denoiser",
    "blend": "Blend",
    "ebd": "gaps by EBD",
}
"""The networks, name -> label; :mod:`mocaplab.comparison.network_methods` trains them.

They learn from the clean training clips, with angular noise of all amounts that they draw
themselves. So one network serves for all corruptions. ``"ebf@uniform:0.5"`` is an EBF that is
trained on one recipe alone.
"""


PIPELINES = {"ebd_ebf": ("ebd", "ebf")}
"""Two networks, one after the other: the first fills the gaps, the second cleans what comes out."""


def part_network(method: str) -> tuple[str, str | None] | None:
    """Part the name of a network's method into the network and its recipe, if it has one.

    Returns
    -------
    (network, recipe or None), or None if the method is no network
    """
    network, at, recipe = method.partition("@")
    known = network in NETWORK_LABELS or network in PIPELINES
    return (network, recipe if at else None) if known else None


def network_label(network: str, recipe: str | None) -> str:
    """Return how tables call a network, and what it was trained on if that is one recipe."""
    parts = PIPELINES.get(network, (network,))
    label = ", then ".join(NETWORK_LABELS[part] for part in parts)
    return f"{label}, trained on {recipe}" if recipe else label
