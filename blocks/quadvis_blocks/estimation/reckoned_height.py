"""The height of a craft whose camera sees nothing."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from quadvis.block import Block, In, Out, Param, State
from quadvis_blocks._craft import DRAG, GRAVITY, MASS, MOTOR_LAG
from quadvis_blocks._stamps import NEWS, RESTART, SIZE, begin, note


class ReckonedHeight(Block):
    """Position and velocity as measured; while blind, height and climb from the commanded thrust.

    A model runs all the time: ``m h'' = u cos(roll) cos(pitch) - m g - drag h' + m trim``, with the lag of
    the motors. Each new frame corrects height and climb by a fading memory. It corrects the trim much more
    slowly, so that the trim includes a constant error of the thrust, but not gusts. While ``blind``, height
    and climb come from the model alone; horizontal position and velocity pass unchanged.

    Error while blind: an error e of the climb at the beginning gives an error of the height of e m / drag in
    the end; an error d of the trim gives d t^2 / 2.
    """

    bandwidth = Param(
        4.0, unit="rad/s", above=0.0, tune=True, shown=True, doc="how fast the model follows the frames"
    )
    trim_bandwidth = Param(
        0.1, unit="rad/s", min=0.0, tune=True, doc="how fast the trim follows; slower than gusts"
    )
    mass = Param(MASS, unit="kg", above=0.0, tune=True, doc="mass of the craft; default: Draganfly IV")
    drag = Param(DRAG, unit="N*s/m", min=0.0, tune=True, doc="drag force over the speed through the air")
    lag = Param(MOTOR_LAG, unit="s", above=0.0, tune=True, doc="time constant of a motor")
    gravity = Param(GRAVITY, unit="m/s^2", above=0.0, doc="g")
    lowest = Param(
        -10.0, unit="m", tune=True, doc="height where the model stops sinking, when the rotors idle"
    )
    restart = Param(
        RESTART,
        unit="s",
        above=0.0,
        tune=True,
        doc="how long a restarted clock must run before its stamps count",
    )
    position = In("float64[3]", unit="m", doc="measured position: x, y, h")
    velocity = In("float64[3]", unit="m/s", doc="measured velocity")
    stamp = In(unit="s", doc="instant of the newest frame; NaN before the first")
    blind = In("bool", doc="whether the measured height does not count")
    collective = In(unit="N", doc="commanded collective thrust of the rotors")
    roll = In(unit="rad", doc="roll angle")
    pitch = In(unit="rad", doc="pitch angle")
    known_position = Out("float64[3]", unit="m", doc="x, y, and the height that counts")
    known_velocity = Out("float64[3]", unit="m/s", doc="rates of x and y, and the climb that counts")
    trim = Out(unit="m/s^2", doc="upward acceleration that the thrust does not explain")
    h = State(unit="m")
    climb = State(unit="m/s")
    excess = State(unit="m/s^2")
    lift = State(unit="N")
    last = State(unit="s")
    stamps = State(f"float64[{SIZE}]")

    example = """
        now: {block: sources.clock, rate: fast}
        blind: {block: logic.compare, rate: fast, with: {operator: ">="}, in: {a: now.y, b: 0.5 s}}
        height:
          block: estimation.reckoned_height
          rate: fast
          in:
            position: {value: [0, 0, 1.5], unit: m}
            velocity: {value: [0, 0, 0], unit: m/s}
            stamp: now.y
            blind: blind.y
            collective: 4.8 N
            roll: 0 rad
            pitch: 0 rad
    """

    def start(self) -> None:
        """Begin in a trimmed hover, without a frame."""
        begin(self.stamps)
        self.last = -math.inf
        self.lift = self.mass * self.gravity

    def output(self, position: Any, velocity: Any, blind: bool) -> tuple[Any, Any, float]:
        """Return position and velocity with the height and climb that count."""
        height = self.h if blind and self.last > -math.inf else position[2]
        climb = self.climb if blind else velocity[2]
        return (
            np.array((position[0], position[1], height)),
            np.array((velocity[0], velocity[1], climb)),
            self.excess,
        )

    def update(
        self,
        position: Any,
        stamp: float,
        blind: bool,
        collective: float,
        roll: float,
        pitch: float,
        time: float,
    ) -> None:
        """Correct the model by a new frame, and let it run for one period."""
        verdict, made = note(self.stamps, stamp, time, self.restart)
        if verdict == NEWS and not math.isnan(stamp) and not blind:
            if self.last == -math.inf:
                self.h = position[2]
            else:
                since, age = made - self.last, time - made
                keep = math.exp(-self.bandwidth * since)
                error = position[2] - (self.h - self.climb * age)
                forget = 1.0 - keep
                self.h += forget * (1.0 + keep) * error
                self.climb += forget * forget / since * error
                slow = -math.expm1(-self.trim_bandwidth * since)
                self.excess += slow * forget * forget / (since * since) * error
            self.last = made
        upright = math.cos(roll) * math.cos(pitch)
        force = self.lift * upright - self.drag * self.climb
        acceleration = force / self.mass - self.gravity + self.excess
        self.h += self.period * self.climb + 0.5 * self.period * self.period * acceleration
        self.climb += self.period * acceleration
        if self.h < self.lowest:
            self.h, self.climb = self.lowest, max(self.climb, 0.0)
        self.lift -= math.expm1(-self.period / self.lag) * (collective - self.lift)
