"""State feedback that is optimal for a linear model."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import Block, Derived, In, Out, Param, ParameterError
from quadvis.machine.inputs import read_once
from quadvis_blocks.systems._files import given_model, model_of, read_model
from quadvis_blocks.systems._models import Model
from quadvis_blocks.systems._products import row_times
from quadvis_blocks.systems._riccati import lqr_gain, refuse_indefinite
from quadvis_blocks.systems._sampling import ZOH, sampled
from quadvis_blocks.systems._units import units_for, vector

CONTINUOUS, SAMPLED, DISCRETE = range(3)
ZERO = ((0.0,),)


class Lqr(Block):
    """State feedback by a linear-quadratic regulator: ``u = -K (x - target)``.

    K minimises the integral of ``x'Qx + u'Ru`` for ``dx/dt = A x + B u`` (continuous), the same for a model
    that is sampled at the block's rate with its inputs held, with Q and R as the weights of each sample
    (sampled), or the sum for ``x[k+1] = A x[k] + B u[k]`` (discrete). It is computed when the diagram is
    loaded, and equals python-control's ``lqr`` and ``dlqr``. Matrices are plain numbers in SI units;
    ``output_units`` says the unit of ``u``, which is a scalar if B has one column.

    ``file`` holds A and B in place of the parameters, as for `systems.state_space`, whose file it may be;
    with ``dt`` (s) it is for ``model: discrete``.

    Refused are a Q with a negative eigenvalue, an R that is not positive definite, and an unstable mode that
    the input does not reach.

    Source: B. D. O. Anderson, J. B. Moore, Optimal Control: Linear Quadratic Methods, chapters 2 and 3.
    """

    A = Param(ZERO, type="float64[n,n]", doc="A of the model")
    B = Param(ZERO, type="float64[n,m]", doc="B of the model, a column for each input")
    file = Param("", type="file", doc="a file with A and B, in their place")
    Q = Param(type="float64[p,p]", doc="weight of the states, symmetric")
    R = Param(type="float64[q,q]", doc="weight of the inputs, symmetric")
    model = Param(
        "continuous", choices=("continuous", "sampled", "discrete"), doc="what A and B are, see above"
    )
    output_units = Param("", type="str", doc="units of u, such as N; one counts for all")
    x = In("float64[1?]", unit="a", doc="the state")
    target = In("float64[1?]", unit="a", default=0.0, doc="the state that is wanted")
    u = Out(doc="the input of the plant; of one input a scalar")
    gain = Derived("float64[1,1]", doc="K")

    example = """
        state: {block: sources.constant, rate: fast, with: {value: {value: [0.1, 0], unit: m m/s}}}
        feedback:
          block: systems.lqr
          rate: fast
          with: {A: [[0, 1], [0, 0]], B: [[0], [1]], Q: [[1, 0], [0, 1]], R: [[1]], output_units: N}
          in: {x: state.y}
    """

    @classmethod
    def ports(cls, A: Any, B: Any, file: str, output_units: str) -> dict[str, Any]:
        """Return ports for the sizes of the model."""
        a, b = model_of(read_once(read_model, file), "AB") if file else (A, B)
        states, inputs = len(a), b.shape[1]
        return {
            "x": In(vector(states), unit="a", doc=cls.x.doc),
            "target": In(
                vector(states), unit="a", default=[0.0] * states if states > 1 else 0.0, doc=cls.target.doc
            ),
            "u": Out(
                "float64" if inputs == 1 else f"float64[{inputs}]",
                unit=units_for(output_units, inputs),
                doc=cls.u.doc,
            ),
            "gain": Derived(f"float64[{inputs},{states}]", doc=cls.gain.doc),
            "output": _scalar if inputs == 1 else _vector,
        }

    def check(self) -> None:
        """Compute the gain; refuse a model and weights for which there is none."""
        a, b = given_model(self, "AB", sampled=self.model == DISCRETE)
        states, inputs = len(a), b.shape[1]
        if len(b) != states:
            raise ParameterError("B", f"B must have {states} rows, one for each state, got {len(b)}")
        if a.shape != (states, states):
            raise ParameterError("A", f"A must be {states} x {states}, got {states} x {a.shape[1]}")
        for name, matrix in (("A", a), ("B", b)):
            if not np.isfinite(matrix).all():
                raise ParameterError(name, f"{name} must be finite")
        refuse_indefinite("Q", np.asarray(self.Q), states)
        refuse_indefinite("R", np.asarray(self.R), inputs, positive=True)
        if self.model == SAMPLED:
            if np.isnan(self.period):
                self.gain = np.zeros((inputs, states))
                return
            with np.errstate(all="ignore"):
                a, b, _, _ = sampled(
                    Model(a, b, np.zeros((1, states)), np.zeros((1, inputs))), ZOH, self.period
                )
            if not np.isfinite(a).all() or not np.isfinite(b).all():
                raise ParameterError("A", "A must be such that its sampled model is finite")
        self.gain = lqr_gain(a, b, self.Q, self.R, discrete=self.model != CONTINUOUS)

    def output(self, x: Any, target: Any) -> Any:
        """Return -K (x - target)."""
        return -row_times(self.gain, 0, x - target)


def _scalar(self: Any, x: Any, target: Any) -> float:
    """Return -K (x - target) of one input."""
    return -row_times(self.gain, 0, x - target)


def _vector(self: Any, x: Any, target: Any) -> Any:
    """Return -K (x - target)."""
    u = np.empty(self.gain.shape[0])
    for row in range(u.size):
        u[row] = -row_times(self.gain, row, x - target)
    return u
