"""A flight whose camera is silent, hangs up, is silent for half a minute, and at last is gone for good."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from quadvis.output.log_reader import Log
from tests.faults.airborne import Airborne

SHORT, AWAY, LONG = 0.5, 1.0, 30.0  # s that the camera is silent, has hung up, and is silent again
CALM = 2.5  # s after each of these
STOP = 54.0  # s, the stop time: the flight may begin some seconds late
PERIOD = 0.1  # s of the camera


class Gap(NamedTuple):
    """A time without pictures: from the stamp of the last one to the tick of the next one (s)."""

    last: float
    next: float


class CameraLosses(NamedTuple):
    """The flight: its log, how the command ended and what it said, and how high (m) the craft was then."""

    log: Log
    code: int
    out: str
    told: str
    height: float

    def gaps(self, longer: float = 0.45) -> list[Gap]:
        """Return the times without pictures that were longer (s), and the one at the end."""
        fresh = self.log["eyes.fresh"]
        stamps, times = self.log["eyes.stamp"][fresh], self.log.times("eyes.stamp")[fresh]
        found = [Gap(stamps[at], times[at + 1]) for at in np.flatnonzero(np.diff(stamps) > longer)]
        return [*found, Gap(stamps[-1], np.inf)]


def fly(folder: Path) -> CameraLosses:
    """Fly, and let the camera fail in one way after the other."""
    with Airborne(folder, "--stop-time", f"{STOP} s") as flight:
        flight.flies()
        camera = flight.world.server
        flight.lasts(1.0)
        camera.stalled = True
        flight.lasts(SHORT)
        camera.stalled = False
        flight.lasts(CALM)
        camera.gone = True
        camera.hang_up()
        flight.lasts(AWAY)
        camera.gone = False
        flight.lasts(CALM)
        camera.stalled = True
        flight.lasts(LONG)
        camera.stalled = False
        flight.lasts(CALM)
        camera.gone = True
        camera.hang_up()
        code, out, told = flight.ended()
        height = float(flight.world.positions[-1][2])
        return CameraLosses(flight.log, code, out, told, height)
