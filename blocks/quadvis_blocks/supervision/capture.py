"""The reference taken from the position of the craft."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from quadvis.block import Block, In, Out, Param, State, Work, copied
from quadvis_blocks._angles import wrapped

COLLECTIVE, ROLL, PITCH, YAW = range(4)


class Capture(Block):
    """A reference that is shifted to the craft when the control law takes over.

    ============================================================= =================================
    event                                                         the reference takes the craft's
    ============================================================= =================================
    the collective becomes automatic                              height
    roll or pitch becomes automatic                               x and y
    yaw becomes automatic                                         heading
    vision comes back (``rearmed``) with the craft further than   x and y
    ``distance`` from x and y of the shifted reference
    ============================================================= =================================

    The shift stays, so a moving reference moves on from the position of the craft. With a ``return_speed``
    the shift of the position shrinks at that speed; the shift of the heading stays.
    """

    distance = Param(0.5, unit="m", min=0.0, tune=True, doc="error above which ``rearmed`` takes x and y")
    return_speed = Param(
        0.0, unit="m/s", min=0.0, tune=True, doc="speed at which the shift shrinks; 0: never"
    )
    position_reference = In("float64[3]", unit="m", doc="where to be: x, y, h")
    velocity_reference = In(
        "float64[3]", unit="m/s", default=(0.0, 0.0, 0.0), doc="rate of change of the position reference"
    )
    heading_reference = In(unit="rad", doc="heading to hold")
    position = In("float64[3]", unit="m", doc="where the craft is: x, y, h")
    heading = In(unit="rad", doc="heading of the craft")
    engaged = In("bool[4]", doc="channels that the law takes over at this tick: collective, roll, pitch, yaw")
    rearmed = In("bool", default=False, doc="true at the tick at which vision comes back")
    shifted_position = Out("float64[3]", unit="m", doc="where to be: x, y, h")
    shifted_velocity = Out("float64[3]", unit="m/s", doc="rate of change of the shifted position")
    shifted_heading = Out(unit="rad", doc="heading to hold, in (-pi, pi]")
    captured = Out("bool", doc="whether x and y are taken from the craft at this tick")
    shift = State("float64[3]")
    turn = State()
    shift_now = Work("float64[3]")
    turn_now = Work()
    away = Work(unit="m")  # length of the shift

    example = """
        wish:
          block: sources.table
          rate: fast
          with:
            times: {value: [0, 0.5, 0.51], unit: s}
            values: [[0, 0, 0, 0], [1, 1, 1, 1], [0, 0, 0, 0]]
            interpolation: hold
        on: {block: math.convert, rate: fast, with: {takes: float64, gives: bool}, in: {u: wish.y}}
        capture:
          block: supervision.capture
          rate: fast
          in:
            position_reference: {value: [0, 0, 1.5], unit: m}
            heading_reference: 0 rad
            position: {value: [0.4, 0, 1.2], unit: m}
            heading: 10 deg
            engaged: on.y
    """

    def output(
        self, position_reference: Any, velocity_reference: Any, heading_reference: float, position: Any,
        heading: float, engaged: Any, rearmed: bool,
    ) -> tuple[Any, Any, float, bool]:  # fmt: skip
        """Return the shifted reference, and whether x and y are taken from the craft now."""
        shift, taken = _shifted(self.shift, position - position_reference, engaged, rearmed, self.distance)
        away = _length(shift)
        self.shift_now = shift
        self.away = away
        speed = min(self.return_speed, away / self.period)
        velocity = velocity_reference - shift * (speed / away) if away > 0.0 else copied(velocity_reference)
        self.turn_now = heading - heading_reference if engaged[YAW] else self.turn
        return position_reference + shift, velocity, wrapped(heading_reference + self.turn_now), taken

    def update(self) -> None:
        """Keep the shift, and let it shrink by one period of ``return_speed``."""
        step = min(self.return_speed * self.period, self.away)
        self.shift = self.shift_now * (1.0 - step / self.away if self.away > 0.0 else 1.0)
        self.turn = self.turn_now


def _shifted(shift: Any, error: Any, engaged: Any, rearmed: bool, distance: float) -> tuple[Any, bool]:
    """Return the shift after the captures of this tick, and whether x and y were captured."""
    taken = engaged[ROLL] or engaged[PITCH]
    if rearmed:
        x, y = error[0] - shift[0], error[1] - shift[1]
        taken = taken or math.sqrt(x * x + y * y) > distance
    x, y = (error[0], error[1]) if taken else (shift[0], shift[1])
    return np.array((x, y, error[2] if engaged[COLLECTIVE] else shift[2])), taken


def _length(shift: Any) -> float:
    return math.sqrt(shift[0] * shift[0] + shift[1] * shift[1] + shift[2] * shift[2])
