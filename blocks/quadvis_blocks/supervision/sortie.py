"""A flight from the ground to the ground."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import Block, In, Out, Param, State, Work, copied, reached

WAIT, SPIN, CLIMB, STAY, LAND, STAND, END = range(7)


class Sortie(Block):
    """The steps of a flight: arm, take off, stay, land, disarm.

    ===== ====== =================================================== ======= =========================
    phase name   goes on when                                        arm     reference
    ===== ====== =================================================== ======= =========================
    0     wait   ``wait`` is over                                    off     on the ground, idle
    1     spin   ``armed``, and ``spin`` is over                     on      on the ground, idle
    2     climb  the reference has reached the target                on      rises at ``climb``
    3     stay   ``stay`` is over                                    on      the target
    4     land   ``landed``                                          on      the target, ``land`` is 1
    5     stand  ``settle`` is over                                  on      on the ground, idle
    6     end    never                                               off     on the ground, idle
    ===== ====== =================================================== ======= =========================

    In phases 2 to 4 a craft that has landed or is no longer armed goes to phase 5, whatever the reason was.
    ``land`` is for `supervision.failsafe`, whose descent `supervision.landing` carries out and ends.
    """

    wait = Param(2.0, unit="s", min=0.0, doc="time before the arm switch")
    spin = Param(1.0, unit="s", min=0.0, doc="time with idle rotors before the take-off")
    climb = Param(0.4, unit="m/s", above=0.0, tune=True, doc="speed of the take-off")
    stay = Param(60.0, unit="s", min=0.0, tune=True, doc="time at the target")
    settle = Param(1.0, unit="s", min=0.0, doc="time on the ground with idle rotors before the arm switch")
    ground = Param(0.0, unit="m", doc="height of the craft when it stands on the ground")
    target = In("float64[3]", unit="m", doc="where to stay: x, y, h")
    armed = In("bool", default=True, doc="whether the flight controller has armed")
    landed = In("bool", doc="whether the craft has landed")
    phase = Out("int64", doc="phase of the flight, see above")
    arm = Out("bool", doc="whether the arm switch is on")
    idle = Out("bool", doc="whether the rotors idle")
    land = Out(doc="1 asks for a landing")
    position = Out("float64[3]", unit="m", doc="where to be: x, y, h")
    velocity = Out("float64[3]", unit="m/s", doc="rate of change of the position")
    step = State("int64")
    since = State(unit="s")  # when this phase began
    height = State(unit="m")  # of the reference while it climbs
    place = Work("float64[3]", unit="m")

    example = """
        sortie:
          block: supervision.sortie
          rate: fast
          with: {wait: 0.2 s, spin: 0.2 s, climb: 4 m/s, stay: 0.1 s}
          in: {target: {value: [0, 0, 1.5], unit: m}, landed: false}
    """

    def start(self) -> None:
        """Stand on the ground."""
        self.height = self.ground

    def output(self, target: Any) -> tuple[int, bool, bool, float, Any, Any]:
        """Return the phase and what it asks for."""
        step = self.step
        idle = step in (WAIT, SPIN, STAND, END)
        where = copied(target)
        where[2] = self.height if step == CLIMB else (self.ground if idle else target[2])
        pace = np.zeros(3)
        pace[2] = self.climb if step == CLIMB else 0.0
        self.place = where
        return step, SPIN <= step <= STAND, idle, 1.0 if step == LAND else 0.0, where, pace

    def update(self, target: Any, armed: bool, landed: bool, time: float) -> None:
        """Go on to the next phase when this one is over."""
        step, spent = self.step, time - self.since
        following = step
        if step == WAIT and reached(spent, self.wait):
            following = SPIN
        elif step == SPIN and armed and reached(spent, self.spin):
            following = CLIMB
        elif step == CLIMB:
            self.height = min(self.place[2] + self.climb * self.period, target[2])
            if self.height >= target[2]:
                following = STAY
        elif step == STAY and reached(spent, self.stay):
            following = LAND
        elif step == STAND and reached(spent, self.settle):
            following = END
        if CLIMB <= step <= LAND and (landed or not armed):
            following = STAND
        if following != step:
            self.since = time + self.period
            self.step = following
