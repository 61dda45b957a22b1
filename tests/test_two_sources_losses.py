import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from mocaplab.kinematics import forward_kinematics
from mocaplab.poses import motion_to_quaternions
from mocaplab.two_sources.losses import (
    invariant_l1_loss,
    kinematics_loss,
    l1_loss,
    multiply,
    quaternion_to_matrix_torch,
    same_side,
    unit,
)


def random_quaternions(*shape, seed=0):
    q = np.random.default_rng(seed).normal(size=(*shape, 4))
    return q / np.linalg.norm(q, axis=-1, keepdims=True)


def test_l1_loss_by_hand():
    # Two frames of two joints. Frame 0: 0.3 + 0.4; frame 1: 0 and 1. Mean of 0.7 and 1.
    truth = torch.zeros(2, 2, 4)
    predicted = truth.clone()
    predicted[0, 0, 1], predicted[0, 1, 3], predicted[1, 1, 2] = 0.3, -0.4, 1.0
    assert l1_loss(predicted, truth).item() == pytest.approx(0.85)


def test_only_our_loss_knows_that_minus_q_is_q():
    q = torch.from_numpy(random_quaternions(3, 5, 2))
    flipped = q * torch.tensor([-1.0, 1.0])[:, None]
    assert invariant_l1_loss(flipped, q).item() == 0
    first = q[..., 0, :].abs().sum(dim=-1)
    assert l1_loss(flipped, q).item() == pytest.approx(2 * first.mean().item())


def test_invariant_loss_chooses_for_each_joint_alone():
    truth = torch.tensor([[[1.0, 0, 0, 0], [1.0, 0, 0, 0]]])
    predicted = torch.tensor([[[0.9, 0, 0, 0], [-0.8, 0, 0, 0.1]]])
    assert invariant_l1_loss(predicted, truth).item() == pytest.approx(0.1 + 0.3)


def test_arithmetic_agrees_with_scipy():
    p, q = random_quaternions(7, seed=1), random_quaternions(7, seed=2)
    r, s = (Rotation.from_quat(x[:, [1, 2, 3, 0]]) for x in (p, q))
    np.testing.assert_allclose(
        quaternion_to_matrix_torch(torch.from_numpy(p)), r.as_matrix(), atol=1e-12
    )
    product = multiply(torch.from_numpy(p), torch.from_numpy(q)).numpy()
    apart = (r * s).inv() * Rotation.from_quat(product[:, [1, 2, 3, 0]])
    assert apart.magnitude().max() < 1e-7


def test_same_side_and_unit():
    q = torch.tensor([[2.0, 0, 0, 0], [0, -3.0, 0, 0]])
    reference = torch.tensor([[-1.0, 0, 0, 0], [0, -1.0, 0, 0]])
    assert same_side(unit(q), reference).tolist() == [[-1, 0, 0, 0], [0, -1, 0, 0]]


def test_kinematics_loss_is_the_mean_distance_of_joints(walk):
    other = walk.with_channels(walk.channels + 5 * walk.skeleton.is_cleaned)
    pair = [motion_to_quaternions(m) for m in (walk, other)]
    places = []
    for motion in (walk, other):
        positions, _ = forward_kinematics(motion)
        places.append(positions - positions[:, :1])
    expected = np.linalg.norm(places[0] - places[1], axis=-1).mean()
    joints = list(range(walk.skeleton.n_joints))
    # Neither sign nor length of a quaternion matters.
    loss = kinematics_loss(
        torch.from_numpy(-2 * pair[1]), torch.from_numpy(pair[0]), walk.skeleton, joints
    )
    assert loss.item() == pytest.approx(expected, rel=1e-9)


def test_kinematics_loss_has_a_gradient(walk):
    q = torch.from_numpy(motion_to_quaternions(walk)[:3]).requires_grad_()
    turned = q.detach().roll(1, dims=0)
    kinematics_loss(q, turned, walk.skeleton, list(range(31))).backward()
    assert torch.isfinite(q.grad).all()
    assert q.grad.abs().max() > 0
