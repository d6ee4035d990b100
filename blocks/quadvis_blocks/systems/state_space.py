"""A linear system by its matrices."""

from __future__ import annotations

from typing import Any, Self

import numpy as np

from quadvis.block import Block, Derived, In, Out, Param, ParameterError, State
from quadvis.machine.inputs import read_once
from quadvis_blocks.systems._files import matrix, read_model
from quadvis_blocks.systems._models import Model
from quadvis_blocks.systems._of_control import matrices_of, method_of
from quadvis_blocks.systems._products import row_times
from quadvis_blocks.systems._sampled import Sampled
from quadvis_blocks.systems._sampling import CONTINUOUS, DIRECT, MATCHED
from quadvis_blocks.systems._units import units_for, vector

ZERO = ((0.0,),)


class StateSpace(Sampled, Block):
    """A linear system by its matrices: ``dx/dt = A x + B u``, ``y = C x + D u``.

    Matrices are lists of rows, of plain numbers in SI units. ``u`` has any units; ``output_units`` says those
    of ``y``, which is a scalar if C has one row. A continuous system needs no ``rate``. At a rate it is
    sampled by a ``method``, as python-control's ``sample_system`` does it; with ``discrete`` it is
    ``x[k+1] = A x[k] + B u[k]``. It has direct feedthrough if D is not 0, or if the method makes it so:
    tustin, foh, impulse, backward. ``initial`` are the states at the start.

    ``file`` holds A, B, C and, unless it is 0, D: .yaml, .npz, .mat, or a text with the name on the line
    above the rows; with ``dt`` (s) it is a sampled system. ``StateSpace.of(system)`` takes a system of
    python-control.

    Source: K. Ogata, Modern Control Engineering, section 2-5.
    """

    A = Param(ZERO, type="float64[n,n]", doc="A, a row and a column for each state")
    B = Param(ZERO, type="float64[n,m]", doc="B, a column for each input")
    C = Param(ZERO, type="float64[p,n]", doc="C, a row for each output")
    D = Param(ZERO, type="float64[q,r]", doc="D, a row for each output and a column for each input")
    file = Param("", type="file", doc="a file with the matrices, in their place")
    initial = Param((0.0,), type="float64[i]", doc="the states at the start; one number counts for all")
    output_units = Param("", type="str", doc="units of the outputs, such as 'm m/s'; one counts for all")
    u = In("float64[1?]", unit="a", doc="the inputs; of one input also a scalar")
    y = Out(doc="the outputs; of one output a scalar")
    x = State("float64[1]")
    a = Derived("float64[1,1]", doc="A of the system as it is computed")
    b = Derived("float64[1,1]", doc="its B")
    c = Derived("float64[1,1]", doc="its C")
    d = Derived("float64[1,1]", doc="its D")

    example = """
        force: {block: sources.step, rate: continuous, with: {after: 2 N}}
        cart:
          block: systems.state_space
          with:
            A: [[0, 1], [0, -0.1]]
            B: [[0], [0.5]]
            C: [[1, 0], [0, 1]]
            output_units: m m/s
          in: {u: force.y}
    """

    @classmethod
    def of(cls, system: Any, **parameters: Any) -> Self:
        """Return the block of a system of python-control, which has a discrete one's period."""
        return cls(**matrices_of(system) | method_of(system) | parameters)

    @classmethod
    def ports(
        cls, A: Any, B: Any, C: Any, D: Any, method: int, file: str, output_units: str
    ) -> dict[str, Any]:
        """Return ports, states and methods for the sizes of the matrices."""
        a, b, c, d = _matrices(read_once(read_model, file)) if file else (A, B, C, D)
        n, m, p = len(a), b.shape[1], len(c)
        direct = method in DIRECT or bool(np.any(d))
        members: dict[str, Any] = {
            "u": In(vector(m), unit="a", doc=cls.u.doc),
            "y": Out(
                "float64" if p == 1 else f"float64[{p}]", unit=units_for(output_units, p), doc=cls.y.doc
            ),
            "x": State(f"float64[{n}]", continuous=method == CONTINUOUS),
            "output": (_scalar if p == 1 else _vector) if direct else (_state if p == 1 else _states),
        }
        for name, shape in (("a", (n, n)), ("b", (n, m)), ("c", (p, n)), ("d", (p, m))):
            members[name] = Derived(f"float64[{shape[0]},{shape[1]}]", doc=getattr(cls, name).doc)
        return members | ({"deriv": _deriv, "update": None} if method == CONTINUOUS else {})

    def check(self) -> None:
        """Refuse matrices that do not fit each other."""
        given = self.A, self.B, self.C, self.D
        if self.file:
            if any(np.any(each) for each in given):
                raise ParameterError("file", "file must be left out where A, B, C or D is given")
            held = self.read_file("file", read_model)
            self.suits(held)
            given = _matrices(held)
        model = _fitting(*given)
        if self.method == MATCHED:
            problem = "method must be another one than matched, which is for zeros and poles"
            raise ParameterError("method", f"{problem}; use systems.zero_pole_gain")
        found = self.computed(model)
        if not found.finite:
            raise ParameterError("A", "A must be such that all coefficients are finite")
        self.a, self.b, self.c, self.d = found
        if len(self.initial) not in (1, len(model.a)):
            raise ParameterError("initial", f"initial must be {len(model.a)} values, got {len(self.initial)}")

    def start(self) -> None:
        """Begin in the initial state."""
        self.x[:] = self.initial

    def output(self, u: Any) -> Any:
        """Return C x + D u."""
        return row_times(self.c, 0, self.x) + row_times(self.d, 0, u)

    def update(self, u: Any) -> None:
        """Go on by one sample."""
        self.x = _moved(self, u)


