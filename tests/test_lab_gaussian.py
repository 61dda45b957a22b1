"""The Gaussian of the lab against scipy and numpy, in Python and in the browser's code."""

from __future__ import annotations

import json
import shutil
import subprocess

import numpy as np
import pytest
from scipy.ndimage import correlate1d

from mocaplab.lab.gaussian import LOOK_AHEADS_S, WIDTHS_S, gaussian, squared_error_table
from mocaplab.packing import javascript

DT = 1 / 120


@pytest.fixture
def noisy():
    rng = np.random.default_rng(3)
    return np.cumsum(rng.normal(size=(90, 4)), axis=0) + rng.normal(size=(90, 4))


def by_numpy(values, sigma_s, look_ahead_s):
    """A matrix of weights, made for this test alone."""
    frames = np.arange(len(values))
    tap = frames[None, :] - frames[:, None]
    weights = np.exp(-0.5 * (tap * DT / sigma_s) ** 2)
    weights[(tap < -np.ceil(4 * sigma_s / DT)) | (tap > round(look_ahead_s / DT))] = 0
    return weights @ values / weights.sum(axis=1, keepdims=True)


def by_scipy(values, sigma_s):
    radius = int(np.ceil(4 * sigma_s / DT))
    weights = np.exp(-0.5 * (np.arange(-radius, radius + 1) * DT / sigma_s) ** 2)
    return correlate1d(values, weights / weights.sum(), axis=0, mode="reflect")


def right_answer(values, sigma_s, look_ahead_s):
    if look_ahead_s is None:
        return by_scipy(values, sigma_s)
    return by_numpy(values, sigma_s, look_ahead_s)


def test_the_table_is_that_of_single_filters(noisy):
    clean = np.ones_like(noisy)
    table = squared_error_table(noisy, clean, DT)
    assert table.shape == (len(LOOK_AHEADS_S), len(WIDTHS_S), 4)
    for row, look_ahead_s in enumerate(LOOK_AHEADS_S):
        for column in (0, 10, 20, len(WIDTHS_S) - 1):
            smooth = right_answer(noisy, WIDTHS_S[column], look_ahead_s)
            right = np.mean((smooth - clean) ** 2, axis=0)
            np.testing.assert_allclose(table[row, column], right)


@pytest.mark.parametrize("look_ahead_s", LOOK_AHEADS_S)
def test_the_gaussian_of_the_library_is_meant(noisy, look_ahead_s):
    seen = np.ones(noisy.shape, dtype=bool)
    smooth = gaussian(0.032, look_ahead_s).smooth(noisy, seen, DT)
    np.testing.assert_allclose(smooth, right_answer(noisy, 0.032, look_ahead_s))


def test_the_narrowest_width_changes_hardly_anything(noisy):
    seen = np.ones(noisy.shape, dtype=bool)
    smooth = gaussian(WIDTHS_S[0]).smooth(noisy, seen, DT)
    np.testing.assert_allclose(smooth, noisy, atol=2e-3)


@pytest.mark.skipif(shutil.which("node") is None, reason="there is no node")
def test_the_browser_s_gaussian_gives_the_same_numbers(noisy):
    cases = [
        (sigma_s, look_ahead_s, frames)
        for sigma_s in (0.004, 0.0316, 0.25)
        for look_ahead_s, frames in ((None, None), (0.0, 0), (1 / 30, 4))
    ]
    values = noisy[:, 0]
    code = (
        f"{javascript('lab_math')}\nconst values = {json.dumps(values.tolist())};\n"
        f"const cases = {json.dumps([[s / DT, f] for s, _, f in cases])};\n"
        "console.log(JSON.stringify(cases.map(([s, f]) => [...gaussianFilter(values, s, f)])));"
    )
    command = ["node", "--input-type=module"]
    run = subprocess.run(command, input=code, capture_output=True, text=True, check=True)
    for (sigma_s, look_ahead_s, _), found in zip(cases, json.loads(run.stdout), strict=True):
        right = right_answer(values[:, None], sigma_s, look_ahead_s)[:, 0]
        np.testing.assert_allclose(found, right, atol=1e-9)
