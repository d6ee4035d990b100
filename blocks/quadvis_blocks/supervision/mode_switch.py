"""The switch between the pilot's controls and the automatic ones."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from quadvis.block import Block, In, Out, Param, State, Work
from quadvis_blocks._craft import GRAVITY, MASS

CHANNELS = 4
MANUAL, AUTOMATIC, NEUTRAL, IDLE = range(4)


class ModeSwitch(Block):
    """Each control from the pilot or from the control law, without a jump when it changes hands.

    At the tick at which a channel changes hands, its output keeps its last value, to the bit. The difference
    from the new source becomes an offset. The offset decays exponentially: with time constant
    ``to_automatic`` if the law takes over, with ``to_manual`` if the pilot takes over or the channel becomes
    neutral. Every change of the new source from that tick on passes through at once. So the pilot has full
    authority from the first moment; only the difference in trim fades out. With ``to_manual: 0`` there is no
    offset: the output jumps by the difference. ``idle``, for a craft on the ground, takes effect at once.
    Precedence: ``idle``, ``neutral``, ``automatic``.

    Source: section 4 ("the four control inputs can independently operate in either manual or automatic
    modes"); the transfer is an addition.
    """

    to_automatic = Param(
        0.5, unit="s", min=0.0, tune=True, doc="time constant of the transfer to the law; 0 jumps"
    )
    to_manual = Param(
        0.2, unit="s", min=0.0, tune=True, doc="time constant of the transfer to pilot or neutral; 0 jumps"
    )
    weight = Param(
        MASS * GRAVITY, unit="N", min=0.0, tune=True, doc="collective at neutral: m g; torques are 0"
    )
    idle_thrust = Param(0.0, unit="N", min=0.0, tune=True, doc="collective when idle; torques are 0")
    manual = In(
        "float64[4]",
        unit="N rad/s^2 rad/s^2 rad/s^2",
        doc="the pilot's controls: collective; roll, pitch and yaw torque over inertia",
    )
    collective = In(unit="N", doc="collective thrust of the control law")
    roll = In(unit="rad/s^2", doc="roll torque of the control law")
    pitch = In(unit="rad/s^2", doc="pitch torque of the control law")
    yaw = In(unit="rad/s^2", doc="yaw torque of the control law")
    automatic = In("bool[4]", doc="channels that the law has, not the pilot: collective, roll, pitch, yaw")
    neutral = In(
        "bool[4]", default=(False, False, False, False), doc="channels that neither of them has: neutral"
    )
    idle = In("bool", default=False, doc="true to let all rotors idle")
    controls = Out(
        "float64[4]",
        unit="N rad/s^2 rad/s^2 rad/s^2",
        doc="controls for the mixer: collective; roll, pitch and yaw torque over inertia",
    )
    source = Out("int64[4]", doc="source of each control: 0 pilot, 1 control law, 2 neutral, 3 idle")
    stamp = Out(unit="s", doc="instant at which the controls were made: now")
    last = State("float64[4]")
    offset = State("float64[4]")
    owner = State("int64[4]")
    begun = State("bool")
    given = Work("float64[4]")
    apart = Work("float64[4]")  # output minus the value that the owner wants
    owner_now = Work("int64[4]")

    example = """
        wish:
          block: sources.table
          rate: fast
          with: {times: {value: [0, 0.3], unit: s}, values: [[0, 0, 0, 0], [1, 1, 1, 1]], interpolation: hold}
        on: {block: math.convert, rate: fast, with: {takes: float64, gives: bool}, in: {u: wish.y}}
        controls:
          block: supervision.mode_switch
          rate: fast
          in:
            manual: {value: [5.2, 0.3, 0, 0], unit: N rad/s^2 rad/s^2 rad/s^2}
            collective: 4.9 N
            roll: 0 rad/s^2
            pitch: 0 rad/s^2
            yaw: 0 rad/s^2
            automatic: on.y
    """

    def output(
        self,
        manual: Any,
        collective: float,
        roll: float,
        pitch: float,
        yaw: float,
        automatic: Any,
        neutral: Any,
        idle: bool,
        time: float,
    ) -> tuple[Any, Any, float]:
        """Return the controls, their sources and the time."""
        law = np.array((collective, roll, pitch, yaw))
        given, apart, owners = self.given, self.apart, self.owner_now
        for channel in range(CHANNELS):
            owner = _owner(automatic[channel], neutral[channel], idle)
            value = _value(owner, channel, manual, law, self.weight, self.idle_thrust)
            smooth = self.begun and _time_constant(owner, self.to_automatic, self.to_manual) > 0.0
            changed = owner != self.owner[channel]
            given[channel], apart[channel] = _handed(
                value, smooth, changed, self.last[channel], self.offset[channel]
            )
            owners[channel] = owner
        return given, owners, time

    def update(self) -> None:
        """Keep the offset, which a change of hands has made, and let it decay."""
        for channel in range(CHANNELS):
            constant = _time_constant(self.owner_now[channel], self.to_automatic, self.to_manual)
            fading = math.exp(-self.period / constant) if constant > 0.0 else 0.0
            self.offset[channel] = self.apart[channel] * fading
        self.last = self.given
        self.owner = self.owner_now
        self.begun = True


def _owner(automatic: bool, neutral: bool, idle: bool) -> int:
    """Return the owner of a channel."""
    if idle:
        return IDLE
    if neutral:
        return NEUTRAL
    return AUTOMATIC if automatic else MANUAL


def _value(owner: int, channel: int, manual: Any, law: Any, weight: float, idle_thrust: float) -> float:
    """Return the value that the owner wants on a channel."""
    if owner == AUTOMATIC:
        return float(law[channel])
    if owner == MANUAL:
        return float(manual[channel])
    if channel > 0:
        return 0.0
    return idle_thrust if owner == IDLE else weight


def _time_constant(owner: int, to_automatic: float, to_manual: float) -> float:
    """Return the time constant of the transfer to an owner; 0 if the owner counts at once."""
    if owner == IDLE:
        return 0.0
    return to_automatic if owner == AUTOMATIC else to_manual


def _handed(value: float, smooth: bool, changed: bool, last: float, offset: float) -> tuple[float, float]:
    """Return a control, and its offset from the value that its owner wants."""
    if not smooth:
        return value, 0.0
    if changed:
        return last, last - value
    return value + offset, offset
