"""What is done when something that the control laws need is missing."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import Block, In, Out, Param, State, Work
from quadvis_blocks.supervision._vision import COAST, FRESH, LEVEL, REARMING
from quadvis_blocks.supervision._vision import LAND as LOST

ROLL, PITCH = 1, 2
TO_LAND, TO_MANUAL = range(2)
NEUTRAL, PILOT = range(2)
ZERO, KEEP = range(2)
MANUAL, MIXED, AUTOMATIC, COASTING, LEVELLED, LANDING = range(6)
NONE, SWITCH, STICK, IMU_STALE, STICKS_STALE = range(5)
OF_VISION = 4  # what is added to the first reasons of vision
ASKED, SATURATED = 8, 9
MORE_OF_VISION = 6  # what is added to the others


class Failsafe(Block):
    """Who has each channel, how much vision counts, and whether to land.

    - Vision not FRESH: positions count as long as it coasts, and less and less over ``blend`` once it is
      LEVEL; velocities not at all while the frames are stale (``coast_velocity: keep`` for an estimator that
      reckons on by itself). When vision is FRESH again both come back over ``blend``.
    - Vision given up (LAND): descend, and go on to the ground even if vision comes back; or hand all channels
      to the pilot (``on_loss: manual``) until he has switched them off and on, but descend while his sticks
      are stale. ``land`` above 0.5 asks for the same at any time. Taking the collective in hand ends it.
    - IMU stale: no automatic roll and pitch. They are neutral; with ``imu_lost: pilot``, right for a craft
      that levels itself, they are the pilot's, if his sticks are not stale.

    Modes: 0 MANUAL (no channel automatic), 1 MIXED (some), 2 AUTOMATIC (all), and with any channel automatic
    3 COAST, 4 LEVEL, 5 LAND. Reasons, the first that holds: in LAND what began it; 3 IMU stale; of vision 5
    no new frames, 6 target not found, 7 not enough good frames yet, 10 frames frozen, 11 stamps ahead, back
    or NaN, 12 their clock started again, 13 a contradiction to the inertial unit; 2 a stick took a channel
    back; 4 sticks stale; 1 a switch is off; 9 a control gave way in the mixer; 0 none. 8: landing was asked
    for.

    ``freeze`` is for integrators and disturbance estimates: channels that the law does not have, or on which
    it does not get what it wants.
    """

    on_loss = Param("land", choices=("land", "manual"), doc="what to do when vision is given up")
    imu_lost = Param("neutral", choices=("neutral", "pilot"), doc="whose roll and pitch are without an IMU")
    coast_velocity = Param("zero", choices=("zero", "keep"), doc="velocities while frames are stale")
    blend = Param(1.0, unit="s", above=0.0, tune=True, doc="time over which positions come and go")
    automatic = In("bool[4]", doc="channels that the pilot leaves to the law: collective, roll, pitch, yaw")
    overridden = In("bool[4]", default=(False,) * 4, doc="channels that a stick took back")
    vision = In("int64", default=FRESH, doc="state of vision: 0 FRESH, 1 COAST, 2 LEVEL, 3 LAND")
    vision_reason = In("int64", default=0, doc="why, as `supervision.vision_watchdog` says: 0 to 7")
    vision_stale = In("bool", default=False, doc="whether the last good frame is too old")
    imu_stale = In("bool", default=False, doc="whether the IMU's last news is too old")
    sticks_stale = In("bool", default=False, doc="whether the sticks' last news is too old")
    limited = In("bool[4]", default=(False,) * 4, doc="controls that gave way in the mixer")
    land = In(default=0.0, doc="above 0.5 asks for a landing")
    allowed = Out("bool[4]", doc="channels that the law has")
    neutral = Out("bool[4]", doc="channels held at neutral")
    engaged = Out("bool[4]", doc="channels that the law gets at this tick")
    freeze = Out("bool[4]", doc="channels whose integrators and disturbance estimates must stand still")
    position_weight = Out(doc="how much horizontal position and heading count, 0 to 1")
    velocity_weight = Out(doc="how much horizontal velocity counts, 0 to 1")
    blind = Out("bool", doc="whether vision does not count now: stale, or not FRESH again since LEVEL")
    descend = Out("bool", doc="whether to land")
    mode = Out("int64", doc="0 MANUAL, 1 MIXED, 2 AUTOMATIC, 3 COAST, 4 LEVEL, 5 LAND")
    reason = Out("int64", doc="why: 0 to 13, see above")
    had = State("bool[4]")
    begun = State("bool")
    landing = State("bool")
    cause = State("int64")
    given_up = State("bool")
    weight = State(init=1.0)
    had_now = Work("bool[4]")
    landing_now = Work("bool")
    cause_now = Work("int64")
    given_up_now = Work("bool")
    weight_now = Work()

    def output(
        self, automatic: Any, overridden: Any, vision: int, vision_reason: int, vision_stale: bool,
        imu_stale: bool, sticks_stale: bool, limited: Any, land: float,
    ) -> tuple[Any, Any, Any, Any, float, float, bool, bool, int, int]:  # fmt: skip
        """Return who has what, what counts, and why."""
        given_up = _given_up(self.given_up, self.on_loss, vision, sticks_stale, automatic)
        allowed = automatic & (not given_up)
        neutral = np.zeros(allowed.size, np.bool_)
        if imu_stale:
            nobody = self.imu_lost == NEUTRAL or sticks_stale
            allowed[ROLL], allowed[PITCH] = False, False
            neutral[ROLL], neutral[PITCH] = nobody, nobody
        descend, cause = _landing(self.landing, self.cause, allowed[0], vision, vision_reason, land)
        weight = _weight(self.weight, vision, self.period / self.blend)
        unknown = vision >= LEVEL or (vision_stale and self.coast_velocity == ZERO)
        reason = _reason(
            allowed.any() or given_up, automatic.all(), overridden.any(), vision_reason, imu_stale,
            sticks_stale, limited.any(),
        )  # fmt: skip
        self.had_now = allowed
        self.landing_now, self.cause_now = descend, cause
        self.given_up_now, self.weight_now = given_up, weight
        return (
            allowed,
            neutral,
            allowed & ~self.had & self.begun,
            limited | ~allowed,
            weight,
            0.0 if unknown else weight,
            vision_stale or vision >= LEVEL,
            descend,
            _mode(allowed, vision, descend),
            cause if descend else reason,
        )

    def update(self) -> None:
        """Keep the decisions that last."""
        self.had = self.had_now
        self.landing, self.cause = self.landing_now, self.cause_now
        self.given_up, self.weight = self.given_up_now, self.weight_now
        self.begun = True


def _given_up(given_up: bool, on_loss: int, vision: int, sticks_stale: bool, automatic: Any) -> bool:
    """Return whether all channels are the pilot's until he has switched them off and on."""
    if sticks_stale or not automatic.any():
        return False
    return given_up or (on_loss == TO_MANUAL and vision == LOST)


