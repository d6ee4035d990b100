"""Nested-saturation control of a lateral position through roll or pitch."""

from __future__ import annotations

from typing import Any

from quadvis.block import Block, In, Out, Param, saturated
from quadvis_blocks._craft import GRAVITY

ROLL, PITCH = range(2)


class NestedSaturation(Block):
    """Roll (or pitch) torque that brings a lateral position to its reference and keeps the angle small.

    Let lambda be the bandwidth, M1..M4 the amplitudes, and x1 to x4 a chain of four integrators:
    x1 = (y - y_ref) / g, x2 = dx1/dt, x3 = phi, x4 = dphi/dt. For pitch, x1 and x2 change sign, and phi is
    theta. The law is::

        torque = -lambda^2 s1(x4/lambda + s2(x3 + x4/lambda + s3(2 x3 + x4/lambda + lambda x2
                 + s4(x4/lambda + 3 x3 + 3 lambda x2 + lambda^2 x1))))

    where s_i holds its argument to [-M_i, M_i]. Near the reference the loop has four poles at -lambda; lambda
    = 1 is the paper's law to the bit. Always |torque| <= lambda^2 M1; in the end |angle| <= M3 and |velocity|
    <= g M4 / lambda. Sufficient for convergence: M1 > 2 M2, M2 > 2 M3, M3 > 2 M4. At 20 Hz with a camera at
    10 FPS a bandwidth of 1 to 2.5 rad/s works.

    Additions, and what each buys: the bandwidth scales time, so that errors shrink as below, and margins of
    delay as 1 / lambda. References let the craft go elsewhere. ``angle_reference`` and ``feedforward`` take
    the place of an integral: with estimates of wind and trim no lasting error is left. But these estimates
    close loops of their own through the inertial unit, and the faster they are compared with the law, the
    less of its margins is left. Unequal poles were tried in the hover of the diagrams and bought nothing.

    Source: equations (22) and (23); bandwidth and references are additions.
    Error: an angle error b leaves a position error of 6 g b / lambda^2; a torque error d leaves a position
    error of g d / lambda^4. ``angle_reference`` and ``feedforward`` remove the known part of these errors.
    """

    axis = Param("roll", choices=("roll", "pitch"), doc="roll moves the craft along y, pitch along -x")
    bandwidth = Param(
        2.0,
        unit="rad/s",
        above=0.0,
        tune=True,
        shown=True,
        doc="lambda, the place of the four poles; 1 in the paper",
    )
    amplitudes = Param(
        (2.0, 0.9, 0.4, 0.19), type="float64[4]", unit="rad", above=0.0, tune=True,
        doc="M1..M4, outermost first: torque / lambda^2, angular rate / lambda, angle, speed * lambda / g",
    )  # fmt: skip
    gravity = Param(GRAVITY, unit="m/s^2", above=0.0, doc="g")
    position = In(unit="m", doc="y for roll, x for pitch")
    velocity = In(unit="m/s", doc="rate of change of the position")
    angle = In(unit="rad", doc="roll or pitch angle")
    angular_rate = In(unit="rad/s", doc="rate of change of the angle")
    position_reference = In(unit="m", default=0.0, doc="where to go")
    velocity_reference = In(unit="m/s", default=0.0, doc="rate of change of the reference")
    angle_reference = In(unit="rad", default=0.0, doc="angle that balances a known disturbance, such as wind")
    feedforward = In(
        unit="rad/s^2", default=0.0, doc="torque that balances a known disturbance, added to the law's"
    )
    torque = Out(unit="rad/s^2", doc="torque divided by inertia: the wanted angular acceleration")
    level = Out("int64", doc="innermost saturated stage: 0 none, 1 the torque, 4 the position")

    example = """
        body:
          block: plant.lateral
          rate: continuous
          with: {initial_position: 0.5 m}
          in: {torque: {from: law.torque, across: hold}}
        law:
          block: control.nested_saturation
          rate: fast
          with: {axis: roll, bandwidth: 2 rad/s}
          in:
            position: {from: body.position, across: sample}
            velocity: {from: body.velocity, across: sample}
            angle: {from: body.angle, across: sample}
            angular_rate: {from: body.angular_rate, across: sample}
    """

    def output(
        self,
        position: float,
        velocity: float,
        angle: float,
        angular_rate: float,
        position_reference: float,
        velocity_reference: float,
        angle_reference: float,
        feedforward: float,
    ) -> tuple[float, int]:
        """Return the torque and the innermost saturated stage."""
        bandwidth, amplitudes = self.bandwidth, self.amplitudes
        sign = 1.0 if self.axis == ROLL else -1.0
        x1 = sign * bandwidth * bandwidth * ((position - position_reference) / self.gravity)
        x2 = sign * bandwidth * ((velocity - velocity_reference) / self.gravity)
        x3 = angle - angle_reference
        x4 = angular_rate / bandwidth
        s4 = x4 + 3.0 * x3 + 3.0 * x2 + x1
        s3 = 2.0 * x3 + x4 + x2 + saturated(s4, amplitudes[3])
        s2 = x3 + x4 + saturated(s3, amplitudes[2])
        s1 = x4 + saturated(s2, amplitudes[1])
        torque = -bandwidth * bandwidth * saturated(s1, amplitudes[0])
        return torque + feedforward, _innermost(abs(s1), abs(s2), abs(s3), abs(s4), amplitudes)


def _innermost(s1: float, s2: float, s3: float, s4: float, amplitudes: Any) -> int:
    if s4 > amplitudes[3]:
        return 4
    if s3 > amplitudes[2]:
        return 3
    if s2 > amplitudes[1]:
        return 2
    return 1 if s1 > amplitudes[0] else 0
