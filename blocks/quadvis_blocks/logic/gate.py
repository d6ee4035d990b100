"""A logical operation on truth values."""

from __future__ import annotations

from typing import Any

from quadvis.block import Block, In, Out, Param, ParameterError

OPERATORS = ("and", "or", "xor", "not", "nand", "nor")
AND, OR, XOR, NOT, NAND, NOR = range(6)


class Gate(Block):
    """A logical operation on any number of truth values, element by element.

    ``xor`` is true if an odd number of inputs is. ``not`` takes one input.
    """

    operator = Param("and", choices=OPERATORS, doc="which operation")
    u = In("bool[*]", many=True, doc="the truth values")
    y = Out("bool[*]", doc="the result")

    example = """
        wave: {block: sources.sine, rate: fast, with: {amplitude: 2 m, frequency: 1 Hz}}
        low: {block: logic.compare, rate: fast, with: {operator: ">"}, in: {a: wave.y, b: -1 m}}
        high: {block: logic.compare, rate: fast, with: {operator: "<"}, in: {a: wave.y, b: 1 m}}
        inside: {block: logic.gate, rate: fast, with: {operator: and}, in: {u: [low.y, high.y]}}
    """

    def picture_formula(self) -> tuple[str, ...]:
        """Return the operator."""
        return (OPERATORS[self.operator].upper(),)

    def check(self) -> None:
        """Refuse several inputs of ``not``."""
        count = self.entry_counts.get("u", 1)
        if self.operator == NOT and count > 1:
            raise ParameterError("operator", f"operator must be another one than not for {count} signals")

    def output(self, *u: Any) -> Any:
        """Return the result."""
        first = u[0]
        if isinstance(first, bool):
            found = first
            for place in range(1, len(u)):
                found = _joined(self.operator, found, u[place])
            return found != (self.operator >= NOT)
        y = first.copy()
        for index in range(y.size):
            found = first.flat[index] != 0
            for place in range(1, len(u)):
                found = _joined(self.operator, found, u[place].flat[index] != 0)
            y.flat[index] = found != (self.operator >= NOT)
        return y


def _joined(operator: int, a: bool, b: bool) -> bool:
    if operator in (AND, NAND):
        return a and b
    return a or b if operator in (OR, NOR) else a != b
