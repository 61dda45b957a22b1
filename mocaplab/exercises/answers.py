"""Reading what students answer: a number, an array or a function, however it is wrapped.

Nothing here raises: what cannot be read comes back as None or as a sentence.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from mocaplab.motion import FloatArray

NOT_YET = "Not answered yet: put your answer in the cell above and run both cells."
NOTHING = "Your function returns nothing. Does it end with return?"
OTHER_DRAW = "Two calls with the same seed differ. Draw every number from the rng you are given."


def as_number(answer: Any) -> float | None:
    """Read one finite number, however it is wrapped; None if it is none."""
    array = as_array(answer)
    if array is None or array.size != 1 or not np.isfinite(array).all():
        return None
    return float(array.ravel()[0])


def as_array(answer: Any) -> FloatArray | None:
    """Read numbers in any shape, from lists, generators and tensors too; None if they are none."""
    if answer is None or isinstance(answer, str | bool):
        return None
    try:
        return np.asarray(list(answer) if np.iterable(answer) else answer, dtype=np.float64)
    except (TypeError, ValueError, OverflowError, RuntimeError):  # the last: torch's tensors
        return None


def not_a_number(answer: Any) -> str:
    """Say that a number was expected."""
    return f"The answer is one number, not {short(answer)}."


def short(answer: Any) -> str:
    """Quote an answer in at most 60 characters."""
    try:
        text = repr(answer)
    except Exception:
        text = f"a {type(answer).__name__}"
    return text if len(text) <= 60 else f"{text[:57]}..."


def known(got: float, hints: dict[float, str], *, rel_tol: float) -> str:
    """Return the hint for the first typical wrong value that an answer is near to, or ""."""
    for value, hint in hints.items():
        if math.isclose(got, value, rel_tol=rel_tol):
            return hint
    return ""


def call(answer: Any, *arguments: Any) -> tuple[Any, str]:
    """Call a student's function: its result, and a sentence if it fails."""
    if not callable(answer):
        return None, "Give the function itself: its name, without brackets behind it."
    try:
        return answer(*arguments), ""
    except Exception as error:  # whatever a student's code raises is part of the answer
        return None, f"Your function stopped with {type(error).__name__}: {error}"
