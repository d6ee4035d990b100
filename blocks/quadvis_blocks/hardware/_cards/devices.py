"""What the devices for cards and boards have in common: a port, by a driver or a line, and its channels."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, ClassVar

import numpy as np

from quadvis.block import Counted, Input, Line, LineDevice, Output, Param, PortSettings
from quadvis_blocks.hardware._cards.frames import ChannelKind, encode, take
from quadvis_blocks.hardware._cards.ports import CardChannel, CardInputs, CardOutputs, request_of
from quadvis_blocks.hardware._cards.ranges import check_channels


class CardDevice(LineDevice):
    """A device with channels of one kind, of a card with a driver or of a board at a serial line."""

    line = Line("baud")
    kind: ClassVar[ChannelKind]

    port = Param(type="port", doc="comedi:/dev/comedi0, nidaqmx:Dev1, or the line of a board: pty:board")
    baud = Param(115_200, "int64", min=1, max=10**7, doc="speed of the line of a board (1/s)")
    channels = Param(type="int64[n]", min=1, doc="channel of each element, from 1")

    def check(self) -> None:
        """Refuse wrong channels."""
        check_channels(self.channels)

    def card_channels(self) -> list[CardChannel]:
        """Return the channels with their ranges."""
        return [CardChannel(int(number)) for number in self.channels]


class CardOutput(CardDevice, Output):
    """A device whose frames are values of channels, to be put out."""

    rate = "spacing"

    spacing = Param(20e-3, unit="s", min=1e-3, max=1.0, doc="from one time that all are put out to the next")

    @property
    def settings(self) -> PortSettings:
        """The settings of the port: those of a driver, or of a line."""
        request = request_of(self.port_given, self.port_parameter, self.kind, self.card_channels())
        return super().settings if request is None else CardOutputs(request)

    def frame_of(self, values: Any) -> bytes:
        """Return the frame of whole values, one for each channel."""
        return encode(self.kind, zip(map(int, self.channels), map(int, values), strict=True))


class CardInput(CardDevice, Input):
    """A device that takes frames with values of channels, which were measured."""

    spacing = Param(10e-3, unit="s", min=2e-4, max=10.0, doc="from one reading of a card to the next")

    @classmethod
    def used_outside(cls) -> set[str]:
        """Return the names of the parameters that say how the port is used."""
        return super().used_outside() | {"spacing"}

    @property
    def settings(self) -> PortSettings:
        """The settings of the port: those of a driver, or of a line."""
        channels = self.card_channels()
        request = request_of(
            self.port_given, self.port_parameter, self.kind, channels, self.is_differential()
        )
        return super().settings if request is None else CardInputs(request, self.spacing)

    def is_differential(self) -> bool:
        """Return whether each channel is the difference of two wires."""
        return False

    def decode(self, received: bytearray) -> Iterator[Any]:
        """Take whole frames; those of other kinds belong to nobody here."""
        for found in take(received):
            if found is None:
                yield Counted.REFUSED
            elif found.kind is self.kind:
                values = [found.values.get(int(number)) for number in self.channels]
                message = None if None in values else self.message(np.array(values))
                yield Counted.REFUSED if message is None else message

    def message(self, values: Any) -> tuple[Any, ...] | None:
        """Return what the block gives out for whole values of its channels; None if they are refused."""
        raise NotImplementedError
