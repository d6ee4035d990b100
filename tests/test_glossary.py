"""The words and the rooms of quadvis/README.md: each word exists, and no class name has two meanings."""

from __future__ import annotations

import ast
import re
from collections import defaultdict
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
TEXT = (ROOT / "quadvis" / "README.md").read_text(encoding="utf-8")
ROOMS = sorted(path.parent.name for path in (ROOT / "quadvis").glob("*/__init__.py"))

# Class names that are defined twice by leave. A block is named after its file: the name in a diagram decides.
TWICE = {
    "Clock": "the block sources.clock; what lets the ticks of a run go",
    "Constant": "the block sources.constant; in a graph, the value of an input without a wire",
    "Diagram": "the checked diagram; the same with methods that run it, which quadvis.load returns",
    "Function": "the block math.function; a compiled method, by its address",
    "Recording": "the block sources.recording; recorded signals in memory",
    "Table": "the block sources.table; the table of a sweep, which quadvis.sweep returns",
}
# Rooms whose tables follow the order of the steps, and name further modules in a second column.
BY_STEP = ("diagram", "engine")


def classes() -> dict[str, list[str]]:
    """Return the files that define each public class of quadvis, its blocks and its vision."""
    found = defaultdict(list)
    for folder in ("quadvis", "blocks"):
        for path in sorted((ROOT / folder).rglob("*.py")):
            for node in ast.parse(path.read_text(encoding="utf-8")).body:
                if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                    found[node.name].append(str(path.relative_to(ROOT)))
    return found


def rows(head: str) -> list[list[str]]:
    """Return the cells of all tables whose first line begins with a head."""
    found = []
    for table in re.findall(rf"^{re.escape(head)}.*\n\|[-|]+\n((?:\|.*\n)+)", TEXT, re.MULTILINE):
        found += [[cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines()]
    return found


def names(cell: str) -> list[str]:
    return re.findall(r"`([\w./]+)`", cell)


WORDS = {name: row[0] for row in rows("| word |") for name in names(row[2])}


def test_no_public_class_name_is_defined_twice_except_by_leave() -> None:
    twice = {name: files for name, files in classes().items() if len(files) > 1}
    assert {name: files for name, files in twice.items() if name not in TWICE} == {}
    assert sorted(TWICE) == sorted(twice), "a leave that is no longer needed"


def test_the_glossary_has_its_words() -> None:
    assert len(WORDS) >= 30
    words = [word for row in rows("| word |") for word in row[0].split(", ")]
    assert len(words) == len(set(words))


@pytest.mark.parametrize("name", WORDS)
def test_a_word_of_the_glossary_exists_in_its_room(name: str) -> None:
    room, _, word = name.rpartition(".")
    folder = ROOT / "quadvis" / room
    pattern = re.compile(rf"^(?:class|def) {word}\b", re.MULTILINE)
    files = [path for path in folder.rglob("*.py") if pattern.search(path.read_text(encoding="utf-8"))]
    assert len(files) == 1 or (folder / f"{word}.py").is_file(), f"'{WORDS[name]}' is not {name}"


def test_the_picture_of_the_rooms_has_every_room_and_no_other() -> None:
    picture = TEXT.partition("\n## The rooms\n")[2].split("```")[1]
    stated = [word for line in picture.splitlines() for word in re.findall(r"^ (\w+)(?: +\| (\w+))?", line)]
    assert sorted(word for pair in stated for word in pair if word) == ROOMS


@pytest.mark.parametrize("room", [room for room in ROOMS if room not in BY_STEP])
def test_the_table_of_a_room_has_every_module_and_no_other(room: str) -> None:
    stated = [name.rstrip("/") for row in rows(f"| `{room}` |") for name in names(row[0])]
    modules = [path.stem for path in (ROOT / "quadvis" / room).glob("*.py") if path.stem != "__init__"]
    assert sorted(stated) == sorted(modules)
