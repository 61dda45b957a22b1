"""Checks and data of the assignment ``filter_ebf``: see :mod:`mocaplab.assignments.grading`."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from mocaplab.adaptive_filter import adaptive_gaussian
from mocaplab.assignments.contest import Contest, call_or_refuse
from mocaplab.assignments.grading import NotRight, quiet_call, student_rng
from mocaplab.assignments.judges import judge_function, judge_numbers
from mocaplab.corruption import corrupt
from mocaplab.exercises.answers import NOT_YET, as_array, as_number
from mocaplab.layers import seeded
from mocaplab.motion import FloatArray, moving_channels
from mocaplab.synthesis import synthesize

RADIUS = 15


@dataclass(frozen=True)
class FilterWork:
    """A student's own numbers."""

    samples: tuple[float, float, float]  # degrees, three neighbours
    sigma: float  # frames
    seed: int


def draw_work(student: str) -> FilterWork:
    """Draw the work of a student."""
    rng = student_rng(student, "filter_ebf")
    # In these ranges no typical mistake comes to the right number by chance.
    first, middle, last = np.round(rng.uniform([25, 15, -20], [32, 25, -12]), 1).tolist()
    sigma, seed = round(float(rng.uniform(1.3, 2.2)), 2), int(rng.integers(999))
    return FilterWork((first, middle, last), sigma, seed)


# ------------------------------------------------------------------ 1: by hand


def check_by_hand(answer: Any, work: FilterWork) -> str:
    """Check one smoothed sample: radius 1, so that three samples count."""
    outer, middle = work.samples[0] + work.samples[2], work.samples[1]

    def smooth(w: float) -> float:
        return (middle + w * outer) / (1 + 2 * w)

    sigma = work.sigma
    w = math.exp(-0.5 / sigma**2)
    mistakes = {
        "The weights do not add up to 1: divide by their sum.": middle + w * outer,
        "You divided by 3. The weights count, not how many they are.": (middle + w * outer) / 3,
        "The exponent needs sigma squared.": smooth(math.exp(-0.5 / sigma)),
        "The factor 1/2 in the exponent is missing.": smooth(math.exp(-1 / sigma**2)),
        "That is the plain mean of the three.": (middle + outer) / 3,
        "You left out the middle sample; its weight is 1.": outer / 2,
        "The second neighbour counts too: there is one on each side.": (
            middle + w * work.samples[0]
        )
        / (1 + w),
    }
    return judge_numbers(answer, smooth(w), mistakes, rtol=0.0, atol=0.02)


# ------------------------------------------------------------------ 2: the filter


def check_filter(answer: Any, seed: int = 3) -> str:
    """Check a differentiable function (x, sigma, radius) with a sigma for each frame, (T,)."""
    rng = np.random.default_rng(seed)
    x = torch.from_numpy(20 + np.cumsum(rng.normal(0, 2, 60)))
    sigma = torch.from_numpy(rng.uniform(1.0, 5.0, 60))
    cases = {"60 frames": (x, sigma, 6), "another radius": (x[:30], sigma[:30], 3)}

    def right(x: Tensor, sigma: Tensor, radius: int) -> Tensor:
        return adaptive_gaussian(x[None, :, None], sigma[None, :, None], radius)[0, :, 0]

    def variant(
        x: Tensor, weight: Any, radius: int, *, inside: bool = True, divide: bool = True
    ) -> Tensor:
        t = torch.arange(len(x))
        total, norm = torch.zeros_like(x), torch.zeros_like(x)
        for d in range(-radius, radius + 1):
            there = (t + d >= 0) & (t + d < len(x))
            at = (t + d).clamp(0, len(x) - 1)
            w = weight(d, at)
            total = total + w * x[at] * there
            norm = norm + (w * there if inside else w)
        return total / norm if divide else total

    def gauss(sigma: Tensor, power: int = 2, half: float = 0.5) -> Any:
        return lambda d, at: torch.exp(-half * d**2 / sigma**power)

    mistakes = {
        "The weights do not add up to 1: divide by their sum.": lambda x, s, r: variant(
            x, gauss(s), r, divide=False
        ),
        "Near the ends the curve sinks towards 0: divide by the weights of those frames alone that "
        "exist.": lambda x, s, r: variant(x, gauss(s), r, inside=False),
        "Each frame is smoothed with its OWN sigma, sigma[t]; you take the sigma of the neighbour, "
        "sigma[t + d].": lambda x, s, r: variant(
            x, lambda d, at: torch.exp(-0.5 * d**2 / s[at] ** 2), r
        ),
        "The exponent needs sigma squared.": lambda x, s, r: variant(x, gauss(s, power=1), r),
        "The factor 1/2 in the exponent is missing.": lambda x, s, r: variant(
            x, gauss(s, half=1.0), r
        ),
        "You used one sigma for all frames.": lambda x, s, r: right(x, s.mean().expand(len(s)), r),
    }
    sentence = judge_function(answer, cases, right, mistakes, rtol=1e-4)
    return _judge_gradient(answer, right, x, sigma) if sentence.startswith("Right:") else sentence


