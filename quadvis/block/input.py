"""Input devices: messages out of the bytes that have come."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from enum import Enum
from typing import Any

import numpy as np

from quadvis.block.declare import Out
from quadvis.block.device import CABLE, LineDevice
from quadvis.block.sizes import parameter_sizes
from quadvis.machine.ports import OpenPort, PortError, Waiting

KEPT = 4096  # bytes at most that wait for the rest of their message


class Counted(Enum):
    """What `Input.decode` yields for a message that no step sees."""

    LOST = "lost"
    REFUSED = "refused"


class Input(LineDevice):
    """A device that gives values: ``decode`` takes messages out of the bytes that have come.

    A step takes all bytes that have come and never waits; the outputs are those of the newest message. Before
    the first one they are 0, or NaN where an output may be missing. If the port is lost, the age
    grows, and the run ends with an error.
    """

    not_replayable = "it reads a port"
    not_restorable = "it reads a port"

    age = Out(unit="s", nan=True, doc="time since the newest message came; NaN before the first one")
    lost = Out("int64", doc="messages that no step saw: newer ones came with them, or the device missed them")
    refused = Out("int64", doc="messages that were damaged")

    actual_port = ""  # what a real-time run puts in the place of `pty:NAME`
    lent: Callable[[], OpenPort] | None = None  # gives a port that is open, in a real-time run that shares it

    def decode(self, received: bytearray) -> Iterator[Any]:
        """Take all whole messages off the beginning of ``received``, and leave the rest there.

        Yield for each message its values, one for each output of the block, or ``Counted.LOST`` or
        ``Counted.REFUSED`` for one that is only counted.
        """
        raise NotImplementedError

    def open(self) -> None:
        """Open the port."""
        self._received, self._gone, self._stamp = bytearray(), "", math.nan
        self._age, self._counts = math.nan, {Counted.LOST: 0, Counted.REFUSED: 0}
        self._newest = self._nothing()
        path = self.actual_port or self.port_given
        if path.startswith(CABLE):
            raise PortError(f"{path} is a cable, and only a real-time run makes cables")
        self._port = self.settings.open(path) if self.lent is None else self.lent()

    def read(self, time: float) -> None:
        """Take all messages that have come."""
        try:
            found = Waiting() if self._gone else self._port.read_waiting()
        except PortError as error:
            self._gone, found = f"{self.port_given}: {error}, at t = {time:.9g} s", Waiting()
        fresh = 0
        self._counts[Counted.LOST] += found.skipped
        for piece in found.pieces:
            self._received += piece
            for message in self.decode(self._received):
                if isinstance(message, Counted):
                    self._counts[message] += 1
                elif found.late:
                    self._counts[Counted.LOST] += 1
                else:
                    self._newest = message
                    fresh += 1
            del self._received[: len(self._received) if self._port.whole else -KEPT]
        if fresh:
            self._counts[Counted.LOST] += fresh - 1
            self._stamp = time - found.age
        self._age = time - self._stamp

    def output(self) -> Any:
        """Return age, counts and the values of the newest message."""
        return self._age, self._counts[Counted.LOST], self._counts[Counted.REFUSED], *self._newest

    def close(self) -> None:
        """Close the port; PortError if it was lost during the run."""
        if "_port" in self.__dict__:
            self.__dict__.pop("_port").close()
            if self._gone:
                raise PortError(self._gone)

    def _nothing(self) -> tuple[Any, ...]:
        """Return the values before the first message."""
        sizes = parameter_sizes(self)
        outputs = [
            port for name, port in self.interface.outputs.items() if name not in Input.interface.outputs
        ]
        return tuple(
            np.full(port.signal.resolve(sizes), math.nan if port.nan else 0, port.signal.scalar)[()]
            for port in outputs
        )
