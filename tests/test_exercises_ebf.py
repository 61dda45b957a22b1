"""The checks of notebook 04 accept right answers and meet each typical mistake with its hint."""

import math

import numpy as np
import pytest
import torch

from mocaplab.adaptive_filter import adaptive_gaussian
from mocaplab.exercises.answers import NOT_YET
from mocaplab.exercises.ebf import (
    check_bias_forward,
    check_kernel,
    check_lstm_size,
    check_width_per_frame,
)

ODD = [
    "text",
    3.0,
    (),
    [1, "a"],
    {"a": 1},
    1j,
    float("nan"),
    True,
    b"x",
    object(),
    10**400,
    torch.zeros(2, requires_grad=True),
    [torch.zeros((), requires_grad=True)],
]
CHECKS = (check_kernel, check_width_per_frame, check_bias_forward)


def size(answer):
    return check_lstm_size(answer, n_in=64, n_hidden=126)


def test_no_answer_yet():
    assert all(check(None) == NOT_YET for check in (*CHECKS, size))


@pytest.mark.parametrize("odd", ODD, ids=lambda odd: type(odd).__name__)
def test_odd_answers_get_a_sentence(odd):
    for answer in (odd, lambda *_: odd):
        for check in (*CHECKS, size):
            text = check(answer)
            assert len(text) > 10
            assert not text.startswith("Right")


def kernel(log_sigma, radius, *, power=0.5, start=None, scale=None):
    sigma = torch.exp(log_sigma)
    offsets = torch.arange(2 * radius + 1) + (-radius if start is None else start)
    weights = torch.exp(-power * (offsets / sigma) ** 2)
    return weights / (weights.sum() if scale is None else scale(weights, sigma))


def kernel_in_a_loop(log_sigma, radius):
    sigma = math.exp(log_sigma)
    weights = [math.exp(-(d**2) / (2 * sigma**2)) for d in range(-radius, radius + 1)]
    return [w / sum(weights) for w in weights]


def kernel_by_softmax(log_sigma, radius):
    offsets = torch.arange(-radius, radius + 1)
    return torch.softmax(-0.5 * (offsets * torch.exp(-log_sigma)) ** 2, dim=0)[:, None]


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (kernel, "Right"),
        (kernel_in_a_loop, "Right"),
        (kernel_by_softmax, "Right"),
        (lambda s, r: kernel(s.clone().requires_grad_(), r), "Right"),
        (lambda s, r: kernel(s, r).numpy(), "Right"),
        (lambda s, r: kernel(s, r, scale=lambda w, s: 1), "Divide by the sum"),
        (lambda s, r: kernel(s, r, scale=lambda w, s: s * math.tau**0.5), "whole bell curve"),
        (lambda s, r: kernel(s, r, scale=lambda w, s: w.norm()), "Divide by the sum"),
        (lambda s, r: kernel(torch.log(s), r), "exp first"),
        (lambda s, r: kernel(s / 2, r), "variance"),
        (lambda s, r: kernel(s, r, power=1.0), "one half"),
        (lambda s, r: kernel(s, r, power=0.25), "there twice"),
        (lambda s, r: kernel(s, r, power=-0.5), "minus is missing"),
        (lambda s, r: kernel(s, r, start=0), "Not centred"),
        (lambda s, r: kernel(s, r)[:-1], "one is missing"),
        (lambda s, r: kernel(s, 2 * r), "there are 11 weights"),
        (lambda s, r: torch.ones(2 * r + 1) / (2 * r + 1), "not the weights"),
        (lambda s, r: torch.zeros(2 * r + 1), "positive"),
        (lambda s, r: torch.full((2 * r + 1,), torch.nan), "finite numbers"),
        (lambda s, r: 1 / 0, "ZeroDivisionError"),
        (lambda s, r: None, "returns nothing"),
        (kernel(torch.tensor(1.0), 5), "the function itself"),
    ],
)
def test_kernel(answer, words):
    assert words in check_kernel(answer)


def parts(x, sigma, radius=15):
    offsets = torch.arange(len(x)) - torch.arange(len(x))[:, None]
    w = torch.exp(-0.5 * (offsets / sigma[:, None]) ** 2) * (offsets.abs() <= radius)
    return w, offsets


def by_frame(x, sigma_s, frame_time):
    w, _ = parts(x, sigma_s / frame_time)
    return w @ x / w.sum(dim=1)


def by_library(x, sigma_s, frame_time):
    sigma = sigma_s / frame_time
    return adaptive_gaussian(x[None, :, None], sigma[None, :, None], 15)


def by_neighbour(x, sigma_s, frame_time):
    w = parts(x, sigma_s / frame_time)[0].T
    return w @ x / w.sum(dim=1)


