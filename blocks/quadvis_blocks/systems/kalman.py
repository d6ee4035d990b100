"""A linear Kalman filter."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import Block, Derived, In, Out, Param, ParameterError, State, Work
from quadvis.machine.inputs import read_once
from quadvis_blocks.systems._files import given_model, model_of, read_model
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
    an observer. Matrices are plain numbers in SI units; ``output_units`` says those of ``x``. ``file`` holds
    A, C and, unless it is 0, B in place of the parameters, as for `systems.state_space`.

    Measurements are whitened by the Cholesky factor of R and taken one by one in Joseph's form, which
    keeps the covariance symmetric to the bit and free of negative variances. Refused are a Q with a
    negative eigenvalue and an R that is not positive definite.

    Source: D. Simon, Optimal State Estimation, sections 5.1, 6.1 (sequential) and 7.3 (steady).
    """

    A = Param(ZERO, type="float64[n,n]", doc="A of the model")
    B = Param(ZERO, type="float64[h,m]", doc="B of the model; left out if nothing is known of its input")
    C = Param(ZERO, type="float64[p,n]", doc="C of the model, a row for each measurement")
    file = Param("", type="file", doc="a file with A, C and B, in their place")
    Q = Param(type="float64[q,q]", doc="covariance of the noise of the states, symmetric")
    R = Param(type="float64[r,r]", doc="covariance of the noise of the measurements, symmetric")
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
    variances = Out("float64[1]", doc="the variances of the estimate, in SI units")
    state = State("float64[1]", doc="the estimate before the measurement")
    covariance = State("float64[1,1]", doc="its covariance")
    estimate = Work("float64[1]")
    remaining = Work("float64[1,1]")
    transition = Derived("float64[1,1]", doc="A")
    inputs = Derived("float64[1,1]", doc="B")
    whitening = Derived("float64[1,1]", doc="the inverse of the Cholesky factor of R")
    seen = Derived("float64[1,1]", doc="that times C")
    settled = Derived("float64[1,1]", doc="the steady gain for whitened measurements")
    after = Derived("float64[1,1]", doc="the steady covariance after a measurement")

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
    def ports(cls, A: Any, B: Any, C: Any, gain: int, file: str, output_units: str) -> dict[str, Any]:
        """Return ports for the sizes of the model, and the methods of the gain."""
        a, b, c = model_of(read_once(read_model, file), "ABC") if file else (A, B, C)
        n, m, p = len(a), b.shape[1], len(c)
        methods = {"output": _steady_output, "update": _steady_update} if gain == STEADY else {}
        derived = {
            "transition": (n, n),
            "inputs": (n, m),
            "whitening": (p, p),
            "seen": (p, n),
            "settled": (n, p),
            "after": (n, n),
        }
        return methods | {
            "u": In(vector(m), unit="a", default=[0.0] * m if m > 1 else 0.0, doc=cls.u.doc),
            "y": In(vector(p), unit="b", doc=cls.y.doc),
            "x": Out(f"float64[{n}]", unit=units_for(output_units, n), doc=cls.x.doc),
            "variances": Out(f"float64[{n}]", doc=cls.variances.doc),
            "state": State(f"float64[{n}]", doc=cls.state.doc),
            "covariance": State(f"float64[{n},{n}]", doc=cls.covariance.doc),
            "estimate": Work(f"float64[{n}]"),
            "remaining": Work(f"float64[{n},{n}]"),
            **{
                name: Derived(f"float64[{rows},{columns}]", doc=getattr(cls, name).doc)
                for name, (rows, columns) in derived.items()
            },
        }

    def check(self) -> None:
        """Refuse matrices that do not fit each other; compute what does not change."""
        a, b, c = given_model(self, "ABC", sampled=True)
        states, outputs = len(a), len(c)
        b = b if np.any(b) else np.zeros((states, b.shape[1]))
        for name, matrix, shape in (
            ("B", b, (states, b.shape[1])), ("C", c, (outputs, states)), ("A", a, (states, states)),
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
        self.transition, self.inputs = np.asarray(a, float), np.asarray(b, float)
        self.whitening = np.linalg.inv(np.linalg.cholesky(self.R))
        self.seen = self.whitening @ c
        if not np.isfinite(self.seen).all():
            raise ParameterError("R", "R must be such that its inverse is finite")
        self.settled, self.after = np.zeros((states, outputs)), np.zeros((states, states))
        if self.gain == STEADY:
            self.settled, self.after = steady(a, self.seen, self.Q)

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
