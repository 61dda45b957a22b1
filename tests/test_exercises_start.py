"""The checks accept right answers and meet each typical mistake with its own hint."""

import numpy as np
import pytest

from mocaplab.corruption import corrupt
from mocaplab.exercises.start import NOT_YET, check_gaussian_width, check_noisiest_joint, check_rms
from mocaplab.measures.by_name import rms_moving_deg


@pytest.fixture(scope="module")
def clip(walk):
    return corrupt(walk, "angular:0.5", rng=np.random.default_rng(1))


def test_no_answer_yet(clip):
    for check in (check_noisiest_joint, check_rms, check_gaussian_width):
        assert check(None, clip) == NOT_YET


def test_noisiest_joint(clip):
    answers = {j: check_noisiest_joint(j, clip) for j in clip.clean.skeleton.joint_names}
    assert sum(text.startswith("Right:") for text in answers.values()) == 1
    assert sum(text.startswith("Almost:") for text in answers.values()) == 1
    assert "got no noise" in answers["LHipJoint"]
    assert "widest angles" in answers["Head"]
    assert "There is no joint" in check_noisiest_joint("Knee", clip)


ODD = ([], [1, 2], {}, object(), float("nan"), True, 1j, b"x", np.arange(3), "knee")


@pytest.mark.parametrize("odd", ODD)
def test_odd_answers_get_a_sentence(odd, clip):
    for check in (check_noisiest_joint, check_rms, check_gaussian_width):
        for answer in (odd, lambda *_: odd):
            text = check(answer, clip)
            assert len(text) > 10
            assert not text.startswith("Right")


def joint_errors(a, b):
    return (a.channels - b.channels)[:, a.skeleton.is_cleaned]


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (lambda a, b: np.sqrt(np.mean(joint_errors(a, b) ** 2)), "Right"),
        (lambda a, b: np.linalg.norm(joint_errors(a, b)) / joint_errors(a, b).size ** 0.5, "Right"),
        (lambda a, b: np.mean(joint_errors(a, b) ** 2), "square root"),
        (lambda a, b: np.mean(np.abs(joint_errors(a, b))), "Square before"),
        (lambda a, b: np.mean(joint_errors(a, b)), "cancel"),
        (lambda a, b: np.linalg.norm(joint_errors(a, b)), "Divide by the number"),
        (lambda a, b: np.sqrt(np.mean((a.channels - b.channels) ** 2)), "root's 6 channels"),
        (rms_moving_deg, "only the channels that move"),
        (lambda a, b: np.mean(np.sqrt(np.mean(joint_errors(a, b) ** 2, axis=0))), "one RMS a"),
        (lambda a, b: np.std(joint_errors(a, b)), "standard deviation"),
        (lambda a, b: np.sqrt(np.mean(joint_errors(a, b) ** 2, axis=0)), "90 numbers, not one"),
        (lambda a, b: None, "end with return"),
        (2.39, "the function itself"),
        (lambda a, b: 12.0, "Subtract, square"),
        (lambda a, b: joint_errors(a, b) @ joint_errors(a, b), "stopped with ValueError"),
        (lambda a: a, "stopped with TypeError"),
    ],
)
def test_rms(clip, answer, words):
    assert words in check_rms(answer, clip)


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (5, "divide by 120"),
        (58, "milliseconds"),
        (0, "above 0"),
        (float("nan"), "number of seconds"),
        ("0.03", "number of seconds"),
        (0.0005, "go up"),
        (0.008, "go up"),
        (0.2, "go down"),
    ],
)
def test_gaussian_width(clip, answer, words):
    assert words in check_gaussian_width(answer, clip)


def test_right_gaussian_width(clip):
    answers = [check_gaussian_width(s, clip) for s in np.arange(0.02, 0.09, 0.002)]
    assert any(text.startswith("Right:") for text in answers)
    assert check_gaussian_width(np.float32(0.035), clip) == check_gaussian_width([0.035], clip)
