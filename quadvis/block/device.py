"""Devices: blocks that reach a port.

An output device says which bytes a command is; the guardian of a real-time run owns its port and sends them,
see ``quadvis.realtime.guardian``. An input device takes messages out of the bytes that have come to its port.
What a process of its own must read is a `quadvis.block.captured_input`.
"""

from __future__ import annotations

import math
from typing import Any, ClassVar

from quadvis.block.block import Block
from quadvis.block.declare import Initial, ParameterError
from quadvis.machine.datagrams import Address, Datagrams
from quadvis.machine.ports import PortSettings
from quadvis.machine.serial_port import Line, missing_port

CABLE = "pty:"  # begins a port that is one end of a cable of ptys


class Device(Block, numeric=False):
    """A block with one port: a parameter of type ``port``.

    A port has one device, unless all its devices are ``shared`` by the same word: then any number of them
    send there, and one may take what comes.
    """

    port_parameter: ClassVar[str] = ""
    port_example: ClassVar[str] = f"{CABLE}name"
    shared: ClassVar[str] = ""

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
        """The port as the diagram has it: a path, `udp:HOST:PORT`, or `pty:NAME`."""
        return str(getattr(self, self.port_parameter))

    def missing(self) -> str:
        """Return a sentence if the port is surely not there, else ""."""
        return "" if self.port_given.startswith(CABLE) else missing_port(self.port_given)

    @staticmethod
    def report(sentence: str) -> None:
        """Report what people should know during a run: a real-time run gives each block its own way."""


class LineDevice(Device):
    """A device that sends or takes bytes, at a serial port with the settings of its ``line`` or by datagrams.

    One whose ``line`` is None has no serial port. One that reaches the driver of a card overrides `settings`.
    """

    line: ClassVar[Line | None]
    sends: ClassVar[bool] = False

    def __init__(self, *, period: float = math.nan, **parameters: Any) -> None:
        super().__init__(period=period, **parameters)
        _ = self.settings  # which refuse a port that cannot be theirs

    @classmethod
    def check_port(cls, ports: list[str]) -> None:
        """Refuse a class with several ports, or without settings of its line."""
        if len(ports) > 1 or not (hasattr(cls, "line") or cls.settings is not LineDevice.settings):
            raise TypeError(f"{cls.__name__} must have one parameter of type port, and say its 'line'")

    @classmethod
    def used_outside(cls) -> set[str]:
        """Return the names of the parameters that say how the port is used."""
        found = {param.name for param in cls.interface.params.values() if isinstance(param, Initial)}
        named = {getattr(cls, name, "") for name in ("rate", "hold")}
        line = cls.serial_line()
        baud = str(line.baud) if line is not None else ""
        return found | named | {cls.port_parameter, baud}

    @classmethod
    def serial_line(cls) -> Line | None:
        """Return its line, if it may be at a serial port."""
        return getattr(cls, "line", None)

    @property
    def settings(self) -> PortSettings:
        """The settings of the port, with the baud that the block's parameters give."""
        if Address.of(self.port_given) is not None:
            return Datagrams(self.sends)
        if self.line is None:
            problem = f"{self.port_parameter} must be such as udp:192.168.0.5:14550, got '{self.port_given}'"
            raise ParameterError(self.port_parameter, problem)
        baud = self.line.baud
        return self.line._replace(baud=int(getattr(self, baud)) if isinstance(baud, str) else baud)

    def missing(self) -> str:
        """Return a sentence if the port is surely not there, else ""."""
        return "" if self.port_given.startswith(CABLE) else self.settings.missing(self.port_given)
