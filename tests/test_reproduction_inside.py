"""What errors do not show: shapes of kernels, learnt biases, filled gaps."""

from types import SimpleNamespace

import numpy as np
import pytest
import torch
from reproduction_cases import few_clips

from mocaplab.comparison.job import Job
from mocaplab.motion import moving_channels
from mocaplab.noise.draws import draw_test
from mocaplab.reproduction import networks_inside
from mocaplab.reproduction.networks_inside import bias_share, fill_one_gap, gaussian_share
from mocaplab.splits import Split

TAPS = np.arange(-15, 16)


def test_a_gaussian_kernel_is_a_gaussian_and_a_flat_one_is_not():
    gaussian = np.exp(-0.5 * (TAPS / 4.0) ** 2)
    flat = (np.abs(TAPS) <= 5) * 1.0
    two = (np.abs(TAPS) == 8) * 1.0
    kernels = np.array([k / k.sum() for k in (gaussian, flat, two)])
    overlap, sigma = gaussian_share(kernels)
    assert overlap[0] > 0.985  # the width that was tried is within 2.5 % of 4
    assert sigma[0] == pytest.approx(4, rel=0.03)
    # A flat kernel and the best Gaussian: by hand, over many widths.
    widths = np.linspace(1, 10, 400)[:, None]
    shapes = np.exp(-0.5 * (TAPS / widths) ** 2)
    best = np.minimum(shapes / shapes.sum(axis=1, keepdims=True), kernels[1]).sum(axis=1).max()
    assert overlap[1] == pytest.approx(best, abs=0.01)
    assert overlap[2] < 0.2


def test_the_size_of_a_bias_is_a_share_of_the_movement(embedded, monkeypatch):
    clip = draw_test(few_clips(embedded).clips[0], "angular:0.5", seed=0, repetition=0)
    moves = moving_channels(clip.clean)

    class Constant(torch.nn.Module):
        def predict(self, pose, root_velocity):
            return pose, torch.full_like(pose, 0.2)  # a fifth of the noisy signal's deviation

    fake = SimpleNamespace(model=Constant(), columns=lambda skeleton: moves)
    monkeypatch.setattr(networks_inside, "load_checkpoint", lambda path: fake)
    noisy, clean = (m.channels[:, moves].std(axis=0) for m in (clip.observed, clip.clean))
    expected = 0.2 * np.sqrt(np.mean(noisy**2) / np.mean(clean**2))
    assert bias_share("no file", [clip]) == pytest.approx(expected, rel=1e-5)


def test_a_gap_is_looked_at_in_a_knee(embedded, tmp_path):
    few = few_clips(embedded)
    split = Split((1, 2, 3, 4, 5), (0,))
    recipe = "angular:0.1+long_gaps:0.3"
    jobs = [
        Job("holdout_1", split, recipe, method, ("rms_all_deg",), seed, 1)
        for seed in range(1)
        for method in ("noisy", "gaussian_58")
    ]
    gap = fill_one_gap(few, jobs, 0, tmp_path)
    clip = draw_test(few.clips[0], recipe, seed=0, repetition=0)
    column = clip.clean.skeleton.channel_labels.index(gap.channel)
    hidden = np.flatnonzero(~clip.mask[:, column])
    assert gap.frames == (hidden[0], hidden[-1])
    np.testing.assert_array_equal(gap.clean, clip.clean.channels[:, column])
    line = gap.filled["noisy"][hidden]
    np.testing.assert_allclose(np.diff(line, 2), 0, atol=1e-9)  # straight
    assert set(gap.filled) == {"noisy", "gaussian_58"}
    assert (
        fill_one_gap(few, [Job("h_1", split, "angular:0.1", "noisy", (), 0, 1)], 0, tmp_path)
        is None
    )
