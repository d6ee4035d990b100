"""Transfer functions as texts, for pictures of diagrams: "0.5 s² + s + 1"."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

LONGEST = 30  # characters
_POWERS = str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹")


def fraction(numerator: Any, denominator: Any, gain: float, variable: str) -> tuple[str, str]:
    """Return numerator and denominator of a transfer function; long ones as N(s), D(s)."""
    above, below = polynomial(numerator, variable), polynomial(denominator, variable)
    if gain != 1.0:
        above = f"{gain:.4g}" if above == "1" else f"{gain:.4g} {_bracketed(above)}"
    return _fitting(above, f"N({variable})"), _fitting(below, f"D({variable})")


def of_factors(
    zeros: Sequence[complex], poles: Sequence[complex], gain: float, variable: str
) -> tuple[str, str]:
    """Return a transfer function by its roots, complex ones in pairs, as a fraction of products."""
    above, below = _factors(zeros, variable), _factors(poles, variable)
    if gain != 1.0:
        above = f"{gain:.4g} {above}" if zeros else f"{gain:.4g}"
    return _fitting(above, f"N({variable})"), _fitting(below, f"D({variable})")


def polynomial(coefficients: Any, variable: str) -> str:
    """Return a polynomial, its highest power first."""
    text = ""
    degree = len(coefficients) - 1
    for place, coefficient in enumerate(np.asarray(coefficients, float)):
        if coefficient == 0.0:
            continue
        power = _power(variable, degree - place)
        size = f"{abs(coefficient):.4g}"
        term = power if power and size == "1" else f"{size} {power}".rstrip()
        sign = "-" if coefficient < 0.0 else "+"
        text = f"{text} {sign} {term}" if text else term if sign == "+" else f"-{term}"
    return text or "0"


def _power(variable: str, power: int) -> str:
    if power < 2:
        return variable * power
    return variable + str(power).translate(_POWERS)


def _factors(roots: Sequence[complex], variable: str) -> str:
    """Return the product of the factors of roots; of a complex pair the one with the upper half."""
    found = []
    for root in roots:
        if root.imag < 0.0:
            continue
        pair = [1.0, -2.0 * root.real, abs(root) ** 2] if root.imag else [1.0, -root.real]
        found.append(_bracketed(polynomial(pair, variable)))
    return found[0].strip("()") if len(found) == 1 else "".join(found) or "1"


def _bracketed(text: str) -> str:
    return f"({text})" if " " in text else text


def _fitting(text: str, name: str) -> str:
    return text if len(text) <= LONGEST else name
