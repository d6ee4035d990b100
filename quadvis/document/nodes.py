"""The values of a YAML file: untyped nodes with their places; the reader of a node decides its type.

YAML's own types never apply: `on`, `1e-3`, `010` and `12:30`, in quotes or not, are texts until a method asks
for a truth value, a number or a quantity. A method that fails raises `DiagramError` with the place. To go on
and report all faults together, call it through `Faults.collect`: `period = faults.collect(node.period)`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterator, Sequence
from fractions import Fraction
from typing import Any, TypeVar

from quadvis import units
from quadvis.errors import DiagramError, Fault, Faults, Odd, Place, closest, counted, quoted, suggestion
from quadvis.errors.characters import first_odd, meant, replacement, with_article
from quadvis.units import Unit, UnitError

ONE = Unit()

_Result = TypeVar("_Result")
_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,63}")
_INTEGER = re.compile(r"[+-]?(0|[1-9][0-9]{0,19})")
_DECIMAL_COMMA = re.compile(r"[+-]?[0-9]+,[0-9]+(?![0-9.,])")
_NO_BLANK = re.compile(r"[A-Za-z_]\w*:(?=[^\s/\\])", re.ASCII)
_TRUTH = {"true": True, "false": False}
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

    def _scalar(self, expected: str) -> str:
        """Return the text of a scalar; lists and maps are not what was expected."""
        raise self.wrong(expected)

    def text(self) -> str:
        """Return a text; only a text in quotes may be empty."""
        value = self._scalar("a text")
        if not value and isinstance(self, YamlScalar) and self.plain:
            raise self.wrong("a text", "write one, or leave the key out")
        return value

    def name(self) -> str:
        """Return an identifier: letters, digits and `_`, no digit first, at most 64 of them."""
        value = self._scalar("a name")
        if _NAME.fullmatch(value) is None:
            raise self.wrong("a name", "use letters, digits and '_', and begin with a letter")
        return value

    def boolean(self) -> bool:
        """Return the truth value of `true` or `false`; YAML's other spellings are refused."""
        value = self._scalar("true or false")
        if value in _TRUTH:
            return _TRUTH[value]
        meant = _TRUTH_ELSEWHERE.get(value.lower())
        raise self.wrong("true or false", f"write {meant}" if meant else "")

    def integer(self) -> int:
        """Return a whole decimal number that fits 64 bits."""
        text = self._scalar("a whole number")
        if _INTEGER.fullmatch(text) is None:
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
        text = self._scalar(expected)
        try:
            return units.parse_number(text)
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
        label = f"{quoted(self.key)}: " if self.key else ""
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

    def array(self, shape: Sequence[int | None] | None = None, unit: Unit | Sequence[Unit] = ONE) -> Any:
        """Return nested lists of floats, each in its unit; all faults of the elements are raised together.

        In `shape`, None means any size; without `shape` any regular shape is accepted. Several units belong
        to the elements along the last axis.
        """
        found = measure(self)
        if shape is not None and not _fits(found, shape):
            raise self.wrong(_sized(shape), found=_sized(found) if found else "")
        faults = Faults()
        result = _array(self, (unit,) if isinstance(unit, Unit) else tuple(unit), 0, faults)
        faults.check()
        return result

    def items(self) -> list[YamlNode]:
        """Return the values of a list."""
        if isinstance(self, YamlList):
            return self.values
        raise self.wrong("a list")

    def mapping(self) -> YamlMap:
        """Return the map of names to values."""
        if isinstance(self, YamlMap):
            return self
        raise self.wrong("a map", _map_remedy(self))

    def fields(
        self, required: Collection[str] = (), optional: Collection[str] = (), faults: Faults | None = None
    ) -> YamlMap:
        """Return a map with known keys only: missing and unknown keys are faults.

        With `faults`, faults of the keys are added there, and the map is returned as far as it is right; a
        misspelt key is replaced by the one that was meant.
        """
        result = self.mapping()
        found = Faults() if faults is None else faults
        result = _check_keys(result, required, optional, found)
        if faults is None:
            found.check()
        return result


class YamlScalar(YamlNode):
    """A text; `plain` says that it has no quotes."""

    __slots__ = ("odd", "plain", "value")

    def __init__(
        self,
        value: str,
        plain: bool,
        file: str,
        line: int,
        column: int,
        key: str = "",
        odd: Odd | None = None,
    ) -> None:
        self.file, self.line, self.column, self.key = file, line, column, key
        self.value, self.plain, self.odd = value, plain, odd

    @property
    def place(self) -> Place:
        """The place at which the value begins, with the odd character in it, if any."""
        return Place(self.file, self.line, self.column, self.odd)

    def to_python(self) -> Any:
        """Return the text or, without quotes, the value that it looks like."""
        return plain_value(self.value) if self.plain else self.value

    def _described(self) -> str:
        return quoted(self.value) if self.value else "empty"

    def _scalar(self, expected: str) -> str:
        return self.value


