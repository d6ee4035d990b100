"""Devices: blocks that reach a port.

An output device says which bytes a command is; the guardian of a real-time run owns its port and sends them,
see ``quadvis.realtime.guardian``. An input device takes messages out of the bytes that have come to its port.
Both reach serial ports; what a process of its own must read is a `quadvis.block.captured_input`.
"""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Iterator, Mapping
from enum import Enum
from typing import Any, ClassVar

import numpy as np

from quadvis.block.block import Block
from quadvis.block.declare import Initial, Out, ParameterError
from quadvis.block.sizes import parameter_sizes
from quadvis.errors import sentence
from quadvis.machine.serial_port import (
    BACKLOG,
    Line,
    PortError,
    close_port,
    missing_port,
    open_port,
    read_waiting,
)
from quadvis.units import format_quantity, parse_period
from quadvis.units.unit import Unit

CABLE = "pty:"  # begins a port that is one end of a cable of ptys
LONGEST = 1024  # bytes of a frame
KEPT = 4096  # bytes at most that wait for the rest of their message


class Counted(Enum):
    """What `Input.decode` yields for a message that no step sees."""

    LOST = "lost"
    REFUSED = "refused"


class Device(Block, numeric=False):
    """A block with one port: a parameter of type ``port``."""

    port_parameter: ClassVar[str] = ""
    port_example: ClassVar[str] = f"{CABLE}name"

    def __init_subclass__(cls, *, numeric: bool | None = None, bound: bool = False) -> None:
        super().__init_subclass__(numeric=numeric, bound=bound)
        ports = [name for name, param in cls.interface.params.items() if param.is_port]
        if ports and not bound:
            cls.check_port(ports)
            cls.port_parameter = ports[0]

    @classmethod
    def check_port(cls, ports: list[str]) -> None:
        """Refuse a class with several ports, which are given by the names of their parameters."""
        if len(ports) > 1:
            raise TypeError(f"{cls.__name__} must have one parameter of type port, not {len(ports)}")

    @classmethod
    def used_outside(cls) -> set[str]:
        """Return the names of the parameters that say how the port is used."""
        return {cls.port_parameter}

    @property
    def port_given(self) -> str:
        """The port as the diagram has it: a path, or `pty:NAME`."""
        return str(getattr(self, self.port_parameter))

    def missing(self) -> str:
        """Return a sentence if the port is surely not there, else ""."""
        return "" if self.port_given.startswith(CABLE) else missing_port(self.port_given)


class LineDevice(Device):
    """A device at a serial port, with the settings of its ``line``."""

    line: ClassVar[Line]

    @classmethod
    def check_port(cls, ports: list[str]) -> None:
        """Refuse a class with several ports, or without settings of its line."""
        if len(ports) > 1 or not hasattr(cls, "line"):
            raise TypeError(f"{cls.__name__} must have one parameter of type port, and say its 'line'")

    @classmethod
    def used_outside(cls) -> set[str]:
        """Return the names of the parameters that say how the port is used."""
        found = {param.name for param in cls.interface.params.values() if isinstance(param, Initial)}
        return found | {cls.port_parameter, str(cls.line.baud), getattr(cls, "rate", "")}

    @property
    def settings(self) -> Line:
        """The settings of the line, with the baud that the block's parameters give."""
        baud = self.line.baud
        return self.line._replace(baud=int(getattr(self, baud)) if isinstance(baud, str) else baud)


