"""Arrays of numbers in texts: tables of rows and columns, and names that stand above their rows."""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping, Sequence
from typing import Any

from quadvis.errors import QuadvisError
from quadvis.units import UnitError, parse_number

_Line = tuple[int, list[str]]  # its number in the file, its cells


def text_arrays(data: bytes) -> Mapping[str, Any]:
    """Return the arrays of a text by name; "" is a whole table. QuadvisError if there is none."""
    lines = _lines(data.decode("utf-8-sig"))
    names = [index for index, (_, cells) in enumerate(lines) if _is_name(cells)]
    column = len(names) == 1 and all(len(cells) == 1 for _, cells in lines)  # a table of one column
    if names[:1] == [0] and not column:
        return _named(lines)
    return _table([cells for _, cells in lines])


def _lines(text: str) -> list[_Line]:
    """Return the cells of the lines, apart by what the first line with several has between its cells."""
    kept = [(number, line.partition("#")[0].strip()) for number, line in enumerate(text.splitlines(), 1)]
    kept = [(number, line) for number, line in kept if line]
    signs = (next((sign for sign in ",;\t" if sign in line), None) for _, line in kept)
    separator = next((sign for sign in signs if sign is not None), None)
    if separator is None:
        return [(number, line.split()) for number, line in kept]
    rows = csv.reader((line for _, line in kept), delimiter=separator)
    found = [[cell.strip() for cell in row] for row in rows]
    if len(found) != len(kept):  # a quoted cell goes over several lines
        raise QuadvisError("its lines are not equally long rows of numbers")
    return [(number, cells) for (number, _), cells in zip(kept, found, strict=True)]


def _is_name(cells: Sequence[str]) -> bool:
    cell = cells[0]
    return len(cells) == 1 and cell.isidentifier() and cell.lower() not in ("nan", "inf", "infinity")


def number_of(cell: str) -> complex | None:
    """Return the number that a text is, such as 1e-3 or -1+2j, or None."""
    try:
        return parse_number(cell)
    except UnitError:
        pass
    try:
        found = complex(cell.replace("i", "j"))
    except ValueError:
        return None
    return found if math.isfinite(abs(found)) else None


def _named(lines: Sequence[_Line]) -> Mapping[str, Any]:
    found: dict[str, list[list[complex]]] = {}
    for number, cells in lines:
        if _is_name(cells):
            rows = found[cells[0]] = []
            continue
        row = [number_of(cell) for cell in cells]
        if None in row:
            raise QuadvisError(f"line {number} is no row of numbers")
        if rows and len(row) != len(rows[0]):
            raise QuadvisError(f"line {number} has {len(row)} numbers, the row above has {len(rows[0])}")
        rows.append([value for value in row if value is not None])
    return found


def _table(rows: Sequence[Sequence[str]]) -> Mapping[str, Any]:
    names = list(rows[0]) if rows and any(number_of(cell) is None for cell in rows[0]) else []
    rows = rows[1:] if names else rows
    if not rows or len({len(row) for row in rows}) != 1:
        raise QuadvisError("its lines are not equally long rows of numbers")
    table = [[number_of(cell) for cell in row] for row in rows]
    if any(None in row for row in table):
        raise QuadvisError("its lines are not all rows of numbers")
    columns = {name: [row[index] for row in table] for index, name in enumerate(names) if name}
    return {"": table, **columns}
