"""The torch twin of forward kinematics: the same numbers, and the right gradients."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from mocaplab.bvh import load_bvh
from mocaplab.kinematics import end_site_positions, forward_kinematics
from mocaplab.motion import Motion, Skeleton
from mocaplab.torch_kinematics import end_site_positions_torch, forward_kinematics_torch

ORDERS = ["XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX", "X", "YZ", ""]


def mixed_motion(n_frames=7) -> Motion:
    """Every order once, positions in odd places, a joint that has nothing, a branching tree."""
    names = [tuple(f"{axis}rotation" for axis in order) for order in ORDERS]
    names[0] = ("Zposition", "Xrotation", "Yrotation", "Xposition", "Zrotation")
    names[3] = (*names[3], "Yposition")
    names[8] = ("Xposition", "Yposition", "Zposition")
    rng = np.random.default_rng(0)
    skeleton = Skeleton(
        tuple(f"joint {j}" for j in range(9)),
        [-1, 0, 1, 2, 1, 4, 0, 6, 7],
        rng.normal(scale=10, size=(9, 3)),
        tuple(names),
        [3, 5, 8],
        rng.normal(scale=10, size=(3, 3)),
    )
    values = rng.normal(scale=90, size=(n_frames, skeleton.n_channels))
    return Motion(skeleton, 0.01, values)


def check(motion: Motion) -> None:
    channels = torch.tensor(motion.channels)
    for ours, numpys in zip(
        forward_kinematics_torch(motion.skeleton, channels),
        forward_kinematics(motion),
        strict=True,
    ):
        np.testing.assert_allclose(ours.numpy(), numpys, atol=1e-9)
    np.testing.assert_allclose(
        end_site_positions_torch(motion.skeleton, channels).numpy(),
        end_site_positions(motion),
        atol=1e-9,
    )


def test_numbers_are_numpys_on_mixed_orders(small_motion):
    check(mixed_motion())
    check(small_motion)


def test_a_root_that_cannot_turn():
    skeleton = Skeleton(
        ("Root", "Hinge"),
        [-1, 0],
        [[1, 2, 3], [0, 1, 0]],
        ((), ("Xrotation",)),
        [],
        np.zeros((0, 3)),
    )
    check(Motion(skeleton, 0.1, [[40.0], [50.0]]))


@pytest.mark.parametrize("name", ["cmu/jump_05.bvh", "cmu_daz/martial_04.bvh"])
def test_numbers_are_numpys_on_real_clips(data_dir, name):
    check(load_bvh(data_dir / name).slice_frames(0, 100))


def test_batches_and_single_precision_go_through():
    motion = mixed_motion(6)
    flat = torch.tensor(motion.channels)
    positions, orientations = forward_kinematics_torch(motion.skeleton, flat)
    batch = flat.reshape(2, 3, -1)
    batched, turned = forward_kinematics_torch(motion.skeleton, batch)
    assert batched.shape == (2, 3, 9, 3)
    assert turned.shape == (2, 3, 9, 3, 3)
    torch.testing.assert_close(batched.reshape(6, 9, 3), positions)
    torch.testing.assert_close(turned.reshape(6, 9, 3, 3), orientations)
    single, _ = forward_kinematics_torch(motion.skeleton, flat[0].float())
    assert single.dtype == torch.float32
    np.testing.assert_allclose(single.numpy(), positions[0].numpy(), atol=1e-3)


def test_gradients_pass_torchs_own_check():
    motion = mixed_motion(2)
    channels = torch.tensor(motion.channels, requires_grad=True)
    assert torch.autograd.gradcheck(
        lambda values: forward_kinematics_torch(motion.skeleton, values), (channels,)
    )


def test_gradients_are_the_differences_of_numpys_kinematics():
    """Move one channel a little; the weighted sum of positions follows as the gradient says."""
    motion = mixed_motion(3)
    weights = np.random.default_rng(1).normal(size=(3, 9, 3))
    channels = torch.tensor(motion.channels, requires_grad=True)
    positions, _ = forward_kinematics_torch(motion.skeleton, channels)
    (positions * torch.tensor(weights)).sum().backward()
    step = 1e-4
    expected = np.empty_like(motion.channels)
    for t, c in np.ndindex(expected.shape):
        sides = []
        for sign in (1, -1):
            moved = motion.channels.copy()
            moved[t, c] += sign * step
            sides.append((forward_kinematics(motion.with_channels(moved))[0] * weights).sum())
        expected[t, c] = (sides[0] - sides[1]) / (2 * step)
    assert channels.grad is not None
    np.testing.assert_allclose(channels.grad.numpy(), expected, atol=1e-6)


def test_a_loss_in_positions_finds_the_angles():
    """Two bones reach for where they once were: what the gradients are for."""
    skeleton = Skeleton(
        ("Shoulder", "Elbow", "Hand"),
        [-1, 0, 1],
        [[0, 0, 0], [2, 0, 0], [1, 0, 0]],
        (("Zrotation",), ("Zrotation",), ()),
        [],
        np.zeros((0, 3)),
    )
    goal, _ = forward_kinematics_torch(skeleton, torch.tensor([[40.0, -70.0]]))
    angles = torch.zeros(1, 2, requires_grad=True)
    optimizer = torch.optim.LBFGS([angles], max_iter=50, line_search_fn="strong_wolfe")

    def loss():
        optimizer.zero_grad()
        error = (forward_kinematics_torch(skeleton, 100 * angles)[0] - goal).square().sum()
        error.backward()
        return error

    optimizer.step(loss)
    np.testing.assert_allclose(100 * angles.detach().numpy(), [[40, -70]], atol=0.1)


@pytest.mark.parametrize("channels", [torch.zeros(4, 3), torch.zeros(4, 16, dtype=torch.int64)])
def test_channels_must_fit(small_motion, channels):
    with pytest.raises(ValueError, match=r"expected channels of shape \(..., 16\) in floating"):
        forward_kinematics_torch(small_motion.skeleton, channels)
