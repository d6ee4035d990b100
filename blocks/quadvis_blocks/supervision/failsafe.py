"""The reaction to the loss of a signal that the control laws need."""

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
OF_VISION = 4  # added to the reasons 1 to 3 of vision
ASKED, SATURATED = 8, 9
MORE_OF_VISION = 6  # added to the reasons 4 to 7 of vision


class Failsafe(Block):
    """Who has each channel, how much vision counts, and whether to land.

    - Vision is not FRESH. In COAST, positions still count; from LEVEL on, their weight falls to 0 over
      ``blend``. Velocities do not count while frames are stale, nor from LEVEL on. ``coast_velocity: keep``
      lets them count in COAST, for an estimator that continues by dead reckoning. When vision is FRESH again,
      both come back over ``blend``.
    - Vision is given up (LAND). The craft descends, and continues to the ground even if vision comes back.
      With ``on_loss: manual`` the pilot gets all channels instead, until he has switched them off and on;
      while his sticks are stale, the craft descends. ``land`` above 0.5 asks for a descent at any time. The
      descent ends when the pilot takes the collective.
    - The IMU is stale. Roll and pitch are not automatic but neutral. With ``imu_lost: pilot``, right for a
      craft that levels itself, the pilot has them, unless his sticks are stale.

    Modes: 0 MANUAL (no channel is automatic), 1 MIXED (some are), 2 AUTOMATIC (all are); while any channel is
    automatic, vision and landing give 3 COAST, 4 LEVEL, 5 LAND.

    In mode LAND the reason is the one that began the landing; 8 means that ``land`` asked for it. In all
    other modes the reason is the first line of this table that holds:

    ====== =========================================
    reason meaning
    ====== =========================================
    3      the IMU is stale
    5      no new frames
    6      the target is not found
    7      not enough good frames yet
    10     frames are frozen
    11     stamps are ahead of the time, back or NaN
    12     the camera's clock restarted
    13     frames contradict the inertial unit
    2      a stick took a channel back
    4      the sticks are stale
    1      a switch is off
    9      a control gave way in the mixer
    0      none of these
    ====== =========================================

    ``freeze`` stops integrators and disturbance estimates on the channels that the law does not have, and on
    the channels whose control gave way in the mixer.
    """

    on_loss = Param("land", choices=("land", "manual"), doc="what to do when vision is given up")
    imu_lost = Param("neutral", choices=("neutral", "pilot"), doc="who has roll and pitch without an IMU")
    coast_velocity = Param("zero", choices=("zero", "keep"), doc="velocities while frames are stale")
    blend = Param(1.0, unit="s", above=0.0, tune=True, doc="time in which positions fade out and in")
    automatic = In("bool[4]", doc="channels that the pilot leaves to the law: collective, roll, pitch, yaw")
    overridden = In("bool[4]", default=(False,) * 4, doc="channels that a stick took back")
    vision = In("int64", default=FRESH, doc="state of vision: 0 FRESH, 1 COAST, 2 LEVEL, 3 LAND")
    vision_reason = In("int64", default=0, doc="reason of `supervision.vision_watchdog` for it: 0 to 7")
    vision_stale = In("bool", default=False, doc="whether the last good frame is too old")
    imu_stale = In("bool", default=False, doc="whether the IMU's last news is too old")
    sticks_stale = In("bool", default=False, doc="whether the sticks' last news is too old")
    limited = In("bool[4]", default=(False,) * 4, doc="controls that gave way in the mixer")
    land = In(default=0.0, doc="above 0.5 asks for a landing")
    allowed = Out("bool[4]", doc="channels that the law has")
    neutral = Out("bool[4]", doc="channels held at neutral")
    engaged = Out("bool[4]", doc="channels that the law takes over at this tick")
    freeze = Out("bool[4]", doc="channels whose integrators and disturbance estimates must stand still")
    position_weight = Out(doc="weight of horizontal position and heading, 0 to 1")
    velocity_weight = Out(doc="weight of horizontal velocity, 0 to 1")
    blind = Out("bool", doc="whether vision does not count now: stale, or LEVEL or LAND")
    descend = Out("bool", doc="whether to land")
    mode = Out("int64", doc="0 MANUAL, 1 MIXED, 2 AUTOMATIC, 3 COAST, 4 LEVEL, 5 LAND")
    reason = Out("int64", doc="reason for the mode: 0 to 13, see above")
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

    example = """
        wish:
          block: sources.table
          rate: fast
          with: {times: {value: [0, 0.5], unit: s}, values: [[1, 1, 1, 1], [1, 0, 0, 1]], interpolation: hold}
        on: {block: math.convert, rate: fast, with: {takes: float64, gives: bool}, in: {u: wish.y}}
        failsafe: {block: supervision.failsafe, rate: fast, in: {automatic: on.y}}
    """

    def output(
        self, automatic: Any, overridden: Any, vision: int, vision_reason: int, vision_stale: bool,
        imu_stale: bool, sticks_stale: bool, limited: Any, land: float,
    ) -> tuple[Any, Any, Any, Any, float, float, bool, bool, int, int]:  # fmt: skip
        """Return the owners of the channels, the weights, the decision to land, mode and reason."""
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
    """Return whether the pilot has all channels until he has switched them off and on."""
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
    """Return the weight of positions one step later."""
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
    """Return the number that the failsafe gives to a reason of vision."""
    return reason + (OF_VISION if reason <= REARMING else MORE_OF_VISION)


def _reason(
    flown: bool, all_on: bool, overridden: bool, vision_reason: int, imu_stale: bool, sticks_stale: bool,
    limited: bool,
) -> int:  # fmt: skip
    """Return the first reason that holds; vision counts if the law has a channel or had to give it up."""
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
