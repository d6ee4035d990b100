"""Input devices: messages out of the bytes that have come."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from enum import Enum
from typing import Any, ClassVar

import numpy as np

from quadvis.block.declare import Out
from quadvis.block.device import CABLE, LineDevice
from quadvis.block.instants import reached
from quadvis.block.sizes import parameter_sizes
from quadvis.machine.ports import OpenPort, PortError, Waiting

KEPT = 4096  # bytes at most that wait for the rest of their message


class Counted(Enum):
    """What `Input.decode` yields for a message that no step sees.

    One that is ``OTHER`` is whole and of a kind that the block does not take.
    """

    LOST = "lost"
    REFUSED = "refused"
    OTHER = "other"


class Input(LineDevice):
    """A device that gives values: ``decode`` takes messages out of the bytes that have come.

    A step takes all bytes that have come and never waits; the outputs are those of the newest message. Before
    the first one they are 0, or NaN where an output may be missing. If the port is lost, the age
    grows, and the run ends with an error. In the time that a device needs to start, its ``settle``, what
    comes does not count.

    A subclass may have outputs besides those of a message: it names them in ``besides`` and returns them,
    in their order, from `beside`.
    """

    not_replayable = "it reads a port"
    not_restorable = "it reads a port"

    age = Out(unit="s", nan=True, doc="time since the newest message came; NaN before the first one")
    lost = Out("int64", doc="messages that no step saw: newer ones came with them, or the device missed them")
    refused = Out("int64", doc="messages that were damaged")

    besides: ClassVar[tuple[str, ...]] = ()
    actual_port = ""  # what a real-time run puts in the place of `pty:NAME`
    lent: Callable[[], OpenPort] | None = None  # gives a port that is open, in a real-time run that shares it

    def decode(self, received: bytearray) -> Iterator[Any]:
        """Take all whole messages off the beginning of ``received``, and leave the rest there.

        Yield for each message its values, one for each of `message_outputs`, or a ``Counted`` for one that is
        only counted.
        """
        raise NotImplementedError

    @classmethod
    def message_outputs(cls) -> tuple[str, ...]:
        """Return the names of the outputs whose values a message gives."""
        beside = {*Input.interface.outputs, *cls.besides}
        return tuple(name for name in cls.interface.outputs if name not in beside)

    def beside(self) -> tuple[Any, ...]:
        """Return the values of the outputs ``besides``."""
        return ()

    @property
    def is_starting(self) -> bool:
        """Whether the device has not had the time to start."""
        return self._starts

    def open(self) -> None:
        """Open the port."""
        self._received, self._gone, self._stamp = bytearray(), "", math.nan
        self._age, self._counts = math.nan, dict.fromkeys(Counted, 0)
        self._late = False  # whether what is decoded came before a pause, and does not count
        self._newest = self._nothing()
        path = self.actual_port or self.port_given
        if path.startswith(CABLE):
            raise PortError(f"{path} is a cable, and only a real-time run makes cables")
        self._starts = self.settings.settle > 0.0
        self._port = self.settings.open(path) if self.lent is None else self.lent()

    def read(self, time: float) -> None:
        """Take all messages that have come, once the device has started."""
        starts, self._starts = self._starts, not reached(time, self.settings.settle)
        try:
            found = Waiting() if self._gone else self._port.read_waiting()
        except PortError as error:
            self._gone, found = f"{self.port_given}: {error}, at t = {time:.9g} s", Waiting()
        fresh = 0
        self._late = found.late
        self._counts[Counted.LOST] += 0 if starts else found.skipped
        for piece in () if starts else found.pieces:
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

    def send(self, piece: bytes) -> int:
        """Send as many bytes to the device as there is room for, without waiting; return their number."""
        try:
            return 0 if self._gone or not piece else self._port.write(piece)
        except PortError as error:
            self._gone = f"{self.port_given}: {error}"
            return 0

    def output(self) -> Any:
        """Return age, counts and the values of the newest message."""
        counts = self._counts[Counted.LOST], self._counts[Counted.REFUSED]
        return self._age, *counts, *self.beside(), *self._newest

    def close(self) -> None:
        """Close the port; PortError if it was lost during the run."""
        if "_port" in self.__dict__:
            self.__dict__.pop("_port").close()
            if self._gone:
                raise PortError(self._gone)

    def _nothing(self) -> tuple[Any, ...]:
        """Return the values before the first message."""
        sizes = parameter_sizes(self)
        outputs = [self.interface.outputs[name] for name in self.message_outputs()]
        return tuple(
            np.full(port.signal.resolve(sizes), math.nan if port.nan else 0, port.signal.scalar)[()]
            for port in outputs
        )
