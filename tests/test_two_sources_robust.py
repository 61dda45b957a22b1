import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from mocaplab.two_sources.losses import unit
from mocaplab.two_sources.robust import PAIRS, RobustConfig, RobustFusion, principal_axis


def model(n_joints=3, **config):
    return RobustFusion(RobustConfig(n_joints, n_trust=4, **config), seed=0)


def sources(n_frames=30, n_joints=3, seed=0):
    """Two recordings of a turn that goes on evenly, in double precision."""
    rng = np.random.default_rng(seed)
    turns = np.linspace(0, 0.4, n_frames)[:, None, None] * rng.normal(size=(1, n_joints, 3))
    clean = Rotation.from_rotvec(turns.reshape(-1, 3)).as_quat()[:, [3, 0, 1, 2]]
    clean = clean.reshape(1, n_frames, n_joints, 4)
    return [
        torch.from_numpy(clean),
        *(unit(torch.from_numpy(clean + 0.02 * rng.normal(size=clean.shape))) for _ in range(2)),
    ]


def test_principal_axis_is_the_eigenvector_of_numpy():
    rng = np.random.default_rng(0)
    half = rng.normal(size=(50, 4, 4))
    matrices = half @ half.transpose(0, 2, 1) + np.diag([30.0, 0, 0, 0])
    i, j = PAIRS
    found = principal_axis(torch.from_numpy(matrices[:, i, j])).numpy()
    expected = np.linalg.eigh(matrices)[1][..., -1]
    np.testing.assert_allclose(np.abs(np.sum(found * expected, axis=-1)), 1, atol=1e-9)


def test_blend_is_the_weighted_mean_of_scipy():
    _, a, b = sources()
    rng = np.random.default_rng(1)
    trust = torch.from_numpy(rng.uniform(0.1, 5, size=(1, 30, 3, 2)))
    sigma = torch.full((1, 30, 3), 2.0, dtype=torch.float64)
    fused = model(radius=6).blend(a, b, trust, sigma)[0].numpy()
    frames = np.arange(30)
    for frame, joint in ((0, 1), (4, 0), (17, 2), (29, 1)):
        near = np.abs(frames - frame) <= 6
        gauss = np.exp(-0.5 * ((frames - frame) / 2.0) ** 2)[near]
        both = np.concatenate([a[0, near, joint], b[0, near, joint]])
        weights = np.concatenate([gauss * trust[0, near, joint, s].numpy() for s in (0, 1)])
        mean = Rotation.from_quat(both[:, [1, 2, 3, 0]]).mean(weights)
        apart = mean.inv() * Rotation.from_quat(fused[frame, joint][[1, 2, 3, 0]])
        assert apart.magnitude() < 1e-6


def test_signs_and_order_of_the_sources_do_not_matter():
    _, a, b = (x.float() for x in sources())
    network = model()
    signs = torch.from_numpy(
        np.random.default_rng(2).choice([-1.0, 1.0], size=(1, 30, 3, 1))
    ).float()
    fused = network(a, b, 0.01)
    for other in (network(b, a, 0.01), network(a * signs, b, 0.01)):
        cosine = (fused * other).sum(dim=-1).abs()
        torch.testing.assert_close(cosine, torch.ones_like(cosine), atol=1e-5, rtol=0)
    torch.testing.assert_close(fused.norm(dim=-1), torch.ones(1, 30, 3))


def test_correction_is_the_conditional_mean():
    """Two joints that always turn alike, by hand: what one says is half of what both say."""
    network = RobustFusion(RobustConfig(3), seed=0)
    variance, error = 0.01, 0.02
    network.covariance.copy_(variance * torch.eye(3).repeat(2, 2))
    x = np.zeros((1, 1, 3, 3))
    x[..., 1, 0], x[..., 2, 0] = 0.011, 0.005
    q = np.concatenate([np.sqrt(1 - (x**2).sum(-1, keepdims=True) / 4), x / 2], axis=-1)
    fused = network.correct(torch.from_numpy(q).float(), torch.full((1, 1, 3), error))
    found = 2 * fused[0, 0, 1:, 1].numpy()
    # Of a sum s = 2 z + noise of variance 2 error^2, z is s * variance / (2 variance + error^2).
    expected = 0.016 * variance / (2 * variance + error**2)
    np.testing.assert_allclose(found, expected, rtol=0.02)


def test_a_body_that_moves_otherwise_is_left_alone():
    network = RobustFusion(RobustConfig(2), seed=0)
    network.covariance.copy_(1e-8 * torch.eye(3))
    turn = torch.tensor([0.0, 0.3, 0.0, 0.0])
    turn[0] = (1 - turn[1] ** 2).sqrt()
    q = torch.stack([torch.eye(4)[0], turn]).expand(1, 5, 2, 4)
    fused = network.correct(q, torch.full((1, 5, 2), 0.007))
    torch.testing.assert_close(fused, q, atol=1e-3, rtol=0)


def test_poses_are_learned_from_clips():
    rng = np.random.default_rng(3)
    turns = rng.normal(size=(500, 3, 3)) * 0.1
    q = Rotation.from_rotvec(turns.reshape(-1, 3)).as_quat()[:, [3, 0, 1, 2]].reshape(500, 3, 4)
    network = model()
    network.learn_poses(np.eye(4)[[0, 0, 0]], q)
    expected = np.cov(
        2
        * np.sin(np.linalg.norm(turns[:, 1], axis=-1) / 2)
        * turns[:, 1].T
        / np.linalg.norm(turns[:, 1], axis=-1)
    )
    np.testing.assert_allclose(network.covariance[:3, :3], expected, atol=1e-6)


def test_judging_serves_any_number_of_joints_and_every_rate():
    network = model(n_joints=3)
    _, a, b = (x.float() for x in sources(n_joints=7))
    trust, sigma_s, error_rad = network.judge_sources(a, b)
    assert trust.shape == (1, 30, 7, 2)
    assert (trust > 0).all()
    assert sigma_s.shape == error_rad.shape == (1, 30, 7)


def test_known_best_weights_are_learned():
    """A clean source and one of noise: after a few steps the clean one has nearly all trust."""
    network = model()
    optimizer = torch.optim.Adam(network.parameters(), lr=0.02)
    rng = np.random.default_rng(4)
    for step in range(80):
        clean, _, _ = sources(seed=step)
        clean = clean.float()
        noise = unit(torch.from_numpy(rng.normal(size=clean.shape)).float())
        pair = (clean, noise) if step % 2 else (noise, clean)
        trust, sigma_s, _ = network.judge_sources(*pair)
        fused = network.blend(*pair, trust, sigma_s / 0.01)
        loss = (1 - (fused * clean).sum(-1) ** 2).clamp_min(0).mean()
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
    clean, _, _ = sources(seed=1000)
    noise = unit(torch.from_numpy(rng.normal(size=clean.shape)).float())
    trust, _, _ = network.judge_sources(clean.float(), noise)
    assert (trust[..., 0] / trust.sum(dim=-1)).mean() > 0.95


def test_configuration_is_checked():
    with pytest.raises(ValueError, match="radius must be a whole number"):
        RobustConfig(3, radius=0)
