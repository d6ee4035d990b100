"""The common part of the linear systems with one input: each element of the signal has states of its own."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from quadvis.block import Block, Derived, In, Out, Param, ParameterError, State, element
from quadvis_blocks.systems._models import Model

if TYPE_CHECKING:
    _Base = Block
else:  # `Lti` alone is not a block: it has no model
    _Base = object


class Lti(_Base):
    """Ports, states and methods; a block adds the parameters of its model, and `lti` to its ports."""

    gain = Param(1.0, unit="b/a", tune=True, doc="a factor, which brings the unit of the output")
    initial_input = Param(
        0.0, type="float64[*?]", unit="a", doc="the input before the start, in whose steady state it begins"
    )
    u = In("float64[*]", unit="a", doc="any signal")
    y = Out("float64[*]", unit="b", doc="the output, in the unit of the input times that of ``gain``")
    x = State("float64[1,*]")
    a = Derived("float64[1,1]", doc="A of the system as it is computed")
    b = Derived("float64[1]", doc="its B")
    c = Derived("float64[1]", doc="its C")
    d = Derived(doc="its D")
    rest = Derived("float64[1]", doc="its states in the steady state of an input of 1")

    def take(self, model: Model, discrete: bool) -> None:
        """Take the model as it is computed; ParameterError if it cannot be, or has no steady state."""
        if not model.finite:
            raise ParameterError("gain", "gain must be such that all coefficients are finite")
        self.a, self.d = model.a, float(model.d[0, 0])
        self.b, self.c = model.b[:, 0].copy(), model.c[0].copy()
        rest = model.rest(discrete)
        if rest is None and np.any(self.initial_input):
            problem = "initial_input must be 0, since with a pole at 0 there is no steady state"
            raise ParameterError("initial_input", problem)
        self.rest = np.zeros(len(self.a)) if rest is None else rest[:, 0]

    def start(self) -> None:
        """Begin in the steady state of the initial input."""
        for row in range(self.rest.size):
            self.x[row] = self.rest[row] * self.initial_input

    def output(self, u: Any) -> Any:
        """Return C x + D u."""
        if isinstance(u, float):
            return self.gain * (self.d * u + _weighted(self.c, self.x, 0, 1))
        y = np.empty_like(u)
        for index in range(u.size):
            y.flat[index] = self.gain * (self.d * u.flat[index] + _weighted(self.c, self.x, index, u.size))
        return y

    def update(self, u: Any) -> None:
        """Go on by one sample."""
        self.x = _moved(self, u)


def lti(order: int, continuous: bool, direct: bool) -> dict[str, Any]:
    """Return states and methods for a model of this order, at least 1, in which D is not 0 if ``direct``."""
    members: dict[str, Any] = {
        "x": State(f"float64[{order},*]", continuous=continuous),
        "a": Derived(f"float64[{order},{order}]", doc="A of the system as it is computed"),
    }
    if not direct:
        members["output"] = _output_of_states
    if continuous:
        members |= {"deriv": _deriv, "update": None}
    for name, doc in (("b", "its B"), ("c", "its C"), ("rest", Lti.rest.doc)):
        members[name] = Derived(f"float64[{order}]", doc=doc)
    return members


def _output_of_states(self: Any) -> Any:
    """Return C x."""
    first = self.x[0]
    if isinstance(first, float):
        return self.gain * _weighted(self.c, self.x, 0, 1)
    y = np.empty_like(first)
    for index in range(y.size):
        y.flat[index] = self.gain * _weighted(self.c, self.x, index, y.size)
    return y


def _deriv(self: Any, u: Any) -> Any:
    """Return A x + B u."""
    return _moved(self, u)


def _moved(block: Any, u: Any) -> Any:
    found = np.empty_like(block.x)
    count = block.x.size // block.b.size
    for row in range(block.b.size):
        for index in range(count):
            moved = _weighted(block.a[row], block.x, index, count)
            found.flat[row * count + index] = moved + block.b[row] * element(u, index)
    return found


def _weighted(weights: Any, x: Any, index: int, count: int) -> float:
    """Return the weighted sum of the states of one element, of ``count``."""
    total = 0.0
    for row in range(weights.size):
        total += weights[row] * x.flat[row * count + index]
    return total
