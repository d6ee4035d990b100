"""What the compiled loop takes from a room above it: a clock, and the machine code of an observer."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

GO = 0  # a clock that does not pause the loop


class MachineClock(Protocol):
    """A clock in machine code: the compiled loop calls it before each tick, see `quadvis.engine.clock`.

    The code is ``int32 f(int64 *places)``. Its first place is that of the loop's ``control``: the clock reads
    TICK, the next tick, and UNTIL, and writes TICK, the tick to run, or UNTIL; and PAUSE, which is `GO` or
    another number. Then the loop returns to Python, which answers; after that the clock is called again.
    """

    @property
    def address(self) -> int:
        """The address of its code."""

    @property
    def places(self) -> Sequence[int]:
        """The addresses that it takes behind the first."""

    def answer(self, pause: int) -> None:
        """Do what a clock that pauses asks of Python; an exception ends the run."""
