"""A linear system by its transfer function."""

from __future__ import annotations

from typing import Any, Self

import numpy as np

from quadvis.block import Block, Param, ParameterError
from quadvis.machine.inputs import read_once
from quadvis_blocks.systems._files import polynomials, read_model
from quadvis_blocks.systems._lti import Lti, lti
from quadvis_blocks.systems._models import degree, of_polynomials
from quadvis_blocks.systems._of_control import polynomials_of
from quadvis_blocks.systems._sampled import Sampled
from quadvis_blocks.systems._sampling import CONTINUOUS, DIRECT, DISCRETE, MATCHED, matched, roots_of
from quadvis_blocks.systems._written import fraction

IMPROPER = "numerator must be of a degree that is not higher than the denominator's; add a filter, N/(s + N)"


class TransferFunction(Lti, Sampled, Block):
    """A linear system by its transfer function, for a scalar, or for each element of an array alike.

    ``Y = gain numerator(s) / denominator(s) U``, highest powers first: ``[1, 3]`` is s + 3, of plain numbers
    in SI units (s in rad/s); ``gain`` brings the unit. A continuous system needs no ``rate``. At a rate it is
    sampled by a ``method`` as python-control's ``sample_system`` does it; with ``discrete`` the polynomials
    are in z. It has direct feedthrough if both degrees are equal, or if the method makes it so: tustin, foh,
    impulse, backward. It begins at rest, or in the steady state of ``initial_input``.

    ``file`` holds ``numerator`` and ``denominator`` (or ``num``, ``den``) in place of the parameters:
    .yaml, .npz, .mat, or a text with the name on the line above the numbers; with ``dt`` (s) it is a
    sampled system. ``TransferFunction.of(system)`` takes a system of python-control. A numerator of
    higher degree is refused.

    Source: K. Ogata, Modern Control Engineering, section 9-2 (controllable canonical form).
    """

    numerator = Param((1.0,), type="float64[k]", doc="coefficients, highest power first")
    denominator = Param((1.0,), type="float64[l]", doc="coefficients, highest power first")
    file = Param("", type="file", doc="a file with both, in their place")

    example = """
        voltage: {block: sources.step, rate: continuous, with: {after: 6 V}}
        motor:
          block: systems.transfer_function
          with: {numerator: [0.01], denominator: [0.005, 0.06, 0.1001], gain: 1 rad/s/V}
          in: {u: voltage.y}
    """

    @classmethod
    def of(cls, system: Any, **parameters: Any) -> Self:
        """Return the block of a system of python-control with one input and one output.

        A discrete system runs at the rate whose period it has. QuadvisError if it has more ports.
        """
        return cls(**polynomials_of(system), **parameters)

    @classmethod
    def ports(cls, numerator: Any, denominator: Any, method: int, file: str) -> dict[str, Any]:
        """Return states for the order of the system."""
        if file:
            numerator, denominator = polynomials(read_once(read_model, file))
        order = degree(denominator)
        direct = degree(numerator) == order or method in DIRECT
        return lti(max(order, 1), method == CONTINUOUS, direct)

    def check(self) -> None:
        """Refuse a system that is none, and one that is not causal."""
        given = self.numerator, self.denominator
        if self.file:
            if any(each.tolist() != [1.0] for each in given):
                raise ParameterError("file", "file must be left out where numerator or denominator is given")
            held = self.read_file("file", read_model)
            self.suits(held)
            given = polynomials(held)
        numerator, denominator = given
        if not np.isfinite(numerator).all():
            raise ParameterError("numerator", "numerator must be finite")
        if degree(denominator) < 0 or not np.isfinite(denominator).all():
            raise ParameterError("denominator", "denominator must be finite, and not 0")
        if degree(numerator) > degree(denominator):
            raise ParameterError("numerator", IMPROPER)
        with np.errstate(all="ignore"):
            exact = self._matched(numerator, denominator)
            model = self.computed(of_polynomials(numerator, denominator), exact)
        self.take(model, discrete=self.method != CONTINUOUS)

    def picture_formula(self) -> tuple[str, str]:
        """Return numerator and denominator."""
        given = polynomials(self.read_file("file", read_model)) if self.file else None
        numerator, denominator = given or (self.numerator, self.denominator)
        return fraction(numerator, denominator, self.gain, "z" if self.method == DISCRETE else "s")

    def _matched(self, numerator: Any, denominator: Any) -> Any:
        if self.method != MATCHED or np.isnan(self.period):
            return None
        if numerator[-1] == 0.0 or denominator[-1] == 0.0:
            problem = "method must be another one than matched, which needs a finite gain at 0 other than 0"
            raise ParameterError("method", problem)
        return matched(*roots_of(numerator, denominator), self.period)
