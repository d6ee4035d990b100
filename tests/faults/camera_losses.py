"""A flight whose camera is silent, hangs up, is silent for long, and at last is gone for good."""

from __future__ import annotations

import time
from pathlib import Path
from typing import NamedTuple

import numpy as np

from quadvis.output.log_reader import Log
from tests.faults.airborne import Airborne

SHORT, AWAY, LONG = 1.0, 1.5, 30.0  # s that the camera is silent, has hung up, and is silent again
CALM = 2.5  # s after each of these
REST = 24.0  # s of the flight beside the long silence: it may begin some seconds late
PERIOD = 0.1  # s of the camera


class Gap(NamedTuple):
    """A time without pictures: from the stamp of the last one to the tick of the next one (s)."""

    last: float
    next: float


class CameraLosses(NamedTuple):
    """The flight: its log, how the command ended and what it said, and how high (m) the craft was then.

    ``losses`` are when the camera was lost and came again, on the clock of the test (s). ``latest`` says how
    late (s) the world was at most that the craft flies in.
    """

    log: Log
    code: int
    out: str
    told: str
    height: float
    losses: list[tuple[float, float]]
    latest: float

    def gaps(self) -> list[Gap]:
        """Return the time without pictures that each loss made, and the one at the end.

        A busy machine makes others. The longest one is that of the longest loss, and says how the clock of
        the test and the time of the flight differ.
        """
        fresh = self.log["eyes.fresh"]
        stamps, times = self.log["eyes.stamp"][fresh], self.log.times("eyes.stamp")[fresh]
        found = [Gap(stamps[at], times[at + 1]) for at in range(len(stamps) - 1)]
        offset = max(found, key=lambda gap: gap.next - gap.last).last - self.losses[-1][0]

        def common(gap: Gap, begin: float, end: float) -> float:
            return min(gap.next, end) - max(gap.last, begin)

        losses = [(begin + offset, end + offset) for begin, end in self.losses]
        made = [max(found, key=lambda gap: common(gap, *loss)) for loss in losses]
        return [*made, Gap(stamps[-1], np.inf)]


def fly(folder: Path, silence: float = LONG) -> CameraLosses:
    """Fly, and let the camera fail in one way after the other; ``silence`` is the longest one (s)."""
    with Airborne(folder, "--stop-time", f"{REST + silence} s") as flight:
        flight.flies()
        camera, losses = flight.world.server, []

        def lose(seconds: float, *, hang_up: bool = False) -> None:
            begin = time.monotonic()
            camera.stalled, camera.gone = not hang_up, hang_up
            if hang_up:
                camera.hang_up()
            flight.lasts(seconds)
            camera.stalled = camera.gone = False
            losses.append((begin, time.monotonic()))

        flight.lasts(1.0)
        for seconds, hang_up in ((SHORT, False), (AWAY, True), (silence, False)):
            lose(seconds, hang_up=hang_up)
            flight.lasts(CALM)
        camera.gone = True
        camera.hang_up()
        code, out, told = flight.ended()
        height = float(flight.world.positions[-1][2])
        return CameraLosses(flight.log, code, out, told, height, losses, flight.world.latest)
