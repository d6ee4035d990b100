"""The difference of diagrams, variants and logs."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import quadvis
from quadvis import read_log
from quadvis.cli import main
from quadvis.diff.changes import compare_diagrams
from quadvis.diff.difference import diff
from quadvis.diff.places import shared_blocks
from quadvis.diff.report import DiffReport
from quadvis.diff.texts import changed_texts, value_text
from quadvis.errors import QuadvisError
from tests.quadvis.relogged import flipped, rewritten, without

TEXT = """\
quadvis: 1
name: flight
rates: {fast: 20 Hz, slow: 10 Hz}
stop_time: 1 s
seed: 7
blocks:
  noise: {block: sources.noise, rate: fast, with: {sigma: 0.1 m}}
  filter: {block: signal.low_pass, slot: true, rate: fast, with: {time_constant: 0.2 s}, in: {u: noise.y}}
  slow: {block: signal.gain, rate: slow, with: {factor: 2}, in: {u: {from: filter.y, across: sample}}}
  control: {part: law.yaml, rate: slow, in: {u: slow.y}}
variants:
  other:
    slots:
      filter: {block: signal.saturation, with: {upper: 1 m, lower: -1 m}}
expect:
  - {signal: slow.y, within: 1 m}
"""
LAW = """\
quadvis: 1
name: law
ports: {in: [u], out: {y: twice.y}}
blocks:
  once: {block: signal.gain, in: {u: in.u}}
  twice: {block: signal.gain, with: {factor: 2}, in: {u: once.y}}