class YamlList(YamlNode):
    """A list of nodes."""

    __slots__ = ("_values",)

    def __init__(self, values: list[YamlNode], file: str, line: int, column: int, key: str = "") -> None:
        self.file, self.line, self.column, self.key = file, line, column, key
        self._values: list[YamlNode] | None = values

    @property
    def values(self) -> list[YamlNode]:
        """The nodes of the elements."""
        if self._values is None:
            self._values = self._make()
        return self._values

    def _make(self) -> list[YamlNode]:
        """Make the nodes of a list that was read as a whole."""
        raise NotImplementedError

    @property
    def shape(self) -> tuple[int, ...] | None:
        """The sizes along the axes, if they are known without looking at the elements."""
        return None

    def to_python(self) -> Any:
        """Return the list of plain values."""
        return [node.to_python() for node in self.values]

    def _described(self) -> str:
        return "a list"

    def __len__(self) -> int:
        return len(self.values)

    def __getitem__(self, index: int) -> YamlNode:
        return self.values[index]

    def __iter__(self) -> Iterator[YamlNode]:
        return iter(self.values)


class YamlMap(YamlNode):
    """Nodes by name, in the order of the file; `keys` holds the names as nodes, for their places."""

    __slots__ = ("keys", "values")

    def __init__(
        self,
        keys: dict[str, YamlScalar],
        values: dict[str, YamlNode],
        file: str,
        line: int,
        column: int,
        key: str = "",
    ) -> None:
        self.file, self.line, self.column, self.key = file, line, column, key
        self.keys, self.values = keys, values

    def to_python(self) -> Any:
        """Return the dict of plain values."""
        return {key: node.to_python() for key, node in self.values.items()}

    def _described(self) -> str:
        return "a map"

    def get(self, key: str) -> YamlNode | None:
        """Return the value under a key, or None."""
        return self.values.get(key)

    def pairs(self) -> list[tuple[YamlScalar, YamlNode]]:
        """Return the keys, as nodes with a place, and their values."""
        return list(zip(self.keys.values(), self.values.values(), strict=True))

    def renamed(self, key: str, name: str) -> YamlMap:
        """Return a map with one key renamed; the place of the key stays."""
        keys = {name if old == key else old: node for old, node in self.keys.items()}
        values = {name if old == key else old: node for old, node in self.values.items()}
        return YamlMap(keys, values, self.file, self.line, self.column, self.key)

    def __contains__(self, key: str) -> bool:
        return key in self.values

    def __getitem__(self, key: str) -> YamlNode:
        return self.values[key]

    def __iter__(self) -> Iterator[str]:
        return iter(self.values)

    def __len__(self) -> int:
        return len(self.values)


def _map_remedy(node: YamlNode) -> str:
    """Return the remedy for a text in place of a map: "name:value" lacks a blank."""
    match = _NO_BLANK.match(node.value) if isinstance(node, YamlScalar) and node.plain else None
    return f"write a blank behind {quoted(match.group())}" if match else "write 'name: value' lines below it"


def plain_value(text: str) -> Any:
    """Return what a text without quotes looks like: None, a truth value, a number, or the text itself."""
    if text in ("", "~", "null"):
        return None
    if text in _TRUTH:
        return _TRUTH[text]
    if _INTEGER.fullmatch(text):
        return int(text)
    try:
        return units.parse_number(text)
    except UnitError:
        return text


def _check_keys(
    found: YamlMap, required: Collection[str], optional: Collection[str], faults: Faults
) -> YamlMap:
    """Add a fault for each unknown and each missing key; return the map with misspelt keys corrected."""
    known = list(dict.fromkeys((*required, *optional)))
    free = [name for name in known if name not in found]
    result = found
    for key, node in found.keys.items():
        if key not in known:
            near, taken = closest(key, free), closest(key, [name for name in known if name not in free])
            remedy = suggestion(key, free)
            if near is None and taken is not None:
                remedy = f"did you mean {quoted(taken)}, which is in line {found.keys[taken].line}?"
            faults.add(node.place, f"key {quoted(key)} is unknown", remedy)
            if near is not None and near not in result:
                result = result.renamed(key, near)
    for name in required:
        if name not in result:
            faults.add(found.place, f"key '{name}' is missing", f"add '{name}: ...'")
    return result


def measure(node: YamlNode) -> tuple[int, ...]:
    """Return the shape of nested lists, () for other values; elements of one list must have one shape."""
    if not isinstance(node, YamlList):
        return ()
    if node.shape is not None:
        return node.shape
    shapes = [measure(child) for child in node.values]
    for child, shape in zip(node.values, shapes, strict=True):
        if shape != shapes[0]:
            raise child.wrong(f"{_sized(shapes[0])} like the first", found=_sized(shape) if shape else "")
    return (len(shapes), *(shapes[0] if shapes else ()))


def _fits(found: Sequence[int], shape: Sequence[int | None]) -> bool:
    pairs = zip(found, shape, strict=False)
    return len(found) == len(shape) and all(wanted is None or size == wanted for size, wanted in pairs)


def _sized(shape: Sequence[int | None]) -> str:
    """Return a shape in words: "a number", "a list of 3 numbers", "a 2 x 3 list of numbers"."""
    if not shape:
        return "a number"
    if len(shape) == 1:
        return "a list of numbers" if shape[0] is None else f"a list of {counted(shape[0], 'number')}"
    return f"a {' x '.join('any' if size is None else str(size) for size in shape)} list of numbers"


def _array(node: YamlNode, each: tuple[Unit, ...], index: int, faults: Faults) -> Any:
    if isinstance(node, YamlList):
        return [_array(child, each, i, faults) for i, child in enumerate(node.values)]
    value = faults.collect(node.quantity, each[index] if len(each) > 1 and index < len(each) else each[0])
    return 0.0 if value is None else value
