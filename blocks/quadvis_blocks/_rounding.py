"""Rules of rounding to whole numbers, the same for every block, interpreted and compiled."""

from __future__ import annotations

import math

NEAREST, EVEN, FLOOR, CEIL, FIX = RULES = range(5)
NAMES = ("nearest", "even", "floor", "ceil", "fix")
WORDS = "nearest takes halves away from zero, even to the even number; fix rounds towards zero"
EXACT = 2.0**52  # from here on every number is whole


def rounded(x: float, rule: int) -> float:
    """Return a number rounded by a rule, with its sign; NaN and infinity stay what they are."""
    if not abs(x) < EXACT:
        return x
    if rule == FLOOR:
        found = math.floor(x)
    elif rule == CEIL:
        found = math.ceil(x)
    else:
        found = math.floor(abs(x))
        rest = abs(x) - found  # exact
        if rule == NEAREST:
            found += 1 if rest >= 0.5 else 0
        elif rule == EVEN:
            found += 1 if rest > 0.5 or (rest == 0.5 and found % 2 == 1) else 0
    return math.copysign(float(found), x)
