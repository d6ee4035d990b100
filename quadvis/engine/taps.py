"""Taps: who takes rows of signals while a run goes on. The log and a scope are both taps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol


class Tap(Protocol):
    """Takes a block's outputs at the block's first and then at every ``every`` ticks of the block's own.

    A row is taken when the outputs of the tick are there and before the updates. A restored run is tapped at
    the same ticks as the first one.
    """

    @property
    def block(self) -> str:
        """The path of the block."""

    @property
    def every(self) -> int:
        """The number of the block's ticks from one row to the next."""

    def take(self, tick: int, row: memoryview) -> None:
        """Take the bytes of the outputs, side by side as in memory; a tap that keeps them makes a copy."""


@dataclass(frozen=True)
class Observer:
    """Something to do at the ticks of a task, with the memory as it is between outputs and updates."""

    task: str
    every: int
    call: Callable[[int], None]  # takes the tick
