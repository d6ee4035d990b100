"""The table of faults names, for each of them, tests that exist and are marked, and all that are."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

TESTS = Path(__file__).resolve().parents[1]
TABLE = (TESTS / "faults" / "README.md").read_text(encoding="utf-8")
MARK = "pytest.mark.faults"


def rows() -> dict[int, list[str]]:
    """Return the tests that are named, by the number of their row."""
    found = re.findall(r"^\| (\d+) \|(.*)\|$", TABLE, re.MULTILINE)
    return {
        int(number): re.findall(r"`((?:\w+/)+test_\w+\.py(?:::test_\w+)?)`", text) for number, text in found
    }


ROWS = rows()


def marked(path: Path) -> set[str]:
    """Return the names of the tests of a file that have the mark, by themselves or by their file."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    found, whole = set(), False
    for each in tree.body:
        if isinstance(each, ast.Assign) and ast.unparse(each.targets[0]) == "pytestmark":
            whole = MARK in ast.unparse(each.value)
        if not isinstance(each, ast.FunctionDef) or not each.name.startswith("test_"):
            continue
        if whole or any(ast.unparse(one).startswith(MARK) for one in each.decorator_list):
            found.add(each.name)
    return found


def numbers(test: str) -> list[int]:
    """Return the rows with whose numbers a name begins, such as `test_02_and_03_frames`."""
    found = re.match(r"test_(\d\d(?:_and_\d\d)*)_", test)
    return list(map(int, found[1].split("_and_"))) if found else []


def test_all_twenty_faults_are_there() -> None:
    assert sorted(ROWS) == list(range(1, 21)) and all(ROWS.values())


@pytest.mark.parametrize("row", ROWS)
def test_each_fault_has_the_tests_that_are_named(row: int) -> None:
    for name in ROWS[row]:
        file, _, test = name.partition("::")
        found = marked(TESTS / file)
        assert test in found if test else any(row in numbers(each) for each in found)


def test_no_test_of_a_fault_is_missing_in_the_table() -> None:
    named = {name for names in ROWS.values() for name in names}
    for path in TESTS.rglob("test_*.py"):
        if path == Path(__file__) or MARK not in path.read_text(encoding="utf-8"):
            continue
        file = path.relative_to(TESTS).as_posix()
        for test in marked(path):
            mine = all(file in ROWS[row] for row in numbers(test)) and numbers(test)
            assert f"{file}::{test}" in named or mine, f"{file}::{test}"
