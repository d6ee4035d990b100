"""One of several signals, by its number."""

from __future__ import annotations

from typing import Any

from quadvis.block import Block, In, Out, OutOfRange, Param, copied

NEAREST, REFUSE = range(2)


class MultiportSwitch(Block):
    """One of several signals, by its number in the list: ``y = u[index]``, counted from 0.

    An index below the list gives the first signal and one beyond it the last, or ends the run.
    """

    outside = Param(
        "nearest", choices=("nearest", "refuse"), doc="what an index that is no place of the list does"
    )
    index = In("int64", doc="the place of the signal, from 0")
    u = In("float64[*]", unit="a", many=True, doc="the signals")
    y = Out("float64[*]", unit="a", doc="the chosen signal")

    symbol = "switch"
    example = """
        slow: {block: sources.sine, rate: fast, with: {frequency: 1 Hz}}
        quick: {block: sources.sine, rate: fast, with: {frequency: 5 Hz}}
        chosen: {block: logic.multiport_switch, rate: fast, in: {index: 1, u: [slow.y, quick.y]}}
    """

    def output(self, index: int, *u: Any) -> Any:
        """Return the chosen signal."""
        last = len(u) - 1
        if self.outside == REFUSE and not 0 <= index <= last:
            raise OutOfRange("the index is no place of the list, which counts from 0")
        return copied(u[min(max(index, 0), last)])
