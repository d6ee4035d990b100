"""News: frames that are sent once, when they are new, such as measurements and requests.

A command is repeated, since it must outlive a frame that is lost, and ends in safe values. A measurement that
is repeated would look like a newer one, and needs no end.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any, ClassVar

from quadvis.block.device import LineDevice
from quadvis.block.output import LONGEST, Sealer
from quadvis.units import parse_period


class NewsDevice(LineDevice):
    """A device that sends frames once each: `tell` hands one to the guardian, which sends the newest.

    The guardian looks for news at the ``rate``; what comes faster replaces what was not sent. Frames are sent
    at no other time, and none at the end.
    """

    sends = True
    rate: ClassVar[str] = "100 Hz"

    @property
    def interval(self) -> float:
        """The time from one look for news to the next (s)."""
        return float(parse_period(self.rate))

    def sealer(self) -> Sealer | None:
        """Return what makes each frame ready when it is sent; None if nothing must.

        It is called without bytes, too, and may send what is due by itself.
        """
        return None

    def tell(self, frame: bytes) -> None:
        """Let a frame be sent; ValueError if it is too long."""
        if len(frame) > LONGEST:
            raise ValueError(f"a frame must have at most {LONGEST} bytes, not {len(frame)}")
        self._told = self.__dict__.get("_told", 0) + 1
        self.deliver(frame, self._told)

    @staticmethod
    def deliver(frame: bytes, number: int) -> None:
        """Take a frame to the guardian: a real-time run gives each block a function of its own for this."""


class NewsOutput(NewsDevice):
    """A device that sends measurements: ``frame`` returns the bytes of one, or none if it is not new."""

    harmless = "a measurement is sent once, and nothing follows it"

    def __init_subclass__(cls, *, numeric: bool | None = None, bound: bool = False) -> None:
        frame = vars(cls).get("frame")
        if frame is not None and not bound:
            cls.write = _telling(frame)  # type: ignore[attr-defined]  # its arguments are those of `frame`
        super().__init_subclass__(numeric=numeric, bound=bound)


def _telling(frame: Callable[..., bytes]) -> Callable[..., None]:
    """Return the ``write`` of a device with this ``frame``, which asks for the same inputs."""

    def write(self: NewsOutput, *values: Any) -> None:
        if made := frame(self, *values):
            self.tell(made)

    write.__signature__ = inspect.signature(frame)  # type: ignore[attr-defined]
    write.__doc__ = "Send a measurement, if there is a new one."
    return write
