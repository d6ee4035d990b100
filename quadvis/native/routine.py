"""Routines: plain functions of pointers, compiled with what they call; they are no methods of blocks."""

from __future__ import annotations

import types
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from quadvis.native.source import fingerprint

ROUTINE = "routine"


@dataclass(frozen=True)
class Routine:
    """A function to compile. ``pointers`` has a letter for each of its arguments: to whole or real numbers.

    The arguments are indexed as arrays are. All functions that it reaches are compiled with it;
    ``instead`` names those that others stand for in machine code.
    """

    function: Callable[..., Any]
    pointers: str
    instead: Mapping[Callable[..., Any], Callable[..., Any]] = field(default_factory=dict)

    @cached_property
    def text(self) -> str:
        """All that decides over the machine code beside the software and the processor."""
        return repr((fingerprint(plain(self.function), *map(plain, self.instead.values())), self.pointers))


def plain(function: Callable[..., Any]) -> types.FunctionType:
    """Return a function that is a plain one, with this type."""
    assert isinstance(function, types.FunctionType)
    return function