"""


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("a.yaml").write_text(TEXT)
    Path("law.yaml").write_text(LAW)


def written(*pairs: tuple[str, str]) -> None:
    """Write another diagram, with texts replaced."""
    text = TEXT
    for old, new in pairs:
        assert old in text
        text = text.replace(old, new)
    Path("b.yaml").write_text(text)


def printed(*words: str, code: int, capsys: pytest.CaptureFixture[str]) -> list[str]:
    assert main(["diff", *words]) == code
    return capsys.readouterr().out.splitlines()


def test_what_is_written_in_another_way_is_the_same(capsys: pytest.CaptureFixture[str]) -> None:
    written(("0.2 s", "200 ms"), ("20 Hz", "50 ms"))
    assert printed("a.yaml", "b.yaml", code=0, capsys=capsys) == ["a.yaml -> b.yaml", "the same"]


def test_every_change_has_its_line(capsys: pytest.CaptureFixture[str]) -> None:
    written(
        ("slow: 10 Hz", "slow: 5 Hz"),
        ("seed: 7", "seed: 8"),
        ("sigma: 0.1 m", "sigma: 0.2 m"),
        ("in: {u: noise.y}", "in: {u: other.y}"),
        ("across: sample", "across: delay"),
        (
            "  control: {part: law.yaml, rate: slow, in: {u: slow.y}}\n",
            "  other: {block: sources.sine, rate: fast, with: {amplitude: 1 m}}\n",
        ),
        ("within: 1 m", "rms: 1 m"),
    )
    assert printed("a.yaml", "b.yaml", code=1, capsys=capsys) == [
        "a.yaml -> b.yaml",
        "rates",
        "  ~ slow  1/10 s -> 1/5 s",
        "seed",
        "  ~ 7 -> 8",
        "blocks: 1 added, 2 removed, 3 changed, 0 the same",
        "  ~ noise  sources.noise",
        "      ~ sigma  0.1 m -> 0.2 m",
        "  ~ filter  signal.low_pass",
        "      ~ in.u  noise.y -> other.y",
        "  ~ slow  signal.gain",
        "      ~ in.u  filter.y (sample) -> filter.y (delay)",
        "  + other  sources.sine  fast",
        "  control/",
        "    - once   signal.gain  slow",
        "    - twice  signal.gain  slow",
        "expect",
        "  - signal slow.y, within 1 m",
        "  + signal slow.y, rms 1 m",
    ]


def test_variants_of_one_file(capsys: pytest.CaptureFixture[str]) -> None:
    lines = printed("a.yaml", "--variants", "none", "other", code=1, capsys=capsys)
    assert lines[:2] == ["a.yaml -> a.yaml (other)", "blocks: 1 changed, 4 the same"]
    assert lines[2] == "  ~ filter  signal.low_pass -> signal.saturation"
    assert "      - time_constant  0.2 s" in lines and "      + lower          -1.0 m" in lines
    assert printed("a.yaml", "a.yaml", "--variants", "other", "other", code=0, capsys=capsys)[1] == "the same"


@pytest.mark.parametrize(
    "words, sentence",
    [
        (
            ["a.yaml"],
            "'a.yaml' is compared with nothing; name a second file, or two variants by --variants X Y",
        ),
        (["a.yaml", "--variants", "other"], "--variants needs 2 values; write --variants X Y"),
        (["a.yaml", "b", "c"], "'c' is one too many; write 'quadvis diff A [B]'"),
        (["a.yaml", "missing.yaml"], "cannot read 'missing.yaml': "),
        (["a.yaml", "--variants", "none", "othre"], "a.yaml:"),
    ],
)
def test_a_slip_is_a_sentence(words: list[str], sentence: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["diff", *words]) == 2
    assert capsys.readouterr().err.startswith(sentence)


def test_two_logs_differ_in_runs_diagrams_and_signals(capsys: pytest.CaptureFixture[str]) -> None:
    quadvis.load("a.yaml").run(log="a.mcap")
    quadvis.load("a.yaml", settings={"slow.factor": 3}, seed=8).run(log="b.mcap")
    lines = printed("a.mcap", "b.mcap", code=1, capsys=capsys)
    assert lines[1:6] == [
        "seed",
        "  ~ 7 -> 8",
        "blocks: 1 changed, 4 the same",
        "  ~ slow  signal.gain",
        "      ~ factor  2.0 -> 3.0",
    ]
    assert lines[6] == "signals: 5 of 5 differ"
    old, new = read_log("a.mcap"), read_log("b.mcap")
    largest = np.abs(new["noise.y"] - old["noise.y"]).max()
    assert f"  ~ noise.y          from t = 0 s on     by {largest:.3g} m" in lines[7]
    with pytest.raises(QuadvisError, match="is a log, which has no variants"):
        diff("a.mcap", "b.mcap", variants=("other", None))


def test_one_bit_of_a_log_is_found() -> None:
    quadvis.load("a.yaml").run(log="a.mcap")
    log = read_log("a.mcap")
    rewritten(log, flipped("/noise", 4, 0), path="b.mcap")
    found = diff("a.mcap", "b.mcap")
    assert found.signals is not None and not found.diagram
    (only,) = found.signals.different
    assert (only.difference.signal, only.difference.row, only.time) == ("noise.y", 4, 0.2)
    assert 0 < only.difference.largest < 1e-15
    rewritten(log, without("/noise", 4), path="b.mcap")
    found = diff("a.mcap", "b.mcap")
    assert found.signals is not None and not found.signals.different
    assert found.signals.unlike == (("noise.y", "1 rows only in the first, 0 only in the second"),)


def test_a_log_is_compared_with_the_file_as_it_is_now(capsys: pytest.CaptureFixture[str]) -> None:
    quadvis.load("a.yaml").run(log="a.mcap")
    assert printed("a.mcap", "a.yaml", code=0, capsys=capsys)[1] == "the same"
    written(("sigma: 0.1 m", "sigma: 0.3 m"))
    assert printed("a.mcap", "b.yaml", code=1, capsys=capsys)[-1] == "      ~ sigma  0.1 m -> 0.3 m"


def test_the_facts_are_complete(capsys: pytest.CaptureFixture[str]) -> None:
    written(("sigma: 0.1 m", "sigma: 0.3 m"))
    assert main(["diff", "a.yaml", "b.yaml", "--json"]) == 1
    assert json.loads(capsys.readouterr().out) == {
        "old": "a.yaml",
        "new": "b.yaml",
        "same": False,
        "facts": [],
        "sections": {},
        "blocks": [
            {
                "block": "noise", "kind": "changed", "old": "sources.noise", "new": "sources.noise",
                "changes": [{"name": "sigma", "kind": "changed", "old": "0.1 m", "new": "0.3 m"}],
            }
        ],
        "same_blocks": 4,
        "signals": None,
    }  # fmt: skip


def test_a_terminal_sees_colours() -> None:
    written(("sigma: 0.1 m", "sigma: 0.3 m"))
    lines = list(DiffReport(diff("a.yaml", "b.yaml"), colour=True).lines())
    assert lines[-1] == "      \x1b[33m~\x1b[0m sigma  \x1b[31m0.1 m\x1b[0m -> \x1b[32m0.3 m\x1b[0m"


@pytest.mark.parametrize(
    "old, new, texts",
    [
        (1.0, 2.0, ("1.0", "2.0")),
        ("2 rad/s", "3 rad/s", ("2 rad/s", "3 rad/s")),
        (True, False, ("true", "false")),
        ({"value": [1, 2], "unit": "m"}, {"value": [1, 3], "unit": "m"}, ("[1, 2] m", "[1, 3] m")),
        ({"value": [1, 2], "unit": "m 1"}, {"value": [1, 3], "unit": "m 1"}, ("[1 m, 2]", "[1 m, 3]")),
        ([0.5] * 99, [0.5] * 98 + [1.5], ("[98] 0.5", "[98] 1.5")),
        (
            {"value": [[0.25, 0.75]] * 40, "unit": "N"},
            {"value": [[0.25, 1.75]] * 40, "unit": "N"},
            ("[0,1] 0.75 N", "[0,1] 1.75 N and 39 more"),
        ),
        ([0.5] * 99, [0.5] * 98, ("99 values", "98 values")),
    ],
)
def test_values_as_texts(old: Any, new: Any, texts: tuple[str, str]) -> None:
    assert changed_texts(old, new) == texts


def test_a_long_value_is_cut_on_one_line() -> None:
    assert value_text([0.25] * 1000) == "1000 values"
    assert value_text("x" * 1000) == "x" * 69 + "..."


def test_a_port_called_value_is_a_wire() -> None:
    sides = [
        {"blocks": {"hold": {"block": "signal.hold_valid", "rate": "fast", "in": {"value": wire}}}}
        for wire in ("a.y", "b.y")
    ]
    ((block,),) = [compare_diagrams(*sides).blocks]
    assert [(change.name, change.old, change.new) for change in block.changes] == [("in.value", "a.y", "b.y")]


def test_a_block_that_reads_another_one_in_the_place_of_one_that_differs_is_the_same() -> None:
    desk = {"a": {"block": "x", "in": {"u": "slot.y"}}, "b": {"block": "x", "in": {"u": "a.y"}},
            "slot": {"block": "p"}}  # fmt: skip
    bench = {"a": {"block": "x", "in": {"u": "slot/inner.z"}}, "b": {"block": "x", "in": {"u": "a.y"}},
             "slot/inner": {"block": "q"}}  # fmt: skip
    found = shared_blocks({"desk": {"blocks": desk}, "bench": {"blocks": bench, "rates": {"r": "1 Hz"}}})
    assert (found.differing, found.sections, found.same) == (("slot",), ("rates",), 2)
    moved = desk | {"b": {"block": "x", "in": {"u": "slot.y"}}}
    found = shared_blocks({"desk": {"blocks": desk}, "bench": {"blocks": moved}})
    assert (found.differing, found.same) == (("b",), 2)
