"""An identified transfer function: its coefficients with their deviations, and the block that it makes."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadvis.analysis.probe import Vector
from quadvis.analysis.systems import library
from quadvis.machine.columns import table
from quadvis.output.statistics import finite
from quadvis.units import Unit, format_quantity

SECOND = Unit.parse("s")
MOST_DELAYS = 60  # periods of the grid: the longest dead time that is sought
WHITE = 0.3  # a larger correlation of neighbouring residuals is remarked on


@dataclass(frozen=True)
class Identified:
    """A transfer function from the input to the output (``names``), highest powers first, in SI units.

    ``deviations`` are the standard deviations of numerator and denominator, true for white noise on the
    output; the leading 1 has none. ``period`` (s) is 0 for powers of s, else they are powers of z. ``delay``
    is the dead time (s), ``unit`` that of the output over the input. ``fit`` (percent, NRMSE) is that on the
    samples that were not fitted, ``fit_own`` on those that were; ``samples`` are their numbers. ``noise`` is
    the standard deviation of the residuals, ``colour`` the correlation of neighbouring ones. ``simulated``
    are times (s), the output as recorded, and as the model has it: NaN where it answers to inputs before
    the recording. ``longest`` says that no longer dead time was sought.
    """

    names: tuple[str, str]
    unit: Unit
    numerator: Vector
    denominator: Vector
    deviations: tuple[Vector, Vector]
    delay: float
    period: float
    fit: float
    fit_own: float
    noise: float
    colour: float
    samples: tuple[int, int]
    simulated: tuple[Vector, Vector, Vector]
    longest: bool = False

    def __repr__(self) -> str:
        kind = "discrete" if self.period else "continuous"
        poles = ", ".join(f"{pole:.4g}" for pole in self.poles)
        return f"<Identified {kind} transfer function: poles {poles}, fit {self.fit:.1f} %>"

    @cached_property
    def poles(self) -> NDArray[np.complex128]:
        """The poles: in rad/s, or in z."""
        return np.asarray(np.roots(self.denominator), complex)

    @cached_property
    def system(self) -> Any:
        """The transfer function without its delay, as `control.TransferFunction`."""
        return library().TransferFunction(self.numerator, self.denominator, self.period)

    def block(self, name: str = "model") -> str:
        """Return the lines of a diagram that make this model, a block for the delay before it."""
        source = self.names[0]
        lines = [f"  {name}:", "    block: systems.transfer_function"]
        given = [f"numerator: {_numbers(self.numerator)}", f"denominator: {_numbers(self.denominator)}"]
        if self.unit.symbols:
            given.append(f"gain: 1 {self.unit}")
        if self.period:
            given.append("method: discrete")
            lines.append(f"    rate: {name}_rate  # {self.period:.9g} s")
        lines.append(f"    with: {{{', '.join(given)}}}")
        crossing = "" if self.period else ", across: hold"
        if self.delay:
            wait = f"  {name}_delay: {{block: signal.transport_delay, rate: {name}_rate, "
            wait += f"with: {{delay: {self.delay:.9g} s}}, in: {{u: {source}}}}}"
            lines = [wait, *lines]
            source = f"{name}_delay.y"
        lines.append(f"    in: {{u: {{from: {source}{crossing}}}}}")
        return "\n".join(lines)

    def lines(self) -> Iterator[str]:
        """Yield the lines that `quadvis identify` prints."""
        power = "z" if self.period else "s"
        kind = f"in z at {format_quantity(self.period, SECOND)}" if self.period else "continuous"
        way = f"{self.names[0]} to {self.names[1]}"
        yield f"{way}: {kind}, output error by least squares"
        rows = [("", "coefficient", "standard deviation")]
        for label, values, deviations in (
            ("numerator", self.numerator, self.deviations[0]),
            ("denominator", self.denominator, self.deviations[1]),
        ):
            for index, (value, deviation) in enumerate(
                zip(values.tolist(), deviations.tolist(), strict=True)
            ):
                degree = values.size - 1 - index
                share = f"{deviation:.2g}" if deviation else "none"
                rows.append((f"{label} {power}^{degree}", f"{value:.6g}", share))
        yield from (f"  {line}" for line in table(rows))
        yield f"poles: {', '.join(_complex(pole) for pole in self.poles)}" + (
            " rad/s" if not self.period else ""
        )
        if self.delay:
            yield f"delay: {format_quantity(self.delay, SECOND)}"
        if self.longest:
            yield (
                f"no delay of more than {MOST_DELAYS} samples is sought, and it may be longer: take fewer "
                "samples, such as by 'quadvis export LOG --every 1s -o FILE.csv'"
            )
        yield (
            f"fit: {self.fit:.2f} % of {self.samples[1]} samples that were not fitted, "
            f"{self.fit_own:.2f} % of the {self.samples[0]} others"
            if self.samples[1] >= 2
            else f"fit: {self.fit_own:.2f} % of {self.samples[0]} samples, all of them fitted"
        )
        if abs(self.colour) > WHITE:
            yield (
                f"the residuals are not white (neighbours correlate by {self.colour:.2f}): the deviations "
                "are not to be relied upon; a higher order, more zeros or a delay may be missing"
            )

    def facts(self) -> dict[str, Any]:
        """Return the model as plain data: what `quadvis identify --json` prints."""
        return {
            "input": self.names[0],
            "output": self.names[1],
            "unit": str(self.unit),
            "period_s": self.period,
            "delay_s": self.delay,
            "numerator": self.numerator.tolist(),
            "denominator": self.denominator.tolist(),
            "numerator_deviation": self.deviations[0].tolist(),
            "denominator_deviation": self.deviations[1].tolist(),
            "poles": [[float(pole.real), float(pole.imag)] for pole in self.poles],
            "fit_percent": finite(self.fit),
            "fit_own_percent": finite(self.fit_own),
            "noise": self.noise,
            "colour": self.colour,
            "samples": list(self.samples),
            "block": self.block(),
        }


def _numbers(values: Vector) -> str:
    return f"[{', '.join(f'{value:.9g}' for value in values.tolist())}]"


def _complex(pole: complex) -> str:
    return f"{pole.real:.4g}" if math.isclose(pole.imag, 0.0, abs_tol=1e-12) else f"{pole:.4g}"
