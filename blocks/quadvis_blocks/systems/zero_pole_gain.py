"""A linear system by its zeros, poles and gain."""

from __future__ import annotations

from typing import Any, Self

import numpy as np

from quadvis.block import Block, Param, ParameterError
from quadvis.errors import QuadvisError, quoted
from quadvis.machine.inputs import read_once
from quadvis_blocks.systems._files import read_model, roots
from quadvis_blocks.systems._lti import Lti, lti
from quadvis_blocks.systems._models import of_roots, paired
from quadvis_blocks.systems._of_control import method_of, roots_text
from quadvis_blocks.systems._sampled import Sampled
from quadvis_blocks.systems._sampling import CONTINUOUS, DIRECT, DISCRETE, MATCHED, matched
from quadvis_blocks.systems._written import of_factors


class ZeroPoleGain(Lti, Sampled, Block):
    """A linear system by its zeros, poles and gain, for a scalar, or for each element of an array alike.

    ``Y = gain (s - z0)(s - z1) ... / ((s - p0)(s - p1) ...) U``, zeros and poles in rad/s: plain numbers,
    complex ones in conjugate pairs, ``poles: -2, -1+3j, -1-3j``. It runs as a chain of sections of order 2,
    which is accurate for systems of high order. ``method``, direct feedthrough and start are those of
    `systems.transfer_function`; with ``discrete`` the zeros and poles are in z.
    ``file`` holds ``zeros``, ``poles`` and ``gain`` (or ``z``, ``p``, ``k``) in place of the parameters, as
    for `systems.transfer_function`; its gain is times the block's, which brings the unit.
    ``ZeroPoleGain.of(system)`` takes a system of python-control.

    Source: G. F. Franklin, J. D. Powell, M. Workman, Digital Control of Dynamic Systems, chapter 6.
    """

    zeros = Param("", type="str", doc="the zeros, apart by commas or blanks; none by default")
    poles = Param("", type="str", doc="the poles")
    file = Param("", type="file", doc="a file with zeros, poles and gain, in their place")

    example = """
        force: {block: sources.step, rate: continuous, with: {after: 2 N}}
        beam:
          block: systems.zero_pole_gain
          with: {poles: "-0.5+6j, -0.5-6j", gain: 3 m/N}
          in: {u: force.y}
    """

    @classmethod
    def of(cls, system: Any, **parameters: Any) -> Self:
        """Return the block of a system of python-control with one input and one output."""
        if not system.issiso():
            raise QuadvisError("a system by zeros and poles has one input and one output")
        zeros, poles = system.zeros(), system.poles()
        given: dict[str, Any] = {
            "zeros": roots_text(zeros),
            "poles": roots_text(poles),
            "gain": _gain(system, zeros, poles),
        }
        return cls(**given | method_of(system) | parameters)

    @classmethod
    def ports(cls, zeros: str, poles: str, method: int, file: str) -> dict[str, Any]:
        """Return states for the poles."""
        if file:
            above, below = map(len, roots(read_once(read_model, file))[:2])
        else:
            above, below = len(_roots("zeros", zeros)), len(_roots("poles", poles))
        return lti(max(below, 1), method == CONTINUOUS, above == below or method in DIRECT)

    def check(self) -> None:
        """Refuse roots that are none, and a system that is not causal."""
        zeros, poles, gain = self._given()
        if len(zeros) > len(poles):
            problem = f"zeros must be no more than poles, {len(poles)}, got {len(zeros)}"
            raise ParameterError("zeros", f"{problem}; add a pole, -N, as a filter")
        exact = None
        with np.errstate(all="ignore"):
            if self.method == MATCHED and self.period == self.period:
                if 0.0 in (*zeros, *poles):
                    problem = "method must be another one than matched, which needs a finite gain at 0"
                    raise ParameterError("method", f"{problem} other than 0")
                exact = matched(zeros, poles, gain, self.period)
            model = self.computed(of_roots(zeros, poles, gain), exact)
        self.take(model, discrete=self.method != CONTINUOUS)

    def picture_formula(self) -> tuple[str, str]:
        """Return numerator and denominator as products."""
        zeros, poles, gain = self._given()
        return of_factors(zeros, poles, gain * self.gain, "z" if self.method == DISCRETE else "s")

    def _given(self) -> tuple[list[complex], list[complex], float]:
        """Return zeros, poles and gain, by the parameters or by the file."""
        if not self.file:
            return _roots("zeros", self.zeros), _roots("poles", self.poles), 1.0
        if self.zeros or self.poles:
            raise ParameterError("file", "file must be left out where zeros or poles are given")
        held = self.read_file("file", read_model)
        self.suits(held)
        zeros, poles, gain = roots(held)
        for name, found in (("zeros", zeros), ("poles", poles)):
            if not paired(found):
                raise ParameterError(
                    "file", f"file must have the conjugate of each complex number of its {name}"
                )
        return zeros, poles, gain


def _roots(name: str, text: str) -> list[complex]:
    """Return the complex numbers in a text."""
    found = []
    for word in text.replace(",", " ").split():
        try:
            root = complex(word.replace("i", "j"))
        except ValueError:
            root = complex(np.nan)
        if not np.isfinite(root):
            problem = f"{name} must be numbers such as -2 or -1+3j, without blanks inside, got {quoted(word)}"
            raise ParameterError(name, problem)
        found.append(root)
    if not paired(found):
        raise ParameterError(
            name, f"{name} must have the conjugate of each complex number, got {quoted(text)}"
        )
    return found


def _gain(system: Any, zeros: Any, poles: Any) -> float:
    """Return the gain, from the response at a point that is no root."""
    point = 2.0 + 2.0 * float(np.max(np.abs([0.0, *zeros, *poles])))
    return float((system(point) * np.prod(point - poles) / np.prod(point - zeros)).real)
