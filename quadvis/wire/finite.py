"""Plain data as JSON can have it, which has neither infinity nor NaN."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any


def finite(value: Any, text: Callable[[float], str]) -> Any:
    """Return plain data with a ``text`` in the place of each number that is not finite.

    Arrays and numbers of numpy become lists and numbers, and the keys of maps are texts.
    """
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, Mapping):
        return {str(key): finite(each, text) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [finite(each, text) for each in value]
    return text(value) if isinstance(value, float) and not math.isfinite(value) else value
