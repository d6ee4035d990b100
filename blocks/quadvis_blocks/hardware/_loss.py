"""What each element of a pilot's commands becomes when the link to him is lost.

What an element does follows from its role, unless the diagram says otherwise: a throttle goes to its minimum,
an arm switch is off, a stick is in the centre, any other switch is at its low end. On some flight controllers
all channels went to the centre until their failsafe began, and a craft jumped off the ground (cleanflight
#939); with the throttle held where it was, one flew away (betaflight #7365).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from quadvis.block import ParameterError
from quadvis.errors import quoted, sentence, suggestion

THROTTLE, ARM, STICK, SWITCH = "throttle", "arm", "stick", "switch"
LOW, CENTRE, HIGH, HOLD = "low", "centre", "high", "hold"
BY_ROLE = {THROTTLE: LOW, ARM: LOW, STICK: CENTRE, SWITCH: LOW}
WORDS = (LOW, CENTRE, HIGH, HOLD)
ROLES_DOC = "what each element is, in one word each: throttle, arm, stick or switch"
ON_LOSS_DOC = (
    "what each element becomes on a loss, in one word each: low, centre, high, hold or a number; '' goes by "
    "the roles: throttle and arm low, sticks centre, switches low"
)


class LossValues(NamedTuple):
    """The commands after a loss: ``values``, but for the elements ``held``, which keep their last ones."""

    values: Any
    held: Any

    def after(self, last: Any) -> Any:
        """Return the commands after a loss; ``last`` is the last good command, or None."""
        return self.values if last is None else np.where(self.held, last, self.values)


def loss_values(roles: str, on_loss: str, lowest: Any, highest: Any) -> LossValues:
    """Return what commands between ``lowest`` and ``highest`` become; ParameterError for a wrong word.

    The low end of an element is its smaller command, whichever way its channel goes.
    """
    given = _words("roles", roles, len(lowest), tuple(BY_ROLE))
    usual = [BY_ROLE[role] for role in given]
    words = _words("on_loss", on_loss, len(lowest), WORDS) if on_loss.strip() else usual
    low, high = np.minimum(lowest, highest), np.maximum(lowest, highest)
    values = np.empty(len(words))
    for place, word in enumerate(words):
        known = {LOW: low[place], CENTRE: (low[place] + high[place]) / 2, HIGH: high[place]}
        named = usual[place] if word == HOLD else word
        value = known[named] if named in known else float(named)
        if not low[place] <= value <= high[place]:
            problem = f"on_loss must lie between lowest and highest, element by element, got {value:g}"
            raise ParameterError("on_loss", problem)
        values[place] = value
    return LossValues(values, np.array([word == HOLD for word in words]))


def loss_doubts(roles: str, on_loss: str, lowest: Any, highest: Any) -> list[ParameterError]:
    """Return a warning if a throttle does not go to its minimum on a loss."""
    loss, low = loss_values(roles, on_loss, lowest, highest), np.minimum(lowest, highest)
    risen = (loss.values > low) | loss.held
    throttles = [role == THROTTLE for role in roles.split()]
    if not (risen & throttles).any():
        return []
    problem = "on_loss leaves a throttle above its minimum: a craft whose pilot is lost may rise, or fly away"
    return [ParameterError("on_loss", sentence(problem, "write 'low' for each throttle"))]


def _words(name: str, text: str, count: int, known: Sequence[str]) -> list[str]:
    words = text.split()
    if len(words) != count:
        raise ParameterError(name, f"{name} must have {count} words, one for each element, got {len(words)}")
    for word in words:
        if word not in known and not (HOLD in known and _is_number(word)):
            problem = f"{name} must be words such as {', '.join(known)}, got {quoted(word)}"
            raise ParameterError(name, sentence(problem, suggestion(word, known)))
    return words


def _is_number(word: str) -> bool:
    try:
        return math.isfinite(float(word))
    except ValueError:
        return False
