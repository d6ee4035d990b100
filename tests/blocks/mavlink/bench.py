"""The block of an autopilot at a pty, with a fake one at its other end, on a clock that the test sets."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from quadvis.testing.alone import ALONE, alone
from quadvis.units import parse_period
from quadvis_blocks.mavlink.autopilot import Autopilot
from tests.blocks.mavlink.fake_autopilot import FakeAutopilot, MavPty
from tests.quadvis.realtime.ptys import arrive

RATE = 100  # Hz of the block


class Bench:
    """One step of it is one tick of the block, 10 ms, in which the other end does what is due."""

    def __init__(self, fake: dict[str, Any] | None = None, **given: Any) -> None:
        self.peer, self.port = os.openpty()
        self.block = Autopilot(port=os.ttyname(self.port), **given)
        self.engine = alone(self.block, {"arm": False}, {}, parse_period(f"{RATE} Hz"))
        self.bound: Any = self.engine.bound(ALONE)
        self.sealer, self.reports = self.block.sealer(), []
        self.bound.report = self.reports.append
        self.bound.deliver = self._send
        self.requests: list[float] = []
        self.steps = 0
        self.fake = FakeAutopilot(MavPty(self.peer, 1, 1, port=self.port), **(fake or {}))

    @property
    def time(self) -> float:
        return self.steps / RATE

    def _send(self, frame: bytes, number: int) -> None:
        """Do what the guardian does with a frame."""
        self.requests.append(self.time)
        self.bound._port.write(self.sealer.seal(frame, round(1e9 * self.time)))

    def step(self, count: int = 1, *, arm: bool | None = None) -> None:
        if arm is not None:
            self.engine.memory.write(self.engine.program[ALONE].inputs["arm"], arm)
        for _ in range(count):
            self.fake.pump(self.time)
            self.engine.run(1)
            self.steps += 1

    def put(self, data: bytes) -> None:
        """Let bytes come to the block besides those of the fake."""
        arrive(self.peer, self.port, data)

    def __getitem__(self, name: str) -> Any:
        return self.engine.read(ALONE, name)


@contextmanager
def bench(fake: dict[str, Any] | None = None, **given: Any) -> Iterator[Bench]:
    """Yield a bench whose block is open."""
    made = Bench(fake, **given)
    try:
        with made.engine:
            yield made
    finally:
        os.close(made.peer)
        os.close(made.port)