def _judge_gradient(answer: Any, right: Any, x: Tensor, sigma: Tensor) -> str:
    """Judge whether the result of a function knows how it depends on sigma."""
    slopes: list[Tensor | None] = []
    for function in (answer, right):
        leaf = sigma.clone().requires_grad_(True)
        try:
            torch.sum(function(x.clone(), leaf, 6) ** 2).backward()  # type: ignore[no-untyped-call]
        except Exception:  # no gradient, or a function that left torch
            slopes.append(None)
        else:
            slopes.append(leaf.grad)
    got, wanted = slopes
    if got is None or wanted is None:
        return (
            "The numbers are right, but no gradient gets back to sigma: nothing could be learned. "
            "Stay in torch: no NumPy, no .item(), no .detach(), no writing into a tensor of zeros."
        )
    if not torch.allclose(got, wanted, rtol=1e-3, atol=1e-6):
        return "The numbers are right, but the gradient is not. Is a part of it detached?"
    return "Right: the numbers, and the gradient of all of them with respect to sigma."


# ------------------------------------------------------------------ 3: learn a width


def noisy_curve(seed: int) -> tuple[Tensor, Tensor]:
    """Draw a noisy and a clean curve, shape (T,)."""
    rng = np.random.default_rng(seed)
    t = np.arange(240) / 120
    clean = 20 * np.sin(2 * np.pi * t * rng.uniform(0.8, 1.6)) + 3 * np.sin(2 * np.pi * 3 * t)
    noisy = clean + rng.normal(0, rng.uniform(5, 8), len(t))
    return torch.from_numpy(noisy), torch.from_numpy(clean)


def smooth(x: Tensor, sigma: Tensor) -> Tensor:
    """Smooth a curve, shape (T,), with one sigma in frames; gradients flow to sigma."""
    widths = sigma.expand(len(x))[None, :, None]
    return adaptive_gaussian(x[None, :, None], widths, RADIUS)[0, :, 0]


def check_learning(answer: Any, seed: int = 3) -> str:
    """Check a function (noisy, clean) that learns the best single sigma, in frames."""
    if answer is None or answer is ...:
        return NOT_YET
    for number in range(2):
        noisy, clean = noisy_curve(seed + number)
        grid = np.geomspace(0.3, 15, 80)
        errors = [float(((smooth(noisy, torch.tensor(s)) - clean) ** 2).mean()) for s in grid]
        best = float(grid[int(np.argmin(errors))])
        result, problem = quiet_call(answer, noisy, clean)
        if problem:
            return problem
        if result is None or result is ...:
            return f"{NOT_YET} So far, your function returns nothing."
        got = as_number(result.detach().numpy() if isinstance(result, Tensor) else result)
        if got is None:
            return (
                "Return one finite number: sigma in frames. If it is NaN, your steps are too large."
            )
        if got > 0:
            error = float(((smooth(noisy, torch.tensor(got)) - clean) ** 2).mean())
            if error < 1.01 * min(errors):
                continue
        if math.isclose(got, math.log(best), abs_tol=0.1):
            return "That is the logarithm of sigma. Take exp of it."
        if math.isclose(got, best / 120, rel_tol=0.05):
            return "That is in seconds. Here sigma is in frames."
        if got <= 0:
            return "A sigma is above 0. Learn its logarithm, and take exp."
        if error > 1.01 * errors[0]:
            return (
                "Your sigma is worse than hardly any smoothing: do you walk uphill? Subtract the "
                "gradient."
            )
        side = "narrow" if got < best else "wide"
        return (
            f"Your sigma is still too {side}. More steps, or larger ones; and set the gradient to "
            f"0 before each step, or old ones add up."
        )
    return "Right: no other width does better on either curve."


