"""One value of a YAML file: its place, its faults, and its readings, since the reader decides its type.

YAML's own types never apply: `on`, `1e-3`, `010` and `12:30`, in quotes or not, are texts until a method asks
for a truth value, a number or a quantity. A method that fails raises `DiagramError` with the place. To go on
and report all faults together, call it through `Faults.collect`: `period = faults.collect(node.period)`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Sequence
from fractions import Fraction
from typing import TYPE_CHECKING, Any, TypeVar

from quadvis import units
from quadvis.errors import DiagramError, Fault, Faults, Place, closest, counted, quoted
from quadvis.errors.characters import first_odd, meant, replacement, with_article
from quadvis.units import Unit, UnitError

if TYPE_CHECKING:
    from quadvis.document.tree import YamlMap

ONE = Unit()

_Result = TypeVar("_Result")
_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,63}")
INTEGER = re.compile(r"[+-]?(0|[1-9][0-9]{0,19})")
_DECIMAL_COMMA = re.compile(r"[+-]?[0-9]+,[0-9]+(?![0-9.,])")
TRUTH = {"true": True, "false": False}
_TRUTH_ELSEWHERE = {
    **dict.fromkeys(("on", "yes", "y", "1", "true"), "true"),
    **dict.fromkeys(("off", "no", "n", "0", "false"), "false"),
}


class YamlNode:
    """A value in a file; `key` is its name in messages ("rate", "value[2]")."""

    __slots__ = ("column", "file", "key", "line")

    def __init__(self, file: str, line: int, column: int, key: str = "") -> None:
        self.file, self.line, self.column, self.key = file, line, column, key

    @property
    def place(self) -> Place:
        """The place at which the value begins."""
        return Place(self.file, self.line, self.column)

    def to_python(self) -> Any:
        """Return plain dicts, lists, texts, numbers and truth values, as `dump_yaml` writes them."""
        raise NotImplementedError

    def fault(self, problem: str, remedy: str = "") -> DiagramError:
        """Return an error about this value, to be raised."""
        return DiagramError([Fault(self.place, "", problem, remedy)])

    def wrong(self, expected: str, remedy: str = "", found: str = "") -> DiagramError:
        """Return the error "'rate' must be <expected>, not 'abc'", to be raised."""
        label = quoted(self.key) if self.key else "this"
        return self.fault(f"{label} must be {expected}, not {found or self._described()}", remedy)

    def _described(self) -> str:
        raise NotImplementedError

    def _label(self) -> str:
        """Return how a fault of a quantity begins."""
        return f"{quoted(self.key)}: " if self.key else ""

    def _scalar(self, expected: str) -> str:
        """Return the text of a scalar; lists and maps are not what was expected."""
        raise self.wrong(expected)

    def text(self) -> str:
        """Return a text; only a text in quotes may be empty."""
        return self._scalar("a text")

    def name(self) -> str:
        """Return an identifier: letters, digits and `_`, no digit first, at most 64 of them."""
        value = self._scalar("a name")
        if _NAME.fullmatch(value) is None:
            raise self.wrong("a name", "use letters, digits and '_', and begin with a letter")
        return value

    def boolean(self) -> bool:
        """Return the truth value of `true` or `false`; YAML's other spellings are refused."""
        value = self._scalar("true or false")
        if value in TRUTH:
            return TRUTH[value]
        meant = _TRUTH_ELSEWHERE.get(value.lower())
        raise self.wrong("true or false", f"write {meant}" if meant else "")

    def integer(self) -> int:
        """Return a whole decimal number that fits 64 bits."""
        text = units.plain_text(self._scalar("a whole number"))
        if INTEGER.fullmatch(text) is None:
            value = self._unit_free("a whole number")
            round_one = value.is_integer() and abs(value) < 2**53
            raise self.wrong("a whole number", f"write {value:.0f}" if round_one else "")
        if not -(2**63) <= int(text) < 2**63:
            raise self.wrong("a whole number of at most 64 bits")
        return int(text)

    def number(self) -> float:
        """Return a finite decimal number."""
        return self._unit_free("a number")

    def _unit_free(self, expected: str) -> float:
        text = units.plain_text(self._scalar(expected))
        try:
            number, unit = units.split_quantity(text)
            return (
                float(units.parse_rational(number))
                if "/" in number and not unit
                else units.parse_number(text)
            )
        except UnitError as error:
            number, unit = units.split_quantity(text)
            remedy = f"leave out the unit {quoted(unit)}" if number and unit[:1].isalpha() else error.remedy
            raise self.wrong(expected, remedy) from None

    def choice(self, options: Collection[str]) -> str:
        """Return the text if it is one of the options."""
        value = self._scalar("one word")
        if value in options:
            return value
        names = list(options)
        expected = f"one of {', '.join(map(quoted, names))}" if len(names) <= 8 else "a known word"
        near = closest(value, names)
        raise self.wrong(expected, f"did you mean {quoted(near)}?" if near else "")

    def quantity(self, unit: Unit = ONE, *, bare: bool = True) -> float:
        """Return "50 ms" as a number of `unit`; a bare number counts as such, unless `bare` is false."""
        return self.read(lambda text: units.read_quantity(text, unit, bare=bare))

    def exact(self, unit: Unit) -> Fraction:
        """Return the exact SI value of a quantity that must have a unit of this dimension."""
        return self.read(lambda text: units.parse_rational(text, unit))

    def period(self) -> Fraction:
        """Return the exact period in seconds of "10 Hz", "50 ms" or "1/30 s"."""
        return self.read(units.parse_period)

    def unit(self) -> Unit:
        """Return a unit such as "rad/s^2"."""
        return self.read(Unit.parse)

    def units(self) -> tuple[Unit, ...]:
        """Return the units of elements such as "m m m rad"."""
        return self.read(units.parse_units)

    def read(self, read: Callable[[str], _Result]) -> _Result:
        """Return the result of `read` for a quantity; its `UnitError` is raised with the place."""
        text = self._scalar("a text such as '50 ms'")
        label = self._label()
        odd = first_odd(text)
        if odd is not None and meant(odd) == " ":  # odd blanks are accepted elsewhere
            raise self.fault(f"{label}{quoted(text)} holds {with_article(odd)}", replacement(odd))
        try:
            return read(text)
        except UnitError as error:
            problem, remedy = error.problem, error.remedy
            if odd is not None:
                problem, remedy = f"{quoted(text)} holds {with_article(odd)}", replacement(odd)
            elif _DECIMAL_COMMA.match(text):
                problem, remedy = f"{quoted(text)} is not a number", f"write {quoted(text.replace(',', '.'))}"
            raise self.fault(label + problem, remedy) from None

    def shape(self) -> tuple[int, ...]:
        """Return the sizes of nested lists, () for other values; the elements of a list have one shape."""
        return ()

    def array(self, shape: Sequence[int | None]) -> Any:
        """Return nested lists of floats; all faults of the elements are raised together.

        In `shape`, None means any size.
        """
        found = self.shape()
        if not _fits(found, shape):
            raise self.wrong(sized(shape), found=sized(found) if found else "")
        faults = Faults()
        result = self._floats(faults)
        faults.check()
        return result

    def _floats(self, faults: Faults) -> Any:
        """Return a float for a scalar, and nested lists for a list; faults are added."""
        value = faults.collect(self.quantity)
        return 0.0 if value is None else value

    def items(self) -> list[YamlNode]:
        """Return the values of a list."""
        raise self.wrong("a list")

    def mapping(self) -> YamlMap:
        """Return the map of names to values."""
        raise self.wrong("a map", "write 'name: value' lines below it")

    def fields(
        self, required: Collection[str] = (), optional: Collection[str] = (), faults: Faults | None = None
    ) -> YamlMap:
        """Return a map with known keys only: missing and unknown keys are faults.

        With `faults`, faults of the keys are added there, and the map is returned as far as it is right; a
        misspelt key is replaced by the one that was meant.
        """
        return self.mapping().fields(required, optional, faults)


def _fits(found: Sequence[int], shape: Sequence[int | None]) -> bool:
    pairs = zip(found, shape, strict=False)
    return len(found) == len(shape) and all(wanted is None or size == wanted for size, wanted in pairs)


def sized(shape: Sequence[int | None]) -> str:
    """Return a shape in words: "a number", "a list of 3 numbers", "a 2 x 3 list of numbers"."""
    if not shape:
        return "a number"
    if len(shape) == 1:
        return "a list of numbers" if shape[0] is None else f"a list of {counted(shape[0], 'number')}"
    return f"a {' x '.join('any' if size is None else str(size) for size in shape)} list of numbers"
