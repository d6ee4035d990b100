"""Fault 1: a camera that is silent, hangs up, is silent for long, and is gone for good.

What is checked holds however late everybody is; how the craft comes down, if the world that is simulated by
the clock was in time.
"""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from quadvis.machine.capture import GOOD
from quadvis_blocks.supervision.failsafe import AUTOMATIC, COASTING, LANDING, LEVELLED
from tests.faults.bench import no_trace
from tests.faults.camera_losses import LONG, PERIOD, CameraLosses, fly
from tests.processes import linux
from tests.punctual import LATE, punctual
from tests.stages import mostly_slow

pytestmark = [pytest.mark.faults, linux]

FRESH, COAST = 0, 1
LAND, LEVEL = 5.0, 4.5  # s without vision: see supervision in flight.yaml


# For half a minute the camera is silent only if a person wants it: OpenCV would give up then by itself.
@pytest.mark.parametrize("silence", mostly_slow([12.0, LONG], quick=0, slow=1))
def test_01_a_flight_survives_its_camera_and_says_that_it_is_lost(silence: float, tmp_path: Path) -> None:
    flown = fly(tmp_path, silence)
    each_loss_is_a_time_without_pictures(flown)
    the_camera_comes_again_by_itself(flown)
    vision_is_stale_within_three_periods(flown)
    the_craft_coasts_is_kept_level_and_lands(flown)
    it_says_so(flown)


def each_loss_is_a_time_without_pictures(flown: CameraLosses) -> None:
    """Check that no picture is there that cannot be."""
    short, away, long, end = flown.gaps()
    for gap, (begin, again) in zip((short, away, long), flown.losses, strict=True):
        assert gap.next - gap.last > (again - begin) / 2  # pictures may have waited on their way
    assert short.next < away.last < away.next < long.last < long.next < end.last


def the_camera_comes_again_by_itself(flown: CameraLosses) -> None:
    """Check that there are pictures after each loss."""
    gaps = flown.gaps()
    status, times = flown.log["eyes.status"], flown.log.times("eyes.status")
    for before, after in pairwise(gaps):
        between = status[(times >= before.next) & (times <= after.last)]
        assert (between == GOOD).sum() > 5
    assert flown.log["eyes.refused"][-1] <= 3  # half a picture, where a connection ended


def vision_is_stale_within_three_periods(flown: CameraLosses) -> None:
    """Check what is known of vision after each loss."""
    state, stale = (flown.log[f"supervision/vision.{name}"] for name in ("state", "stale"))
    times = flown.log.times("supervision/vision.state")
    for gap in flown.gaps():
        rows = (times > gap.last + 3 * PERIOD) & (times < gap.next)
        assert rows.any() and (state[rows] != FRESH).all() and stale[rows].all()


def the_craft_coasts_is_kept_level_and_lands(flown: CameraLosses) -> None:
    """Check the modes of the failsafe, and that it stays down; in a late world vision is lost anyway."""
    mode, times = flown.log["supervision/failsafe.mode"], flown.log.times("supervision/failsafe.mode")
    short, away, long, _ = flown.gaps()
    lost = [(times > gap.last + 3 * PERIOD) & (times < gap.next) for gap in (short, away, long)]
    assert all((mode[inside] >= COASTING).all() and inside.any() for inside in lost)
    assert (mode[lost[-1] & (times > long.last + LAND + 0.5)] == LANDING).all()
    assert (mode[times > long.next] == LANDING).all()
    if flown.latest >= LATE or not punctual(flown.log, ("target/imu", "target/control")):
        return
    for inside in lost[:-1]:
        assert (mode[inside] == COASTING).all()
    between = mode[(times > short.next) & (times < away.last)]
    assert (between == AUTOMATIC).any()
    order = mode[lost[-1]][np.flatnonzero(np.diff(mode[lost[-1]], prepend=-1))]
    assert order.tolist() == [COASTING, LEVELLED, LANDING]
    first = {kind: times[lost[-1] & (mode == kind)][0] - long.last for kind in (LEVELLED, LANDING)}
    assert LEVEL < first[LEVELLED] < LEVEL + 0.5 and LAND < first[LANDING] < LAND + 0.5
    assert flown.log["supervision/landing.landed"][-1]
    assert flown.height < 0.3


def it_says_so(flown: CameraLosses) -> None:
    """Check the end of a flight that has no camera any more."""
    assert flown.code == 1, flown.told
    assert (
        "block 'eyes'" in flown.told and "does not answer" in flown.told
    ) or "no pictures any more" in flown.told
    no_trace(flown.told)
