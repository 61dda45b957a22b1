"""Checks for the exercises of notebook 05, which trains EBF.

As in :mod:`mocaplab.exercises`, each returns a sentence that begins with "Right:" only if
the answer is right, and never raises whatever the answer is.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import torch

from mocaplab.exercises.answers import NOT_YET, NOTHING, as_number, call, known, short
from mocaplab.motion import FloatArray, Motion

READINGS = ("fine", "overfit", "underfit", "too fast")
"""What the curves of a training may tell."""

_CURVES = {"A": "overfit", "B": "too fast", "C": "fine", "D": "underfit"}


def check_loss(answer: Any) -> str:
    """Check a function (cleaned, clean, std, weight) that returns the loss of a batch."""
    if answer is None:
        return NOT_YET
    rng = np.random.default_rng(7)
    cleaned, clean = (torch.tensor(rng.normal(size=(3, 12, 4))) for _ in range(2))
    std = torch.tensor(rng.uniform(0.5, 9, size=(3, 1, 4)))
    weight = torch.ones(3, 12)
    weight[0, :3] = weight[1, :3] = weight[1, -4:] = 0
    result, problem = call(answer, *(t.clone() for t in (cleaned, clean, std, weight)))
    if problem or result is None:
        return problem or NOTHING
    got = as_number(result.detach() if isinstance(result, torch.Tensor) else result)
    if got is None:
        return f"The loss is one number, not {short(result)}. Sum, or mean, over all three axes."
    square, w = (cleaned - clean) ** 2, weight[..., None].expand(3, 12, 4)
    spread = (std**2).mean(dim=-1, keepdim=True)
    error = square * std**2 / spread
    n = w.sum()
    right = float((error * w).sum() / n)
    if np.isclose(got, right, rtol=1e-5):
        return "Right: margins left out, every clip over its own spread, and one mean of it all."
    batch_spread = (std**2).mean()
    pieces = (error * w).sum(dim=(1, 2)) / w.sum(dim=(1, 2))
    hints = {
        error.mean(): "The margins count, too. Multiply by weight (it wants a third axis: "
        "weight[..., None]).",
        (error * w).mean(): "Margins are 0 now, but you still divide by all frames. Divide by how "
        "many samples count.",
        right * 4: "You divide by the frames that count, but each has several channels.",
        (error * w).sum(): "That is the sum. Divide by the number of samples that count.",
        (error * (1 - w)).sum() / (1 - w).sum(): "You took the margins alone: weight is 1 where a "
        "frame counts.",
        (square * w).sum() / n: "All channels count the same here: an ankle's small tremble like "
        "a thigh's. Multiply the squared error by std squared.",
        (square * std / std.mean(dim=-1, keepdim=True) * w).sum() / n: "The error is "
        "squared, so std must be squared, too.",
        (square * std**2 * w).sum() / n: "That is in degrees squared: clips with wide movements "
        "decide everything. Divide each piece by the mean of its std squared.",
        (square * std**2 / batch_spread * w).sum() / n: "You divided all pieces by one spread. "
        "Each piece has its own: take the mean over the channels alone, with keepdim.",
        ((cleaned - clean).abs() * std / spread.sqrt() * w).sum() / n: "That is the mean absolute "
        "error. Square it.",
        right**0.5: "That is the root. The loss is the mean square itself.",
        pieces.mean(): "That is the mean of each piece's mean. A piece with margins has fewer "
        "samples: divide the sum of all by the number of all.",
        -right: "The sign is wrong: a loss is above 0.",
    }
    values = {float(value): hint for value, hint in hints.items()}
    return known(got, values, rel_tol=1e-5) or (
        f"{got:.5g} is not it. Square the error, times std squared, over the piece's mean of std "
        f"squared; then the mean over the samples whose weight is 1."
    )


def mystery_curves() -> dict[str, tuple[FloatArray, FloatArray]]:
    """Return four made-up trainings: letter -> losses and validation losses of 40 epochs."""
    epoch = np.arange(40)
    rng = np.random.default_rng(3)
    jumps = 0.035 + 0.012 * np.abs(rng.normal(size=(2, 40)))
    curves = {
        "A": (0.008 + 0.02 * np.exp(-epoch / 9), 0.017 + 0.011 * np.exp(-epoch / 5)),
        "B": (jumps[0], jumps[0] + 0.3 * (jumps[1] - 0.035)),
        "C": (0.015 + 0.012 * np.exp(-epoch / 8), 0.016 + 0.012 * np.exp(-epoch / 8)),
        "D": (0.031 - 0.00012 * epoch, 0.0315 - 0.00012 * epoch),
    }
    curves["A"] = (curves["A"][0], curves["A"][1] + 0.00025 * np.maximum(epoch - 8, 0))
    tremble = 0.0004 * rng.normal(size=(4, 2, 40))
    return {
        letter: (losses + noise[0], validation + noise[1])
        for (letter, (losses, validation)), noise in zip(curves.items(), tremble, strict=True)
    }


def check_curves(answer: Any) -> str:
    """Check what a student reads in :func:`mystery_curves`: letter -> one of ``READINGS``."""
    if answer is None:
        return NOT_YET
    words = _words(answer, tuple(_CURVES))
    if words is None:
        return 'Give a word for each letter: {"A": "fine", "B": "overfit", ...}.'
    for letter, word in words.items():
        if word not in READINGS:
            return f"{letter}: there is no reading {word!r}. The words are {', '.join(READINGS)}."
    hints = {
        "A": "look at the dashed line from epoch 10 on, and at the solid one.",
        "B": "does any of the two lines become lower at all? What do they do from epoch to epoch?",
        "C": "are the lines still falling at the end? How far are they from each other?",
        "D": "compare the first and the last epoch. Would you stop here?",
    }
    wrong = [letter for letter, reading in _CURVES.items() if words[letter] != reading]
    if not wrong:
        return "Right: all four. C is what you want; A wanted an earlier stop, D more of all."
    pair = {(words[letter], _CURVES[letter]) for letter in wrong}
    if pair == {("overfit", "underfit"), ("underfit", "overfit")}:
        return (
            "You swapped the two: a network that overfits is good on what it was trained on, and "
            "only there. One that underfits is good on nothing yet."
        )
    return f"{4 - len(wrong)} of 4 are right. {wrong[0]}: {hints[wrong[0]]}"


def check_leaks(answer: Any, clips: Sequence[Motion]) -> str:
    """Check a function (train, validation, test) that names test clips seen before.

    Parameters
    ----------
    answer : function, returns names
    clips : at least six different clips
    """
    if answer is None:
        return NOT_YET
    a, b, c, d, e, f = clips[:6]
    copy, namesake = replace(a, name="new_take"), replace(e, name=b.name)
    train, validation, test = [a, b, c], [d], [copy, namesake, d, f]
    result, problem = call(answer, list(train), list(validation), list(test))
    if problem or result is None:
        return problem or NOTHING
    try:
        got = {getattr(item, "name", item) for item in result}
    except TypeError:
        got = {None}
    if isinstance(result, str) or not all(isinstance(name, str) for name in got):
        return "Your function must return the names of test clips: a list or a set of texts."
    right, everything = {copy.name, d.name}, {clip.name for clip in test}
    if got == right:
        return "Right: a copy under another name is found, and a mere namesake is not accused."
    known_wrong: tuple[tuple[set[str], str], ...] = (
        ({b.name, d.name}, "You compared names. One test clip is a training clip that was given "
         "another name, and one has a training clip's name by accident: compare the numbers."),
        ({copy.name}, "A clip that was used to choose when to stop has been seen, too: look at "
         "the validation clips."),
        ({d.name}, "A training clip is in the test under another name: compare the numbers."),
        ({b.name}, "You compared names, and only with the training clips."),
        ({a.name, d.name}, "You gave the names that the clips have in training. Which test clips "
         "must go?"),
        (right | {b.name}, "One of them only has a training clip's name, its numbers are new."),
        (everything - right, "These are the honest ones. Name the others."),
        (everything, "Not all test clips were seen before."),
        (set(), "You found none, but some test clips were seen before."),
    )  # fmt: skip
    for names, hint in known_wrong:
        if got == names:
            return hint
    return f"{len(got & right)} of {len(right)} were found, and {len(got - right)} wrongly accused."


def check_noise_range(answer: Any, errors: Mapping[float, Mapping[str, float]]) -> str:
    """Check a forecast: which of some networks is best at each amount of noise.

    Parameters
    ----------
    answer : amount -> name of a network, or the names in the order of the amounts
    errors : amount of noise -> network -> its error
    """
    if answer is None:
        return NOT_YET
    amounts = tuple(f"{k:g}" for k in errors)
    names = tuple(next(iter(errors.values())))
    words = _words(answer, amounts)
    if words is None or not set(words.values()) <= set(names):
        example = ", ".join(f"{k}: {names[0]!r}" for k in amounts)
        return (
            f"Give {' or '.join(map(repr, names))} for each amount of noise, as in {{{example}}}."
        )
    wrong = []
    for k, by_network in zip(amounts, errors.values(), strict=True):
        if by_network[words[k]] > 1.01 * min(by_network.values()):
            wrong.append(k)
    if not wrong:
        return "Right: so it came out. The numbers are in the next cell."
    if len(set(words.values())) == 1:
        return (
            f"{words[amounts[0]]!r} is not the best one everywhere. Which amounts has each network "
            f"met in its training?"
        )
    return (
        f"Not at {', '.join(wrong)}. A network that was trained for one amount takes every file "
        f"for one of that kind: what does it do with less noise, and what with more?"
    )


def _words(answer: Any, keys: tuple[str, ...]) -> dict[str, str] | None:
    """Read a text for each key, from a dictionary or in order; None if that is not what it is."""
    if isinstance(answer, Mapping):
        pairs = {str(key): value for key, value in answer.items()}
    elif isinstance(answer, list | tuple) and len(answer) == len(keys):
        pairs = dict(zip(keys, answer, strict=True))
    else:
        return None
    if set(pairs) != set(keys) or not all(isinstance(v, str) for v in pairs.values()):
        return None
    return {key: pairs[key].strip().lower() for key in keys}
