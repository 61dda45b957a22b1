"""All wrong answers that are planted, by assignment."""

from __future__ import annotations

from data_tools.planted import WrongAnswer
from data_tools.wrong_answers_motion import WRONG_ANSWERS_MOTION
from data_tools.wrong_answers_networks import WRONG_ANSWERS_NETWORKS

__all__ = ["WRONG_ANSWERS", "WrongAnswer"]

WRONG_ANSWERS = WRONG_ANSWERS_MOTION | WRONG_ANSWERS_NETWORKS
