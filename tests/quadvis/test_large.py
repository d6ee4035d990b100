"""Large diagrams: 10,000 blocks in a file, whose shapes and units flow once per case and not per block."""

from __future__ import annotations

import gc
import subprocess
import sys
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from quadvis.api import check, load, load_text
from quadvis.block import Block
from quadvis.diagram.shape_flow import ShapeFlow
from quadvis.diagram.unit_flow import Bindings, UnitFlow
from quadvis.document import MAX_BYTES, parse_yaml
from quadvis.engine.engine import Engine
from quadvis.engine.memory import Record
from quadvis.errors import DiagramError

HEAD = "quadvis: 1\nname: large\nrates: {fast: 1 kHz}\nstop_time: 1 s\nblocks:\n"
PART = """\
quadvis: 1
name: stage
ports: {in: [u], out: {y: delay.y}}
params: {factor: 1}
blocks:
  gain: {block: signal.gain, with: {factor: $factor}, in: {u: in.u}}
  delay: {block: signal.unit_delay, in: {u: gain.y}}
"""


def chain(count: int) -> str:
    """Return a source and then gains and unit delays in turn; the gains halve and double."""
    rows = [HEAD, "  source: {block: sources.constant, rate: fast, with: {value: 1.5 m}}\n"]
    before = "source.y"
    for number in range(1, count):
        kind = "signal.unit_delay" if number % 2 == 0 else "signal.gain"
        given = "" if number % 2 == 0 else f"with: {{factor: {2.0 if number % 4 == 1 else 0.5}}}, "
        rows.append(f"  b{number}: {{block: {kind}, rate: fast, {given}in: {{u: {before}}}}}\n")
        before = f"b{number}.y"
    return "".join(rows)


