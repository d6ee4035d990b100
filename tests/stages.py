"""What the second stage, ``pytest -m slow``, tries beyond the first."""

from collections.abc import Iterable
from typing import Any

import pytest


def mostly_slow(cases: Iterable[Any], quick: int = 1) -> list[Any]:
    """Have the first cases tried in the first stage, all others in the second."""
    entries = [case if isinstance(case, tuple) else (case,) for case in cases]
    return [
        pytest.param(*entry, marks=pytest.mark.slow if number >= quick else ())
        for number, entry in enumerate(entries)
    ]
