"""Expressions over signals."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from functools import lru_cache
from typing import Any, ClassVar

import numpy as np

from quadvis.block import Block, Derived, In, Out, Param, ParameterError, copied
from quadvis.errors import quoted
from quadvis.units import UnitError, parse_quantity
from quadvis.units.expression import Tree, names_of, parse_expression
from quadvis_blocks._expressions.code import (
    CONSTANTS,
    CodeWriter,
    elementwise,
    is_name,
    is_parameter,
    made,
    with_signals,
)
from quadvis_blocks._expressions.kinds import TIME, Kinds

Texts = tuple[tuple[str, str], ...]


class Expression(Block):
    """Outputs by formulas: ``with: {y: "k * sin(a) + max(b, 0)", k: 2 m}`` has the inputs a and b.

    Under ``with``, what has names in it is an output, and what is a value is a parameter. All other names are
    inputs, and ``time`` is the time (s). There are ``+ - * / ^``, comparisons, ``and``, ``or``, ``not``,
    ``if(condition, a, b)``, ``pi``, and the functions sin cos tan asin acos atan atan2 sinh cosh tanh exp log
    log10 sqrt abs sign min max mod rem floor ceil round fix. Units are checked: sin takes an angle, a sum one
    unit. An output may use other outputs. Arrays count element by element. A value that a function does not
    have ends the run. Without any formula the block is ``y: u``.
    """

    free_names = "outputs, parameters and inputs, by formulas under 'with'"
    u = In("float64[*]", unit="a", doc="a signal of the formulas")
    y = Out("float64[*]", unit="a", doc="the value of a formula")
    constants: ClassVar[tuple[float, ...]] = ()

    example = """
        angle: {block: sources.ramp, rate: fast, with: {slope: 90 deg/s}}
        load: {block: sources.constant, rate: fast, with: {value: 3 N}}
        force:
          block: math.expression
          rate: fast
          with: {y: "k * sin(a) + max(b, 0)", k: 2 N}
          in: {a: angle.y, b: load.y}
    """

    @classmethod
    def named(cls, given: Mapping[str, Any], inputs: Collection[str]) -> type[Block]:
        """Return the class for the formulas and values under ``with``."""
        texts = {name: value for name, value in given.items() if isinstance(value, str)}
        formulas = tuple((name, text) for name, text in texts.items() if is_formula(text, given, inputs))
        if not formulas:
            raise ParameterError("", "there is no formula; give one under 'with', such as y: \"2 * u\"")
        values = tuple(name for name in given if name not in dict(formulas))
        base: Any = cls
        return _kind(base, formulas, values, tuple(inputs))

    def picture_lines(self) -> tuple[str, ...]:
        """Return the formulas."""
        texts = {
            name: getattr(self, name) for name in self.interface.params if name in self.interface.outputs
        }
        return tuple(f"{name} = {text}" for name, text in texts.items())

    def check(self) -> None:
        """Lay the numbers of the formulas down in memory."""
        if self.constants:
            setattr(self, CONSTANTS, np.array(self.constants))

    def output(self, u: Any) -> Any:
        """Return the signal itself."""
        return copied(u)


def is_formula(text: str, given: Collection[str], inputs: Collection[str]) -> bool:
    """Say whether a text has names in it; a quantity is a value, also if its unit is the name of an input."""
    if text in ("true", "false") or _is_value(text):
        return False
    try:
        return any(True for _ in names_of(parse_expression(text, (*given, *inputs, TIME))))
    except UnitError:
        return True


def _is_value(text: str) -> bool:
    try:
        parse_quantity(text)
    except UnitError:
        return False
    return True


@lru_cache(maxsize=256)
def _kind(cls: Any, formulas: Texts, values: tuple[str, ...], inputs: tuple[str, ...]) -> type[Block]:
    trees = _trees(formulas, (*values, *inputs))
    used = {name for tree in trees.values() for name in names_of(tree)}
    for name in (*dict(formulas), *inputs):
        if not is_name(name):
            raise ParameterError(name, f"{quoted(name)} cannot be a name here; choose another one")
    for name in (*dict(formulas), *values):
        if not is_parameter(name):
            raise ParameterError(name, f"{quoted(name)} cannot be a name under 'with'; choose another one")
    for name in values:
        if name not in used:
            raise ParameterError(name, f"no formula has {quoted(name)}; leave it out, or use it")
    try:
        kinds = Kinds((*values, *inputs), trees)
    except UnitError as error:
        raise ParameterError(formulas[0][0], str(error)) from None
    return _made(cls, trees, kinds, values, inputs)


def _trees(formulas: Texts, others: tuple[str, ...]) -> dict[str, Tree]:
    """Return the trees of the formulas, each after those that it uses."""
    names = (*dict(formulas), *others, TIME)
    trees: dict[str, Tree] = {}
    for name, text in formulas:
        try:
            trees[name] = parse_expression(text, names)
        except UnitError as error:
            raise ParameterError(name, str(error)) from None
    found: dict[str, Tree] = {}

    def add(name: str, above: tuple[str, ...]) -> None:
        if name in above:
            raise ParameterError(name, f"{quoted(name)} is computed from itself; use another name")
        for other in names_of(trees[name]):
            if other in trees and other not in found:
                add(other, (*above, name))
        found[name] = trees[name]

    for name in trees:
        if name not in found:
            add(name, ())
    return found


def _made(
    cls: type[Expression],
    trees: Mapping[str, Tree],
    kinds: Kinds,
    values: tuple[str, ...],
    inputs: tuple[str, ...],
) -> type[Block]:
    has_time = any(name == TIME for tree in trees.values() for name in names_of(tree)) and TIME not in inputs
    asked = (*inputs, *((TIME,) if has_time else ()))
    words = {name: f"_p{index}" for index, name in enumerate(values)} | {name: name for name in asked}
    words |= {name: f"_y{index}" for index, name in enumerate(trees)}
    writer = CodeWriter(words)
    lines = [f"{words[name]} = {writer.text(tree)}" for name, tree in trees.items()]
    results = [(words[name], kinds.is_truth(name)) for name in trees]
    shape = "[*]" if inputs else ""
    members: dict[str, Any] = {
        "u": None, "y": None, "output": _nothing, "constants": tuple(writer.constants) or (0.0,),
        CONSTANTS: Derived(f"float64[{len(writer.constants) or 1}]", doc="numbers of the formulas (SI)"),
        "made_for": {}, "__doc__": cls.__doc__, "__module__": cls.__module__,
    }  # fmt: skip
    for name in values:
        truth = kinds.is_truth(name)
        many = "[*?]" if inputs and not truth else ""
        unit = _unit(kinds, name)
        members[name] = Param(None, _type(truth, many), unit, tune=True, doc="a value of the formulas")
    members |= {name: Param(type="str", doc="a formula") for name in trees}
    kind: type[Block] = type(cls.__name__, (cls,), members)
    types = {name: _type(kinds.is_truth(name), shape) for name in (*inputs, *trees)}
    units = {name: _unit(kinds, name) for name in types}
    taken = {name: In(types[name], unit=units[name], doc="a signal of the formulas") for name in inputs}
    given = {name: Out(types[name], unit=units[name], doc="the value of a formula") for name in trees}
    function = made(elementwise(asked, values, lines, results))["output"]
    return with_signals(kind, function, asked, taken, given)


def _nothing(self: Any) -> None:
    """Stand in for a method until the ports are there."""


def _type(is_truth: bool, shape: str) -> str:
    return f"{'bool' if is_truth else 'float64'}{shape}"


def _unit(kinds: Kinds, name: str) -> str:
    return "1" if kinds.is_truth(name) else str(kinds.unit(name).reduced)
