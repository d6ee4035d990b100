"""What stands in for a device and its messages in a simulation."""

from __future__ import annotations

from typing import Any

from quadvis.block import Block, Declared, In, Out
from quadvis_blocks.hardware._message_device import DescribedMessage, check_names, chosen
from quadvis_blocks.hardware._protocol.formats import WrittenMessage


class MessageTwin(DescribedMessage, Block, numeric=False):
    """Stands in for a device that ``hardware.message_in`` reads: values become a message, and values again.

    It has the outputs of ``hardware.message_in`` with the same message, as that device would give them at
    once: rounded as its numbers are, and within its ranges. So a simulation has the steps and the limits of
    the real protocol. It runs everywhere. Each value ``roll`` has an input ``true_roll``.
    """

    age = Out(unit="s", nan=True, doc="0: the message has just come")
    lost = Out("int64", doc="0")
    refused = Out("int64", doc="0")
    others = Out("int64", doc="0")
    starting = Out("bool", doc="false")

    example = r"""
        roll: {block: sources.sine, rate: fast, with: {amplitude: 10 deg, frequency: 1 Hz}}
        imu:
          block: hardware.message_twin
          rate: fast
          with: {format: "%.2f,%.2f", names: roll pitch, units: rad rad, terminator: \r\n, checksum: none}
          in: {true_roll: roll.y, true_pitch: 0 rad}
    """

    @classmethod
    def ports(
        cls,
        protocol: str,
        message: str,
        format: str,
        names: str,
        units: str,
        ranges: str,
        header: str,
        terminator: str,
        checksum: str,
    ) -> dict[str, Declared]:
        """Return an input and an output for each value of the message."""
        written = WrittenMessage(format, names, units, ranges, header, terminator, checksum)
        values = chosen(protocol, message, written).message.values
        check_names(values, cls, ("true_{}",))
        found: dict[str, Declared] = {}
        for value in values:
            words = value.doc or f"'{value.name}' of the message"
            unit = str(value.unit)
            found[f"true_{value.name}"] = In(value.type, unit=unit, doc=words)
            found[value.name] = Out(value.type, unit=unit, nan=value.optional, doc=f"{words}, as it comes")
        return found

    def output(self, *inputs: Any) -> Any:
        """Return the values as they come out of their message."""
        return 0.0, 0, 0, 0, False, *self.on_wire(inputs)
