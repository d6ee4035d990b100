"""Vectors and matrices from files: ``K: {file: gains.npz, name: K, unit: N/m}``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from quadvis.document import YamlList, YamlMap, YamlNode, YamlScalar
from quadvis.document.array_file import chosen, read_arrays
from quadvis.document.number_lists import NumberList, Numbers
from quadvis.errors import QuadvisError, quoted
from quadvis.machine.inputs import read_once, results_of
from quadvis.machine.missing_file import file_trouble
from quadvis.machine.shipped import named_file
from quadvis.units import Unit

if TYPE_CHECKING:
    from collections.abc import Sequence

FILE = "file"
FILE_KEYS = (FILE, "name", "unit")


class FileNumbers(Numbers):
    """The numbers of a file, all at the place where a diagram names the file."""

    __slots__ = ()

    def with_units(self, units: tuple[Unit, ...], key: str) -> FileNumbers:
        """Return the same numbers under another key, with units."""
        return FileNumbers(
            NumberList(0, 0, self.numbers, 0), "", self.file, self.line, self.column, key, units
        )

    def of_rank(self, rank: int) -> FileNumbers:
        """Return a row or a column as a vector, where one is wanted: tables and MATLAB have no vectors."""
        shape = self.shape()
        if rank != 1 or len(shape) != 2 or 1 not in shape:
            return self
        found = NumberList(0, 0, self.flat(), 0)
        return FileNumbers(found, "", self.file, self.line, self.column, self.key, self.element_units)

    def to_python(self) -> Any:
        """Return the numbers as nested lists, with their units if they have any."""
        return self.numbers if not self.element_units else YamlList.to_python(self)

    def _make(self) -> list[YamlNode]:
        return self._nodes(self.numbers, self.key)

    def _nodes(self, numbers: Sequence[Any], key: str) -> list[YamlNode]:
        found: list[YamlNode] = []
        for index, number in enumerate(numbers):
            name = f"{key}[{index}]"
            if isinstance(number, list):
                inner = self._nodes(number, name)
                found.append(YamlList(inner, self.file, self.line, self.column, name))
                continue
            unit = self.element_units[index % len(self.element_units)] if self.element_units else Unit()
            text = number_text(number)
            text = f"{text} {unit}" if unit.symbols else text
            found.append(YamlScalar(text, True, self.file, self.line, self.column, name))
        return found


def number_text(number: float) -> str:
    """Return a number as text: 3 for 3.0, which a whole number may be, too."""
    return str(int(number)) if number.is_integer() and abs(number) < 2**53 else repr(number)


def read_matrix(fields: YamlMap) -> YamlNode:
    """Return the numbers of ``{file: ..., name: ...}``; DiagramError at its place."""
    named = fields.values.get(FILE, fields)
    text = named.text()
    path = str(named_file(text, named.file))
    problem, remedy = file_trouble(path, text)
    if problem:
        raise named.fault(problem, remedy)
    try:
        array = chosen(read_once(read_arrays, path), fields["name"].text() if "name" in fields else None)
    except QuadvisError as error:
        place = fields["name"] if "name" in fields and "no array" in str(error) else named
        raise place.fault(f"{quoted(text)}: {error}") from None
    if not array.shape:
        number = number_text(float(array))
        return YamlScalar(number, True, fields.file, fields.line, fields.column, fields.key)
    found = NumberList(0, 0, array.tolist(), 0)
    return FileNumbers(found, "", fields.file, fields.line, fields.column, fields.key)


def matrix_files() -> list[str]:
    """Return the files of which arrays were read while a diagram is loaded."""
    return results_of(read_arrays)
