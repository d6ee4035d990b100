"""A linear Kalman filter."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import Block, Derived, In, Out, Param, ParameterError, State, Work
from quadvis_blocks.systems._kalman import corrected, corrected_steadily, predicted, spread, steady
from quadvis_blocks.systems._riccati import refuse_indefinite
from quadvis_blocks.systems._units import units_for, vector

STEADY = 0
ZERO = ((0.0,),)


class Kalman(Block):
    """A Kalman filter for ``x[k+1] = A x[k] + B u[k] + w``, ``y = C x + v``, a model at the block's rate.

    Q is the covariance of w, R that of v, both for each sample. The output is the estimate after the
    measurement of this tick. While ``valid`` is false the measurement does not count, and the estimate
    follows the model alone. With ``gain: varying`` the covariance begins at ``spread`` and is carried
    along; with ``steady`` the gain is that of infinite time, computed when the diagram is loaded, as in
    an observer. Matrices are plain numbers in SI units; ``output_units`` says those of ``x``.

    Measurements are whitened by the Cholesky factor of R and taken one by one in Joseph's form, which
    keeps the covariance symmetric to the bit and free of negative variances. Refused are a Q with a
    negative eigenvalue and an R that is not positive definite.

    Source: D. Simon, Optimal State Estimation, sections 5.1, 6.1 (sequential) and 7.3 (steady).
    """

    A = Param(type="float64[n,n]", doc="A of the model")
    B = Param(ZERO, type="float64[h,m]", doc="B of the model; left out if nothing is known of its input")
    C = Param(type="float64[p,n]", doc="C of the model, a row for each measurement")
    Q = Param(type="float64[n,n]", doc="covariance of the noise of the states, symmetric")
    R = Param(type="float64[p,p]", doc="covariance of the noise of the measurements, symmetric")
    gain = Param("varying", choices=("steady", "varying"), doc="whether the gain is that of infinite time")
    spread = Param(
        (1e6,), type="float64[i]", min=0.0, doc="variances of the states at the start; one for all"
    )
    initial = Param((0.0,), type="float64[j]", doc="the estimate before the first measurement; one for all")
    output_units = Param("", type="str", doc="units of the states, such as 'm m/s'; one counts for all")
    u = In("float64[1?]", unit="a", default=0.0, doc="the known input of the model")
    y = In("float64[1?]", unit="b", doc="the measurement; of one also a scalar")
    valid = In("bool", default=True, doc="false where there is no measurement")
    x = Out("float64[1]", doc="the estimate of the states")
    variances = Out("float64[n]", doc="the variances of the estimate, in SI units")
    state = State("float64[n]", doc="the estimate before the measurement")
    covariance = State("float64[n,n]", doc="its covariance")
    estimate = Work("float64[n]")
    remaining = Work("float64[n,n]")
    inputs = Derived("float64[n,1]", doc="B")
    whitening = Derived("float64[p,p]", doc="the inverse of the Cholesky factor of R")
    seen = Derived("float64[p,n]", doc="that times C")
    settled = Derived("float64[n,p]", doc="the steady gain for whitened measurements")
    after = Derived("float64[n,n]", doc="the steady covariance after a measurement")

    example = """
        height: {block: sources.ramp, rate: fast, with: {slope: 0.5 m/s}}
        filter:
          block: systems.kalman
          rate: fast
          with:
            A: [[1, 0.01], [0, 1]]
            C: [[1, 0]]
            Q: [[1e-9, 1e-7], [1e-7, 1e-5]]
            R: [[1e-4]]
            output_units: m m/s
          in: {y: height.y}
    """

    @classmethod
    def ports(cls, A: Any, B: Any, C: Any, gain: int, output_units: str) -> dict[str, Any]:
        """Return ports for the sizes of the model, and the methods of the gain."""
        states, inputs = len(A), B.shape[1]
        methods = {"output": _steady_output, "update": _steady_update} if gain == STEADY else {}
        return methods | {
            "u": In(vector(inputs), unit="a", default=[0.0] * inputs if inputs > 1 else 0.0, doc=cls.u.doc),
            "y": In(vector(len(C)), unit="b", doc=cls.y.doc),
            "x": Out(f"float64[{states}]", unit=units_for(output_units, states), doc=cls.x.doc),
            "inputs": Derived(f"float64[{states},{inputs}]", doc=cls.inputs.doc),
        }

    def check(self) -> None:
        """Refuse matrices that do not fit each other; compute what does not change."""
        states, outputs = len(self.A), len(self.C)
        b = np.zeros((states, self.B.shape[1])) if not np.any(self.B) else self.B
        for name, matrix, shape in (
            ("B", b, (states, b.shape[1])), ("C", self.C, (outputs, states)), ("A", self.A, (states, states)),
        ):  # fmt: skip
            if matrix.shape != shape or not np.isfinite(matrix).all():
                found = " x ".join(map(str, matrix.shape))
                raise ParameterError(
                    name, f"{name} must be {shape[0]} x {shape[1]} finite numbers, got {found}"
                )
        refuse_indefinite("Q", np.asarray(self.Q), states)
        refuse_indefinite("R", np.asarray(self.R), outputs, positive=True)
        for name in ("spread", "initial"):
            given = getattr(self, name)
            if len(given) not in (1, states) or not np.isfinite(given).all():
                raise ParameterError(name, f"{name} must be {states} finite values, or one for all")
        self.inputs = np.asarray(b, float)
        self.whitening = np.linalg.inv(np.linalg.cholesky(self.R))
        self.seen = self.whitening @ self.C
        if not np.isfinite(self.seen).all():
            raise ParameterError("R", "R must be such that its inverse is finite")
        self.settled, self.after = np.zeros((states, outputs)), np.zeros((states, states))
        if self.gain == STEADY:
            self.settled, self.after = steady(self.A, self.seen, self.Q)

    def start(self) -> None:
        """Begin with the initial estimate and its variances."""
        self.state[:] = self.initial
        self.covariance[:] = 0.0
        for row in range(self.state.size):
            self.covariance[row, row] = self.spread[row if self.spread.size > 1 else 0]

    def output(self, y: Any, valid: bool) -> Any:
        """Return the estimate, and its variances."""
        self.estimate = self.state
        self.remaining = self.covariance
        if valid:
            corrected(self, y)
        variances = np.empty(self.state.size)
        for row in range(variances.size):
            variances[row] = self.remaining[row, row]
        return self.estimate, variances

    def update(self, u: Any) -> None:
        """Go on by one sample of the model."""
        self.state = predicted(self, u)
        self.covariance = spread(self)


def _steady_output(self: Any, y: Any, valid: bool) -> Any:
    """Return the estimate by the steady gain, and its variances."""
    self.estimate = self.state
    if valid:
        corrected_steadily(self, y)
    variances = np.empty(self.state.size)
    for row in range(variances.size):
        variances[row] = self.after[row, row]
    return self.estimate, variances


def _steady_update(self: Any, u: Any) -> None:
    """Go on by one sample of the model."""
    self.state = predicted(self, u)
