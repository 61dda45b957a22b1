"""The adaptive Gaussian and the EBF."""

import numpy as np
import pytest
import torch

from mocaplab.adaptive_filter import _weights, adaptive_gaussian, free_filter
from mocaplab.layers import seeded
from mocaplab.networks import EBD, EBF, NN, EBDConfig, EBFConfig, NNConfig, build_network


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


def test_no_weight_is_a_denormal_number():
    """They would take the processor many times as long; a width of 0.3 frames made them."""
    x, sigma = torch.ones(1, 40, 1), torch.full((1, 40, 1), 0.3)
    weights = [w.clone() for _, w, _ in _weights(sigma, 15)]
    assert min(w.min() for w in weights) >= 1e-18
    torch.testing.assert_close(adaptive_gaussian(x, sigma), x)


def test_free_weights_shaped_as_a_gaussian_equal_the_gaussian():
    rng = np.random.default_rng(0)
    x = torch.from_numpy(rng.normal(size=(2, 40, 3)))
    sigma = torch.from_numpy(rng.uniform(0.3, 20, size=x.shape))
    taps = torch.arange(-15, 16)
    own = free_filter(x, -0.5 * (taps / sigma[..., None]) ** 2)
    torch.testing.assert_close(own, adaptive_gaussian(x, sigma))
    shared = free_filter(x, (-0.5 * (taps / sigma[..., :1, None]) ** 2))
    torch.testing.assert_close(shared, adaptive_gaussian(x, sigma[..., :1].expand_as(x)))


def test_free_weights_pass_gradients():
    with seeded(0):
        x = torch.randn(1, 8, 2, dtype=torch.float64, requires_grad=True)
        scores = torch.randn(1, 8, 2, 5, dtype=torch.float64, requires_grad=True)
    assert torch.autograd.gradcheck(free_filter, (x, scores))


VARIANTS = {
    "EBF": EBFConfig(9),
    "BF": EBFConfig(9, encoder=False),
    "bias": EBFConfig(9, bias=True),
    "free": EBFConfig(9, kernel="free"),
    "free and bias": EBFConfig(9, kernel="free", bias=True),
    "NN": NNConfig(9),
    "EBD": EBDConfig(9),
}


@pytest.mark.parametrize("config", VARIANTS.values(), ids=VARIANTS)
@pytest.mark.parametrize("n_frames", [1, 5, 50])
def test_every_network_answers_a_pose_with_a_pose_and_learns(config, n_frames):
    network = build_network(config, seed=0)
    with seeded(0):
        pose, velocity = torch.randn(2, n_frames, 9), torch.randn(2, n_frames, 3)
    cleaned = network(pose, velocity)
    assert cleaned.shape == pose.shape
    cleaned.square().sum().backward()
    n_without = sum(p.grad is None for p in network.parameters())
    assert n_without == 0
    assert all(torch.isfinite(p.grad).all() for p in network.parameters())


@pytest.mark.parametrize("name", ["EBF", "BF", "free", "NN"])
def test_filter_networks_keep_what_does_not_change(name):
    """Weights that sum to 1 leave a still pose as it is, whatever the network says."""
    network = build_network(VARIANTS[name], seed=0).eval()
    still = torch.full((1, 60, 9), 2.5)
    torch.testing.assert_close(network(still, torch.zeros(1, 60, 3)), still)


def test_first_free_kernels_are_gaussians_of_the_width_asked_for():
    network = EBF(EBFConfig(9, kernel="free", first_sigma=3.0), seed=0).eval()
    with torch.no_grad():
        scores, _ = network.predict(torch.zeros(1, 40, 9), torch.zeros(1, 40, 3))
    taps = torch.arange(-15, 16)
    width = (scores.softmax(-1) * taps**2).sum(-1).sqrt()
    assert scores.shape == (1, 40, 1, 31)
    assert ((width > 2) & (width < 4)).all()


def test_first_bias_is_near_zero():
    network = EBF(EBFConfig(9, bias=True), seed=0).eval()
    with torch.no_grad():
        _, bias = network.predict(torch.zeros(1, 40, 9), torch.zeros(1, 40, 3))
    assert bias.abs().max() < 0.5


