"""The house style of YAML files: what is laid out otherwise, what stays, and that no meaning changes."""

from __future__ import annotations

import difflib
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from quadvis.cli import main
from quadvis.diagram.key_order import FILE, ORDERS, key_ranks
from quadvis.diagram.keys import SECTIONS
from quadvis.diagram.sections.block_schema import BLOCK_KEYS, WIRE_KEYS
from quadvis.diagram.sections.figures import FIGURE_KEYS, PANEL_KEYS
from quadvis.diagram.settings import PARAMETERS_KEYS, PARAMETERS_REQUIRED
from quadvis.document import parse_yaml
from quadvis.document.source import SourceText
from quadvis.document.style import formatted, same
from quadvis.errors import DiagramError, QuadvisError

ROOT = Path(__file__).parents[2]
DIAGRAMS = sorted((ROOT / "diagrams").rglob("*.yaml"))

UNTIDY = """\


# The head of the file
# stays at its head.
name: untidy   # of the diagram
quadvis: 1


rates: { fast:  10 Hz,slow: 1 Hz }
blocks:
    # This explains a.
    a:   {in: {u: {across: hold, from: b.y}},block: signal.gain,   rate: fast}   # one
    b:
          with: {matrix: [[1,2],
                          [3, 4]]}     # rows
          block: sources.ramp
          # The end of b.
    # The end of the blocks.

doc: "two
  lines"
expect:
- {within: 3 m, signal: a.y}
- rms: 1 m
  signal: "b.y[0]"
# The end of the file."""

TIDY = """\
# The head of the file
# stays at its head.
quadvis: 1
name: untidy   # of the diagram

doc: "two
  lines"

rates: {fast: 10 Hz, slow: 1 Hz}
blocks:
  # This explains a.
  a: {block: signal.gain, rate: fast, in: {u: {from: b.y, across: hold}}}        # one
  b:
    block: sources.ramp
    with: {matrix: [[1, 2], [3, 4]]}   # rows
    # The end of b.
  # The end of the blocks.
expect:
  - {signal: a.y, within: 3 m}
  - signal: "b.y[0]"
    rms: 1 m
# The end of the file.
"""


def tidy(text: str) -> str:
    return formatted(text, ranks=key_ranks)


def test_an_untidy_file_becomes_tidy() -> None:
    assert tidy(UNTIDY) == TIDY


@pytest.mark.parametrize("path", DIAGRAMS, ids=lambda path: str(path.relative_to(ROOT / "diagrams")))
def test_the_diagrams_that_come_along_are_in_the_house_style(path: Path) -> None:
    text = path.read_text("utf-8")
    ranks = key_ranks if text.startswith("quadvis") or "\nquadvis:" in text else None
    found = formatted(text, str(path), ranks) if ranks else formatted(text, str(path))
    assert "\n".join(difflib.unified_diff(text.splitlines(), found.splitlines(), lineterm="")) == ""


def test_the_order_knows_all_keys() -> None:
    assert set(FILE) == {(key,) for key in {section.key for section in SECTIONS} | {
        *PARAMETERS_REQUIRED, *PARAMETERS_KEYS
    }}  # fmt: skip
    for path, keys in (
        (("blocks", "*"), BLOCK_KEYS),
        (("blocks", "*", "in", "*"), WIRE_KEYS),
        (("figures", "#"), FIGURE_KEYS),
        (("figures", "#", "panels", "#"), PANEL_KEYS),
    ):
        assert sorted(key for group in ORDERS[path] for key in group) == sorted(keys)


@pytest.mark.parametrize(
    ("text", "tidied"),
    [
        ("a: {b: 1}", "a: {b: 1}\n"),
        ("---\na: 1\n...\n", "a: 1\n"),
        ("a:\n  |\n   x\n    y\n\n\nb: 1\n", "a: |\n  x\n   y\n\nb: 1\n"),
        ("a: |+\n  x\n\n\n", "a: |+\n  x\n\n\n"),
        ("a: >-\n   folded\n   text\n# end\n", "a: >-\n  folded\n  text\n# end\n"),
        ("a:\n  # why\n  1\n", "# why\na: 1\n"),
        ("a:  # one\n  1  # two\n", "# one\na: 1  # two\n"),
        ("a:\n- # first\n  b: 1\n-   - 2\n    -   3\n", "a:\n  # first\n  - b: 1\n  - - 2\n    - 3\n"),
        ("a: [ 1,2 ,  # of two\n  3]\n", "# of two\na: [1, 2,\n  3]\n"),
        ("a: [\n 1,\n 2\n]\n", "a: [\n  1,\n  2]\n"),
        ("- a\n-\n  - b\n", "- a\n- - b\n"),
        ("a: 'it''s' #no comment\n", "a: 'it''s'  #no comment\n"),
        ("a: b#c\n", "a: b#c\n"),
        ("{a: 1, b: [ ]}\n", "{a: 1, b: []}\n"),
        ("a: {}\r\nb:\r\n", "a: {}\nb:\n"),
        ("a: 1\n\n\n\n# x\n\n\nb: 2\n\n", "a: 1\n\n# x\n\nb: 2\n"),
    ],
)
def test_small_texts(text: str, tidied: str) -> None:
    assert tidy(text) == tidied
    assert tidy(tidied) == tidied


