"""What is unknown because its fault has been reported: one value stands for all of it.

A check leaves out what is `UNKNOWN`, since a fault about it would only follow from the reported one. What a
check finds wrong it reports, and hands on `UNKNOWN` in its place.
"""

from __future__ import annotations

from enum import Enum
from typing import TypeGuard, TypeVar

_Value = TypeVar("_Value")


class Unknown(Enum):
    """The type of `UNKNOWN`, which is its only value."""

    UNKNOWN = "unknown"


UNKNOWN = Unknown.UNKNOWN


def known(value: _Value | Unknown) -> TypeGuard[_Value]:
    """Say whether a value is known."""
    return value is not UNKNOWN
