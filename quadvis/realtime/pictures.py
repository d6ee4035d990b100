"""Pictures of a running loop for people: the newest one of a signal that somebody wants to see.

Nobody waits. The loop looks at one word; while a signal is wanted there, it leaves a copy of its newest
picture in a mailbox, a few times a second. A picture costs the loop its copy, some 0.1 ms for 320 x 240.
"""

from __future__ import annotations

import struct
import time
from collections.abc import Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadvis.engine.engine import Engine
from quadvis.graph.graph import Graph
from quadvis.machine.mailbox import Mailbox

WANTED, HEAD = 0, 8  # words before the mailbox: by the supervisor, the number of the signal that is wanted
ROOM = 1920 * 1080 * 3  # bytes of a picture; a larger one is not shown
PLACES = 3
OFTEN = 100_000_000  # ns from one picture to the next, at least
LIFE = 3_000_000_000  # ns that a wish lasts without another question

_SHAPE = struct.Struct("<4qd")  # height, width, sequence, tick, stamp


class Picture(NamedTuple):
    """A picture (height, width, 3), blue-green-red, and its number among those of its signal.

    ``tick`` is the base tick at which it was on its wire, ``stamp`` the middle of its exposure (s, run time).
    """

    pixels: NDArray[np.uint8]
    sequence: int
    tick: int
    stamp: float


def picture_signals(graph: Graph) -> list[tuple[str, str]]:
    """Return the signals of a graph that are pictures: path and port, in the order of their numbers."""
    return [
        (node.path, name)
        for node in graph.nodes
        if not node.hidden
        for name, port in node.block.interface.outputs.items()
        if port.signal.scalar == "frame"
    ]


class PictureBox:
    """The shared words of a loop's pictures, for either side."""

    def __init__(self, words: Any) -> None:
        view = memoryview(words).cast("B").cast("q")
        self._asked = self._next = 0
        self._head = view[:HEAD]
        self._mailbox = Mailbox(view[HEAD:], _SHAPE.size + ROOM, PLACES)

    @staticmethod
    def size() -> int:
        """Return the number of words."""
        return HEAD + Mailbox.size(_SHAPE.size + ROOM, PLACES)

    # for the loop

    def put_from(self, engine: Engine, signals: Sequence[tuple[str, str]], clock: Any) -> None:
        """Let an engine leave pictures here; ``clock.now()`` is the time (ns)."""
        for number, (path, port) in enumerate(signals, 1):
            task = engine.graph[path].task.name
            engine.observe(task, partial(self._look, engine, number, path, port, clock))

    def _look(self, engine: Engine, number: int, path: str, port: str, clock: Any, tick: int) -> None:
        if self._head[WANTED] != number or clock.now() < self._next:
            return
        frame = engine.read(path, port)
        pixels = np.ascontiguousarray(frame.pixels)
        if pixels.nbytes == 0 or pixels.nbytes > ROOM:
            return
        self._next = clock.now() + OFTEN
        head = _SHAPE.pack(*pixels.shape[:2], frame.sequence, tick, frame.stamp)
        self._mailbox.put(head + pixels.tobytes(), number)

    # for the supervisor

    def rest(self) -> None:
        """Let the loop leave no more pictures if nobody has asked for one lately."""
        if self._head[WANTED] and time.monotonic_ns() - self._asked > LIFE:
            self._head[WANTED] = 0

    def newest(self, number: int) -> Picture | None:
        """Return the newest picture of a signal, and let the loop leave more; None if there is none of it."""
        self._asked = time.monotonic_ns()
        self._head[WANTED] = number
        found = self._mailbox.newest(number + 1, number - 1)
        if found is None:
            return None
        height, width, sequence, tick, stamp = _SHAPE.unpack_from(found.payload)
        pixels = np.frombuffer(found.payload, np.uint8, height * width * 3, _SHAPE.size)
        return Picture(pixels.reshape(height, width, 3), sequence, tick, stamp)
