"""Units that a diagram gives as a text, and ports of as many elements as a matrix has."""

from __future__ import annotations

from quadvis.block import ParameterError
from quadvis.units import UnitError, parse_units


def vector(count: int) -> str:
    """Return the type of an input of so many elements; for one element a scalar will do."""
    return "float64[1?]" if count == 1 else f"float64[{count}]"


def units_for(text: str, count: int, name: str = "output_units") -> str:
    """Return the units of a port from a parameter; ParameterError unless they are one, or ``count``."""
    try:
        units = parse_units(text or "1")
    except UnitError as error:
        raise ParameterError(name, f"{name} must be units such as 'm m/s': {error}") from None
    if len(units) not in (1, count) or any(unit.variables for unit in units):
        raise ParameterError(name, f"{name} must be {count} units, or one for all, got '{text}'")
    return text or "1"
