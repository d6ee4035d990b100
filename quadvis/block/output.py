"""Output devices: the bytes of commands, and how they are sent."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Mapping
from typing import Any, ClassVar, Protocol

from quadvis.block.declare import Initial, ParameterError
from quadvis.block.device import LineDevice
from quadvis.block.unlike import unlike_sizes
from quadvis.errors import sentence
from quadvis.units import format_quantity, parse_period, read_quantity
from quadvis.units.unit import Unit

LONGEST = 1024  # bytes of a frame
SECOND = Unit.parse("s")


class Sealer(Protocol):
    """Makes a frame ready to be sent, at the moment when it is: adds a number or a signature, for example.

    It goes to the guardian's process, which calls it for each frame that it sends, the safe ones too; so it
    must be plain data with functions that import nothing. ``added`` is how many bytes it adds at most.
    """

    added: int

    def seal(self, frame: bytes, now_ns: int) -> bytes:
        """Return the bytes to be sent at an instant of the monotonic clock (ns)."""


class Output(LineDevice):
    """A device that takes commands: ``frame`` returns the bytes of one.

    ``frame`` asks for inputs by name; each has an ``Initial`` and a ``Safe`` value. The guardian sends the
    newest frame again and again at the device's ``rate``: a rate such as "50 Hz", or the name of the
    parameter that is the time (s) from one frame to the next. Before the first command it sends the frame of
    the initial values, and at every end that of the safe values. So a frame follows from its inputs and the
    parameters alone; what differs from one sending to the next, such as a number, is the work of a `sealer`.

    Safe frames are sent as long as anybody lives, or for the time ``hold``: a time such as "2 s", or the name
    of the parameter that has it (s). After it the device is released: no frame follows.
    """

    sends = True
    rate: ClassVar[str]
    hold: ClassVar[str] = ""
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

    @property
    def held(self) -> float:
        """The time for which safe frames are sent (s); 0 where nothing releases the device."""
        if self.hold in self.interface.params:
            return float(getattr(self, self.hold))
        return read_quantity(self.hold, SECOND) if self.hold else 0.0

    def sealer(self) -> Sealer | None:
        """Return what makes each frame ready at the moment when it is sent; None if nothing must."""
        return None

    def beginning(self) -> bytes:
        """Return the bytes that are sent once, before the first frame."""
        return b""

    def ending(self) -> bytes:
        """Return the bytes that are sent once, after the last frame."""
        return b""

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
        sealer = self.sealer()
        try:
            count = len(make()) + (sealer.added if sealer is not None else 0)
        except ParameterError:
            raise
        except Exception as error:
            wrong = ParameterError(parameter, f"{parameter} gives no frame: {error}")
            raise unlike_sizes(self) or wrong from error
        taken, line = self.settings.time(count) + self.settings.gap, self.settings
        if taken > self.interval:
            named = self.rate if self.rate in self.interface.params else self.port_parameter
            times = format_quantity(taken, SECOND, 3), format_quantity(self.interval, SECOND, 3)
            problem = f"a frame of {count} bytes takes {times[0]} at {line}, and one is due every {times[1]}"
            raise ParameterError(named, sentence(problem, "send fewer frames, or use a faster line"))


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
