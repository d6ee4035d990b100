"""A comparison of two signals."""

from __future__ import annotations

from typing import Any

from quadvis.block import Block, In, Out, Param

OPERATORS = ("<", "<=", "==", "!=", ">=", ">")
LESS, AT_MOST, EQUAL, UNEQUAL, AT_LEAST, MORE = range(6)
KINDS = ("float64", "int64", "bool")


class Compare(Block):
    """Whether two signals, or a signal and a constant, compare as asked, element by element: ``y = a < b``.

    ``takes: int64`` compares whole numbers, such as modes. What is NaN is unequal to all, and neither less
    nor more.
    """

    jumps = True
    operator = Param(
        "<", choices=OPERATORS, doc="how they must compare; in quotes, since YAML knows > itself"
    )
    takes = Param("float64", choices=KINDS, doc="the kind of the inputs")
    a = In("float64[*]", unit="a", doc="the left side")
    b = In("float64[*]", unit="a", doc="the right side")
    y = Out("bool[*]", doc="whether it is so")

    example = """
        wave: {block: sources.sine, rate: fast, with: {amplitude: 2 m, frequency: 1 Hz}}
        high: {block: logic.compare, rate: fast, with: {operator: ">="}, in: {a: wave.y, b: 1 m}}
    """

    @classmethod
    def ports(cls, takes: int) -> dict[str, Any]:
        """Return inputs of that kind; numbers have a unit."""
        unit = "a" if takes == 0 else "1"
        sides = {"a": "the left side", "b": "the right side"}
        return {name: In(f"{KINDS[takes]}[*]", unit=unit, doc=doc) for name, doc in sides.items()}

    def picture_formula(self) -> tuple[str, ...]:
        """Return the operator."""
        return (OPERATORS[self.operator],)

    def output(self, a: Any, b: Any) -> Any:
        """Return the truth value."""
        if self.operator == LESS:
            return a < b
        if self.operator == AT_MOST:
            return a <= b
        if self.operator == EQUAL:
            return a == b
        if self.operator == UNEQUAL:
            return a != b
        return a >= b if self.operator == AT_LEAST else a > b