class Output(LineDevice):
    """A device that takes commands: ``frame`` returns the bytes of one.

    ``frame`` asks for inputs by name; each has an ``Initial`` and a ``Safe`` value. The guardian sends the
    newest frame again and again at the device's ``rate``: a rate such as "50 Hz", or the name of the
    parameter that is the time (s) from one frame to the next. Before the first command it sends the frame of
    the initial values, and at every end that of the safe values. So a frame follows from its inputs and the
    parameters alone.
    """

    rate: ClassVar[str]
    initial_values: ClassVar[Mapping[str, Initial]] = {}  # by input

    def __init_subclass__(cls, *, numeric: bool | None = None, bound: bool = False) -> None:
        frame = vars(cls).get("frame")
        if frame is not None and not bound:
            cls.write = _writing(frame)  # type: ignore[attr-defined]  # its arguments are those of `frame`
        super().__init_subclass__(numeric=numeric, bound=bound)
        if bound or "write" not in cls.interface.arguments:
            return
        params, inputs = cls.interface.params.values(), cls.interface.inputs
        cls.initial_values = {param.input: param for param in params if isinstance(param, Initial)}
        asked = cls.interface.arguments["write"]
        if "time" in asked or cls.initial_values.keys() != {*asked}:
            problem = f"{cls.__name__}.frame must ask for inputs that have an initial value each"
            raise TypeError(sentence(problem, "declare initial = Initial('command'), for example"))
        for name, value in cls.initial_values.items():
            value.stand_for(inputs[name])
        if not (cls.port_parameter and hasattr(cls, "rate")):
            raise TypeError(f"{cls.__name__} must have a parameter of type port, a 'line' and a 'rate'")

    def __init__(self, *, period: float = math.nan, **parameters: Any) -> None:
        super().__init__(period=period, **parameters)
        for values, make in (
            (self.initial_values, self.initial_frame),
            (self.interface.safe, self.safe_frame),
        ):
            self._check_frame(next(iter(values.values())).name if values else self.port_parameter, make)

    @property
    def interval(self) -> float:
        """The time from one frame to the next (s)."""
        if self.rate in self.interface.params:
            return float(getattr(self, self.rate))
        return float(parse_period(self.rate))

    def initial_frame(self) -> bytes:
        """Return the bytes that are sent before the first command."""
        return self._frame({name: param.name for name, param in self.initial_values.items()})

    def safe_frame(self) -> bytes:
        """Return the bytes that are sent at every end."""
        return self._frame({name: param.name for name, param in self.interface.safe.items()})

    def outgoing(self, *values: Any) -> tuple[Any, ...]:
        """Return what goes out at a step in the place of the inputs: a device may let them change slowly."""
        return values

    def write_safe(self, time: float) -> None:
        """Hand over the safe frame."""
        self.deliver(self.safe_frame())

    @staticmethod
    def deliver(frame: bytes) -> None:
        """Take a frame to the guardian: a real-time run gives each block a function of its own for this."""

    def _frame(self, names: Mapping[str, str]) -> bytes:
        frame: Any = getattr(self, "frame")  # noqa: B009  # its arguments differ from class to class
        return checked_frame(
            frame(*(getattr(self, names[name]) for name in self.interface.arguments["write"]))
        )

    def _check_frame(self, parameter: str, make: Callable[[], bytes]) -> None:
        """Refuse values of which no frame can be made, and a line that is too slow for the frames."""
        try:
            count = len(make())
        except ParameterError:
            raise
        except Exception as error:
            raise ParameterError(parameter, f"{parameter} gives no frame: {error}") from error
        taken, line = self.settings.time(count) + self.settings.gap, self.settings
        if taken > self.interval:
            named = self.rate if self.rate in self.interface.params else self.port_parameter
            second = Unit.parse("s")
            times = format_quantity(taken, second, 3), format_quantity(self.interval, second, 3)
            problem = f"a frame of {count} bytes takes {times[0]} at {line}, and one is due every {times[1]}"
            raise ParameterError(named, sentence(problem, "send fewer frames, or use a faster line"))


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
        self._descriptor = open_port(path, self.settings)

    def read(self, time: float) -> None:
        """Take all messages that have come."""
        try:
            found = b"" if self._gone else read_waiting(self._descriptor)
        except PortError as error:
            self._gone, found = f"{self.port_given}: {error}, at t = {time:.9g} s", b""
        # The system had no room for more: nobody knows how old these are.
        late = len(found) >= BACKLOG
        self._received += found
        fresh = 0
        for message in self.decode(self._received):
            if isinstance(message, Counted):
                self._counts[message] += 1
            elif late:
                self._counts[Counted.LOST] += 1
            else:
                self._newest = message
                fresh += 1
        del self._received[:-KEPT]
        if fresh:
            self._counts[Counted.LOST] += fresh - 1
            self._stamp = time
        self._age = time - self._stamp

    def output(self) -> Any:
        """Return age, counts and the values of the newest message."""
        return self._age, self._counts[Counted.LOST], self._counts[Counted.REFUSED], *self._newest

    def close(self) -> None:
        """Close the port; PortError if it was lost during the run."""
        if "_descriptor" in self.__dict__:
            close_port(self.__dict__.pop("_descriptor"))
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


def checked_frame(frame: Any) -> bytes:
    """Return what ``frame`` has returned; TypeError or ValueError if it cannot be sent."""
    if not isinstance(frame, bytes):
        raise TypeError(f"frame must return bytes, not {type(frame).__name__}")
    if not 0 < len(frame) <= LONGEST:
        raise ValueError(f"a frame must have 1 to {LONGEST} bytes, not {len(frame)}")
    return frame


def _writing(frame: Callable[..., bytes]) -> Callable[..., None]:
    """Return the ``write`` of an output device, which asks for the same inputs as its ``frame``."""

    def write(self: Output, *values: Any) -> None:
        self.deliver(checked_frame(frame(self, *self.outgoing(*values))))

    write.__signature__ = inspect.signature(frame)  # type: ignore[attr-defined]
    write.__doc__ = "Hand over the frame of a command."
    return write
