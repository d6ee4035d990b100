"""The time as a signal."""

from __future__ import annotations

from quadvis.block import Block, Out


class Clock(Block):
    """The time of the run: ``y = t``, 0 at its start."""

    y = Out(unit="s", doc="the time")

    symbol = "clock"
    example = """
        now: {block: sources.clock, rate: fast}
        late: {block: logic.compare, rate: fast, with: {operator: ">="}, in: {a: now.y, b: 0.5 s}}
    """

    def output(self, time: float) -> float:
        """Return the time."""
        return time
