"""Fault 1: a camera that is silent, hangs up, is silent for half a minute, and is gone for good."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from quadvis.machine.capture import GOOD
from quadvis_blocks.supervision.failsafe import AUTOMATIC, COASTING, LANDING, LEVELLED
from tests.faults.bench import no_trace
from tests.faults.camera_losses import AWAY, LONG, PERIOD, SHORT, CameraLosses, fly
from tests.processes import linux

pytestmark = [pytest.mark.faults, pytest.mark.slow, linux]

FRESH, COAST = 0, 1
LAND, LEVEL = 5.0, 4.5  # s without vision: see supervision in flight.yaml


def test_01_a_flight_survives_its_camera_and_says_that_it_is_lost(tmp_path: Path) -> None:
    flown = fly(tmp_path)
    the_camera_comes_again_by_itself(flown)
    vision_is_stale_within_three_periods(flown)
    the_craft_coasts_is_kept_level_and_lands(flown)
    it_says_so(flown)


def the_camera_comes_again_by_itself(flown: CameraLosses) -> None:
    """Check that there are pictures after each loss."""
    short, away, long, end = flown.gaps()[-4:]
    assert SHORT - PERIOD < short.next - short.last < away.next - away.last + SHORT
    assert away.next - away.last > AWAY - PERIOD
    assert LONG - PERIOD < long.next - long.last < LONG + 10.0 and end.next == np.inf
    status, times = flown.log["eyes.status"], flown.log.times("eyes.status")
    for before, after in zip((short, away, long), (away, long, end), strict=True):
        between = status[(times >= before.next) & (times <= after.last)]
        assert len(between) > 5 and (between == GOOD).mean() > 0.8
    assert flown.log["eyes.refused"][-1] <= 3  # half a picture, where a connection ended


def vision_is_stale_within_three_periods(flown: CameraLosses) -> None:
    """Check what is known of vision after each loss."""
    state, stale = (flown.log[f"supervision/vision.{name}"] for name in ("state", "stale"))
    times = flown.log.times("supervision/vision.state")
    for gap in flown.gaps()[-4:]:
        rows = (times > gap.last + 3 * PERIOD) & (times < gap.next)
        assert rows.any() and (state[rows] != FRESH).all() and stale[rows].all()


def the_craft_coasts_is_kept_level_and_lands(flown: CameraLosses) -> None:
    """Check the modes of the failsafe, and that it stays down."""
    mode, times = flown.log["supervision/failsafe.mode"], flown.log.times("supervision/failsafe.mode")
    short, away, long, _ = flown.gaps()[-4:]
    for gap in (short, away):
        inside = mode[(times > gap.last + 3 * PERIOD) & (times < gap.next)]
        assert set(inside.tolist()) == {COASTING}
    between = mode[(times > short.next) & (times < away.last)]
    assert (between == AUTOMATIC).any()
    inside = (times > long.last + 3 * PERIOD) & (times < long.next)
    order = mode[inside][np.flatnonzero(np.diff(mode[inside], prepend=-1))]
    assert order.tolist() == [COASTING, LEVELLED, LANDING]
    first = {kind: times[inside & (mode == kind)][0] - long.last for kind in (LEVELLED, LANDING)}
    assert LEVEL < first[LEVELLED] < LEVEL + 0.5 and LAND < first[LANDING] < LAND + 0.5
    assert (mode[times > long.next] == LANDING).all()
    assert flown.log["supervision/landing.landed"][-1]
    assert flown.height < 0.3


def it_says_so(flown: CameraLosses) -> None:
    """Check the end of a flight that has no camera any more."""
    assert flown.code == 1, flown.told
    assert (
        "block 'eyes'" in flown.told and "does not answer" in flown.told
    ) or "no pictures any more" in flown.told
    no_trace(flown.told)