def test_a_line_that_is_too_long_gets_a_line_for_each_key() -> None:
    wires = ", ".join(f"input_{number}: {{from: block_{number}.y, across: hold}}" for number in range(4))
    found = tidy(f"in: {{{wires}}}  # many\n")
    assert found.splitlines()[:2] == ["in:  # many", "  input_0: {from: block_0.y, across: hold}"]
    assert tidy(found) == found
    numbers = f"a: [{', '.join(['1'] * 60)}]\n"
    assert tidy(numbers) == numbers


WORDS = st.text("ab:#,[]{}'\"-? \\|>%", max_size=8)
KEYS = st.sampled_from(
    ["a", "in", "blocks", "rate", "with", "from", "value", "unit", "quadvis", "log", "name"]
)
VALUES: Any = st.recursive(
    WORDS | st.integers() | st.booleans() | st.none() | st.text("xyz\n ", max_size=30),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(KEYS, inner, max_size=5),
    max_leaves=20,
)


@st.composite
def commented(draw: Any) -> str:
    """Return a text of YAML with comments and blank lines where they may be."""
    style = draw(st.sampled_from([True, False, None]))
    data = draw(st.dictionaries(KEYS, VALUES, min_size=1))
    indent, width = draw(st.integers(2, 6)), draw(st.sampled_from([20, 80, 500]))
    text = yaml.safe_dump(data, default_flow_style=style, indent=indent, width=width, sort_keys=False)
    lines = text.split("\n")
    for number, line in enumerate(lines):
        if draw(st.integers(0, 5)) == 0 and "'" not in text and '"' not in text and "|" not in text:
            lines[number] = line + draw(st.sampled_from(["  # c", "\n# d", "\n\n      # e", "   ", "\n\n"]))
    return "\n".join(lines)


@given(commented())
@settings(max_examples=40, deadline=None)
def test_the_style_is_reached_at_once_and_changes_no_meaning(text: str) -> None:
    try:
        before = parse_yaml(text).to_python()
    except DiagramError:
        return
    once = tidy(text)
    assert parse_yaml(once).to_python() == before
    assert tidy(once) == once
    comments = sorted(each.text for each in SourceText(text).comments.values())
    assert sorted(each.text for each in SourceText(once).comments.values()) == comments


def test_what_means_something_else_is_not_the_same() -> None:
    def alike(one: str, other: str) -> bool:
        return same(SourceText(one).root, SourceText(other).root, key_ranks, ())

    assert alike("blocks: {a: {rate: x, block: y}}", "blocks: {a: {block: y, rate: x}}")
    assert not alike("blocks: {a: 1, b: 2}", "blocks: {b: 2, a: 1}")
    assert not alike("a: 1", "a: '1'")
    assert not alike("a: [1, 2]", "a: [2, 1]")
    assert not alike("a: 1", "a: {b: 1}")


def test_a_result_that_means_something_else_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("quadvis.document.style._Layout.text", lambda self: "a: 2\n")
    with pytest.raises(QuadvisError, match="would not mean the same afterwards"):
        tidy("a: 1\n")


def test_the_command_checks_shows_and_writes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, other = tmp_path / "untidy.yaml", tmp_path / "tidy.yaml"
    path.write_text(UNTIDY)
    other.write_text(TIDY)
    assert main(["fmt", str(path), str(other), "--check"]) == 1
    assert capsys.readouterr().out == f"{path}\n" and path.read_text() == UNTIDY
    assert main(["fmt", str(path), "--diff"]) == 0
    shown = capsys.readouterr().out
    assert f"--- {path}" in shown and "+rates: {fast: 10 Hz, slow: 1 Hz}" in shown
    assert path.read_text() == UNTIDY
    assert main(["fmt", str(path), str(other)]) == 0
    assert capsys.readouterr().out == f"{path}\n" and path.read_text() == TIDY
    assert main(["fmt", str(path), "--check", "--diff"]) == 0
    assert capsys.readouterr().out == ""


def test_a_file_with_a_fault_stays(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "a.yaml"
    path.write_text("a: [1\n")
    assert main(["fmt", str(path)]) == 2
    assert f"{path}:1:4" in capsys.readouterr().err and path.read_text() == "a: [1\n"
