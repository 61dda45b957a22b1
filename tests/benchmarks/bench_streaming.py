"""Measure a stream: what a frame costs, and what a look-ahead buys.

    python tests/benchmarks/bench_streaming.py                            cost only
    python tests/benchmarks/bench_streaming.py --errors                   on embedded clips
    python tests/benchmarks/bench_streaming.py --errors --data FOLDER     on your clean clips

Cost: CPU milliseconds a frame on one core, median and 99th percentile, as a share of the time
between two frames, and over the floor: nothing but the matrix products that the frame needs. (In
a recurrence each waits for the one before, so they are products of a matrix and a vector.)

Errors: RMS in degrees over all joint angles, mean over held-out clips with 0.5 noise. All that can
be tuned is tuned anew for each look-ahead, on clips that were not held out.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np

from mocaplab.cleaning import Cleaner
from mocaplab.datasets import load_dataset, split_holdout
from mocaplab.evaluation import format_table
from mocaplab.filters import Denoiser, GaussianDenoiser, Smoother
from mocaplab.live.bank import N_PAST, kernels
from mocaplab.live.blend import LiveBlend
from mocaplab.live.ebf import LiveEBF
from mocaplab.live.filters import LiveFilter, LiveGaussian
from mocaplab.measures.by_name import rms_all_deg
from mocaplab.motion import BoolArray, Corrupted, FloatArray, Motion, moving_channels
from mocaplab.noise.draws import draw_test, draw_training
from mocaplab.smoothers import OneEuro
from mocaplab.streaming import Stream, stream_motion
from mocaplab.tuning import squared_errors, tune_gaussian

LOOK_AHEADS = (0, 2, 4, 7, 10, 15)  # frames
WIDTHS_S = np.geomspace(0.006, 0.06, 14)


def cost_table(clip: Motion) -> list[list[str]]:
    rows = [["stream", "look-ahead ms", "p50 ms", "p99 ms", "p50 % of period", "p50 / floor"]]
    live: LiveFilter
    for look_ahead in (0, 3, 7, 15):
        live = LiveEBF(look_ahead_s=look_ahead * clip.frame_time)
        row = cost_row("LiveEBF", clip, live)
        floor = np.median(cpu_ms(lambda step: step(), [ebf_products(live, look_ahead)] * 300))
        rows.append([*row, f"{float(row[2]) / floor:.1f}"])
    for look_ahead in (0, 15):
        blend = LiveBlend(look_ahead_s=look_ahead * clip.frame_time)
        row = cost_row("LiveBlend", clip, blend)
        floor = np.median(cpu_ms(lambda step: step(), [blend_products(blend, look_ahead)] * 300))
        rows.append([*row, f"{float(row[2]) / floor:.1f}"])
    rows.append([*cost_row("LiveGaussian 32 ms", clip, LiveGaussian(0.032)), "-"])
    return rows


def cost_row(name: str, clip: Motion, live: LiveFilter) -> list[str]:
    stream = Stream(clip.skeleton, clip.frame_time, live)
    ms = cpu_ms(stream.push, list(clip.channels))[60:]  # the first frames only fill the window
    middle, high = np.percentile(ms, (50, 99))
    period_ms = 1000 * clip.frame_time
    ahead = f"{1000 * stream.latency_s:.0f}"
    return [name, ahead, f"{middle:.3f}", f"{high:.3f}", f"{100 * middle / period_ms:.1f}"]


def cpu_ms(task: Callable[[FloatArray], object], inputs: Sequence[FloatArray]) -> FloatArray:
    milliseconds = []
    for each in inputs:
        start = time.thread_time_ns()
        task(each)
        milliseconds.append((time.thread_time_ns() - start) / 1e6)
    return np.array(milliseconds)


def ebf_products(live: LiveEBF, look_ahead: int) -> Callable[[], None]:
    """Return a function that does the matrix products of one frame, and nothing else."""
    network, n = live.checkpoint.model, look_ahead + 1
    dense = [w.detach().numpy().T.copy() for w in network.parameters() if w.ndim == 2]
    dense = [w for w in dense if w.shape[1] != 4 * network.config.n_hidden]
    h = network.config.n_hidden
    rng = np.random.default_rng(0)
    state = rng.normal(size=(h, 4 * h)).astype(np.float32)
    from_code = rng.normal(size=(network.config.n_code, 4 * h)).astype(np.float32)
    from_both = rng.normal(size=(2 * h, 4 * h)).astype(np.float32)
    vectors = [np.ones(len(w), np.float32) for w in dense]
    output, code = np.ones(h, np.float32), np.ones(network.config.n_code, np.float32)
    both = np.ones((n, 2 * h), np.float32)

    def products() -> None:
        for vector, weight in zip(vectors, dense, strict=True):
            vector @ weight
        for _ in range(2):  # two layers: one step forward, n steps backward
            for _ in range(n + 1):
                output @ state
            code @ from_code
        both @ from_both
        both[0] @ from_both

    return products


def blend_products(live: LiveBlend, look_ahead: int) -> Callable[[], None]:
    """Return the same for a LiveBlend; of the amounts of noise, two are worked out."""
    config = live.checkpoint.model.config
    n_channels, n_windows = config.n_channels, config.n_channels * config.n_cosines
    rng = np.random.default_rng(0)
    window = rng.normal(size=(N_PAST + 1 + look_ahead, n_channels))
    basis = rng.normal(size=(config.n_cosines, config.radius + 1 + look_ahead))
    projected, gains = rng.normal(size=n_windows), rng.normal(size=(2, n_windows, n_channels))
    clues = rng.normal(size=(n_channels, config.n_clues))
    sizes = (config.n_clues, config.n_head, config.n_head, config.n_estimates)
    layers = [rng.normal(size=size) for size in pairwise(sizes)]
    fixed = kernels(look_ahead)

    def products() -> None:
        fixed @ window
        basis @ window[N_PAST - config.radius :]
        for gain in gains:
            projected @ gain
        x = clues
        for layer in layers:
            x = x @ layer

    return products


class Shifted(Smoother):
    """A causal filter that may use a look-ahead: its answer some frames later is taken."""

    def __init__(self, inner: Smoother, look_ahead: int):
        self.inner, self.look_ahead = inner, look_ahead

    def smooth(self, values: FloatArray, mask: BoolArray, frame_time: float) -> FloatArray:
        later = np.minimum(np.arange(len(values)) + self.look_ahead, len(values) - 1)
        return self.inner.smooth(values, mask, frame_time)[later]


class Streamed:
    """A stream as a Denoiser of whole clips."""

    def __init__(self, live: LiveFilter):
        self.live = live

    def denoise(self, observed: Motion, mask: BoolArray) -> Motion:
        return stream_motion(observed, self.live)


def best(candidates: Sequence[Smoother], clips: Sequence[Corrupted], each: bool) -> FloatArray:
    """Return the number of the best candidate, for all channels or one a channel."""
    errors = [np.where(moving_channels(c.clean), squared_errors(candidates, c), 0.0) for c in clips]
    total = np.sum(errors, axis=0)  # (candidates, C)
    chosen = np.argmin(total.sum(axis=1))
    return np.where(np.ptp(total, axis=0) > 0, np.argmin(total, axis=0), chosen) if each else chosen


def error_table(
    training: Sequence[Corrupted], test: Sequence[Corrupted], look_aheads: Sequence[int]
) -> list[list[str]]:
    frame_time = test[0].clean.frame_time
    curves: dict[str, list[float]] = {}
    euros = [OneEuro(c, b) for c in (1, 2, 4, 8) for b in (0, 0.003, 0.01, 0.03, 0.1)]
    chosen: list[Shifted] = []
    for n in look_aheads:
        ahead_s = n * frame_time
        widths = [LiveGaussian(s, ahead_s) for s in WIDTHS_S]
        single, per_channel = (WIDTHS_S[best(widths, training, each)] for each in (False, True))
        shifted = [Shifted(euro, n) for euro in euros]
        # Its answers may also be taken sooner than the look-ahead allows.
        chosen = [*chosen, shifted[int(best(shifted, training, False))]]
        methods: dict[str, Denoiser] = {
            "LiveBlend": Streamed(LiveBlend(look_ahead_s=ahead_s)),
            "LiveEBF": Streamed(LiveEBF(look_ahead_s=ahead_s)),
            "LiveGaussian, tuned": Streamed(LiveGaussian(single, ahead_s)),
            "LiveGaussian, tuned per channel": Streamed(LiveGaussian(per_channel, ahead_s)),
            "One-Euro, tuned": chosen[int(best(chosen, training, False))],
        }
        for name, method in methods.items():
            curves.setdefault(name, []).append(mean_error(method, test))
    single_s, per_channel_s = tune_gaussian(training)
    whole: dict[str, Denoiser] = {
        "offline: EBF": Cleaner("ebf"),
        "offline: Blend": Cleaner("blend"),
        "offline: Gaussian tuned": GaussianDenoiser(single_s),
        "offline: Gaussian tuned per channel": GaussianDenoiser(per_channel_s),
    }
    for name, method in whole.items():
        curves[name] = [mean_error(method, test)] * len(look_aheads)
    header = ["look-ahead, ms", *(f"{1000 * n * frame_time:.0f}" for n in look_aheads)]
    return [header, *([name, *(f"{e:.3f}" for e in errors)] for name, errors in curves.items())]


def mean_error(method: Denoiser, clips: Sequence[Corrupted]) -> float:
    return float(np.mean([rms_all_deg(method.denoise(c.observed, c.mask), c.clean) for c in clips]))


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--errors", action="store_true", help="the latency-error curve, too")
    parser.add_argument("--data", metavar="FOLDER", help="clean clips (default: the embedded ones)")
    options = parser.parse_args()
    dataset = load_dataset("cmu", options.data) if options.data else load_dataset("embedded")
    train_set, test_set = split_holdout(dataset)
    noisy = draw_test(test_set.clips[0], "angular:0.5", seed=0, repetition=0)
    print(format_table(cost_table(noisy.observed)))
    if options.errors:
        training = [draw_training(c, "angular:0.5", seed=0) for c in train_set.clips[::5]]
        test = [draw_test(c, "angular:0.5", seed=0, repetition=0) for c in test_set.clips]
        print(f"\nRMS in degrees, mean over {len(test)} clips")
        print(format_table(error_table(training, test, LOOK_AHEADS)))


if __name__ == "__main__":
    main()
