"""The jump of a control when it changes hands."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import Block, In, Out, State, Work


class TransferJump(Block):
    """The change of each control at the tick at which its source changes, and 0 at all other ticks.

    The block measures whether a mode switch is bumpless. It knows nothing of the method of the switch.
    """

    controls = In(
        "float64[4]",
        unit="N rad/s^2 rad/s^2 rad/s^2",
        doc="collective; roll, pitch and yaw torque over inertia",
    )
    source = In("int64[4]", doc="source of each control")
    jump = Out(
        "float64[4]", unit="N rad/s^2 rad/s^2 rad/s^2", doc="change of each control as it changes hands"
    )
    changes = Out("int64", doc="how often a control has changed hands so far")
    last = State("float64[4]")
    owner = State("int64[4]")
    begun = State("bool")
    counted = State("int64")
    counted_now = Work("int64")

    example = """
        owner:
          block: sources.table
          rate: fast
          with: {times: {value: [0, 0.3], unit: s}, values: [[0, 0, 0, 0], [1, 1, 1, 1]], interpolation: hold}
        source: {block: math.convert, rate: fast, with: {takes: float64, gives: int64}, in: {u: owner.y}}
        jump:
          block: supervision.transfer_jump
          rate: fast
          in: {controls: {value: [4.9, 0.1, 0, 0], unit: N rad/s^2 rad/s^2 rad/s^2}, source: source.y}
    """

    def output(self, controls: Any, source: Any) -> tuple[Any, int]:
        """Return the jumps, and the number of changes of hands so far."""
        changed = (source != self.owner) & self.begun
        self.counted_now = self.counted + int(changed.sum())
        return np.where(changed, controls - self.last, 0.0), self.counted_now

    def update(self, controls: Any, source: Any) -> None:
        """Keep controls and sources."""
        self.counted = self.counted_now
        self.last = controls
        self.owner = source
        self.begun = True