def past(x, sigma_s, frame_time):
    w, offsets = parts(x, sigma_s / frame_time)
    w = w * (offsets <= 0)
    return w @ x / w.sum(dim=1)


def padded(x, sigma_s, frame_time, mode):
    longer = torch.tensor(np.pad(x.numpy(), 15, mode=mode))
    sigma = (sigma_s / frame_time)[:, None]
    w = torch.exp(-0.5 * (torch.arange(-15, 16) / sigma) ** 2)
    return (longer.unfold(0, 31, 1) * w).sum(1) / w.sum(1)


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (by_frame, "Right"),
        (by_library, "Right"),
        (lambda *a: by_frame(*a).tolist(), "Right"),
        (lambda x, s, dt: by_frame(x, s, 1), "how many frames is that"),
        (lambda x, s, dt: by_frame(x, s * dt, 1), "how many frames is that"),
        (lambda x, s, dt: by_frame(x, s, 1 / 120), "At 60 frames"),
        (lambda x, s, dt: by_frame(x, (s / dt).sqrt(), 1), "variances"),
        (lambda x, s, dt: parts(x, s / dt)[0] @ x, "Divide it by the sum"),
        (lambda x, s, dt: parts(x, s / dt)[0] / parts(x, s / dt)[0].sum(0) @ x, "wrong axis"),
        (by_neighbour, "its own width"),
        (lambda x, s, dt: by_frame(x, s.mean().expand(len(x)), dt), "the mean width"),
        (past, "looks back only"),
        (lambda *a: padded(*a, "constant"), "not at the ends"),
        (lambda *a: padded(*a, "symmetric"), "not at the ends"),
        (lambda *a: by_frame(*a)[15:-15], "20 numbers came out"),
        (lambda x, s, dt: x.mean().expand(len(x)), "differ by up to"),
        (lambda x, s: x, "stopped with TypeError"),
        (lambda *a: None, "returns nothing"),
        (0.5, "the function itself"),
    ],
)
def test_width_per_frame(answer, words):
    assert words in check_width_per_frame(answer)


def one(n_in, n_hidden, biases=2):
    return 4 * n_hidden * (n_in + n_hidden + biases)


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (576576, "Right"),
        (576576.0, "Right"),
        ([576576], "Right"),
        (torch.tensor(576576), "Right"),
        (2 * (one(64, 126) + one(252, 126)), "Right"),
        (one(64, 126) + one(252, 126), "one direction"),
        (one(64, 126) + one(126, 126), "one direction"),
        (2 * (one(64, 126) + one(126, 126)), "twice as wide"),
        (2 * one(64, 126), "first layer only"),
        (4 * one(64, 126), "another input"),
        (2 * (one(64, 126, 1) + one(252, 126, 1)), "two biases"),
        (2 * (one(64, 126, 0) + one(252, 126, 0)), "biases are missing"),
        (144144, "one gate"),
        (12, "is not it"),
        ("many", "one number"),
    ],
)
def test_lstm_size(answer, words):
    assert words in size(answer)


def forward(x, head):
    log_sigma, bias = head.chunk(2, dim=-1)
    return adaptive_gaussian(x, torch.exp(log_sigma)) - bias


def halves(head):
    return head.chunk(2, dim=-1)


def smooth(x, head):
    return adaptive_gaussian(x, torch.exp(halves(head)[0]))


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (forward, "Right"),
        (lambda x, h: forward(x, h).float().tolist(), "Right"),
        (smooth, "still there"),
        (lambda x, h: smooth(x, h) + halves(h)[1], "You added"),
        (lambda x, h: smooth(x - halves(h)[1], h), "before smoothing"),
        (lambda x, h: adaptive_gaussian(x, halves(h)[0]) - halves(h)[1], "Take exp first"),
        (lambda x, h: forward(x, torch.cat(halves(h)[::-1], -1)), "swapped"),
        (lambda x, h: smooth(x, h) - halves(h)[1].exp(), "any sign"),
        (lambda x, h: forward(x, torch.cat([h[..., ::2], h[..., 1::2]], -1)), "every other"),
        (lambda x, h: forward(x, h * torch.tensor([0.5] * 3 + [1.0] * 3)), "variances"),
        (lambda x, h: x - halves(h)[1], "Nothing was smoothed"),
        (lambda x, h: x, "The numbers are others"),
        (lambda x, h: smooth(x, h)[..., :1], "must the result have"),
        (lambda x, h: x.no_such_thing, "AttributeError"),
        (lambda x, h: None, "returns nothing"),
        (torch.zeros(3), "the function itself"),
    ],
)
def test_bias_forward(answer, words):
    assert words in check_bias_forward(answer)
