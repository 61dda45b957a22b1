"""Notebook 02's checks on noise accept right answers and answer typical mistakes with hints."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from mocaplab.exercises.answers import NOT_YET, as_array, as_number, call, short
from mocaplab.exercises.noise import (
    check_bias,
    check_k_of_snr,
    check_noise_left,
    check_uniform_noise,
)
from mocaplab.inverse_kinematics import solve_angles
from mocaplab.kinematics import forward_kinematics
from mocaplab.measures.by_name import rms_moving_deg
from mocaplab.noise.angular import angular_noise, movement_std, uniform_noise
from mocaplab.noise.spatial import has_own_place, joints_that_move
from mocaplab.skeletons.units import cm_per_unit

RIGHT = "Right:"
ODD = ("0.3", "text", [1, 2], [], {}, object(), float("nan"), True, 1j, [[1], [2, 3]], b"x")


@pytest.fixture(scope="module")
def clip(walk):
    return walk.slice_frames(0, 240)


@pytest.fixture(scope="module")
def solved(clip):
    positions, _ = forward_kinematics(clip)
    rng = np.random.default_rng(0)
    noise = 0.5 / cm_per_unit(clip.skeleton) * rng.normal(size=positions.shape)
    return solve_angles(clip, positions + noise, tolerance=1e-3)[0]


def first(value, *_):
    return value


def all_checks(clip, solved):
    return {
        "k": check_k_of_snr,
        "uniform": lambda answer: check_uniform_noise(answer, clip),
        "left": lambda answer: check_noise_left(answer, solved, clip),
        "bias": check_bias,
    }


@pytest.mark.parametrize("name", ["k", "uniform", "left", "bias"])
def test_nothing_and_odd_answers(name, clip, solved):
    check = all_checks(clip, solved)[name]
    assert check(None) == NOT_YET
    functions = [partial(first, value) for value in ODD] + [lambda: 1, lambda *_: 1 / 0]
    for answer in [*ODD, *functions, lambda *_: None]:
        sentence = check(answer)
        assert isinstance(sentence, str)
        assert len(sentence) > 10
        assert not sentence.startswith(RIGHT)


# ------------------------------------------------------------------ k of an SNR


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (10**-0.5, RIGHT),
        (0.316, RIGHT),
        (np.float32(0.32), RIGHT),
        (np.array([0.3162]), RIGHT),
        (0.1, "not 10 log10"),
        (3.162, "turned the ratio over: this noise is louder"),
        (10, "10 log10 where deviations need 20"),
        (np.exp(-0.5), "base 10"),
        (0, "over 0"),
        (-0.3, "over 0"),
        (0.5, "gives 6.0 dB"),
    ],
)
def test_k_of_snr(answer, words):
    assert words in check_k_of_snr(answer)


# ------------------------------------------------------------------ uniform noise


def uniform(low, high, scale=movement_std):
    def noisy(motion, k, rng):
        noise = rng.uniform(low, high, size=motion.channels.shape)
        return motion.channels + k * scale(motion) * noise

    return noisy


def one_loop_a_channel(motion, k, rng):
    channels = motion.channels.copy()
    for c in np.flatnonzero(motion.skeleton.is_cleaned):
        a = 3**0.5 * k * channels[:, c].std()
        channels[:, c] += [rng.uniform(-a, a) for _ in range(motion.n_frames)]
    return motion.with_channels(channels)


def raw_std(motion):
    return motion.channels.std(axis=0)


def one_std(motion):
    cleaned = motion.skeleton.is_cleaned
    return motion.channels[:, cleaned].std() * (movement_std(motion) > 0)


def one_number_a_channel(motion, k, rng):
    return motion.channels + k * movement_std(motion) * rng.uniform(
        -(3**0.5), 3**0.5, size=motion.skeleton.n_channels
    )


def one_number_a_frame(motion, k, rng):
    noise = rng.uniform(-(3**0.5), 3**0.5, size=(motion.n_frames, 1))
    return motion.channels + k * movement_std(motion) * noise


def noise_alone(motion, k, rng):
    return uniform(-(3**0.5), 3**0.5)(motion, k, rng) - motion.channels


ROOT3 = 3**0.5


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (lambda m, k, rng: uniform_noise(m, k, rng=rng), RIGHT),
        (uniform(-ROOT3, ROOT3), RIGHT),
        (one_loop_a_channel, RIGHT),
        (lambda m, k, rng: uniform_noise(m, k, rng=rng).channels.tolist(), RIGHT),
        (uniform(-1, 1), "What must a be"),
        (uniform(-0.5, 0.5), "How wide must it be"),
        (uniform(-3, 3), "where sqrt(3) belongs"),
        (uniform(-(12**0.5), 12**0.5), "from end to end"),
        (uniform(0, 2 * ROOT3), "that is a bias"),
        (uniform(-2, 2), "wanted are k = 0.5"),
        (uniform(-ROOT3, ROOT3, raw_std), "The root moved too"),
        (uniform(-ROOT3, ROOT3, one_std), "std over axis=0"),
        (lambda m, k, rng: angular_noise(m, k, rng=rng), "Gaussian noise"),
        (lambda m, k, rng: uniform_noise(m, 0.5, rng=rng), "Multiply by k"),
        (lambda m, k, rng: uniform_noise(m, k, rng=np.random.default_rng()), "Draw every number"),
        (lambda m, k, rng: m, "changed nothing"),
        (one_number_a_channel, "Every frame got the same"),
        (one_number_a_frame, "All channels got the same"),
        (noise_alone, "the noise alone"),
        (lambda m, k, rng: m.channels[:10], "an array of shape (10, 96)"),
        (lambda m, k, rng: m.channels * np.nan, "NaNs"),
        (lambda m: m, "stopped with TypeError"),
        (lambda m, k, rng: None, "end with return"),
        (0.5, "the function itself"),
    ],
)
def test_uniform_noise(clip, answer, words):
    assert words in check_uniform_noise(answer, clip)


def test_noise_on_channels_that_never_move(clip):
    def everywhere(motion, k, rng):
        size = np.where(motion.skeleton.is_cleaned, 1.0, 0.0)
        return motion.channels + k * size * rng.uniform(-ROOT3, ROOT3, motion.channels.shape)

    assert "never move got noise" in check_uniform_noise(everywhere, clip)


# ------------------------------------------------------------------ noise left


def test_noise_left(clip, solved):
    unit = cm_per_unit(clip.skeleton)
    error = forward_kinematics(solved)[0] - forward_kinematics(clip)[0]
    moves = joints_that_move(clip) & has_own_place(clip.skeleton)
    right = np.sqrt(np.mean(error[:, moves] ** 2)) * unit
    distance = np.linalg.norm(error[:, moves], axis=-1) * unit
    cases = [
        (right, RIGHT),
        (np.std(error[:, moves]) * unit, RIGHT),
        (np.sqrt(np.mean(distance**2)), "smaller by sqrt(3)"),
        (right / unit, "in units of the file"),
        (right / unit**2, "a unit is longer than 1 cm"),
        (distance.mean(), "mean distance"),
        (np.sqrt(np.mean(error**2)) * unit, "joints that cannot move"),
        (np.sqrt(np.mean(error**2)), "multiply by cm_per_unit"),
        (right**2, "mean square"),
        (np.abs(error[:, moves]).mean() * unit, "Square first"),
        (rms_moving_deg(solved, clip), "in degrees"),
        (0.5, "absorbed a part"),
        (7.7, "You got 7.7 cm"),
    ]
    for answer, words in cases:
        assert words in check_noise_left(answer, solved, clip), words


# ------------------------------------------------------------------ bias


def unit(q, axis=-1):
    return q / np.linalg.norm(q, axis=axis, keepdims=True)


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (lambda q, t, rng: unit(q + t * rng.normal(size=q.shape[1:])), RIGHT),
        (lambda q, t, rng: unit(q + rng.normal(0, t, (1, *q.shape[1:]))).tolist(), RIGHT),
        (lambda q, t, rng: q + t * rng.normal(size=q.shape[1:]), "length is not 1"),
        (lambda q, t, rng: unit(q + t * rng.normal(size=q.shape[1:]), axis=0), "its own length"),
        (lambda q, t, rng: unit(q + t * rng.normal(size=q.shape[1:]), axis=None), "its own length"),
        (lambda q, t, rng: unit(q + t * rng.normal(size=q.shape)), "imprecision"),
        (lambda q, t, rng: unit(q + t * rng.normal(size=4)), "All joints got the same"),
        (lambda q, t, rng: unit(q + t * rng.normal(size=(q.shape[1], 1))), "All numbers"),
        (lambda q, t, rng: t * rng.normal(size=q.shape), "bias alone"),
        (lambda q, t, rng: unit(q + t * rng.random(q.shape[1:])), "one sign"),
        (lambda q, t, rng: unit(q + t**2 * rng.normal(size=q.shape[1:])), "once"),
        (
            lambda q, t, rng: unit(q + t * np.random.default_rng().normal(size=q.shape)),
            "Draw every",
        ),
        (lambda q, t, rng: q, "Nothing changed"),
        (lambda q, t, rng: q[0], "array of shape (40, 4)"),
        (lambda q, t, rng: None, "end with return"),
        (lambda q, t, rng: q + undefined, "NameError"),  # noqa: F821
        (0.005, "the function itself"),
    ],
)
def test_bias(answer, words):
    assert words in check_bias(answer)


# ------------------------------------------------------------------ reading answers


def test_reading_answers():
    assert as_number([0.5]) == as_number(np.float32(0.5)) == 0.5
    assert as_number([1, 2]) is None
    assert as_array(x for x in range(3)).tolist() == [0, 1, 2]
    assert as_array("12") is None
    assert short("x" * 100).endswith("...")

    class Broken:
        def __repr__(self):
            raise RuntimeError

    assert short(Broken()) == "a Broken"
    assert call(lambda x: x + 1, 2) == (3, "")
