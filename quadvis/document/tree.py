"""The kinds of values in a YAML file: texts, lists and maps. `YamlNode` reads them."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator
from typing import Any

from quadvis import units
from quadvis.document.node import INTEGER, TRUTH, YamlNode, sized
from quadvis.errors import Faults, Odd, Place, closest, quoted, suggestion
from quadvis.units import UnitError

_NO_BLANK = re.compile(r"[A-Za-z_]\w*:(?=[^\s/\\])", re.ASCII)


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

    def text(self) -> str:
        """Return the text; it may be empty in quotes alone."""
        if not self.value and self.plain:
            raise self.wrong("a text", "write one, or leave the key out")
        return self.value

    def mapping(self) -> YamlMap:
        """Refuse a text in place of a map: "name:value" lacks a blank."""
        match = _NO_BLANK.match(self.value) if self.plain else None
        if match is None:
            return super().mapping()
        raise self.wrong("a map", f"write a blank behind {quoted(match.group())}")


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

    def shape(self) -> tuple[int, ...]:
        """Return the sizes along the axes; an element of another shape than the first one is refused."""
        shapes = [child.shape() for child in self.values]
        for child, shape in zip(self.values, shapes, strict=True):
            if shape != shapes[0]:
                raise child.wrong(f"{sized(shapes[0])} like the first", found=sized(shape) if shape else "")
        return (len(shapes), *(shapes[0] if shapes else ()))

    def items(self) -> list[YamlNode]:
        """Return the values."""
        return self.values

    def _floats(self, faults: Faults) -> list[Any]:
        return [child._floats(faults) for child in self.values]

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

    def mapping(self) -> YamlMap:
        """Return the map itself."""
        return self

    def fields(
        self, required: Collection[str] = (), optional: Collection[str] = (), faults: Faults | None = None
    ) -> YamlMap:
        """Return the map with known keys only."""
        found = Faults() if faults is None else faults
        result = _check_keys(self, required, optional, found)
        if faults is None:
            found.check()
        return result

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


def plain_value(text: str) -> Any:
    """Return what a text without quotes looks like: None, a truth value, a number, or the text itself."""
    if text in ("", "~", "null"):
        return None
    if text in TRUTH:
        return TRUTH[text]
    if INTEGER.fullmatch(text):
        return int(text)
    try:
        return units.parse_number(text)
    except UnitError:
        return text


def _check_keys(
    found: YamlMap, required: Collection[str], optional: Collection[str], faults: Faults
) -> YamlMap:
    """Add a fault for each unknown and each missing key; return the map with misspelt keys corrected."""
    if all(key in required or key in optional for key in found) and all(name in found for name in required):
        return found
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
