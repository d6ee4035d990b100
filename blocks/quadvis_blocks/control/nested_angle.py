"""Nested saturations for a craft that a flight controller levels: the angle that it is to take."""

from __future__ import annotations

from quadvis.block import Block, In, Out, Param, saturated
from quadvis_blocks._craft import GRAVITY

ROLL, PITCH = range(2)


class NestedAngle(Block):
    """Roll (or pitch) angle that brings a lateral position to its reference.

    It is the angle at which `control.nested_saturation` would ask for no torque of a craft that does not
    turn: with the same bandwidth lambda, amplitudes and x1, x2, the one solution phi of::

        phi + s3(2 phi + lambda x2 + s4(3 phi + 3 lambda x2 + lambda^2 x1)) = 0

    So the gains are those of that law, and its limits hold: |angle| <= M3, and in the end |velocity| <= g M4
    / lambda. Near the reference, angle = -(4 lambda x2 + lambda^2 x1) / 6. If the flight controller takes the
    angle at once, the poles are those of s^2 + 2/3 lambda s + lambda^2 / 6: lambda / sqrt(6) with a damping
    of 0.82. The law asks for an angle loop that is at least as fast as its own, 1.5 lambda.

    ``angle_reference`` is added: the angle that balances a known disturbance.

    Source: equations (22) and (23), without the two stages that the flight controller has.
    Error: an angle error b leaves a position error of 6 g b / lambda^2.
    """

    axis = Param("roll", choices=("roll", "pitch"), doc="roll moves the craft along y, pitch along -x")
    bandwidth = Param(
        2.0, unit="rad/s", above=0.0, tune=True, shown=True, doc="lambda of the law; 1 in the paper"
    )
    amplitudes = Param(
        (0.4, 0.19), type="float64[2]", unit="rad", above=0.0, tune=True,
        doc="M3, M4: the angle, and speed * lambda / g",
    )  # fmt: skip
    gravity = Param(GRAVITY, unit="m/s^2", above=0.0, doc="g")
    position = In(unit="m", doc="y for roll, x for pitch")
    velocity = In(unit="m/s", doc="rate of change of the position")
    position_reference = In(unit="m", default=0.0, doc="where to go")
    velocity_reference = In(unit="m/s", default=0.0, doc="rate of change of the reference")
    angle_reference = In(unit="rad", default=0.0, doc="angle that balances a known disturbance, such as wind")
    angle = Out(unit="rad", doc="the angle to take")

    example = """
        place: {block: sources.sine, rate: fast, with: {amplitude: 1 m, frequency: 0.5 Hz}}
        speed: {block: signal.derivative, rate: fast, in: {u: place.y}}
        law:
          block: control.nested_angle
          rate: fast
          with: {axis: roll, bandwidth: 2 rad/s}
          in: {position: place.y, velocity: speed.rate}
    """

    def output(
        self,
        position: float,
        velocity: float,
        position_reference: float,
        velocity_reference: float,
        angle_reference: float,
    ) -> float:
        """Return the angle."""
        bandwidth, most, far = self.bandwidth, self.amplitudes[0], self.amplitudes[1]
        sign = 1.0 if self.axis == ROLL else -1.0
        x1 = sign * bandwidth * bandwidth * ((position - position_reference) / self.gravity)
        x2 = sign * bandwidth * ((velocity - velocity_reference) / self.gravity)
        angle = -(4.0 * x2 + x1) / 6.0
        distance = 3.0 * angle + 3.0 * x2 + x1
        if abs(distance) > far:
            angle = -(x2 + saturated(distance, far)) / 3.0
        return float(saturated(angle, most)) + angle_reference
