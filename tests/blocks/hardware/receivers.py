"""Inputs of radio control at the end of a pty, and their peer."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from quadvis.block import Counted
from quadvis.testing.alone import ALONE, alone
from quadvis.units import parse_period
from quadvis_blocks.hardware._counts import CHANNELS
from quadvis_blocks.hardware._receiver import ReceiverInput

COUNTS = {"lowest": -820.0, "highest": 819.0}  # so that a command is a count less 992


def given(channels: list[int], roles: str, **more: Any) -> dict[str, Any]:
    """Return parameters by which commands are counts less 992."""
    ends = {name: [end] * len(channels) for name, end in COUNTS.items()}
    return {"port": "pty:rc", "channels": channels, "roles": roles, **ends, **more}


def counts(**others: int) -> list[int]:
    """Return 16 counts at the centre, but for some channels: `counts(c3=172)`."""
    return [others.get(f"c{number}", 992) for number in range(1, CHANNELS + 1)]


class Receiver:
    """A block at the end of a pty; its peer writes."""

    def __init__(self, kind: type[ReceiverInput], rate: str = "100 Hz", **parameters: Any) -> None:
        self.peer, self.port = os.openpty()
        block = kind(**{**parameters, "port": os.ttyname(self.port)})
        sizes = {"n": len(parameters["channels"])}
        self.engine = alone(block, {}, sizes, parse_period(rate))

    def step(self, came: bytes = b"") -> dict[str, Any]:
        """Write bytes, and return the outputs of the step that reads them."""
        if came:
            os.write(self.peer, came)
        self.engine.run(1)
        names = self.engine.program[ALONE].outputs
        return {name: np.asarray(self.engine.read(ALONE, name)).tolist() for name in names}

    def unplug(self) -> None:
        """Take the peer away."""
        os.close(self.peer)
        self.peer = -1


@contextmanager
def receiving(kind: type[ReceiverInput], **parameters: Any) -> Iterator[Receiver]:
    """Yield a block at a pty, open."""
    made = Receiver(kind, **parameters)
    try:
        with made.engine:
            yield made
    finally:
        os.close(made.port)
        if made.peer >= 0:
            made.unplug()


def messages(kind: type[ReceiverInput], data: bytes, piece: int = 1, **parameters: Any) -> list[Any]:
    """Return what the decoder gives for bytes that come piece by piece, on a good link."""
    received, found = bytearray(), []
    with receiving(kind, **parameters) as made:
        block = made.engine.bound(ALONE)
        block._link.good = True
        for begin in range(0, len(data), piece):
            received += data[begin : begin + piece]
            found += list(block.decode(received))
            assert len(received) < 64 + piece
    return found


def values(found: list[Any]) -> list[tuple[int, ...]]:
    """Return the commands among messages, as whole numbers."""
    return [tuple(np.rint(each[0]).astype(int).tolist()) for each in found if not isinstance(each, Counted)]
