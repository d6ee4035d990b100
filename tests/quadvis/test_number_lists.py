"""Long lists of numbers: read as a whole, and the same in every respect as element by element."""

from __future__ import annotations

import random
import time
from pathlib import Path

import pytest

from quadvis.api import check, load_text
from quadvis.document import MAX_BYTES, YamlNode, number_lists, parse_yaml
from quadvis.document.number_lists import Numbers, find_lists, hide_lists
from quadvis.errors import DiagramError

rng = random.Random(7)
LONG = ", ".join(f"{rng.uniform(-9, 9):.6g}" for _ in range(120))
WHOLE = ",".join(str(rng.randrange(-99, 99)) for _ in range(200))
ROWS = ", ".join(f"[{i}, {i / 3:.4f}, 0]" for i in range(60))
LINES = ",\n  ".join(f"{i}.5" for i in range(150))

TEXTS = [
    f"a: [{LONG}]\nb: 1\n", f"a: [{WHOLE}]", f"a: [{ROWS}]\nb: c", f"a:\n  [{LINES}]\nb: x",
    f"- [{WHOLE}]\n- 2",
    f"{{a: [{WHOLE}], b: [{LONG}]}}", f"a: {{value: [{LONG}], unit: m}}", f"[{ROWS}]",
    f"a: [{LONG}] # [{WHOLE}]",
    f"a: '[{LONG}]'\nb: \"[{WHOLE}]\"", f"a: |\n  [{LONG}]\nb: [{LONG}]", f"a: text [{LONG}] more",
    f"# [{LONG}]\na: 1",
    f"a: [{LONG}, x]", f"a: [{LONG}, 010]", f"a: [{LONG}, 1e999]", f"a: [{LONG}, [1, 2]]", f"a: [{LONG},]",
    f"a: [{LONG}\n  # comment\n  , 3]", f"a: [{LONG},\r\n {LONG}]\r\nb: 2", f"a: [ [{LONG}], [{LONG}] ]",
    f"a: &x [{LONG}]", f"a: !!seq [{LONG}]", f"a: [{LONG}]: b", f"? [{LONG}]\n: b", f"a: [{LONG}] m",
    f"a: [{LONG}",
    f"a: [{LONG}]]", f"a: [{LONG}]\na: [{WHOLE}]", f"\u00e4: [{LONG}]\nb\u00a0: [{WHOLE}]",
    f"a: [{', '.join(['1'] * 99_997)}]",
    f"a: [{', '.join(['1'] * 99_998)}]", "a: " + "[" * 5 + LONG + "]" * 5,
]  # fmt: skip


def outcome(text: str) -> object:
    """Return all that can be seen of a text: its nodes with their places, or its faults."""
    try:
        return seen(parse_yaml(text, "d"))
    except DiagramError as error:
        return [str(fault) for fault in error.faults]


def seen(node: YamlNode) -> object:
    children: list[object] = []
    if hasattr(node, "values"):
        values = node.values if isinstance(node.values, list) else list(node.values.values())
        children = [seen(child) for child in values]
    return (
        str(node.place),
        node.key,
        getattr(node, "value", ""),
        children,
        node.to_python() if not children else 0,
    )


@pytest.mark.parametrize("text", TEXTS, ids=range(len(TEXTS)))
def test_a_list_read_whole_is_the_list_read_element_by_element(
    text: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = outcome(text)
    monkeypatch.setattr(number_lists, "SHORTEST", 2 * MAX_BYTES)
    assert outcome(text) == whole


def test_long_lists_are_read_whole() -> None:
    for text, count in ((TEXTS[0], 120), (TEXTS[2], 60), (TEXTS[3], 150)):
        node = parse_yaml(text).mapping()["a"]
        assert isinstance(node, Numbers) and node.shape()[0] == count
        assert node.to_python() == [each.to_python() for each in node.items()]


@pytest.mark.parametrize("text", TEXTS, ids=range(len(TEXTS)))
def test_hiding_a_list_moves_nothing(text: str) -> None:
    hidden = hide_lists(text, find_lists(text))
    assert len(hidden) == len(text)
    assert [len(line) for line in hidden.split("\n")] == [len(line) for line in text.split("\n")]


HEAD = "quadvis: 1\nname: n\nrates: {r: 10 Hz}\nstop_time: 1 s\nblocks:\n"
VALUES = [
    f"{{value: [{WHOLE}]}}", f"{{value: [{LONG}]}}", f"{{value: {{value: [{LONG}], unit: cm}}}}",
    f"{{value: {{value: [{LONG}], unit: 1}}}}", f"{{value: [{LONG}, 3 m]}}", f"{{value: [{LONG}, 2 2]}}",
    f"{{value: {{value: [{ROWS}], unit: m m rad}}}}", f"{{value: [{', '.join(['0'] * 200)}]}}",
    f"{{value: [0, {WHOLE}]}}", f"{{value: {{value: [{LONG}], unit: m m}}}}",
    f"{{value: [{LONG}], tune: [{WHOLE}]}}",
]  # fmt: skip


@pytest.mark.parametrize("value", VALUES, ids=range(len(VALUES)))
def test_a_diagram_is_the_same_either_way(
    value: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    text = f"{HEAD}  c: {{block: sources.constant, rate: r, with: {value}}}\n"

    def loaded() -> str:
        try:
            return load_text(text, tmp_path).resolved
        except DiagramError as error:
            return str(error)

    whole = loaded()
    monkeypatch.setattr(number_lists, "SHORTEST", 2 * MAX_BYTES)
    assert loaded() == whole


@pytest.mark.slow
def test_many_numbers_cost_less_than_half_of_as_many_nodes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def cpu(count: int) -> float:
        path = tmp_path / f"{count}.yaml"
        source = f"  c: {{block: sources.constant, rate: r, with: {{value: [{','.join(['1'] * count)}]}}}}\n"
        path.write_text(HEAD + source)
        start = time.process_time()
        check(path)
        return time.process_time() - start

    cpu(10)
    whole = min(cpu(45_000) for _ in range(3))
    monkeypatch.setattr(number_lists, "SHORTEST", 2 * MAX_BYTES)
    one_by_one = min(cpu(45_000) for _ in range(2))
    assert whole < one_by_one / 2  # it is a sixth