def loops(count: int) -> str:
    """Return feedback loops of four blocks, one behind the other, named against the signals."""
    rows = [HEAD, "  source: {block: sources.constant, rate: fast, with: {value: 1.5 m}}\n"]
    before = "source.y"
    for number in range(count // 4, 0, -1):
        rows.append(
            f"  sum{number}: {{block: signal.sum, rate: fast, in: {{u: [{before}, last{number}.y]}}}}\n"
            f"  gain{number}: {{block: signal.gain, rate: fast, in: {{u: sum{number}.y}}}}\n"
            f"  more{number}: {{block: signal.gain, rate: fast, in: {{u: gain{number}.y}}}}\n"
            f"  last{number}: {{block: signal.unit_delay, rate: fast, in: {{u: more{number}.y}}}}\n"
        )
        before = f"last{number}.y"
    return "".join(rows)


def calls(monkeypatch: pytest.MonkeyPatch, *watched: tuple[type, str]) -> Counter[str]:
    """Return the numbers of calls of methods from now on, by their names."""
    found: Counter[str] = Counter()

    def counted(kind: type, name: str) -> Callable[..., Any]:
        method = getattr(kind, name)

        def call(*given: Any) -> Any:
            found[f"{kind.__name__}.{name}"] += 1
            return method(*given)

        return call

    for kind, name in watched:
        monkeypatch.setattr(kind, name, counted(kind, name))
    return found


@pytest.mark.slow
def test_ten_thousand_blocks_are_checked_and_run() -> None:
    diagram = load_text(chain(10_000))
    assert len(diagram.graph.nodes) == 10_000
    assert {str(unit) for node in diagram.graph.nodes for unit in node.units["y"]} == {"m"}
    with Engine(diagram.graph) as engine:
        engine.run(4)
        # After tick k the sample has passed k unit delays; before each odd one the gain doubles it.
        values = [engine.read(f"b{number}", "y") for number in range(1, 11)]
    assert values == [3.0, 3.0, 1.5, 1.5, 3.0, 3.0, 1.5, 0.0, 0.0, 0.0]


@pytest.mark.slow
def test_parts_may_hold_ten_thousand_blocks(tmp_path: Path) -> None:
    (tmp_path / "stage.yaml").write_text(PART)
    rows = [f"  s{k}: {{part: stage.yaml, rate: fast, in: {{u: s{k + 1}.y}}}}\n" for k in range(5_000)]
    source = "  s5000: {block: sources.constant, rate: fast, with: {value: 2}}\n"
    (tmp_path / "large.yaml").write_text(HEAD + "".join(rows) + source)
    assert len(load(tmp_path / "large.yaml").graph.nodes) == 10_001


@pytest.mark.parametrize("make", [chain, loops])
def test_what_holds_for_a_case_is_worked_out_once(
    make: Callable[[int], str], monkeypatch: pytest.MonkeyPatch
) -> None:
    counted = calls(
        monkeypatch, (ShapeFlow, "settle"), (UnitFlow, "settle"), (Bindings, "match"), (Record, "of")
    )

    def count(blocks: int) -> dict[str, int]:
        counted.clear()
        Engine(load_text(make(blocks)).graph)
        return dict(counted)

    few = count(40)
    assert few["ShapeFlow.settle"] and few["UnitFlow.settle"] and few["Record.of"]
    if make is chain:
        assert count(400) == few
    else:  # in each loop one block goes ahead
        rings = 90
        assert all(count(400)[name] <= number + 2 * rings for name, number in few.items())


def test_variants_share_the_blocks_that_they_have_in_common(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rows = "  slot: {block: sources.constant, slot: true, rate: fast, with: {value: 1}}\n"
    rows += "".join(
        f"  g{k}: {{block: signal.gain, rate: fast, with: {{factor: 2}}, in: {{u: slot.y}}}}\n"
        for k in range(10)
    )
    variants = "variants:\n" + "".join(
        f"  v{k}: {{slots: {{slot: {{block: sources.constant, with: {{value: {k}}}}}}}}}\n" for k in range(5)
    )
    path = tmp_path / "d.yaml"
    path.write_text(HEAD + rows + variants)
    made = calls(monkeypatch, (Block, "check"), (ShapeFlow, "settle"))
    check(path)
    assert made["Block.check"] == 11 + 5
    assert made["ShapeFlow.settle"] == 2  # a source, and a gain


def test_a_variant_takes_a_block_that_an_earlier_one_had(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "stage.yaml").write_text(PART)
    rows = "  slot: {block: sources.constant, slot: true, rate: fast, with: {value: 1}}\n"
    part = "{part: stage.yaml, rate: fast, with: {factor: 3}, in: {u: slot.y}}"
    rows += f"  stage: {part.replace('{', '{slot: true, ', 1)}\n"
    other = "{part: stage.yaml, with: {factor: 4}}"
    variants = (
        f"variants:\n  a: {{slots: {{stage: {other}}}}}\n  b: {{slots: {{slot: {{block: sources.sine}}}}}}\n"
    )
    path = tmp_path / "d.yaml"
    path.write_text(HEAD + rows + variants)
    made = calls(monkeypatch, (Block, "check"))
    check(path)
    assert made["Block.check"] == 3 + 1 + 1  # the gain of "a", the sine of "b"


def test_a_fault_in_one_of_many_equal_blocks_is_that_block_s() -> None:
    text = chain(200).replace("in: {u: b120.y}", "in: {u: 2 s}")
    end = "  end: {block: signal.sum, rate: fast, in: {u: [b199.y, b119.y]}}\n"
    with pytest.raises(DiagramError) as caught:
        load_text(text + end)
    assert [fault.subject for fault in caught.value.faults] == ["block 'end'"]


@pytest.mark.parametrize("text", [chain(3), "name: [broken"])
def test_loading_leaves_the_garbage_collector_as_it_was(text: str) -> None:
    for switch in (gc.disable, gc.enable):
        switch()
        before = gc.isenabled()
        with suppress(DiagramError):
            Engine(load_text(text).graph)
        assert gc.isenabled() == before


def test_garbage_is_collected_again_but_not_among_what_was_made_at_rest() -> None:
    code = (
        "import gc; from quadvis.machine.garbage import collected_from_now_on as again\n"
        "again(); enabled = gc.get_freeze_count(); gc.disable(); again()\n"
        "print(enabled, gc.get_freeze_count() > 1000, gc.isenabled())"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.split() == ["0", "True", "True"]


def test_the_end_of_a_process_collects_no_garbage() -> None:
    code = (
        "import atexit, gc; from quadvis.machine.garbage import uncollected_at_exit\n"
        "atexit.register(lambda: print(gc.get_freeze_count() > 1000, end=''))\n"  # the last to be called
        "uncollected_at_exit()"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout == "True"


@pytest.mark.slow
def test_a_long_honest_file_is_read() -> None:
    row = f"- {{name: one, value: 0.5 m, more: [1, 2, 3], doc: '{'word ' * 60}'}}\n"
    text = row * (10_000_000 // len(row))
    assert len(parse_yaml(text).items()) == len(text) // len(row)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("[" + "a," * 300_000 + "]", "the file holds more than 150000 values; split it"),
        ("a: &a [x]\n" + "b: [*a]\n", "the anchor '&a' is not allowed"),
        ("x" * (MAX_BYTES + 1), "the text is larger than 16 MB; split it"),
    ],
)
def test_a_file_that_is_more_than_its_length_is_refused(text: str, problem: str) -> None:
    with pytest.raises(DiagramError) as caught:
        parse_yaml(text)
    assert problem in str(caught.value)
