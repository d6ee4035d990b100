"""The four-rotor craft: thrust commands in, motion out."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from quadvis.block import Block, In, Out, Param, ParameterError, Random, State, clip, random_signs
from quadvis_blocks._angles import wrapped
from quadvis_blocks._craft import ARM, DRAG, GRAVITY, INERTIA, MASS, MOTOR_LAG, THRUST_MAX, TORQUE_RATIO

PAPER, RIGID_BODY = range(2)
GIVEN, RANDOM = range(2)


class Rotorcraft(Block):
    """A four-rotor craft near hover: rotors with lag and limits, rigid body, linear drag against the wind.

    World: x forward, y right, h up; roll > 0 right side down, pitch > 0 nose up, yaw > 0 clockwise from
    above. Rotors: 0 front, 1 right, 2 rear, 3 left; front and rear turn counterclockwise seen from above.
    Each thrust follows its command, held to the limits and times ``thrust_scale``, with a first-order lag. u
    is the sum of the thrusts.
    The torques over inertia are l (f3 - f1) / Ix, l (f0 - f2) / Iy, c (f0 + f2 - f1 - f3) / Iz, each plus its
    ``torque_bias``. With ``bias_sign: random`` each bias is a size, and gets a random sign of its own at the
    start of a run. Other forces and torques on the craft, such as those of the ground or a tether, are the
    inputs ``force`` and ``torque``.

    Model ``paper``, equations (11)-(16): m x'' = -u sin(pitch), m y'' = u cos(pitch) sin(roll), m h'' = u
    cos(pitch) cos(roll) - m g, and the angles are double integrals of the torques (equation 14 with its
    missing dots). Yaw has no effect on x and y in this model, so x and y are axes that turn with the craft.
    Model ``rigid_body``: Newton-Euler with 3-2-1 angles; rates are those about the body axes. To first order
    in the tilt, at yaw 0, both models are the same.

    A run starts in a trimmed hover: every rotor carries a quarter of the weight. Only the output wraps yaw to
    (-pi, pi]; the state of yaw is not wrapped, so that no solver step jumps. Error: a pitch of +-90 deg is
    singular in ``rigid_body``.
    """

    model = Param("paper", choices=("paper", "rigid_body"), shown=True, doc="equations of motion")
    mass = Param(MASS, unit="kg", above=0.0, tune=True, doc="mass; default: Draganfly IV")
    arm = Param(ARM, unit="m", above=0.0, doc="l, from the centre to each rotor; default: Draganfly IV")
    inertia = Param(
        INERTIA, type="float64[3]", unit="kg*m^2", above=0.0, doc="about roll, pitch and yaw axis"
    )
    torque_ratio = Param(
        TORQUE_RATIO, unit="m", above=0.0, doc="c, drag torque of a rotor divided by its thrust"
    )
    lag = Param(MOTOR_LAG, unit="s", above=0.0, tune=True, doc="time constant of a motor")
    thrust_min = Param(0.0, unit="N", min=0.0, doc="least thrust of a rotor")
    thrust_max = Param(THRUST_MAX, unit="N", above=0.0, doc="greatest thrust of a rotor")
    thrust_scale = Param(
        (1.0, 1.0, 1.0, 1.0), type="float64[4]", above=0.0, tune=True,
        doc="thrust that each rotor gives over the thrust commanded: error of the thrust curve",
    )  # fmt: skip
    drag = Param(
        DRAG, unit="N*s/m", min=0.0, tune=True, doc="drag force divided by the speed through the air"
    )
    torque_bias = Param(
        (0.0, 0.0, 0.0),
        type="float64[3]",
        unit="rad/s^2",
        tune=True,
        doc="trim error about roll, pitch and yaw axis",
    )
    bias_sign = Param(
        "given", choices=("given", "random"), doc="random: each torque bias gets a random sign at the start"
    )
    gravity = Param(GRAVITY, unit="m/s^2", above=0.0, doc="g")
    initial_position = Param((0.0, 0.0, 0.0), type="float64[3]", unit="m", doc="x, y, h at the start")
    initial_velocity = Param((0.0, 0.0, 0.0), type="float64[3]", unit="m/s", doc="velocity at the start")
    initial_attitude = Param(
        (0.0, 0.0, 0.0), type="float64[3]", unit="rad", doc="roll, pitch, yaw at the start"
    )
    thrust = In("float64[4]", unit="N", doc="commanded thrust of each rotor: front, right, rear, left")
    wind = In("float64[3]", unit="m/s", default=(0.0, 0.0, 0.0), doc="velocity of the air along x, y, h")
    force = In(
        "float64[3]", unit="N", default=(0.0, 0.0, 0.0), doc="other force on the centre of mass along x, y, h"
    )
    torque = In(
        "float64[3]", unit="N*m", default=(0.0, 0.0, 0.0), doc="other torque about roll, pitch and yaw axis"
    )
    position = Out("float64[3]", unit="m", doc="x, y, h")
    velocity = Out("float64[3]", unit="m/s", doc="rate of change of the position")
    attitude = Out("float64[3]", unit="rad", doc="roll, pitch, yaw; yaw in (-pi, pi]")
    rates = Out("float64[3]", unit="rad/s", doc="about roll, pitch and yaw axis, as a gyro measures them")

    # Scalars, because the solver reads them four times a step, and a float costs a tenth of a small array.
    front = State(unit="N", continuous=True)
    right = State(unit="N", continuous=True)
    rear = State(unit="N", continuous=True)
    left = State(unit="N", continuous=True)
    x = State(unit="m", continuous=True)
    y = State(unit="m", continuous=True)
    h = State(unit="m", continuous=True)
    vx = State(unit="m/s", continuous=True)
    vy = State(unit="m/s", continuous=True)
    vh = State(unit="m/s", continuous=True)
    roll = State(unit="rad", continuous=True)
    pitch = State(unit="rad", continuous=True)
    yaw = State(unit="rad", continuous=True)
    p = State(unit="rad/s", continuous=True)
    q = State(unit="rad/s", continuous=True)
    r = State(unit="rad/s", continuous=True)
    signs = State("float64[3]")  # of the torque biases
    sign_stream = Random()

    example = """
        wind: {block: plant.gust, rate: fast}
        craft:
          block: plant.rotorcraft
          rate: continuous
          with: {initial_position: {value: [0, 0, 1.5], unit: m}}
          in: {thrust: {value: [1.23, 1.226, 1.222, 1.226], unit: N}, wind: {from: wind.wind, across: hold}}
    """

    def check(self) -> None:
        """Refuse a least thrust that is not below the greatest."""
        if self.thrust_min >= self.thrust_max:
            problem = f"thrust_min must be below thrust_max, {self.thrust_max:g} N, got {self.thrust_min:g} N"
            raise ParameterError("thrust_min", problem)

    def start(self) -> None:
        """Begin in a trimmed hover at the initial position, velocity and attitude."""
        hover = 0.25 * self.mass * self.gravity
        self.front, self.right, self.rear, self.left = hover, hover, hover, hover
        position, velocity, attitude = self.initial_position, self.initial_velocity, self.initial_attitude
        self.x, self.y, self.h = position[0], position[1], position[2]
        self.vx, self.vy, self.vh = velocity[0], velocity[1], velocity[2]
        self.roll, self.pitch, self.yaw = attitude[0], attitude[1], attitude[2]
        self.p, self.q, self.r = 0.0, 0.0, 0.0
        self.signs[:] = 1.0
        if self.bias_sign == RANDOM:
            random_signs(self.sign_stream, self.signs)

    def output(self) -> tuple[Any, Any, Any, Any]:
        """Return position, velocity, attitude and rates."""
        return (
            np.array((self.x, self.y, self.h)),
            np.array((self.vx, self.vy, self.vh)),
            np.array((self.roll, self.pitch, wrapped(self.yaw))),
            np.array((self.p, self.q, self.r)),
        )

    def deriv(self, thrust: Any, wind: Any, force: Any, torque: Any) -> tuple[float, ...]:
        """Return the rates of change of rotors, position, velocity, attitude and rates."""
        front, right, rear, left = self.front, self.right, self.rear, self.left
        roll, pitch, p, q, r = self.roll, self.pitch, self.p, self.q, self.r
        vx, vy, vh = self.vx, self.vy, self.vh
        least, most, lag = self.thrust_min, self.thrust_max, self.lag
        arm, inertia, bias, signs = self.arm, self.inertia, self.torque_bias, self.signs
        ix, iy, iz = float(inertia[0]), float(inertia[1]), float(inertia[2])
        p_rate = (arm * (left - right) + float(torque[0])) / ix + float(signs[0] * bias[0])
        q_rate = (arm * (front - rear) + float(torque[1])) / iy + float(signs[1] * bias[1])
        turning = self.torque_ratio * (front + rear - right - left) + float(torque[2])
        r_rate = turning / iz + float(signs[2] * bias[2])
        if self.model == PAPER:
            roll_rate, pitch_rate, yaw_rate = p, q, r
            forward, rightward, upward = _paper_lift(roll, pitch)
        else:
            p_rate += (iy - iz) / ix * q * r
            q_rate += (iz - ix) / iy * p * r
            r_rate += (ix - iy) / iz * p * q
            roll_rate, pitch_rate, yaw_rate = _angle_rates(roll, pitch, p, q, r)
            forward, rightward, upward = _lift(roll, pitch, self.yaw)
        mass, drag, scale = self.mass, self.drag, self.thrust_scale
        lift = front + right + rear + left
        return (
            (clip(float(thrust[0]), least, most) * float(scale[0]) - front) / lag,
            (clip(float(thrust[1]), least, most) * float(scale[1]) - right) / lag,
            (clip(float(thrust[2]), least, most) * float(scale[2]) - rear) / lag,
            (clip(float(thrust[3]), least, most) * float(scale[3]) - left) / lag,
            vx, vy, vh,
            (lift * forward + drag * (float(wind[0]) - vx) + float(force[0])) / mass,
            (lift * rightward + drag * (float(wind[1]) - vy) + float(force[1])) / mass,
            (lift * upward + drag * (float(wind[2]) - vh) + float(force[2])) / mass - self.gravity,
            roll_rate, pitch_rate, yaw_rate,
            p_rate, q_rate, r_rate,
        )  # fmt: skip


def _paper_lift(roll: float, pitch: float) -> tuple[float, float, float]:
    """Return the direction of the thrust along x, y, h by equations (11)-(13)."""
    cosine = math.cos(pitch)
    return -math.sin(pitch), cosine * math.sin(roll), cosine * math.cos(roll)


def _lift(roll: float, pitch: float, yaw: float) -> tuple[float, float, float]:
    """Return the direction of the thrust, minus the third column of Rz(yaw) Ry(pitch) Rx(roll), h upward."""
    across, along = math.sin(roll), math.cos(roll) * math.sin(pitch)
    cosine, sine = math.cos(yaw), math.sin(yaw)
    return -along * cosine - across * sine, across * cosine - along * sine, math.cos(roll) * math.cos(pitch)


def _angle_rates(roll: float, pitch: float, p: float, q: float, r: float) -> tuple[float, float, float]:
    """Return the rates of change of roll, pitch and yaw for given rates about the body axes."""
    cosine, sine = math.cos(roll), math.sin(roll)
    turn = (q * sine + r * cosine) / math.cos(pitch)
    return p + turn * math.sin(pitch), q * cosine - r * sine, turn
