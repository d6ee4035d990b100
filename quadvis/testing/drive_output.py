"""Run a single output device without a diagram: the guardian sends its frames to a peer behind a pty."""

from __future__ import annotations

import multiprocessing
import os
import select
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from quadvis.block import Block, Output, parameter_sizes
from quadvis.block.output import checked_frame
from quadvis.diagram.sections.on_host_loss import SAFE
from quadvis.machine.datagrams import HERE, UDP, Datagrams
from quadvis.machine.serial_port import Line
from quadvis.realtime.guard import Guard
from quadvis.realtime.guardian import Standing, outboxes, words_for
from quadvis.realtime.outlet import OutputPort
from quadvis.testing.drive import series_of

WAIT = 20.0  # s in which each frame must have come
TWICE = 2  # frames in a row, so that what was read is a whole one


class DrivenOutput(NamedTuple):
    """What a peer has read: one whole frame of each kind; ``wire`` are all bytes in their order."""

    initial: bytes
    commands: list[bytes]
    safe: bytes
    wire: bytes


def drive_output(block: Block, **inputs: Any) -> DrivenOutput:
    """Send commands through the guardian, kill their sender with SIGKILL, and return what a peer has read.

    Each input is one value, or an array with a leading time axis. A pty takes the place of a serial port, a
    socket of this computer that of `udp:HOST:PORT`. Frames come without what a sealer would add: that differs
    from one to the next. AssertionError if a frame does not come.
    """
    if not isinstance(block, Output):
        raise TypeError(f"{type(block).__name__} is no output device")
    frames = [checked_frame(frame) for frame in _frames(block, inputs)]
    with _peer(block) as (peer, path):
        reader = _Reader(peer)
        context = multiprocessing.get_context("spawn")
        words = context.RawArray("q", words_for(1))
        port = replace(OutputPort.of(block, "block", path), sealer=None)
        guard = Guard(context, words, [], SAFE, Standing())
        sender = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
        try:
            guard.start()
            guard.open([port], lambda _: None)
            guard.watch(sender.pid)
            initial = reader.whole(port.initial)
            (box,) = outboxes(words)
            read = []
            for frame in frames:
                box.put(frame)
                read.append(reader.whole(frame))
            sender.kill()
            safe = reader.whole(port.safe)
        finally:
            sender.kill()
            sender.communicate()
            unsafe = guard.close()
        reader.take()
        assert not unsafe, unsafe
    return DrivenOutput(initial, read, safe, bytes(reader.wire))


class _Reader:
    """Reads what comes to a peer."""

    def __init__(self, peer: int) -> None:
        self._peer = peer
        self.wire = bytearray()
        self._passed = 0  # bytes that belong to the frames before

    def take(self) -> None:
        """Read what is there."""
        while select.select([self._peer], [], [], 0)[0]:
            self.wire += os.read(self._peer, 1 << 16)

    def whole(self, frame: bytes) -> bytes:
        """Return a frame as it was read, once it has come twice in a row."""
        until = time.monotonic() + WAIT
        wanted = TWICE * frame
        while (at := self.wire.find(wanted, self._passed)) < 0:
            rest = until - time.monotonic()
            assert rest > 0, f"{frame.hex()} has not come; the peer has read {bytes(self.wire).hex()}"
            if select.select([self._peer], [], [], rest)[0]:
                self.take()
        self._passed = at + len(wanted)
        return bytes(self.wire[at : at + len(frame)])


def _frames(block: Output, inputs: dict[str, Any]) -> Iterator[bytes]:
    """Yield the frames of the commands, one for each row of the longest input."""
    names = block.interface.arguments["write"]
    if inputs.keys() != {*names}:
        raise TypeError(f"{type(block).__name__} asks for {', '.join(names)}")
    sizes = parameter_sizes(block)
    rows = [series_of(name, block.interface.inputs[name].signal, inputs[name], sizes) for name in names]
    count = max(len(values) for values, _ in rows)
    frame: Any = getattr(block, "frame")  # noqa: B009  # its arguments differ from class to class
    for k in range(count):
        yield frame(*(np.asarray(values[0 if constant else k])[()] for values, constant in rows))


@contextmanager
def _peer(block: Output) -> Iterator[tuple[int, str]]:
    """Yield the descriptor at which a peer reads, and the port that leads there."""
    if isinstance(block.settings, Datagrams):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as heard:
            heard.bind((HERE, 0))
            yield heard.fileno(), f"{UDP}{HERE}:{heard.getsockname()[1]}"
    elif isinstance(block.settings, Line):
        peer, port = os.openpty()
        try:
            yield peer, os.ttyname(port)
        finally:
            os.close(peer)
            os.close(port)
    else:
        raise TypeError(f"{type(block).__name__} reaches a driver; test it with one that stands in for it")
