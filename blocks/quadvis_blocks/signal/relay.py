"""A switch with hysteresis."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import Block, In, Out, Param, State, element
from quadvis_blocks._limits import refuse_reversed


class Relay(Block):
    """One of two values: on from an upper threshold, off from a lower one, between them as before.

    On while ``u >= on_at``, off while ``u <= off_at``, element by element. The output is one of the two
    values from the first tick on. At ``rate: continuous`` the instant at which it switches is located between
    two ticks.
    """

    on_at = Param(0.5, type="float64[*?]", unit="a", tune=True, shown=True, doc="switches on at or above it")
    off_at = Param(
        -0.5, type="float64[*?]", unit="a", tune=True, shown=True, doc="switches off at or below it"
    )
    on_value = Param(1.0, type="float64[*?]", unit="b", tune=True, doc="the output while on")
    off_value = Param(0.0, type="float64[*?]", unit="b", tune=True, doc="the output while off")
    initial = Param("off", choices=("off", "on"), doc="what it is between the thresholds at the start")
    u = In("float64[*]", unit="a", doc="any signal")
    y = Out("float64[*]", unit="b", doc="one of the two values")
    is_on = State("bool[*]")

    symbol = "relay"
    example = """
        room: {block: sources.sine, rate: fast, with: {amplitude: 2 K, bias: 293 K, frequency: 1 Hz}}
        heating:
          block: signal.relay
          rate: fast
          with: {on_at: 294 K, off_at: 292 K, on_value: 0 W, off_value: 2 kW}
          in: {u: room.y}
    """

    def check(self) -> None:
        """Refuse thresholds of which the one to switch on lies below."""
        refuse_reversed(("off_at", self.off_at), ("on_at", self.on_at))

    def start(self) -> None:
        """Begin on or off."""
        self.is_on = self.initial == 1

    def output(self, u: Any) -> Any:
        """Return the value of its state."""
        if isinstance(u, float):
            return self.on_value if _switched(u, self.is_on, self.on_at, self.off_at) else self.off_value
        y = np.empty_like(u)
        for index in range(u.size):
            on_at, off_at = element(self.on_at, index), element(self.off_at, index)
            if _switched(u.flat[index], self.is_on.flat[index], on_at, off_at):
                y.flat[index] = element(self.on_value, index)
            else:
                y.flat[index] = element(self.off_value, index)
        return y

    def update(self, u: Any) -> None:
        """Keep its state."""
        _switch(self, u)

    def crossing(self, u: Any) -> Any:
        """Return how far each element is from the threshold at which it switches next."""
        if isinstance(u, float):
            return u - self.off_at if self.is_on else self.on_at - u
        found = np.empty_like(u)
        for index in range(u.size):
            value = u.flat[index]
            if self.is_on.flat[index]:
                found.flat[index] = value - element(self.off_at, index)
            else:
                found.flat[index] = element(self.on_at, index) - value
        return found

    def event(self, u: Any) -> None:
        """Switch."""
        _switch(self, u)


def _switch(self: Any, u: Any) -> None:
    """Let a relay be on or off, as its input says."""
    if isinstance(u, float):
        self.is_on = _switched(u, self.is_on, self.on_at, self.off_at)
    else:
        for index in range(u.size):
            on_at, off_at = element(self.on_at, index), element(self.off_at, index)
            self.is_on.flat[index] = _switched(u.flat[index], self.is_on.flat[index], on_at, off_at)


def _switched(u: float, is_on: Any, on_at: float, off_at: float) -> bool:
    """Return whether it is on with this input; where the thresholds are one, on."""
    return bool(u >= on_at or (is_on and not u <= off_at))
