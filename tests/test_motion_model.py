"""The statistical motion model: its file, its series, and the fit that made it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from safetensors.numpy import load_file

from data_tools.fit_motion_model import fit_model, main, principal_components
from data_tools.gait_cycles import fit_cycle, gait_phase, is_plain_gait, travel_direction
from data_tools.model_clips import common_branch, hold_spinning, joint_reach
from data_tools.motion_events import fit_event, jump_landmarks, kick_landmarks
from mocaplab.bvh import save_bvh
from mocaplab.euler import alternate_euler
from mocaplab.kinematics import forward_kinematics
from mocaplab.motion import Motion, Skeleton
from mocaplab.motion_model import (
    FRAME_TIME,
    MODEL_FILE,
    cosine_basis,
    fourier_basis,
    load_motion_model,
    turn_root,
)
from mocaplab.synthesis import synthesize


def draw(action: str, seed: int, duration_s: float = 4.0, style: float = 1.0) -> Motion:
    rng = np.random.default_rng(seed)
    return synthesize(action, duration_s=duration_s, rng=rng, style=style, name=f"{action}{seed}")


def test_model_file_is_small_and_holds_no_clip() -> None:
    assert MODEL_FILE.stat().st_size < 300_000
    model = load_motion_model()
    for action in model.actions.values():
        assert len(action.std) <= 11
        assert action.components.shape == (len(action.std), *action.mean.shape)
        assert action.mean.shape[1] == model.moving.sum() + 3
        assert (action.limits[0] <= action.limits[1]).all()


def test_jog_lies_between_walk_and_run() -> None:
    walk, jog, run = (load_motion_model().actions[name] for name in ("walk", "jog", "run"))
    assert walk.log_rate[0] < jog.log_rate[0] < run.log_rate[0]
    assert walk.mean[0, -1] < jog.mean[0, -1] < run.mean[0, -1]  # mean speed forward
    assert len(jog.std) == len(walk.std) + len(run.std)


def test_fourier_basis_repeats_and_is_orthogonal() -> None:
    phase = np.arange(120) / 120
    basis = fourier_basis(phase, 3)
    assert basis.shape == (120, 7)
    np.testing.assert_allclose(fourier_basis(phase + 5, 3), basis, atol=1e-12)
    np.testing.assert_allclose(basis.T @ basis, np.diag([120.0] + [60.0] * 6), atol=1e-9)


def test_cosine_basis_is_level_at_both_ends() -> None:
    basis = cosine_basis(np.linspace(0, 1, 2001), 6)
    slope = np.gradient(basis, 1 / 2000, axis=0)
    assert np.abs(slope[[0, -1]]).max() < 0.1
    assert np.abs(slope).max() > 10


def test_evaluate_is_the_mean_plus_scores_times_components() -> None:
    action = load_motion_model().actions["walk"]
    basis = fourier_basis(np.linspace(0, 2, 30), 8)
    scores = np.random.default_rng(0).normal(size=(30, len(action.std)))
    expected = np.stack(
        [
            row @ (action.mean + np.tensordot(score, action.components, axes=1))
            for row, score in zip(basis, scores, strict=True)
        ]
    )
    np.testing.assert_allclose(action.evaluate(basis, scores), expected, atol=1e-9)


def test_turn_root_turns_the_body_and_nothing_else() -> None:
    motion = draw("walk", 0, 1.0)
    angle = np.linspace(0.3, 2.5, motion.n_frames)
    before, after = (forward_kinematics(m)[0] for m in (motion, turn_root(motion, angle)))
    cosine, sine = np.cos(angle)[:, None], np.sin(angle)[:, None]
    x, y, z = np.moveaxis(before - before[:, :1], -1, 0)
    expected = np.stack([x * cosine + z * sine, y, z * cosine - x * sine], axis=-1)
    np.testing.assert_allclose(after - after[:, :1], expected, atol=1e-9)
    back = turn_root(turn_root(motion, angle), -angle)
    np.testing.assert_allclose(back.channels, motion.channels, atol=1e-9)


@pytest.mark.parametrize("action", ["walk", "run"])
def test_fit_finds_the_cycle_again(action: str) -> None:
    """The fit of a drawn average clip gives the rate and the speeds that it was drawn with."""
    model = load_motion_model()
    motion = draw(action, 1, 12.0, style=0.0)
    direction = travel_direction(motion)
    assert is_plain_gait(motion)
    phase = gait_phase(motion, direction)
    assert (np.diff(phase) > 0).all()
    coefficients, rate = fit_cycle(motion, model.moving, direction)
    statistics = model.actions[action]
    assert np.log(rate) == pytest.approx(statistics.log_rate[0], abs=0.03)
    # Average angles do not depend on where the cycle starts; the heading drifts, so leave
    # the root out.
    np.testing.assert_allclose(coefficients[0, 3:-3], statistics.mean[0, 3:-3], atol=1.0)
    assert coefficients[0, -1] == pytest.approx(statistics.mean[0, -1], rel=0.1)


def test_whole_phase_is_the_left_foot_passing() -> None:
    motion = draw("walk", 3, 5.0)
    direction = travel_direction(motion)
    phase = gait_phase(motion, direction)
    names = motion.skeleton.joint_names
    positions = forward_kinematics(motion)[0]
    apart = positions[:, names.index("LeftFoot")] - positions[:, names.index("RightFoot")]
    ahead = apart[:, 0] * np.sin(direction) + apart[:, 2] * np.cos(direction)
    quarter = phase % 1
    assert ahead[(quarter > 0.2) & (quarter < 0.3)].min() > 0
    assert ahead[(quarter > 0.7) & (quarter < 0.8)].max() < 0


def test_clips_that_turn_or_climb_are_no_plain_gait() -> None:
    motion = draw("walk", 1)
    turning = turn_root(motion, np.linspace(0, 1.0, motion.n_frames))
    assert not is_plain_gait(turning)
    climbing = motion.channels.copy()
    climbing[:, 1] += np.linspace(0, 10, motion.n_frames)
    assert not is_plain_gait(motion.with_channels(climbing))


def test_landmarks_come_in_order() -> None:
    assert jump_landmarks(draw("walk", 0)) == []
    for motion, find in ((draw("jump", 2), jump_landmarks), (draw("kick", 4), kick_landmarks)):
        frames = find(motion)
        assert frames == sorted(set(frames))
        assert frames[0] > 0
        assert frames[-1] < motion.n_frames


def test_event_fitted_on_its_own_knots_is_the_clip_again() -> None:
    motion = draw("jump", 2)
    moving = load_motion_model().moving
    frames = jump_landmarks(motion)
    knots_s = np.concatenate([[0.0], 0.9 + (np.array(frames) - frames[0]) * FRAME_TIME])
    knots_s = np.append(knots_s, knots_s[-1] + 0.5)
    coefficients = fit_event(motion, moving, 0.0, frames, knots_s)
    time_s = np.arange(0.0, knots_s[-1], FRAME_TIME)
    fitted = cosine_basis(time_s / knots_s[-1], len(coefficients)) @ coefficients
    start = frames[0] - 0.9 / FRAME_TIME
    knee = motion.channels[:, moving][:, 10:-3]
    at = start + np.arange(len(time_s))
    recorded = np.stack([np.interp(at, np.arange(len(knee)), column) for column in knee.T], axis=1)
    assert np.sqrt(np.mean((fitted[:, 10 : 10 + knee.shape[1]] - recorded) ** 2)) < 0.5


def test_common_branch_undoes_branches_and_turns() -> None:
    motion = draw("walk", 2, 2.0)
    channels = motion.channels.copy()
    channels[:, 30:33] = alternate_euler(channels[:, 30:33], "ZYX")
    channels[:, 12] += 720.0
    reference = np.median(motion.channels, axis=0)
    back = common_branch(motion.with_channels(channels), reference)
    np.testing.assert_allclose(back.channels, motion.channels, atol=1e-9)


def test_spinning_fingers_are_held_and_knees_are_not() -> None:
    motion = draw("walk", 2, 1.0)
    channels = motion.channels.copy()
    thumb = motion.skeleton.channel_index("LThumb.Xrotation")
    knee = motion.skeleton.channel_index("LeftLeg.Xrotation")
    channels[:, [thumb, knee]] = np.linspace(0, 150, motion.n_frames)[:, None]
    held = hold_spinning(motion.with_channels(channels)).channels
    assert np.ptp(held[:, thumb]) == 0
    assert np.ptp(held[:, knee]) == 150


def test_joint_reach_is_the_farthest_end_site() -> None:
    names = (("Zrotation",),) * 3
    sites = np.array([[0.0, 4, 0], [1, 0, 0]])
    skeleton = Skeleton(("A", "B", "C"), [-1, 0, 0], np.eye(3) * [0, 3, 1], names, [1, 2], sites)
    np.testing.assert_allclose(joint_reach(skeleton), [7, 4, 1])


def test_principal_components_find_the_direction_that_samples_were_made_with() -> None:
    rng = np.random.default_rng(0)
    shape = rng.normal(size=(5, 8))
    truth = rng.normal(size=40)
    samples = 20 + truth[:, None, None] * shape
    arrays, scores = principal_components(samples, np.full(5, 10.0), 1)
    np.testing.assert_allclose(arrays["mean"], samples.mean(axis=0))
    rebuilt = arrays["mean"] + np.tensordot(scores, arrays["components"], axes=1)
    np.testing.assert_allclose(rebuilt, samples, atol=1e-9)
    assert arrays["std"] == pytest.approx(scores.std(ddof=1))


def test_command_refuses_too_few_clips(tmp_path: Path) -> None:
    save_bvh(draw("walk", 0), tmp_path / "only.bvh")
    (tmp_path / "clips.csv").write_text("clip,action\nonly,walk\n")
    with pytest.raises(ValueError, match="expected over 8 usable walks, got 1"):
        main([str(tmp_path), "-o", str(tmp_path / "model.safetensors")])
    assert not (tmp_path / "model.safetensors").exists()


def test_command_fits_drawn_clips(tmp_path: Path) -> None:
    lines = ["clip,action"]
    for action, count in {"walk": 10, "run": 5, "jump": 4, "kick": 4}.items():
        for seed in range(count):
            motion = draw(action, seed, 2.0 if action in ("walk", "run") else 2.5)
            save_bvh(motion, tmp_path / f"{motion.name}.bvh")
            lines.append(f"{motion.name},{action}")
    (tmp_path / "clips.csv").write_text("\n".join(lines) + "\n")
    output = tmp_path / "new" / "model.safetensors"
    main([str(tmp_path), "-o", str(output)])
    fitted, stored = load_file(output), load_file(MODEL_FILE)
    assert set(fitted) == set(stored)
    for key in ("walk.log_rate", "run.log_rate"):
        assert fitted[key][0] == pytest.approx(stored[key][0], abs=0.1)


def test_refit_gives_the_same_model(data_dir: Path) -> None:
    arrays, _ = fit_model(data_dir / "cmu")
    stored = load_file(MODEL_FILE)
    assert set(arrays) == set(stored)
    for key, value in arrays.items():
        np.testing.assert_allclose(value, stored[key], rtol=1e-3, atol=1e-3, err_msg=key)
