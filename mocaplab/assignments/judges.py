"""Judging numbers and functions: any correct answer is right, typical mistakes get their hint.

An exercise is written down as what is right and as what typical mistakes lead to, each with
its hint. An answer is compared by value, so that it does not matter how it was written.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mocaplab.assignments.grading import quiet_call
from mocaplab.exercises.answers import NOT_YET, NOTHING, as_array, short
from mocaplab.motion import FloatArray

Function = Callable[..., Any]


def judge_numbers(
    answer: Any,
    right: ArrayLike,
    mistakes: Mapping[str, ArrayLike],
    *,
    rtol: float = 0.005,
    atol: float = 0.0,
    otherwise: str = "That is not it yet.",
) -> str:
    """Judge one number, or several in their order.

    Parameters
    ----------
    answer : whatever the student gives; None is "not answered yet"
    right : number or array of numbers
    mistakes : hint -> the numbers that this mistake leads to
    rtol, atol : float, how near is near enough
    otherwise : str, what to say if nothing fits

    Returns
    -------
    str, beginning with "Right:" only if the answer is right
    """
    if answer is None or answer is ...:
        return NOT_YET
    wanted = np.asarray(right, dtype=np.float64).ravel()
    array = as_array(answer)
    if array is None or array.size != wanted.size:
        count = "one number" if wanted.size == 1 else f"{wanted.size} numbers"
        return f"The answer is {count}, not {short(answer)}."
    got = array.ravel()
    if not np.isfinite(got).all():
        return "Your answer is not a finite number. Is there a division by 0, or a gap (NaN)?"
    if np.allclose(got, wanted, rtol=rtol, atol=atol):
        return f"Right: {', '.join(f'{number:.4g}' for number in got)}."
    for hint, values in mistakes.items():
        if np.allclose(got, np.asarray(values).ravel(), rtol=rtol, atol=atol):
            return hint
    return otherwise


def judge_function(
    answer: Any,
    cases: Mapping[str, tuple[Any, ...]],
    right: Function | tuple[Function, ...],
    mistakes: Mapping[str, Function],
    *,
    rtol: float = 1e-5,
    atol: float = 1e-7,
    otherwise: str = "That is not it yet.",
    nan_hint: str = "",
) -> str:
    """Judge a function by what it returns for several cases.

    Parameters
    ----------
    answer : whatever the student gives; a function that returns None is "not answered yet"
    cases : what the case is, in words -> the arguments
    right : function of the same arguments, or several, where more than one way is right
    mistakes : hint -> function that makes this mistake
    rtol, atol : float, how near is near enough
    otherwise : str, what to say if nothing fits
    nan_hint : str, what to say in addition if a result has NaN in it

    Returns
    -------
    str, beginning with "Right:" only if the answer is right in all cases
    """
    if answer is None or answer is ...:
        return NOT_YET
    ways = right if isinstance(right, tuple) else (right,)
    done: list[str] = []
    for label, arguments in cases.items():
        result, problem = quiet_call(answer, *arguments)
        if problem:
            return f"{problem} (for {label})"
        if result is None or result is ...:
            return NOTHING if done else f"{NOT_YET} So far, your function returns nothing."
        wanted = [_array(quiet_call(way, *arguments)[0]) for way in ways]
        got = _array(result)
        if any(_same(got, values, rtol, atol) for values in wanted):
            done.append(label)
            continue
        for hint, mistake in mistakes.items():
            values = _array(quiet_call(mistake, *arguments)[0])
            if _same(got, values, rtol, atol):
                return hint
        before = f"Right for {' and '.join(done)}, but not for {label}. " if done else ""
        return before + (_odd(result, got, wanted[0], nan_hint) or otherwise)
    return f"Right: {'; '.join(done)}."


def _array(value: Any) -> FloatArray | None:
    if hasattr(value, "detach"):  # a tensor of torch, perhaps one that knows its gradient
        value = value.detach().numpy()
    return as_array(value)


def _same(got: FloatArray | None, wanted: FloatArray | None, rtol: float, atol: float) -> bool:
    """Tell whether two results agree; (1,) or (n, 1) may stand for a number or (n,)."""
    if got is None or wanted is None or got.squeeze().shape != wanted.squeeze().shape:
        return False
    return bool(np.allclose(got.squeeze(), wanted.squeeze(), rtol=rtol, atol=atol))


def _odd(result: Any, got: FloatArray | None, wanted: FloatArray | None, nan_hint: str) -> str:
    """Say what is odd about a result at first sight, or nothing."""
    if got is None:
        return f"Your function should return numbers, not {short(result)}."
    if wanted is not None and got.squeeze().shape != wanted.squeeze().shape:
        return f"Your function returns the shape {got.shape}; it should be {wanted.shape}."
    if not np.isfinite(got).all():
        return (
            f"There are NaN or infinite numbers in what your function returns. {nan_hint}".strip()
        )
    return ""
