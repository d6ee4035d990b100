"""Position and heading where the craft should be."""

from __future__ import annotations

from typing import Any

from quadvis.block import Block, Out, Param


class Setpoint(Block):
    """Position and heading to hold, from one parameter that can be tuned during a run."""

    target = Param(
        (0.0, 0.0, 1.5, 0.0),
        type="float64[4]",
        unit="m m m rad",
        tune=True,
        shown=True,
        doc="x forward, y right, h up, heading",
    )
    position = Out("float64[3]", unit="m", doc="x, y, h to hold")
    heading = Out(unit="rad", doc="yaw angle to hold")

    example = """
        goal:
          block: control.setpoint
          rate: fast
          with: {target: {value: [0.5, 0, 1.5, 0.1], unit: m m m rad}}
    """

    def output(self) -> tuple[Any, float]:
        """Return the position and the heading."""
        return self.target[:3], self.target[3]
