"""What the second stage, ``pytest -m slow``, tries beyond the first, and ``pytest -m long`` beyond both."""

from collections.abc import Iterable
from typing import Any

import pytest


def mostly_slow(cases: Iterable[Any], quick: int = 1, slow: int | None = None) -> list[Any]:
    """Have the first cases tried in the first stage, all others in the second.

    With ``slow``, so many are tried in the second, and what is left only by a person.
    """
    entries = [case if isinstance(case, tuple) else (case,) for case in cases]
    last = len(entries) if slow is None else quick + slow
    return [
        pytest.param(
            *entry, marks=() if number < quick else pytest.mark.slow if number < last else pytest.mark.long
        )
        for number, entry in enumerate(entries)
    ]
