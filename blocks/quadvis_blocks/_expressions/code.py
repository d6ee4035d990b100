"""Functions that compute expressions, made from their trees.

The text of such a function consists of names of ours, of checked names of ports, and of signs that stand for
the calls of a tree; nothing that a diagram says is in it otherwise. Numbers are constants of the block, so
expressions that differ in their numbers alone share their machine code.
"""

from __future__ import annotations

import hashlib
import keyword
import linecache
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from quadvis.block import Block, In, Out
from quadvis.block.interface import RESERVED
from quadvis.units.expression import COMPARISONS, Call, Number, Symbol, Tree
from quadvis_blocks._expressions import functions
from quadvis_blocks._expressions.kinds import constant

SCOPE: dict[str, Any] = {
    "__name__": "quadvis_blocks._expressions.code", "_np": np, "_entry": functions.entry,
    **{f"_{name}": getattr(math, name) for name in (
        "sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "exp", "log", "log10",
        "sqrt", "pow",
    )},
    "_abs": abs, "_sign": functions.sign, "_min": functions.least, "_max": functions.greatest,
    "_mod": functions.mod, "_rem": functions.rem, "_floor": functions.floor, "_ceil": functions.ceil,
    "_round": functions.nearest, "_fix": functions.fix,
}  # fmt: skip
CONSTANTS = "_constants"
_SIGNS = {"+", "-", "*", "/", *COMPARISONS, "and", "or"}
_MOST_SQUARES = 8  # whole powers up to this one are written as products


def is_name(name: str) -> bool:
    """Say whether a signal can have a name, which stands in a function."""
    return not keyword.iskeyword(name) and not name.startswith("_") and name not in ("self", "time")


def is_parameter(name: str) -> bool:
    """Say whether a parameter can have a name, which is an attribute of the block."""
    return is_name(name) and name not in RESERVED


def with_signals(
    kind: type[Block],
    function: Any,
    asked: Sequence[str],
    inputs: Mapping[str, In],
    outputs: Mapping[str, Out],
) -> type[Block]:
    """Return a class with these ports, which are no attributes: a signal may have any name."""
    for name, port in (*inputs.items(), *outputs.items()):
        port.name = name
    made: Any = kind
    made.output = function
    arguments = {**kind.interface.arguments, "output": tuple(asked)}
    made.interface = replace(kind.interface, inputs=inputs, outputs=outputs, arguments=arguments)
    return kind


class CodeWriter:
    """Writes expressions as text; ``constants`` are the numbers that it has met (SI)."""

    def __init__(self, words: Mapping[str, str], numbers: str = CONSTANTS) -> None:
        """``words`` say what stands for each name, ``numbers`` what stands for the array of constants."""
        self.words, self.numbers = words, numbers
        self.constants: list[float] = []

    def number(self, value: float) -> str:
        """Return what stands for a number."""
        if value not in self.constants:
            self.constants.append(value)
        return f"{self.numbers}[{self.constants.index(value)}]"

    def text(self, tree: Tree) -> str:
        """Return an expression as text."""
        value = constant(tree)
        if value is not None:
            return self.number(float(value))
        assert not isinstance(tree, Number)
        if isinstance(tree, Symbol):
            return self.words[tree.text]
        return self._call(tree)

    def _call(self, tree: Call) -> str:
        function = tree.function
        if function == "^":
            return self._power(*tree.arguments)
        texts = [self.text(argument) for argument in tree.arguments]
        if function in _SIGNS:
            return f"({texts[0]} {function} {texts[1]})"
        if function == "neg":
            return f"(-{texts[0]})"
        if function == "not":
            return f"(not {texts[0]})"
        if function == "if":
            return f"({texts[1]} if {texts[0]} else {texts[2]})"
        if function in ("min", "max"):
            found = texts[0]
            for text in texts[1:]:
                found = f"_{function}({found}, {text})"
            return found
        return f"_{function}({', '.join(texts)})"

    def _power(self, base: Tree, exponent: Tree) -> str:
        power, text = constant(exponent), self.text(base)
        if power == 0.5:
            return f"_sqrt({text})"
        if power is not None and isinstance(base, Symbol) and power in range(2, _MOST_SQUARES + 1):
            return f"({' * '.join([text] * int(power))})"
        return f"_pow({text}, {self.text(exponent)})"


def made(text: str) -> dict[str, Any]:
    """Return the functions of a text, whose lines Python finds as it finds those of a file."""
    name = f"<expression {hashlib.sha256(text.encode()).hexdigest()[:16]}>"
    linecache.cache[name] = (len(text), None, text.splitlines(keepends=True), name)
    scope = dict(SCOPE)
    exec(compile(text, name, "exec", dont_inherit=True), scope)
    return scope


def elementwise(
    inputs: Sequence[str], params: Sequence[str], lines: Sequence[str], results: Sequence[tuple[str, bool]]
) -> str:
    """Return the text of ``output``: some lines that compute results from inputs, for each element.

    ``results`` are names in those lines, and whether they are truth values.
    """
    names = [name for name, _ in results]
    values = [CONSTANTS, *(f"_p{index}" for index in range(len(params))), *inputs]
    arrays = [name for name in inputs if name != "time"]
    taken = [f"self.{CONSTANTS}", *(f"self.{name}" for name in params)]
    one = ", ".join([*taken, *inputs])
    each = [name if name == "time" else f"_entry({name}, _index)" for name in inputs]
    some = ", ".join([taken[0], *(f"_entry({name}, _index)" for name in taken[1:]), *each])
    text = [f"def _values({', '.join(values)}):", *(f"    {line}" for line in lines)]
    text += [f"    return {', '.join(names)}", "", f"def output({', '.join(['self', *inputs])}):"]
    if not arrays:
        return "\n".join([*text, f"    return _values({one})", ""])
    text += [f"    if isinstance({arrays[0]}, (float, bool)):", f"        return _values({one})"]
    for name, is_truth in results:
        text.append(f"    {name} = _np.empty({arrays[0]}.shape, _np.{'bool_' if is_truth else 'float64'})")
    targets = ", ".join(f"{name}.flat[_index]" for name in names)
    text += [f"    for _index in range({arrays[0]}.size):", f"        {targets} = _values({some})"]
    return "\n".join([*text, f"    return {', '.join(names)}", ""])
