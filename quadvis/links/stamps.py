"""Blocks that carry a stamp along a path of wires, so that the age of what arrives there can be measured.

One stands beside each block of the path, in its task and on its computer, and hands the stamp on when the
block does: at once if the block's output depends on its input of the same tick, else at its next tick. A
stamp that is NaN, or infinite, says that there is nothing new: the last one holds, at first the start of the
run.
"""

from __future__ import annotations

import math
from typing import Any

from quadvis.block import Block, In, Out, State

STAMP, HELD, AGE = "stamp", "held_stamp", "age"  # the ports of these blocks
METER, HOLDER = "age", "holder of a stamp"  # the origins of their nodes


class StampHolder(Block):
    """Hands a stamp on at once, beside a block with direct feedthrough."""

    stamp = In(unit="s", doc="when what arrives was measured")
    held_stamp = Out(unit="s", doc="the same, or the last one before")
    last = State(unit="s")

    def output(self, stamp: float) -> Any:
        """Return the stamp, or the last one if it is missing."""
        return stamp if math.isfinite(stamp) else self.last

    def update(self, stamp: float) -> None:
        """Keep it."""
        self.last = stamp if math.isfinite(stamp) else self.last


class StampKeeper(Block):
    """Hands a stamp on at the next tick, beside a block that keeps its input in a state."""

    stamp = In(unit="s", doc="when what arrives was measured")
    held_stamp = Out(unit="s", doc="that of one tick ago")
    last = State(unit="s")

    def output(self) -> Any:
        """Return the stamp of one tick ago."""
        return self.last

    def update(self, stamp: float) -> None:
        """Keep the stamp."""
        self.last = stamp if math.isfinite(stamp) else self.last


class AgeMeter(Block):
    """The age of what a block acts on, at each of its ticks."""

    stepwise = True
    stamp = In(unit="s", doc="when what arrives was measured")
    age = Out(unit="s", doc="time since then")
    last = State(unit="s")

    def output(self, stamp: float, time: float) -> Any:
        """Return the age."""
        return time - (stamp if math.isfinite(stamp) else self.last)

    def update(self, stamp: float) -> None:
        """Keep the stamp."""
        self.last = stamp if math.isfinite(stamp) else self.last


class PresentStamp(Block):
    """A stamp that is now, for the question how old it can become on its way."""

    stepwise = True
    now = Out(unit="s", doc="the time of the tick")

    def output(self, time: float) -> Any:
        """Return the time."""
        return time
