"""An input at the end of a pty whose peer is a board, and an input at a card that stands in for one."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from quadvis.block import Input, parameter_sizes
from quadvis.testing.alone import ALONE, alone
from quadvis.units import parse_period


class Board:
    """A peer that sends, and the block that reads."""

    def __init__(self, block: Input, peer: int) -> None:
        self.block, self._peer = block, peer
        self.engine = alone(block, {}, parameter_sizes(block), parse_period("100 Hz"))

    def step(self, came: bytes = b"") -> dict[str, Any]:
        """Send bytes, run a step, and return the outputs."""
        if came:
            os.write(self._peer, came)
        self.engine.run(1)
        names = self.block.interface.outputs
        return {name: np.asarray(self.engine.read(ALONE, name)).tolist() for name in names}


@contextmanager
def board(kind: type[Input], **given: Any) -> Iterator[Board]:
    """Yield a block at the end of a pty, opened."""
    peer, port = os.openpty()
    try:
        made = Board(kind(port=os.ttyname(port), **given), peer)
        with made.engine:
            yield made
    finally:
        os.close(peer)
        os.close(port)


@contextmanager
def at_card(block: Input) -> Iterator[Board]:
    """Yield a block at a card, opened: a process of its own reads it."""
    made = Board(block, -1)
    with made.engine:
        yield made
