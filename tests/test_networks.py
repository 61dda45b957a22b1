"""The adaptive Gaussian and the EBF."""

import numpy as np
import pytest
import torch

from mocaplab.networks import EBF, EBFConfig, adaptive_gaussian, seeded


def naive_filter(x, sigma, radius):
    """The formula of paper A, one sample at a time."""
    y = np.zeros_like(x)
    n_frames = x.shape[1]
    for b, t, c in np.ndindex(*x.shape):
        taus = np.arange(max(0, t - radius), min(n_frames, t + radius + 1))
        w = np.exp(-((taus - t) ** 2) / (2 * sigma[b, t, c] ** 2))
        y[b, t, c] = np.sum(w * x[b, taus, c]) / w.sum()
    return y


@pytest.mark.parametrize("n_frames", [1, 7, 40])
def test_filter_equals_the_formula(n_frames):
    rng = np.random.default_rng(0)
    x = rng.normal(size=(2, n_frames, 3))
    sigma = rng.uniform(0.1, 20, size=x.shape)
    y = adaptive_gaussian(torch.from_numpy(x), torch.from_numpy(sigma), radius=15)
    np.testing.assert_allclose(y.numpy(), naive_filter(x, sigma, 15), atol=1e-12)


def test_gradients_equal_finite_differences():
    with seeded(0):
        x = torch.randn(2, 9, 3, dtype=torch.float64, requires_grad=True)
        sigma = (torch.rand(2, 9, 3, dtype=torch.float64) * 4 + 0.3).requires_grad_()
    assert torch.autograd.gradcheck(lambda a, b: adaptive_gaussian(a, b, 4), (x, sigma))


def test_narrow_filter_returns_the_signal_and_a_wide_one_its_mean():
    x = torch.arange(9.0).reshape(1, 9, 1)
    torch.testing.assert_close(adaptive_gaussian(x, torch.full_like(x, 0.1)), x)
    wide = adaptive_gaussian(x, torch.full_like(x, 1e4))
    torch.testing.assert_close(wide, torch.full_like(x, 4.0))


@pytest.fixture(scope="module")
def model():
    return EBF(EBFConfig(n_channels=90), seed=0)


def test_ebf_has_the_shape_of_the_paper():
    model = EBF(EBFConfig(n_channels=126), seed=0)
    dense = [layer for layer in model.encoder if isinstance(layer, torch.nn.Linear)]
    assert (len(dense), dense[0].in_features, dense[-1].out_features) == (4, 129, 64)
    dense = [layer for layer in model.head if isinstance(layer, torch.nn.Linear)]
    assert (len(dense), dense[0].in_features, dense[-1].out_features) == (4, 252, 126)
    assert (model.lstm.num_layers, model.lstm.hidden_size, model.lstm.bidirectional) == (
        2,
        126,
        True,
    )


def test_first_widths_are_near_the_one_asked_for(model):
    pose, velocity = torch.zeros(2, 30, 90), torch.zeros(2, 30, 3)
    with torch.no_grad():
        sigma = model.eval()(pose, velocity)
    assert sigma.shape == (2, 30, 90)
    assert ((sigma > 3) & (sigma < 5.5)).all()


def test_same_seed_same_weights_and_no_trace_outside():
    torch.manual_seed(5)
    expected = torch.rand(1)
    torch.manual_seed(5)
    a, b = EBF(EBFConfig(3), seed=1), EBF(EBFConfig(3), seed=1)
    assert torch.equal(torch.rand(1), expected)
    other = EBF(EBFConfig(3), seed=2)
    assert torch.equal(a.encoder[0].weight, b.encoder[0].weight)
    assert not torch.equal(a.encoder[0].weight, other.encoder[0].weight)


def test_widths_far_away_do_not_depend_on_a_change_here_much_but_near_ones_do(model):
    """The network looks both ways: a change shows before and after it."""
    pose, velocity = torch.zeros(1, 61, 90), torch.zeros(1, 61, 3)
    changed = pose.clone()
    changed[0, 30] = 3.0
    with torch.no_grad():
        difference = (model.eval()(changed, velocity) - model(pose, velocity)).abs().sum(-1)[0]
    assert difference[29] > 0
    assert difference[31] > 0
    assert difference[[0, 60]].max() < difference[30]
