"""The table of xPC Target's features names tests that exist, and no row is without one."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

from quadvis.library.catalogue import Catalogue

TESTS = Path(__file__).resolve().parents[2]
HEAD = "| xPC Target | here | test |"


def rows() -> list[list[str]]:
    """Return the cells of the table in the README of the inside."""
    text = (TESTS.parent / "quadvis" / "README.md").read_text(encoding="utf-8")
    _, _, table = text.partition(HEAD)
    lines = table.partition("\n\n")[0].splitlines()[2:]
    return [[cell.strip() for cell in line.strip("|").split(" | ")] for line in lines]


ROWS = rows()


def test_all_features_are_there() -> None:
    assert len(ROWS) == 27 and all(len(row) == 3 and all(row) for row in ROWS)


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row[0])
def test_each_feature_has_the_test_that_is_named(row: list[str]) -> None:
    name, _, test = row[2].strip("`").partition("::")
    path = next(each for each in (TESTS / "quadvis" / name, TESTS / name) if each.exists())
    found = ast.parse(path.read_text(encoding="utf-8")).body
    assert test in {each.name for each in found if isinstance(each, ast.FunctionDef)}


def test_the_devices_that_rows_name_are_in_the_library() -> None:
    """Cards and the CAN bus, too, of which the table once said that there are none."""
    library = Catalogue(None)
    text = " ".join(row[1] for row in ROWS)
    names = re.findall(r"`(hardware\.\w+)`", text)
    assert {"hardware.dac_out", "hardware.adc_in", "hardware.can_in"} <= set(names)
    assert all(library.find(name) for name in names)