def _landing(
    landing: bool, cause: int, allowed: bool, vision: int, vision_reason: int, land: float
) -> tuple[bool, int]:
    """Return whether to land, and why."""
    if not allowed:
        return False, NONE
    if landing:
        return True, cause
    if vision == LOST:
        return True, _of_vision(max(vision_reason, 1))
    return land > 0.5, (ASKED if land > 0.5 else NONE)


def _weight(weight: float, vision: int, step: float) -> float:
    """Return how much positions count one step later."""
    return min(weight + step, 1.0) if vision <= COAST else max(weight - step, 0.0)


def _mode(allowed: Any, vision: int, descend: bool) -> int:
    if not allowed.any():
        return MANUAL
    if descend:
        return LANDING
    if vision == COAST:
        return COASTING
    if vision >= LEVEL:
        return LEVELLED
    return AUTOMATIC if allowed.all() else MIXED


def _of_vision(reason: int) -> int:
    """Return the failsafe's number of a reason of vision."""
    return reason + (OF_VISION if reason <= REARMING else MORE_OF_VISION)


def _reason(
    flown: bool, all_on: bool, overridden: bool, vision_reason: int, imu_stale: bool, sticks_stale: bool,
    limited: bool,
) -> int:  # fmt: skip
    """Return the first reason that holds; vision matters to a channel that the law has or had to give up."""
    if imu_stale:
        return IMU_STALE
    if flown and vision_reason > 0:
        return _of_vision(vision_reason)
    if overridden:
        return STICK
    if sticks_stale:
        return STICKS_STALE
    if not all_on:
        return SWITCH
    return SATURATED if limited else NONE
