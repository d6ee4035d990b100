"""The grammar of expressions: "$a / $b", "2 pi rad/s", "k * sin(x) + max(y, 0)" as trees; nothing is run.

From loose to tight: or, and, not, comparisons, + and -, * and /, the sign, ^ (or **; from the right, as in
Python). A unit follows its number: "3 m/s", "2 kg*m^2". Behind a fraction of plain numbers it belongs to the
whole fraction: "1/30 s" and "pi/2 rad". Elsewhere a unit behind a divisor is refused, as it has two readings.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator
from fractions import Fraction
from typing import NamedTuple

from quadvis.errors import counted, quoted, suggestion
from quadvis.units.grammar import UnitError, plain_spelling
from quadvis.units.unit import Unit

LONGEST_EXPRESSION, MOST_WORDS, DEEPEST = 1000, 300, 60
PI = Unit(frozenset({("pi", Fraction(1))}))  # a scale without a name, so multiples of pi stay exact
# Functions and the numbers of their arguments.
FUNCTIONS = {
    **dict.fromkeys(
        ("sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "exp", "log", "log10",
         "abs", "sign", "sqrt", "floor", "ceil", "round", "fix"), (1, 1),
    ),
    "atan2": (2, 2), "mod": (2, 2), "rem": (2, 2), "min": (2, 16), "max": (2, 16), "if": (3, 3),
}  # fmt: skip
COMPARISONS = ("<", "<=", ">", ">=", "==", "!=")
WORDS = ("and", "or", "not")
_TOKEN = re.compile(
    r"\s*(?:(?P<number>(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)"
    r"|(?P<parameter>\$[A-Za-z_]\w*(?:\.[A-Za-z_]\w*)?(?:\[[0-9]{1,6}\])?)"
    r"|(?P<name>[A-Za-z_]\w*|%)|(?P<sign>\*\*|[<>=!]=|[-+*/^(),<>]))",
    re.ASCII,
)
_ELSEWHERE = {
    "pow": "write a ^ b", "power": "write a ^ b", "arcsin": "write asin", "arccos": "write acos",
    "arctan": "write atan", "arctan2": "write atan2", "ln": "write log", "fabs": "write abs",
    "sgn": "write sign", "square": "write a ^ 2", "hypot": "write sqrt(a^2 + b^2)",
}  # fmt: skip


class Number(NamedTuple):
    """A number and its unit, as written."""

    value: Fraction
    unit: Unit = Unit()


class Symbol(NamedTuple):
    """A parameter with its ``$``, or the name of a signal."""

    text: str


class Call(NamedTuple):
    """An operator or a function by name, and its arguments; ``neg`` is the sign, ``^`` the power."""

    function: str
    arguments: tuple[Tree, ...]


Tree = Number | Symbol | Call


def parse_expression(text: str, names: Collection[str] | None = None) -> Tree:
    """Return the tree of an expression; UnitError says what is wrong.

    With ``names``, these are signals and parameters, which stand without ``$``.
    """
    if len(text) > LONGEST_EXPRESSION:
        raise UnitError(f"an expression has {len(text)} characters", f"stay below {LONGEST_EXPRESSION}")
    return _Reader(text, names).tree()


def names_of(tree: Tree) -> Iterator[str]:
    """Yield the names in a tree, from left to right."""
    if isinstance(tree, Symbol):
        yield tree.text
    elif isinstance(tree, Call):
        for argument in tree.arguments:
            yield from names_of(argument)


class _Reader:
    """Reads one expression by recursive descent."""

    def __init__(self, text: str, names: Collection[str] | None) -> None:
        self.text, self.names = text, names
        self.tokens = self._split(plain_spelling(text))
        self.at = self.depth = 0

    def _split(self, text: str) -> list[tuple[str, str]]:
        found, position = [], 0
        while position < len(text):
            match = _TOKEN.match(text, position)
            if match is None or match.lastgroup is None:
                raise self._fault(f"holds {quoted(text[position:].strip()[:1])}", "that is no part of one")
            kind, token = match.lastgroup, match[match.lastgroup]
            found.append((kind, "^" if token == "**" else token))
            position = match.end()
            if len(found) > MOST_WORDS:
                raise self._fault("is too long", "use parameters for parts of it")
        return found

    def _fault(self, problem: str, remedy: str = "") -> UnitError:
        return UnitError(f"{quoted(self.text)} {problem}", remedy)

    def _peek(self, ahead: int = 0) -> tuple[str, str]:
        place = self.at + ahead
        return self.tokens[place] if place < len(self.tokens) else ("end", "")

    def _takes(self, *signs: str) -> str:
        """Return the next token if it is one of these, and go on; else an empty text."""
        if self._peek()[0] in ("sign", "name") and self._peek()[1] in signs:
            self.at += 1
            return self.tokens[self.at - 1][1]
        return ""

    def tree(self) -> Tree:
        """Return the whole."""
        found = self._either()
        if self._peek()[0] != "end":
            raise self._unexpected()
        return found

    def _unexpected(self) -> UnitError:
        kind, token = self._peek()
        before = self.tokens[self.at - 1][0] if self.at else ""
        if kind == "end":
            return self._fault("ends too early")
        if kind in ("number", "name", "parameter") and before in ("number", "name", "parameter"):
            return self._fault(f"lacks a sign before {quoted(token)}", "write '*' for a product")
        return self._fault(f"has {quoted(token)} where it cannot stand")

    def _either(self) -> Tree:
        self._enter()
        found = self._both()
        while self._takes("or"):
            found = Call("or", (found, self._both()))
        self.depth -= 1
        return found

    def _both(self) -> Tree:
        found = self._denied()
        while self._takes("and"):
            found = Call("and", (found, self._denied()))
        return found

    def _denied(self) -> Tree:
        self._enter()
        found = Call("not", (self._denied(),)) if self._takes("not") else self._compared()
        self.depth -= 1
        return found

    def _compared(self) -> Tree:
        found = self._sum()
        sign = self._takes(*COMPARISONS)
        if sign:
            found = Call(sign, (found, self._sum()))
            if self._peek()[1] in COMPARISONS:
                raise self._fault("compares three values at once", "join two comparisons by 'and'")
        return found

    def _sum(self) -> Tree:
        found = self._product()
        while sign := self._takes("+", "-"):
            found = Call(sign, (found, self._product()))
        return found

    def _product(self) -> Tree:
        """Read factors; a unit behind a fraction of plain numbers belongs to all of it."""
        begin, divided = self.at, False
        found = self._signed(measured=True)
        while sign := self._takes("*", "/"):
            if sign == "/" and self._is_unit() and self._is_plain(begin):  # 5/s
                found = Call("/", (found, Number(Fraction(1), self._unit())))
                continue
            divided |= sign == "/"
            found = Call(sign, (found, self._signed(measured=not divided)))
            if divided and self._is_unit():
                if not self._is_plain(begin):
                    remedy = "put the divisor in brackets, as in a/(2 s), or what is before it"
                    raise self._fault("has a unit behind a divisor, which can be read in two ways", remedy)
                found = Call("*", (found, Number(Fraction(1), self._unit())))
        return found

    def _is_plain(self, begin: int) -> bool:
        """Say whether all from there to here are numbers without units."""
        return all(
            kind in ("number", "sign") or token == "pi" or (kind == "name" and token in FUNCTIONS)
            for kind, token in self.tokens[begin : self.at]
        )

    def _signed(self, measured: bool) -> Tree:
        """Read signs and a power; ``measured`` says whether a unit may follow."""
        negative = False
        while sign := self._takes("-", "+"):
            negative ^= sign == "-"
        found = self._power(measured)
        return Call("neg", (found,)) if negative else found

    def _power(self, measured: bool) -> Tree:
        self._enter()
        begin = self.at
        found = self._operand()
        if self._takes("^"):
            found = Call("^", (found, self._signed(measured=False)))
        self.depth -= 1
        is_number = self.tokens[begin][0] == "number" or self.tokens[begin][1] in ("pi", "(", *FUNCTIONS)
        if measured and is_number and self._is_unit():
            unit = self._unit()
            if isinstance(found, Number):
                return Number(found.value, found.unit * unit)
            found = Call("*", (found, Number(Fraction(1), unit)))
        return found

    def _enter(self) -> None:
        self.depth += 1
        if self.depth > DEEPEST:
            raise self._fault("is nested too deep", "use parameters for parts of it")

    def _operand(self) -> Tree:
        kind, token = self._peek()
        self.at += 1
        if kind == "number":
            value = _number(token, self.text)
            if self._peek() == ("name", "pi"):
                return Call("*", (Number(value), self._power(measured=False)))
            return Number(value)
        if token == "(":
            found = self._either()
            self._close()
            return found
        if kind == "parameter" and self.names is None:
            return Symbol(token)
        if kind == "name" and self._peek() == ("sign", "("):
            return self._called(token)
        if kind == "name" and self.names is not None and token in self.names:
            return Symbol(token)
        if token == "pi":
            return Number(Fraction(1), PI)
        self.at -= 1
        if kind == "parameter":
            raise self._fault(f"holds {quoted(token)}", f"write {quoted(token[1:])}")
        if kind == "name" and token not in WORDS:
            raise self._unknown(token)
        raise self._unexpected()

    def _unknown(self, name: str) -> UnitError:
        if self.names is None:
            remedy = f"write '${name}' for a parameter"
            return self._fault(f"holds {quoted(name)}, which is no number", remedy)
        remedy = suggestion(name, (*self.names, "pi"))
        return self._fault(f"holds {quoted(name)}, which is neither an input nor a parameter", remedy)

    def _close(self) -> None:
        if not self._takes(")"):
            if self._peek()[0] == "end":
                raise self._fault("lacks a ')'")
            raise self._unexpected()

    def _called(self, function: str) -> Tree:
        if function not in FUNCTIONS:
            remedy = _ELSEWHERE.get(function) or suggestion(function, FUNCTIONS)
            raise self._fault(f"calls {quoted(function)}, which is not a function here", remedy)
        self.at += 1
        arguments: list[Tree] = []
        if self._peek() != ("sign", ")"):
            arguments.append(self._either())
            while self._takes(","):
                arguments.append(self._either())
        self._close()
        least, most = FUNCTIONS[function]
        if not least <= len(arguments) <= most:
            wanted = counted(least, "argument") if least == most else f"{least} to {most} arguments"
            raise self._fault(f"gives '{function}' {counted(len(arguments), 'argument')}", f"give {wanted}")
        return Call(function, tuple(arguments))

    def _is_unit(self, ahead: int = 0) -> bool:
        """Say whether the next token begins a unit: a name that is nothing else, or the 1 of "5 1/s"."""
        kind, token = self._peek(ahead)
        if kind == "number":
            begins = token == "1" and self._peek(ahead + 1) == ("sign", "/") and ahead < 2
            return begins and self._is_unit(ahead + 2)
        is_other = token in ("pi", *WORDS) or (self.names is not None and token in self.names)
        return kind == "name" and not is_other and self._peek(ahead + 1) != ("sign", "(")

    def _unit(self) -> Unit:
        """Read a unit: names with powers, joined by * and / as far as names of units follow."""
        begin = self.at
        if self._peek()[0] == "number":
            self.at += 2
        self._unit_factor()
        while self._peek()[1] in ("*", "/"):
            grouped = self._peek(1) == ("sign", "(") and self._is_unit_name(2)
            if not grouped and not self._is_unit_name(1):
                break
            self.at += 1
            if not grouped:
                self._unit_factor()
                continue
            while self._peek()[1] not in (")", ""):
                self.at += 1
            self._close()
        text = "".join(token for _, token in self.tokens[begin : self.at])
        unit = Unit.parse(text)
        if unit.variables:
            raise UnitError(f"{quoted(text)} is not a unit", "use m, s, rad, kg, N, V, Hz, px ...")
        return unit

    def _is_unit_name(self, ahead: int) -> bool:
        if not self._is_unit(ahead) or self._peek(ahead)[0] != "name":
            return False
        if self.names is None:
            return True  # parameters have a $, so it can be nothing else
        try:
            return not Unit.parse(self._peek(ahead)[1]).variables
        except UnitError:
            return False

    def _unit_factor(self) -> None:
        self.at += 1
        if not self._takes("^"):
            return
        grouped = self._takes("(")
        self._takes("-")
        self.at += 1
        if grouped:
            while self._peek()[1] not in (")", ""):
                self.at += 1
            self._close()


def _number(token: str, text: str) -> Fraction:
    _, _, exponent = token.lower().partition("e")
    if len(token) > 80 or abs(int(exponent or 0)) > 400:
        raise UnitError(f"{quoted(text)} is outside the range of numbers", "stay between 1e-300 and 1e300")
    if token[0] == "0" and token[1:2].isdigit():
        raise UnitError(
            f"{quoted(text)} holds {quoted(token)}, which begins with a zero", "leave the zero out"
        )
    return Fraction(token)
