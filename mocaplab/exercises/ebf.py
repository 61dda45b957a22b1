"""Checks for the exercises of notebook 04, which builds EBF.

As in :mod:`mocaplab.exercises`, each returns a sentence that begins with "Right:" only if
the answer is right, and never raises whatever the answer is. Functions may answer with
tensors, arrays or lists.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from numpy.typing import ArrayLike

from mocaplab.adaptive_filter import adaptive_gaussian
from mocaplab.exercises.answers import (
    NOT_YET,
    NOTHING,
    as_array,
    as_number,
    call,
    known,
    not_a_number,
)
from mocaplab.layers import bidirectional_lstm
from mocaplab.motion import FloatArray

RADIUS = 15
"""Frames that the filter of exercise 2 reaches to each side."""


def check_kernel(answer: Any) -> str:
    """Check a function (log_sigma, radius) that returns the weights of a Gaussian."""
    if answer is None:
        return NOT_YET
    for sigma, radius in ((3.0, 5), (4.0, 15)):
        log_sigma = torch.tensor(np.log(sigma))
        got, problem = _array(answer, log_sigma, radius)
        if got is None:
            return problem
        got = got.ravel()
        problem = _wrong_kernel(got, sigma, radius)
        if problem:
            return problem
    return "Right: 11 weights or 31, as wide as asked for, and their sum is 1."


def _wrong_kernel(got: FloatArray, sigma: float, radius: int) -> str:
    n = 2 * radius + 1
    if len(got) == n - 1:
        return f"{n - 1} weights for radius {radius}: one is missing. arange leaves its end out."
    if len(got) != n:
        return f"For radius {radius} there are {n} weights, -{radius} to {radius}; got {len(got)}."
    offsets = np.arange(-radius, radius + 1)
    right = _bell(offsets, sigma)
    total = float(got.sum())
    if total == 0:
        return "The sum of your weights is 0. All weights of a Gaussian are positive."
    shape = got / total
    if not np.allclose(shape, right / right.sum(), atol=1e-5):
        wrong = (
            (_bell(offsets, np.log(sigma)), "You used log sigma as if it were sigma: exp first."),
            (_bell(offsets, np.sqrt(sigma)), "Your variance is sigma. Divide first, then square."),
            (_bell(offsets, sigma / np.sqrt(2)), "Too narrow: where is the one half?"),
            (_bell(offsets, sigma * np.sqrt(2)), "Too wide: the one half is there twice."),
            (1 / right, "Your weights grow to the sides. A minus is missing in exp(...)."),
            (_bell(np.arange(n), sigma), "Not centred: offsets go from -radius to radius."),
        )
        for other, hint in wrong:
            if np.allclose(shape, other / other.sum(), atol=1e-5):
                return hint
        return (
            f"These are not the weights exp(-(offset / sigma)^2 / 2) for sigma = {sigma:g}: the "
            f"largest is {shape.max():.3f} of the sum, and {(right / right.sum()).max():.3f} is "
            f"wanted."
        )
    if np.isclose(total, 1, atol=1e-5):
        return ""
    if np.isclose(total, right.sum() / (sigma * np.sqrt(2 * np.pi)), atol=1e-4):
        return (
            f"The shape is right. You divided by the area of the whole bell curve, but these "
            f"{len(got)} weights have their own sum: it is {total:.3f} now, not 1."
        )
    return f"The shape is right, but the sum is {total:.3f}. Divide by the sum of the weights."


def check_width_per_frame(answer: Any) -> str:
    """Check a function (x, sigma_s, frame_time) that smooths each frame with its own width."""
    if answer is None:
        return NOT_YET
    for frame_time in (1 / 120, 1 / 60):
        t = np.arange(50) * frame_time
        x = 20 + 15 * np.sin(2 * np.pi * 1.3 * t) + 5 * np.sin(2 * np.pi * 9 * t)
        sigma_s = 0.025 + 0.015 * np.sin(2 * np.pi * 2.1 * t + 1)
        got, problem = _array(answer, torch.tensor(x), torch.tensor(sigma_s), frame_time)
        if got is None:
            return problem
        problem = _wrong_smoothing(got.ravel(), x, sigma_s, frame_time)
        if problem:
            return problem
    return "Right: each frame has its own width, at 120 and at 60 frames per second."


def _wrong_smoothing(got: FloatArray, x: FloatArray, sigma_s: FloatArray, dt: float) -> str:
    n = len(x)
    if len(got) != n:
        return (
            f"{n} frames went in and {len(got)} numbers came out. Every frame gets its mean, "
            f"those near the ends from fewer neighbours."
        )
    sigma = sigma_s / dt
    offset = np.arange(n) - np.arange(n)[:, None]  # (t, tau)
    near = np.abs(offset) <= RADIUS
    w = _bell(offset, sigma[:, None]) * near
    right = w @ x / w.sum(axis=1)
    if np.allclose(got, right, atol=1e-3):
        return ""
    if np.allclose(got, x, atol=1e-3):
        return "Nothing was smoothed. The widths are in seconds: how many frames is that?"
    of_tau = _bell(offset, sigma) * near
    fixed = _bell(offset, sigma_s[:, None] * 120) * near
    thin = _bell(offset, np.sqrt(sigma)[:, None]) * near
    mean = _bell(offset, sigma.mean()) * near
    past = w * (offset <= 0)
    wrong = (
        (w @ x, "That is the sum. Divide it by the sum of the weights that you used."),
        (w / w.sum(axis=0) @ x, "Your weights are divided by a sum over the wrong axis. The "
         "weights of one output frame must have the sum 1."),
        (of_tau @ x / of_tau.sum(axis=1), "You gave each neighbour its own width. All weights of "
         "one output frame come from the width of that frame."),
        (fixed @ x / fixed.sum(axis=1), "At 60 frames per second it goes wrong. Use frame_time in "
         "place of 1/120."),
        (thin @ x / thin.sum(axis=1), "The widths act as variances. Divide the offset by sigma "
         "before you square."),
        (mean @ x / mean.sum(axis=1), "You used the mean width everywhere, not each its own."),
        (past @ x / past.sum(axis=1), "Your window looks back only. It is centred on the frame."),
    )  # fmt: skip
    for other, hint in wrong:
        if np.allclose(got, other, atol=1e-3):
            return hint
    if np.allclose(got[RADIUS:-RADIUS], right[RADIUS:-RADIUS], atol=1e-3):
        return (
            "Right in the middle, but not at the ends: leave frames that do not exist out of both "
            "sums, in place of zeros or mirror images."
        )
    return (
        f"The numbers differ by up to {np.max(np.abs(got - right)):.3g}. For each frame: weights "
        f"from its own width, {RADIUS} frames to each side, weighted sum over sum of weights."
    )


def check_lstm_size(answer: Any, *, n_in: int, n_hidden: int) -> str:
    """Check the number of parameters in two bidirectional LSTM layers."""
    got = as_number(answer)
    if got is None:
        return NOT_YET if answer is None else not_a_number(answer)
    lstm = bidirectional_lstm(n_in, n_hidden, 0.0)
    right = sum(p.numel() for p in lstm.parameters())

    def one(n: int, biases: int = 2, gates: int = 4) -> int:
        return gates * (n * n_hidden + n_hidden * n_hidden + biases * n_hidden)

    second = 2 * n_hidden
    hints: dict[float, str] = {
        one(n_in) + one(second): "That is one direction only. Another LSTM reads backward.",
        one(n_in) + one(n_hidden): "That is one direction only, and the second layer sees the "
        "outputs of both directions of the first.",
        2 * (one(n_in) + one(n_hidden)): "The second layer sees the outputs of both directions of "
        "the first: its input is twice as wide.",
        2 * one(n_in): "That is the first layer only. There are two.",
        4 * one(n_in): "The second layer has another input than the first: what comes out of it?",
        2 * (one(n_in, 1) + one(second, 1)): "torch keeps two biases for each gate and unit: one "
        "for the input, one for the unit's own past.",
        2 * (one(n_in, 0) + one(second, 0)): "The weights are right; the biases are missing.",
        right / 4: "That is one gate. An LSTM unit has four of them.",
    }
    if got == right:
        return f"Right: {right:,}, the same as torch counts."
    hint = known(got, hints, rel_tol=1e-9)
    return hint or (
        f"{got:,.0f} is not it. For each layer and direction: 4 gates times (inputs + units + 2 "
        f"biases) times units. What are the inputs of the second layer?"
    )


def check_bias_forward(answer: Any) -> str:
    """Check a function (x, head) that smooths and subtracts the bias; head is (B, T, 2C)."""
    if answer is None:
        return NOT_YET
    n_frames, n = 40, 3
    t = torch.arange(n_frames, dtype=torch.float64)[None, :, None]
    phase = torch.arange(n)
    x = 2 * torch.sin(0.7 * t + phase) + 0.5 * torch.sin(2.9 * t * (1 + phase))
    log_sigma = 0.9 + 0.5 * torch.sin(0.2 * t + phase)
    bias = 0.4 + 0.3 * torch.cos(0.5 * t + 2 * phase)
    got, problem = _array(answer, x, torch.cat([log_sigma, bias], dim=-1))
    if got is None:
        return problem
    if got.size != x.numel():
        return (
            f"x has the shape {tuple(x.shape)}, and so must the result have; yours is {got.shape}. "
            f"Split the head's output along the last axis: widths first, then biases."
        )
    sigma = torch.exp(log_sigma)
    smooth = adaptive_gaussian(x, sigma)
    if _equal(got, smooth - bias):
        return "Right: smooth first, then take the bias away."
    head = torch.cat([log_sigma, bias], dim=-1)
    mixed = adaptive_gaussian(x, torch.exp(head[..., 0::2])) - head[..., 1::2]
    wrong = (
        (smooth, "The bias is still there. Subtract the second half of the head's output."),
        (smooth + bias, "You added the bias. It is what the noise added: take it away."),
        (adaptive_gaussian(x - bias, sigma), "You took the bias away before smoothing. In the "
         "paper's formula it comes after: the filter must not blur it."),
        (adaptive_gaussian(x, log_sigma) - bias, "The head gives log sigma. Take exp first."),
        (adaptive_gaussian(x, torch.exp(bias)) - log_sigma, "The halves are swapped: the widths "
         "come first, then the biases."),
        (smooth - torch.exp(bias), "exp is for the widths alone, which must be positive. A bias "
         "may have any sign."),
        (mixed, "You took every other number. The first half of the last axis are the widths."),
        (adaptive_gaussian(x, torch.sqrt(sigma)) - bias, "You used the widths as variances."),
        (x - bias, "Nothing was smoothed, only the bias is away."),
    )  # fmt: skip
    for other, hint in wrong:
        if _equal(got, other):
            return hint
    return (
        "The numbers are others. Three steps: split, smooth with exp of the first half, subtract."
    )


def _equal(got: FloatArray, other: torch.Tensor) -> bool:
    return np.allclose(got.ravel(), other.numpy().ravel(), atol=1e-4)


def _bell(offsets: ArrayLike, sigma: ArrayLike) -> FloatArray:
    """Return the Gaussian of these offsets, 1 in the middle."""
    bell: FloatArray = np.exp(-0.5 * (np.asarray(offsets) / sigma) ** 2)
    return bell


def _array(answer: Any, *arguments: Any) -> tuple[FloatArray | None, str]:
    """Call a student's function and read what it returns as finite real numbers."""
    copies = [a.clone() if isinstance(a, torch.Tensor) else a for a in arguments]
    result, problem = call(answer, *copies)
    if problem or result is None:
        return None, problem or NOTHING
    if isinstance(result, torch.Tensor):
        result = result.detach().cpu()
    is_complex = hasattr(result, "dtype") and np.iscomplexobj(result)
    numbers = None if is_complex else as_array(result)
    if numbers is None or numbers.size == 0 or not np.isfinite(numbers).all():
        return None, "Your function must return finite numbers: a tensor, an array or a list."
    return numbers, ""
