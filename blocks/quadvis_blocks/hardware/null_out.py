"""What stands in for an output device on the desk."""

from __future__ import annotations

from typing import Any

from quadvis.block import Block, In, Out, copied


class NullOut(Block):
    """Stands in for an output device: gives back what it was given, so that the log has it.

    It has the ports of ``hardware.sbus_out`` and runs everywhere, in simulations too: put it where a variant
    has the device.
    """

    command = In("float64[n]", unit="a", doc="the commands")
    sent = Out("float64[n]", unit="a", doc="the same")

    example = """
        sticks:
          block: sources.table
          rate: fast
          with: {times: {value: [0, 1], unit: s}, values: [[-1, 0, 0, 0], [0.5, 0.2, 0, 0]]}
        radio: {block: hardware.null_out, rate: fast, in: {command: sticks.y}}
    """

    def output(self, command: Any) -> Any:
        """Return the commands."""
        return copied(command)
