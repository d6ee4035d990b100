"""Which tasks hold each other up: those with blocks that Python runs."""

from __future__ import annotations

from pathlib import Path

import pytest

from quadvis.api import load_text
from quadvis.cli import main
from quadvis.realtime.hold_ups import hold_ups

TEXT = """\
quadvis: 1
name: shares
tasking: multi
rates: {a: 100 Hz, b: 50 Hz, c: 10 Hz}
stop_time: 1 s
blocks:
  a: {block: sources.sine, rate: a}
  b: {block: sources.sine, rate: b}
  c: {block: sources.sine, rate: c}
  d: {block: sources.sine, rate: c}
  e: {block: sources.sine, rate: c}
  f: {block: sources.sine, rate: c}
"""


@pytest.mark.parametrize(
    ("interpreted", "words"),
    [
        ("", []),
        ("b", ["task 'b' runs Python (b); it holds up no other task"]),
        (
            "ac",
            [
                "task 'a' runs Python (a) and can hold up 'c', which does so, too",
                "task 'c' runs Python (c) and can hold up 'a', which does so, too",
            ],
        ),
        (
            "abcdef",
            [
                "task 'a' runs Python (a) and can hold up 'b' and 'c', which do so, too",
                "task 'b' runs Python (b) and can hold up 'a' and 'c', which do so, too",
                "task 'c' runs Python (c, d, e and 1 other) and can hold up 'a' and 'b', which do so, too",
            ],
        ),
    ],
)
def test_each_task_with_python_is_reported_with_those_that_wait(interpreted: str, words: list[str]) -> None:
    assert hold_ups(load_text(TEXT).graph, set(interpreted)) == words


OWN = """\
from quadvis.block import Block, Out

class Looks(Block, numeric=False):
    \"\"\"Looks outside.\"\"\"

    y = Out()

    def output(self):
        return 0.0
"""


@pytest.mark.parametrize("tasking", ["multi", "single"])
def test_the_command_check_says_so(
    tasking: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("blocks/own").mkdir(parents=True)
    Path("blocks/own/looks.py").write_text(OWN)
    text = TEXT.replace("b: {block: sources.sine", "b: {block: own.looks").replace("multi", tasking)
    Path("shares.yaml").write_text(text)
    assert main(["check", "shares.yaml"]) == 0
    told = "  task 'b' runs Python (b); it holds up no other task\n" if tasking == "multi" else ""
    assert capsys.readouterr().out == f"shares.yaml: 6 blocks in a, b, c: no fault\n{told}"
