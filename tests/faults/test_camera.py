"""Fault 1: a camera that is silent, hangs up, is silent for half a minute, and is gone for good."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import pytest

from quadvis.machine.capture import GOOD
from quadvis.output.log_reader import Log
from quadvis_blocks.supervision.failsafe import AUTOMATIC, COASTING, LANDING, LEVELLED
from tests.faults.airborne import Airborne
from tests.faults.bench import no_trace
from tests.processes import linux

pytestmark = [pytest.mark.faults, pytest.mark.slow, linux]

SHORT, AWAY, LONG = 0.5, 1.0, 30.0  # s that the camera is silent, has hung up, and is silent again
CALM = 2.5  # s after each of these
STOP = 54.0  # s, the stop time: the flight may begin some seconds late
PERIOD = 0.1  # s of the camera
FRESH, COAST = 0, 1
LAND, LEVEL = 5.0, 4.5  # s without vision: see supervision in flight.yaml


class Gap(NamedTuple):
    """A time without pictures: from the stamp of the last one to the tick of the next one (s)."""

    last: float
    next: float


class Flown(NamedTuple):
    """A flight with a camera that failed, how it ended, and where the craft was then."""

    log: Log
    code: int
    out: str
    told: str
    height: float


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Flown]:
    """Let the camera fail in one way after the other; at last it is gone for good."""
    with Airborne(tmp_path_factory.mktemp("camera"), "--stop-time", f"{STOP} s") as flight:
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
        yield Flown(flight.log, code, out, told, height)


def gaps(log: Log, longer: float) -> list[Gap]:
    """Return the times without pictures that were longer, and the one at the end."""
    fresh = log["eyes.fresh"]
    stamps, times = log["eyes.stamp"][fresh], log.times("eyes.stamp")[fresh]
    found = [Gap(stamps[at], times[at + 1]) for at in np.flatnonzero(np.diff(stamps) > longer)]
    return [*found, Gap(stamps[-1], np.inf)]


def test_01_the_camera_comes_again_by_itself_after_each_loss(flown: Flown) -> None:
    short, away, long, end = gaps(flown.log, 0.45)[-4:]
    assert SHORT - PERIOD < short.next - short.last < away.next - away.last + SHORT
    assert away.next - away.last > AWAY - PERIOD
    assert LONG - PERIOD < long.next - long.last < LONG + 10.0 and end.next == np.inf
    status, times = flown.log["eyes.status"], flown.log.times("eyes.status")
    for before, after in zip((short, away, long), (away, long, end), strict=True):
        between = status[(times >= before.next) & (times <= after.last)]
        assert len(between) > 5 and (between == GOOD).mean() > 0.8
    assert flown.log["eyes.refused"][-1] <= 3  # half a picture, where a connection ended


def test_01_vision_is_stale_within_three_periods_and_the_failsafe_knows_it(flown: Flown) -> None:
    state, stale = (flown.log[f"supervision/vision.{name}"] for name in ("state", "stale"))
    times = flown.log.times("supervision/vision.state")
    for gap in gaps(flown.log, 0.45)[-4:]:
        rows = (times > gap.last + 3 * PERIOD) & (times < gap.next)
        assert rows.any() and (state[rows] != FRESH).all() and stale[rows].all()


def test_01_the_craft_coasts_is_kept_level_and_lands_and_stays_down(flown: Flown) -> None:
    mode, times = flown.log["supervision/failsafe.mode"], flown.log.times("supervision/failsafe.mode")
    short, away, long, _ = gaps(flown.log, 0.45)[-4:]
    for gap in (short, away):
        inside = mode[(times > gap.last + 3 * PERIOD) & (times < gap.next)]
        assert set(inside.tolist()) == {COASTING}
    between = mode[(times > short.next) & (times < away.last)]
    assert between[-1] == AUTOMATIC
    inside = (times > long.last + 3 * PERIOD) & (times < long.next)
    order = mode[inside][np.flatnonzero(np.diff(mode[inside], prepend=-1))]
    assert order.tolist() == [COASTING, LEVELLED, LANDING]
    first = {kind: times[inside & (mode == kind)][0] - long.last for kind in (LEVELLED, LANDING)}
    assert LEVEL < first[LEVELLED] < LEVEL + 0.5 and LAND < first[LANDING] < LAND + 0.5
    assert (mode[times > long.next] == LANDING).all()
    assert flown.log["supervision/landing.landed"][-1]
    assert flown.height < 0.3


def test_01_a_flight_without_its_camera_says_so(flown: Flown) -> None:
    assert flown.code == 1, flown.told
    assert (
        "block 'eyes'" in flown.told
        and "does not answer" in flown.told
        or "no pictures any more" in flown.told
    )
    no_trace(flown.told)
    assert flown.log.summary.get("expect 1", "").startswith("NOT MET"), flown.log.summary