def _matrices(held: Any) -> tuple[Any, Any, Any, Any]:
    """Return the matrices of a file."""
    a, b, c = (matrix(held, name) for name in "ABC")
    return a, b, c, matrix(held, "D") if "D" in held or "d" in held else np.zeros((len(c), b.shape[1]))


def _fitting(a: Any, b: Any, c: Any, d: Any) -> Model:
    """Return the model; ParameterError if the matrices do not fit each other. D may be a plain 0."""
    states, inputs, outputs = len(a), b.shape[1], len(c)
    if d.shape == (1, 1) and d[0, 0] == 0.0:
        d = np.zeros((outputs, inputs))
    wanted_shapes = {
        "A": (states, states),
        "B": (states, inputs),
        "C": (outputs, states),
        "D": (outputs, inputs),
    }
    for (name, shape), given in zip(wanted_shapes.items(), (a, b, c, d), strict=True):
        if given.shape != shape:
            wanted_words, found = (f"{rows} x {columns}" for rows, columns in (shape, given.shape))
            raise ParameterError(name, f"{name} must be {wanted_words}, got {found}")
        if not np.isfinite(given).all():
            raise ParameterError(name, f"{name} must be finite")
    return Model(a, b, c, d)


def _scalar(self: Any, u: Any) -> float:
    """Return C x + D u of one output."""
    return row_times(self.c, 0, self.x) + row_times(self.d, 0, u)


def _vector(self: Any, u: Any) -> Any:
    """Return C x + D u."""
    y = np.empty(self.c.shape[0])
    for row in range(y.size):
        y[row] = row_times(self.c, row, self.x) + row_times(self.d, row, u)
    return y


def _state(self: Any) -> float:
    """Return C x of one output."""
    return row_times(self.c, 0, self.x)


def _states(self: Any) -> Any:
    """Return C x."""
    y = np.empty(self.c.shape[0])
    for row in range(y.size):
        y[row] = row_times(self.c, row, self.x)
    return y


def _deriv(self: Any, u: Any) -> Any:
    """Return A x + B u."""
    return _moved(self, u)


def _moved(block: Any, u: Any) -> Any:
    found = np.empty(block.x.size)
    for row in range(found.size):
        found[row] = row_times(block.a, row, block.x) + row_times(block.b, row, u)
    return found
