"""What the blocks that send a message of a protocol have in common: ports, ranges, the frame."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from quadvis.block import Declared, In, Initial, Out, ParameterError, Safe
from quadvis.errors import DiagramError, Fault
from quadvis_blocks.hardware._message_device import BlockMessage, check_names
from quadvis_blocks.hardware._protocol.description import NamedValue


class SentMessage(BlockMessage):
    """A base class beside `Output`, for a block with the ports of `sent_ports`."""

    def check(self) -> None:
        """Refuse values without a range, and initial and safe values beyond it."""
        message = self.described.message
        limits = {value.name: message.limits(value) for value in message.values}
        bare = [value for value in message.values if not all(map(math.isfinite, limits[value.name]))]
        if bare and not bare[0].place.file:
            problem = f"'{bare[0].name}' is sent, so it needs a range; write such as -1..1"
            raise ParameterError("ranges", problem)
        if bare:
            problem, remedy = "'{}' is sent, so it needs a range", "add such as 'range: [-1, 1]'"
            raise DiagramError([Fault(each.place, "", problem.format(each.name), remedy) for each in bare])
        block: Any = self
        for fixed in (*block.initial_values.values(), *block.interface.safe.values()):
            given, (low, high) = np.asarray(getattr(self, fixed.name)), limits[fixed.input]
            if ((given < low) | (given > high)).any():
                problem = f"{fixed.name} must lie between {low:g} and {high:g}, as {fixed.input} does"
                raise ParameterError(fixed.name, problem)

    def output(self, *inputs: Any) -> Any:
        """Return what is sent."""
        sent = self.on_wire(inputs)
        return sent if len(sent) > 1 else sent[0]


def sent_ports(kind: Any, values: Sequence[NamedValue]) -> dict[str, Declared]:
    """Return an input for each value of a message, with its two values, and what is sent of it.

    ``kind`` is the class of the block.
    """
    made = ("initial_{}", "safe_{}", "sent_{}") if len(values) > 1 else ()
    check_names(values, kind, made)
    found: dict[str, Declared] = {}
    for value in values:
        name, unit = value.name, str(value.unit)
        words = value.doc or f"'{name}' of the message"
        behind = f"_{name}" if len(values) > 1 else ""
        found[name] = In(value.type, unit=unit, doc=words)
        found[f"initial{behind}"] = Initial(name, doc=f"{name} before the first command")
        found[f"safe{behind}"] = Safe(name, doc=f"{name} at every end of a run")
        found[f"sent{behind}"] = Out(value.type, unit=unit, doc=f"{name} as it is on the wire")
    return found
