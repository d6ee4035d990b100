"""A command that does not outlive its sender."""

from __future__ import annotations

import math
from typing import Any

from quadvis.block import Block, In, Out, Param, State, Work, all_finite, copied, passed, zeros_like
from quadvis_blocks._stamps import NEWS, RESTART, SIZE, begin, judge, keep


class OutputHold(Block):
    """The last good command for a short time, then a safe command: the gate before an actuator.

    A command is good if ``valid`` is true, if all its elements are finite, and if its ``stamp`` is later than
    all before and not ahead of the time. Without stamps every tick brings a new command. A good command is
    held until it is older than ``max_age``. Then every element of the output is ``safe`` until the next good
    command, as it is before the first.
    """

    max_age = Param(0.25, unit="s", min=0.0, tune=True, doc="how long (inclusive) a command is held")
    safe = Param(0.0, unit="a", tune=True, doc="every element of the safe command: idle, or neutral")
    restart = Param(
        RESTART,
        unit="s",
        above=0.0,
        tune=True,
        doc="how long a restarted clock must run before its stamps count",
    )
    u = In("float64[*]", unit="a", doc="the command")
    valid = In("bool", default=True, doc="whether the command is good")
    stamp = In(unit="s", default=math.nan, doc="instant at which the command was made; NaN means now")
    y = Out("float64[*]", unit="a", doc="the held command, or the safe command")
    stale = Out("bool", doc="whether y is the safe command")
    last = State("float64[*]")
    made = State(unit="s")
    stamps = State(f"float64[{SIZE}]")
    verdict = Work("int64")  # on the stamp of this tick
    moment = Work(unit="s")  # the instant of that stamp
    good = Work("bool")  # whether the command of this tick counts

    example = """
        command: {block: sources.sine, rate: fast, with: {amplitude: 1 N, frequency: 1 Hz}}
        gap: {block: signal.outage, rate: fast, with: {during: [[0.2 s, 0.9 s]]}, in: {u: command.y}}
        gate:
          block: supervision.output_hold
          rate: fast
          with: {max_age: 0.3 s}
          in: {u: gap.y, valid: gap.ok}
    """

    def start(self) -> None:
        """Begin without a command."""
        begin(self.stamps)
        self.made = -math.inf

    def output(self, u: Any, valid: bool, stamp: float, time: float) -> tuple[Any, bool]:
        """Return the held or the safe command, and whether it is the safe one."""
        self.verdict, self.moment = judge(self.stamps, stamp, time, self.restart)
        self.good = self.verdict == NEWS and valid and all_finite(u) and self.moment > self.made
        if passed(time - (self.moment if self.good else self.made), self.max_age):
            return zeros_like(self.last) + self.safe, True
        if self.good:
            return copied(u), False
        return copied(self.last), False

    def update(self, u: Any, stamp: float, time: float) -> None:
        """Keep a good command."""
        keep(self.stamps, stamp, time, self.restart, self.verdict, self.moment)
        if self.good:
            self.last = u
            self.made = self.moment
