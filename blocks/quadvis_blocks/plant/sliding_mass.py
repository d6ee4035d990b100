"""A mass that slides on a surface with dry friction: it sticks and slips."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import Block, In, Out, Param, State, element

BACKWARD, STICKS, FORWARD = -1, 0, 1


class SlidingMass(Block):
    """A mass on a surface with Coulomb and viscous friction, element by element; it sticks and slips.

    While it slips, with the speed w = v - ``surface``: ``mass dv/dt = force - sign(w) coulomb - viscous w``,
    ``dx/dt = v``. It sticks where w becomes zero and ``force`` is less than ``breakaway``: then v is exactly
    ``surface``, until the force is as large. Both instants are located between two ticks. Where the surface
    itself is accelerated, take the motion relative to it. An inertia with a torque is the same.

    Source: Armstrong-Helouvry, Dupont, Canudas de Wit, A survey of models, analysis tools and compensation
    methods for the control of machines with friction, Automatica 30 (1994), section 2.1.
    """

    mass = Param(1.0, type="float64[*?]", unit="b*s^2/a", above=0.0, shown=True, doc="mass, or inertia")
    coulomb = Param(
        1.0,
        type="float64[*?]",
        unit="b",
        min=0.0,
        tune=True,
        shown=True,
        doc="the friction at any speed but zero",
    )
    breakaway = Param(
        0.0,
        type="float64[*?]",
        unit="b",
        min=0.0,
        tune=True,
        doc="the force at which it breaks away from rest; never less than ``coulomb``",
    )
    viscous = Param(
        0.0,
        type="float64[*?]",
        unit="b*s/a",
        min=0.0,
        tune=True,
        doc="the friction for each unit of speed",
    )
    surface = Param(0.0, type="float64[*?]", unit="a/s", doc="speed of the surface, such as a belt")
    initial = Param(0.0, type="float64[*?]", unit="a", doc="x at the start")
    initial_speed = Param(0.0, type="float64[*?]", unit="a/s", doc="v at the start")
    force = In("float64[*]", unit="b", doc="all force on the mass but the friction")
    x = Out("float64[*]", unit="a", doc="the position")
    v = Out("float64[*]", unit="a/s", doc="the speed")
    mode = Out("int64[*]", doc="0: it sticks; 1, -1: it slips forward, backward on the surface")
    place = State("float64[*]", continuous=True)
    speed = State("float64[*]", continuous=True)
    slips = State("int64[*]", doc="the mode")

    symbol = "friction"
    example = """
        block:
          block: plant.sliding_mass
          with: {mass: 1 kg, coulomb: 2 N, breakaway: 3 N, surface: 0.1 m/s}
          in: {force: spring.y}
        spring: {block: signal.gain, rate: continuous, with: {factor: -50 N/m}, in: {u: block.x}}
    """

    def start(self) -> None:
        """Begin with the initial values."""
        self.place = self.initial
        self.speed = self.initial_speed
        if isinstance(self.speed, float):
            self.slips = _direction(self.speed - self.surface)
            return
        for index in range(self.speed.size):
            self.slips.flat[index] = _direction(self.speed.flat[index] - element(self.surface, index))

    def output(self) -> tuple[Any, Any, Any]:
        """Return position, speed and mode."""
        return 1.0 * self.place, 1.0 * self.speed, 1 * self.slips

    def deriv(self, force: Any) -> tuple[Any, Any]:
        """Return speed and acceleration; there is none while it sticks."""
        if isinstance(force, float):
            return self.speed, _acceleration(
                self.speed - self.surface, self.slips, force, self.mass, self.coulomb, self.viscous
            )
        found = np.empty_like(force)
        for index in range(force.size):
            slip = self.speed.flat[index] - element(self.surface, index)
            found.flat[index] = _acceleration(
                slip, self.slips.flat[index], force.flat[index], element(self.mass, index),
                element(self.coulomb, index), element(self.viscous, index),
            )  # fmt: skip
        return 1.0 * self.speed, found

    def update(self, force: Any) -> None:
        """Stick, break away or turn round, if one of these is due."""
        _change(self, force)

    def crossing(self, force: Any) -> Any:
        """Return how far each element is from rest, or from breaking away."""
        if isinstance(force, float):
            withstood = max(self.coulomb, self.breakaway)
            return _distance(self.speed - self.surface, self.slips, force, withstood)
        found = np.empty_like(force)
        for index in range(force.size):
            withstood = max(element(self.coulomb, index), element(self.breakaway, index))
            slip = self.speed.flat[index] - element(self.surface, index)
            found.flat[index] = _distance(slip, self.slips.flat[index], force.flat[index], withstood)
        return found

    def event(self, force: Any) -> None:
        """Stick, break away or turn round."""
        _change(self, force)


def _change(self: Any, force: Any) -> None:
    """Let what happens at rest on the surface happen."""
    if isinstance(force, float):
        self.speed, self.slips = _changed(
            self.speed, self.slips, force, self.surface, max(self.coulomb, self.breakaway)
        )
        return
    for index in range(force.size):
        withstood = max(element(self.coulomb, index), element(self.breakaway, index))
        self.speed.flat[index], self.slips.flat[index] = _changed(
            self.speed.flat[index], self.slips.flat[index], force.flat[index],
            element(self.surface, index), withstood,
        )  # fmt: skip


def _direction(slip: float) -> int:
    """Return the mode at a speed on the surface."""
    return FORWARD if slip > 0.0 else BACKWARD if slip < 0.0 else STICKS


def _acceleration(slip: float, mode: int, force: float, mass: float, coulomb: float, viscous: float) -> float:
    """Return the acceleration."""
    return 0.0 if mode == STICKS else (force - mode * coulomb - viscous * slip) / mass


def _changed(speed: float, mode: int, force: float, surface: float, withstood: float) -> tuple[float, int]:
    """Return speed and mode, after what happens at rest on the surface."""
    slip = speed - surface
    if mode * slip > 0.0:
        return speed, mode
    if abs(force) < withstood:
        return surface, STICKS
    onward = FORWARD if force >= 0.0 else BACKWARD
    return speed if onward * slip > 0.0 else surface, onward


def _distance(slip: float, mode: int, force: float, withstood: float) -> float:
    """Return what falls to zero where the mode changes."""
    return withstood - abs(force) if mode == STICKS else mode * slip
