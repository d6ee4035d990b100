"""An inertial unit at a serial port, in the frames of our own links."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from quadvis.block import Counted, Input, Line, Out, Param
from quadvis.links.frame import Decoder
from quadvis.links.message import Message, MessageSignal

SIGNALS = (("gyro", (3,), "rates"), ("pitch", (), "pitch"), ("roll", (), "roll"))  # and their outputs
REFUSED, LOST = Counted.REFUSED, Counted.LOST


class ImuIn(Input):
    """Angles and rates of an inertial unit that sends the frames of a link of a diagram.

    A frame has gyro (3 x float64, rad/s), pitch and roll (float64, rad) of the block ``sender``; its bytes
    are those of a link with `via: serial` that carries these three signals, see `quadvis.links.frame`. So
    a board or another computer that speaks them can stand where the bench has a simulated unit. A unit with a
    protocol of its own needs an input of its own, see `quadvis new device`.
    """

    line = Line("baud")

    port = Param(type="port", doc="serial port, or a cable such as pty:imu")
    baud = Param(230400, type="int64", min=1, max=10**7, doc="speed of the line (1/s)")
    sender = Param("craft/imu", type="str", doc="block whose gyro, pitch and roll the frames carry")
    roll = Out(unit="rad", doc="right side down")
    pitch = Out(unit="rad", doc="nose up")
    rates = Out("float64[3]", unit="rad/s", doc="of the gyro, about the axes of the craft")

    example = """
        imu: {block: hardware.imu_in, rate: fast, with: {port: pty:imu, baud: 230400}}
    """

    def open(self) -> None:
        """Open the port; no frame has come."""
        super().open()
        self._decoder = Decoder(message_of(self.sender))

    def decode(self, received: bytearray) -> Iterator[Any]:
        """Take all bytes; those of a frame that is not whole yet are kept by the decoder."""
        data, decoder = bytes(received), self._decoder
        received.clear()
        lost, refused = decoder.lost, decoder.refused
        for arrival in decoder.take(data):
            rates, pitch, roll = message_of(self.sender).unpack(arrival.payload)
            if np.isfinite([*rates, pitch, roll]).all():
                yield roll, pitch, rates
            else:
                yield REFUSED
        yield from [LOST] * (decoder.lost - lost)
        yield from [REFUSED] * (decoder.refused - refused)


def message_of(sender: str) -> Message:
    """Return the message that carries the signals of a block."""
    return Message(
        tuple(
            MessageSignal(
                name, sender, name, "float64", shape, ImuIn.interface.outputs[output].units, False, 0.0
            )
            for name, shape, output in SIGNALS
        )
    )
