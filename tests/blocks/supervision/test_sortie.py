from typing import Any

import numpy as np
import pytest

from quadvis.testing import Driven, drive
from quadvis_blocks.supervision.sortie import Sortie

WAIT, SPIN, CLIMB, STAY, LAND, STAND, END = range(7)
STEPS = 400  # 20 s


def flown(armed: Any = True, landed: Any = False, target: Any = (0.3, -0.2, 1.5), **given: Any) -> Driven:
    block = Sortie(**{"stay": 5.0, "climb": 0.5, "wait": 2.0, "spin": 1.0, "settle": 1.0, **given})
    return drive(block, rate="20 Hz", steps=STEPS, target=target, armed=armed, landed=landed)


def begins(found: Driven) -> dict[int, float]:
    """Return the time (s) at which each phase begins."""
    return {int(phase): np.argmax(found.phase == phase) / 20 for phase in np.unique(found.phase)}


def series(*switches: float, first: bool = False) -> list[bool]:
    """Return a truth value for each step, which changes at some times (s)."""
    times = np.arange(STEPS) / 20
    return [bool(first ^ (sum(time >= switch for switch in switches) % 2)) for time in times]


def test_a_whole_flight_goes_from_the_ground_to_the_ground() -> None:
    found = flown(armed=series(2.5, 15.0), landed=series(14.0))
    # Each phase goes on at the tick after the one at which it is over.
    assert begins(found) == pytest.approx(
        {WAIT: 0.0, SPIN: 2.05, CLIMB: 3.1, STAY: 6.15, LAND: 11.2, STAND: 14.05, END: 15.1}
    )
    assert (np.diff(found.phase) >= 0).all()
    assert (found.arm == np.isin(found.phase, [SPIN, CLIMB, STAY, LAND, STAND])).all()
    assert (found.idle == np.isin(found.phase, [WAIT, SPIN, STAND, END])).all()
    assert (found.land == (found.phase == LAND)).all()


def test_the_reference_stands_on_the_ground_rises_at_its_speed_and_stays_at_the_target() -> None:
    found = flown(armed=series(2.5, 15.0), landed=series(14.0), ground=0.1)
    height, climbs = found.position[:, 2], found.phase == CLIMB
    assert found.position[:, :2] == pytest.approx(np.tile([0.3, -0.2], (STEPS, 1)))
    assert height[found.idle] == pytest.approx(0.1)
    assert height[np.isin(found.phase, [STAY, LAND])] == pytest.approx(1.5)
    assert np.diff(height[climbs]) == pytest.approx(0.5 / 20)
    assert found.velocity[climbs, 2] == pytest.approx(0.5) and found.velocity[~climbs] == pytest.approx(0.0)


def test_it_does_not_take_off_before_the_flight_controller_has_armed() -> None:
    found = flown(armed=series(9.0))
    assert begins(found)[CLIMB] == pytest.approx(9.05)
    assert flown(armed=False).phase.max() == SPIN


@pytest.mark.parametrize("phase", [CLIMB, STAY, LAND])
def test_a_craft_that_is_no_longer_armed_is_not_flown(phase: int) -> None:
    when = {CLIMB: 4.0, STAY: 8.0, LAND: 12.0}[phase]
    found = flown(armed=series(when, first=True))
    assert found.phase[round(20 * when)] == phase
    assert set(found.phase[round(20 * when) + 1 :]) <= {STAND, END} and found.phase[-1] == END


def test_a_craft_that_touches_down_by_itself_is_switched_off() -> None:
    found = flown(landed=series(7.0))
    assert begins(found)[STAND] == pytest.approx(7.05) and found.phase[-1] == END and not found.arm[-1]


def test_a_target_below_the_reference_ends_the_climb_at_once() -> None:
    found = flown(target=(0.0, 0.0, -1.0))
    assert (found.phase == CLIMB).sum() == 1
