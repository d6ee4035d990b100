"""A rigid body with six degrees of freedom."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import Block, Derived, In, Out, Param, ParameterError, State
from quadvis_blocks._rotations import (
    dcm_of_quaternion,
    normalised,
    quaternion_rate,
    refuse_no_rotation,
    turned_by,
)


class RigidBody(Block):
    """A rigid body with six degrees of freedom: forces and torques in, motion out.

    ``m dv/dt = R force + world_force + m gravity``, ``J dw/dt = torque - w x J w`` and
    ``dq/dt = q (0, w) / 2``: position and velocity in the axes of the world; force, torque and the rates w in
    those of the body. The quaternion (w, x, y, z) and its matrix R turn body vectors into world vectors; its
    norm is 1, its sign does not jump, and it has no poles. ``rotation.representation`` makes Euler angles of
    it. ``gravity`` is a vector: with z down write ``[0, 0, 9.81 m/s^2]``.

    Source: B. L. Stevens, F. L. Lewis, E. N. Johnson, Aircraft Control and Simulation, section 1.7.
    """

    mass = Param(1.0, unit="kg", above=0.0, doc="m")
    inertia = Param((1.0, 1.0, 1.0), type="float64[3]", unit="kg*m^2", above=0.0, doc="Jxx, Jyy, Jzz of J")
    products = Param(
        (0.0, 0.0, 0.0),
        type="float64[3]",
        unit="kg*m^2",
        doc="Jxy, Jxz, Jyz of J: the elements themselves, negative sums of m x y",
    )
    gravity = Param((0.0, 0.0, 0.0), type="float64[3]", unit="m/s^2", doc="its acceleration in the world")
    initial_position = Param((0.0, 0.0, 0.0), type="float64[3]", unit="m", doc="position at the start")
    initial_velocity = Param((0.0, 0.0, 0.0), type="float64[3]", unit="m/s", doc="velocity at the start")
    initial_attitude = Param(
        (1.0, 0.0, 0.0, 0.0), type="float64[4]", doc="quaternion at the start, of any norm"
    )
    initial_rates = Param((0.0, 0.0, 0.0), type="float64[3]", unit="rad/s", doc="rates at the start")
    force = In("float64[3]", unit="N", default=(0.0, 0.0, 0.0), doc="on the centre of mass, in body axes")
    torque = In("float64[3]", unit="N*m", default=(0.0, 0.0, 0.0), doc="about the body axes")
    world_force = In("float64[3]", unit="N", default=(0.0, 0.0, 0.0), doc="another force, in world axes")
    position = Out("float64[3]", unit="m", doc="of the centre of mass, in the world")
    velocity = Out("float64[3]", unit="m/s", doc="its rate of change")
    attitude = Out("float64[4]", doc="the quaternion")
    rates = Out("float64[3]", unit="rad/s", doc="about the body axes")
    place = State("float64[3]", unit="m", continuous=True)
    speed = State("float64[3]", unit="m/s", continuous=True)
    q = State("float64[4]", continuous=True)
    w = State("float64[3]", unit="rad/s", continuous=True)
    tensor = Derived("float64[3,3]", doc="J")
    inverse = Derived("float64[3,3]", doc="its inverse")

    example = """
        push: {block: sources.constant, rate: continuous, with: {value: [0 N, 0 N, 12 N]}}
        body:
          block: plant.rigid_body
          with: {mass: 1.1 kg, gravity: [0 m/s^2, 0 m/s^2, -9.81 m/s^2]}
          in: {force: push.y}
    """

    def check(self) -> None:
        """Refuse a tensor that no body has, and an attitude that is none."""
        refuse_no_rotation("initial_attitude", self.initial_attitude)
        (xy, xz, yz), (xx, yy, zz) = self.products, self.inertia
        tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        with np.errstate(all="ignore"):
            scaled = tensor / np.sqrt(np.outer(np.diag(tensor), np.diag(tensor)))
            if not np.isfinite(scaled).all() or np.linalg.eigvalsh(scaled).min() <= 0.0:
                raise ParameterError("products", "products must leave the tensor positive definite")
            inverse = np.linalg.inv(tensor)
        if not np.isfinite(inverse).all():
            raise ParameterError("inertia", "inertia must be such that its inverse is finite")
        self.tensor, self.inverse = tensor, inverse

    def start(self) -> None:
        """Begin with the initial motion."""
        self.place = self.initial_position
        self.speed = self.initial_velocity
        self.q = normalised(self.initial_attitude)
        self.w = self.initial_rates

    def output(self) -> Any:
        """Return the motion."""
        return self.place, self.speed, self.q, self.w

    def update(self) -> None:
        """Take the norm of the quaternion back to 1, which changes no rotation."""
        self.q = normalised(self.q)

    def deriv(self, force: Any, torque: Any, world_force: Any) -> Any:
        """Return the rates of position, velocity, quaternion and rates."""
        turned = turned_by(dcm_of_quaternion(self.q), force, False)
        momentum = turned_by(self.tensor, self.w, False)
        w = self.w
        acceleration, moment = np.empty(3), np.empty(3)
        for axis in range(3):
            acceleration[axis] = (turned[axis] + world_force[axis]) / self.mass + self.gravity[axis]
            one, other = (axis + 1) % 3, (axis + 2) % 3
            moment[axis] = torque[axis] - (w[one] * momentum[other] - w[other] * momentum[one])
        return (
            1.0 * self.speed,
            acceleration,
            quaternion_rate(self.q, w),
            turned_by(self.inverse, moment, False),
        )