def test_signals_keep_their_size_at_the_start():
    """torch's own start leaves 0.003 of them behind the LSTM."""
    network = EBF(EBFConfig(68), seed=0).eval()
    with torch.no_grad(), seeded(0):
        code = torch.tanh(network.encoder(torch.randn(4, 200, 71)))
        steps, _ = network.lstm(code)
        hidden = network.head[:-1](steps)
    for signal in (code, steps, hidden):
        assert 0.1 < signal.std(dim=1).mean() < 1
    for name, values in network.lstm.named_parameters():
        for i, gate in enumerate(values.detach().chunk(4)):
            if "weight_hh" in name:
                torch.testing.assert_close(gate @ gate.T, torch.eye(126), rtol=0, atol=1e-5)
            elif "bias" in name:
                assert (gate == float(i == 1 and "_ih" in name)).all()


def test_signals_reach_the_last_layer_of_nn():
    """torch's own start leaves 0.05 of them."""
    network = NN(NNConfig(68), seed=0)
    with torch.no_grad(), seeded(0):
        hidden = network.layers[:-1](torch.randn(200, 71 * 31))
    assert 0.2 < hidden.std(dim=0).mean() < 1


def test_the_start_of_the_paper_gives_wild_widths():
    """Why it is not our default."""
    network = EBF(EBFConfig(90, paper_init=True), seed=0).eval()
    dense = network.encoder[0].weight
    assert -0.5 <= dense.min() < -0.49
    assert 0.49 < dense.max() <= 0.5
    with torch.no_grad(), seeded(0):
        sigma, _ = network.predict(torch.randn(1, 200, 90), torch.zeros(1, 200, 3))
    assert sigma.max() / sigma.min() > 20


def test_ebd_has_the_shape_of_the_paper():
    network = EBD(EBDConfig(126), seed=0)
    assert (network.lstm.hidden_size, network.lstm.num_layers, network.config.stride) == (32, 2, 4)
    dense = [layer for layer in network.decoder if isinstance(layer, torch.nn.Linear)]
    assert (len(dense), dense[0].in_features, dense[-1].out_features) == (4, 64, 126)


@pytest.mark.parametrize("n_frames", [4, 7, 41])
def test_ebd_steps_over_four_frames(n_frames):
    """A frame is told from those 4, 8, 12 ... frames away, and from no other."""
    network = EBD(EBDConfig(2), seed=0).eval()
    pose, velocity = torch.zeros(1, n_frames, 2), torch.zeros(1, n_frames, 3)
    changed = pose.clone()
    changed[0, 2] = 1.0
    with torch.no_grad():
        difference = (network(changed, velocity) - network(pose, velocity)).abs().sum(-1)[0]
    differs = set(torch.nonzero(difference).flatten().tolist())
    assert differs == set(range(2, n_frames, 4))


def test_nn_sees_the_window_of_the_paper():
    network = NN(NNConfig(126), seed=0)
    dense = [layer for layer in network.layers if isinstance(layer, torch.nn.Linear)]
    assert (len(dense), dense[0].in_features) == (6, 129 * 31)
    pose = torch.zeros(1, 101, 126)
    changed = pose.clone()
    changed[0, 50] = 1.0
    with torch.no_grad():
        widths = [network.predict(x, torch.zeros(1, 101, 3))[0] for x in (pose, changed)]
    moved = torch.nonzero((widths[0] - widths[1]).abs().sum(-1)[0]).flatten()
    assert (moved.min(), moved.max()) == (35, 65)


@pytest.mark.parametrize(
    "wrong",
    [{"n_hidden": 0}, {"dropout": 1.0}, {"kernel": "box"}, {"first_sigma": 0.0}, {"radius": 2.5}],
)
def test_configurations_without_sense_are_refused(wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        EBFConfig(9, **wrong)


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
        sigma, bias = model.eval().predict(pose, velocity)
    assert bias is None
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
        widths = [model.eval().predict(x, velocity)[0] for x in (changed, pose)]
        difference = (widths[0] - widths[1]).abs().sum(-1)[0]
    assert difference[29] > 0
    assert difference[31] > 0
    assert difference[[0, 60]].max() < difference[30]