# ------------------------------------------------------------------ 4: the network


def check_network(answer: Any, seed: int = 3) -> str:
    """Check a function (n_channels) that makes a network: pose (B, T, C) -> widths (B, T, C)."""
    if answer is None or answer is ...:
        return NOT_YET
    n_channels = 5
    with seeded(seed):
        network, problem = quiet_call(answer, n_channels)
        pose = torch.randn(3, 40, n_channels, requires_grad=True)
    if problem or network is None:
        return problem or f"{NOT_YET} So far, your function returns nothing."
    if not isinstance(network, nn.Module):
        return "Return the network itself, an nn.Module."
    network.eval()
    try:
        widths = network(pose)
    except Exception as error:
        return f"The network stopped with {type(error).__name__}: {str(error)[:120]}"
    if not isinstance(widths, Tensor) or widths.shape != pose.shape:
        shape = tuple(widths.shape) if isinstance(widths, Tensor) else type(widths).__name__
        return f"For a pose of shape (3, 40, 5) return widths of the same shape, not {shape}."
    return _judge_widths(network, widths, pose)


def _judge_widths(network: nn.Module, widths: Tensor, pose: Tensor) -> str:
    """Judge what widths depend on, and whether they can be widths at all."""
    if not (widths > 0).all():
        return "Some widths are below 0. A width is exp of what the last layer gives."
    (slope,) = torch.autograd.grad(widths[1, 20].sum(), pose, retain_graph=True, allow_unused=True)
    if slope is None or not slope.any():
        return "The widths do not depend on the pose."
    if slope[[0, 2]].any():
        return (
            "The clips of a batch mix: the width of one clip depends on another. Say "
            "batch_first=True to the LSTM."
        )
    if not slope[1, :15].any():
        return "The width of frame 20 does not know what came long before. Is there an LSTM?"
    if not slope[1, 26:].any():
        return "The LSTM looks back only. A bidirectional one also sees what comes."
    widths.log().square().sum().backward()  # type: ignore[no-untyped-call]
    unused = [name for name, p in network.named_parameters() if p.grad is None]
    if unused:
        return f"No gradient gets to {unused[0]}: this layer is made, but not used."
    middle = float(widths.detach().median())
    if not 0.5 <= middle <= 20:
        return (
            f"Before any training the widths are about {middle:.3g} frames. Start near a useful "
            f"width: 4 frames are a bias of log(4) in the last layer."
        )
    return "Right: widths above 0 that depend on the past and the future of their own clip."


# ------------------------------------------------------------------ beat the score


def constant_width(values: FloatArray) -> FloatArray:
    """Smooth everything with 4 frames, the best single width: the answer to beat."""
    return np.full(values.shape, 4.0)


def _score_widths(answer: Any, seed: int) -> float:
    errors = []
    for number, action in enumerate(("walk", "run", "kick")):
        rng = np.random.default_rng([seed, number])
        motion = synthesize(action, duration_s=2.0, rng=rng, name=action)
        clip = corrupt(motion, "angular:0.5", rng=rng)
        moves = moving_channels(clip.clean)
        values = clip.observed.channels[:, moves]
        result = call_or_refuse(answer, values)
        widths = as_array(result.detach().numpy() if isinstance(result, Tensor) else result)
        if widths is None or widths.shape != values.shape or not (widths > 0).all():
            raise NotRight(f"For values of shape {values.shape} return as many widths above 0.")
        x, sigma = (torch.from_numpy(a)[None] for a in (values, widths.clip(0.1, 30.0)))
        cleaned = adaptive_gaussian(x, sigma, 2 * RADIUS)[0].numpy()
        errors.append(np.sqrt(np.mean((cleaned - clip.clean.channels[:, moves]) ** 2)))
    return float(np.mean(errors))


CONTEST = Contest("filter_ebf", "degrees", _score_widths, constant_width, goal=0.96)
