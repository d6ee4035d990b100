"""Texts that are no YAML: our own sentence for each, with every parser, and the faults after it."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any

import pytest
import yaml

from quadvis.document import parse_yaml, reader
from quadvis.document.composer import MAX_DEPTH
from quadvis.errors import DiagramError, Faults
from tests.stages import mostly_slow

LOADERS = [yaml.SafeLoader, *([yaml.CSafeLoader] if yaml.__with_libyaml__ else [])]

# A text, and the places and beginnings of what is to be said about it.
BROKEN = [
    # quotes
    ("a: 'x\n", ["1:4: the quotes opened in line 1 are never closed"]),
    ('a:\n  b: "x\n', ["2:6: the quotes opened in line 2 are never closed"]),
    ("a: 'b\n---\nc'", ["1:4: the quotes opened in line 1 are never closed"]),
    ("a: {b: 'c}, d: 1}\n", ["1:8: the quotes opened in line 1 are never closed"]),
    ("a: 'x'\nb: 'y\nc: 'z'\n", ["2:4: the quotes opened here are closed only in line 3"]),
    ("a: 'it's'", ["1:8: this does not belong to the text in quotes before it"]),
    ("a: {b: 'it's'}", ["1:12: this does not belong to the text in quotes before it"]),
    ('a: "x" y', ["1:8: this does not belong to the text in quotes before it"]),
    ('a: "\\q"\nb: "\\w"', ["1:5: the text in double quotes holds an unknown escape",
                            "2:5: the text in double quotes holds an unknown escape"]),
    ('a: "x\\u12"', ["1:6: the text in double quotes holds an unknown escape"]),
    ('a: "parts\\craft.yaml"', ["1:10: the text in double quotes holds an unknown escape after '\\'; "
                                "write '/' between folders: 'parts/craft.yaml'"]),
    # brackets
    ("a: [1, 2\n", ["1:4: the list opened in line 1 lacks"]),
    ("a: {b: 1", ["1:4: the map opened in line 1 lacks"]),
    ("a: [b, c}\n", ["1:9: the list opened in line 1 lacks"]),
    ("a: {b: 1, c: [1, 2}\n", ["1:19: the list opened in line 1 lacks"]),
    ("a: ]", ["1:4: this ']' closes nothing"]),
    ("a: {b: 1}}", ["1:10: this '}' closes nothing"]),
    ("a: {b: c\nd: e\n", ["2:2: a ':' stands where none can; put a ',' before the key"]),
    ("a: {name}_x", ["1:10: this does not belong to the map before it"]),
    ("a: [[1, 2]] N", ["1:13: the unit 'N' stands behind a list; write {value: [[1, 2]], unit: N}"]),
    ("a: [1, 2] m/s\n", ["1:11: the unit 'm/s' stands behind a list; write {value: [1, 2], unit: m/s}"]),
    ("a: {b: [1, 2] rad, c: @x}\n", ["1:15: the unit 'rad' stands behind a list"]),
    # signs in the wrong place
    ("a: b: c\nd: e: f", ["1:5: a ':' stands where none can", "2:5: a ':' stands where none can"]),
    ("a: @x\nb: `y`\nc: [%z]", ["1:4: a text cannot begin with this character",
                                "2:4: a text cannot begin with this character",
                                "3:5: a text cannot begin with this character"]),
    ("a: *\n", ["1:5: a text cannot begin with '*' or '&'"]),
    ("a: !<x", ["1:4: a tag ('!') is not allowed"]),
    ("x: - a", ["1:4: a '- ' stands where no list can begin"]),
    ("a: ? b", ["1:4: a '? ' stands where none can"]),
    ("a: |x\n b", ["1:5: this does not belong behind '|' or '>'"]),
    (": x", ["1:1: a key is missing before ':'"]),
    ("a: ,b", ["1:4: a text cannot begin with ','"]),
    # lines and levels
    ("a:\n\tb: 1", ["2:1: a tab cannot indent a line; use spaces"]),
    ("a: 1\n  \tb: 2", ["2:3: a tab cannot indent a line; use spaces"]),
    ("a: 1\nb\n", ["2:1: a key has no ':' after it"]),
    ("a\nb: c", ["1:1: a key has no ':' after it"]),
    ("a:\n  b: 1\n c: 2", ["3:2: this does not belong to the map that began in line 1"]),
    ("a: 1\n- b", ["2:1: this does not belong to the map that began in line 1"]),
    ("- a\nb: 1", ["2:1: this does not belong to the list that began in line 1"]),
    ("  a: 1\nb: 2", ["2:1: this does not belong to the document"]),
    ("a: b\n  c: d\n", ["2:4: a ':' stands where none can"]),
    ("[" * 2000, ["1:51: this is nested deeper than 50 levels"]),
    ("{a: " * 2000, ["1:201: this is nested deeper than 50 levels"]),
    ("- " * 2000, ["1:101: this is nested deeper than 50 levels"]),
    ("".join(" " * i + "a:\n" for i in range(1200)), ["51:51: this is nested deeper than 50 levels"]),
    ("x: 1\ny: " + "[{a: " * 1500, ["2:125: this is nested deeper than 50 levels"]),
]  # fmt: skip


def said(text: str) -> list[str]:
    with pytest.raises(DiagramError) as caught:
        parse_yaml(text, "d")
    return [str(fault).removeprefix("d:") for fault in caught.value.faults]


@pytest.fixture(params=LOADERS, ids=lambda loader: loader.__name__)
def loader(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.setattr(reader, "_Loader", request.param)
    return request.param


@pytest.mark.parametrize(("text", "expected"), BROKEN, ids=range(len(BROKEN)))
def test_every_parser_leads_to_the_same_sentences(loader: Any, text: str, expected: list[str]) -> None:
    found = said(text)
    assert len(found) == len(expected)
    assert all(one.startswith(begin) for one, begin in zip(found, expected, strict=True))


@pytest.mark.parametrize("text", [text for text, _ in BROKEN], ids=range(len(BROKEN)))
def test_no_word_of_a_parser_comes_through(text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    expected, parse = said(text), yaml.parse

    def other_words(*args: Any, **kwargs: Any) -> Iterator[Any]:
        try:
            yield from parse(*args, **kwargs)
        except yaml.MarkedYAMLError as error:
            error.problem = error.context = error.note = "quite other words"
            raise

    monkeypatch.setattr(yaml, "parse", other_words)
    assert said(text) == expected
    assert not any("other words" in one for one in expected)


def test_an_error_without_a_place_is_a_fault_too(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*args: Any, **kwargs: Any) -> Iterator[Any]:
        raise yaml.YAMLError("no words of ours")

    monkeypatch.setattr(reader, "_events", broken)
    assert said("a: 1") == [
        "1:1: this cannot be read; check quotes, brackets and indentation here and in the line above"
    ]


def test_the_deepest_text_that_is_allowed_is_read(loader: Any) -> None:
    deep = parse_yaml("[" * MAX_DEPTH + "]" * MAX_DEPTH)
    for _ in range(MAX_DEPTH - 1):
        (deep,) = deep.items()
    assert len(deep.items()) == 0


def test_behind_what_can_be_repaired_everything_else_is_read(loader: Any) -> None:
    text = "a: x: y\nb: {c: d.e[0], f: @g}\nc: \"\\q\"\nh: 'i: j'\nb: 2\n"
    faults = Faults()
    root = parse_yaml(text, "d", faults).mapping()
    assert [str(fault)[: str(fault).index(" ")] for fault in faults] == [
        "d:1:5:",
        "d:2:8:",
        "d:2:19:",
        "d:3:5:",
        "d:5:1:",
    ]
    assert root.to_python() == {"a": "x: y", "b": {"c": "d.e[0]", "f": "@g"}, "c": "\\q", "h": "i: j"}
    assert root["h"].place.column == 4


def test_stand_ins_in_a_text_stay_what_they_are() -> None:
    signs = "\ue000\ue001\ue002\ue003"
    assert parse_yaml(f"a: '{signs}'\nb: {signs}").to_python() == {"a": signs, "b": signs}
    assert len(said(f"a: '{signs}'\nb: c: d")) == 1


DOUBLED = [
    ("a: 1\na: 2", "2:1: key 'a' is already in line 1; keep one of them"),
    ("a: 1\na: 2\na: 3", "2:1: key 'a' is already in line 1, and again in line 3; keep one of them"),
    (
        "a: 1\n" * 9,
        "2:1: key 'a' is already in line 1, and again in line 3, 4, 5, 6, 7, ...; keep one of them",
    ),
    ("{a: 1, a: 2}", "1:8: key 'a' is already in line 1; keep one of them"),
    ("a: {b: 1}\na: {b: 2}", "2:1: key 'a' is already in line 1; keep one of them"),
    ("a:\n  b: 1\na:\n  c: 1", "3:1: key 'a' is already in line 1; keep one of them"),
    ("a: {b: {c: 1}}\na: {b: {d: 1}}", "2:1: key 'a' is already in line 1; keep one of them"),
    ("a: [1]\na: {b: 1}", "2:1: key 'a' is already in line 1; keep one of them"),
    ("'a': 1\na: 1", "2:1: key 'a' is already in line 1; keep one of them"),
    ("x: {a: 1, b: 2, a: 3}", "1:17: key 'a' is already in line 1; keep one of them"),
]


@pytest.mark.parametrize(("text", "expected"), DOUBLED)
def test_a_doubled_key_is_one_fault(text: str, expected: str) -> None:
    assert said(text) == [expected]


def test_after_a_thousand_doubled_keys_of_a_map_the_rest_is_not_read() -> None:
    before, after = "- b: 1\n  b: 2\n- a: 1\n", "- c: 1\n  c: 2\n"
    few, many = (before + "  a: 1\n" * count for count in (1000, 1001))
    assert len(said(few + after)) == len(said(few)) + 1 == 3
    last = "1004:3: more than 1000 keys of one map are repeated; keep one of each"
    assert said(many + after) == [*said(few), last]


def test_what_stands_below_a_doubled_key_is_read_unless_it_describes_another_thing() -> None:
    faults = Faults()
    text = "a: {b: {x: 1}, c: 2}\na: {d: 3, b: {y: 1}}\ne: {k: sine, w: 1}\ne: {k: step, v: 1}"
    assert parse_yaml(text, "d", faults).to_python() == {
        "a": {"b": {"x": 1, "y": 1}, "c": 2, "d": 3}, "e": {"k": "sine", "w": 1},
    }  # fmt: skip
    assert len(faults) == 2


def test_a_list_in_place_of_a_key_is_refused_once() -> None:
    assert len(said("? [a, {[b]: c}]\n: d")) == 1
    assert len(said("? " * 40 + "a")) == 1


HARD = [
    "a: 'b\n",
    "[x, ",
    "a b: c: ",
    "\u00a0",
    "x[",
    "\\",
    '"\\q" ',
    "a:b\n",
    "- - ",
    "\t",
    "{a: ",
    ": ",
    "a\n",
]


@pytest.mark.parametrize("piece", mostly_slow(HARD, 2))
def test_looking_for_the_cause_takes_time_in_proportion_to_the_text(piece: str) -> None:
    def cpu(count: int) -> float:
        text = "z: @\n" + piece * count
        start = time.process_time()
        with pytest.raises(DiagramError):
            parse_yaml(text)
        return time.process_time() - start

    cpu(10)
    small = max(min(cpu(250) for _ in range(3)), 0.0005)
    # 32 times the text takes 32 times as long, or 1024 times where the time grows with the square.
    assert min(cpu(8_000) for _ in range(2)) < 6 * 32 * small
