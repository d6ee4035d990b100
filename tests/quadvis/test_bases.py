"""Diagrams that stand on others. Their faults are in `cases/bases.yaml`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import quadvis
from quadvis.api import check, load_text
from quadvis.cli import main
from quadvis.errors import DiagramError
from quadvis.output.log_reader import read_log

BASE = """\
quadvis: 1
name: base
doc: What others stand on.
params: {size: 1, bias: 0}
rates: {fast: 10 Hz, slow: 5 Hz}
stop_time: 1 s
seed: 3
blocks:
  wave: {block: sources.sine, rate: fast, with: {amplitude: $size, bias: $bias}}
  law: {slot: true, part: parts/law.yaml, rate: fast, in: {u: wave.y}}
  last: {block: signal.gain, rate: slow, in: {u: {from: law.y, across: sample}}}
variants:
  half: {slots: {law: {block: signal.gain, with: {factor: 0.5}}}}
  step: {slots: {law: {block: sources.step, in: {}}}}
expect: [{signal: last.y, below: 2}, {signal: law.y, below: 3}]
summary: {law: law.y, last: last.y}
"""
LAW = """\
quadvis: 1
name: law
ports: {in: [u], out: {y: gain.y}}
blocks: {gain: {block: signal.gain, in: {u: in.u}}}
"""
FILES = {
    "shared/base.yaml": BASE,
    "shared/parts/law.yaml": LAW,
    "mine.yaml": """\
quadvis: 1
name: mine
base: shared/base.yaml
without: {variants: [step], summary: [law]}
params: {size: 4}
rates: {slow: 2 Hz}
blocks:
  law: {block: signal.gain, with: {factor: 7}}
  more: {block: signal.gain, rate: slow, in: {u: last.y}}
variants:
  third: {slots: {law: {block: signal.gain, with: {factor: 3}}}}
expect: [{signal: more.y, below: 99}]
summary: {more: more.y}
""",
    "top.yaml": """\
quadvis: 1
name: top
base: {file: mine.yaml, variant: half}
blocks:
  wave: {block: sources.constant, with: {value: 2}}
""",
}


@pytest.fixture(autouse=True)
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name, text in FILES.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def factor(diagram: quadvis.Diagram) -> float:
    found: float = diagram.graph["law"].block.factor
    return found


def test_entries_with_names_are_merged_and_other_sections_are_replaced() -> None:
    diagram = quadvis.load("mine.yaml")
    assert diagram.listing == ("wave", "law", "last", "more")
    assert (diagram.name, diagram.seed, diagram.duration) == ("mine", 3, 1.0)
    wave = diagram.graph["wave"].block
    assert (wave.amplitude, wave.bias) == (4.0, 0.0)
    assert {task.name: float(task.period) for task in diagram.graph.tasks} == {"fast": 0.1, "slow": 0.5}
    assert [str(each) for each in diagram.expectations] == ["more.y always below 99"]
    assert [entry.label for entry in diagram.summary] == ["last", "more"]
    assert diagram.variants == ("half", "third")


def test_a_block_stands_in_with_the_wires_and_the_rate_of_the_one_in_its_place() -> None:
    law = quadvis.load("mine.yaml").graph["law"]
    assert (law.kind, law.task.name, law.inputs["u"].block) == ("signal.gain", "fast", "wave")
    result = quadvis.load("mine.yaml").run()
    np.testing.assert_array_equal(result["law.y"], 7 * result["wave.y"])


def test_variants_of_the_base_fill_its_slots_also_where_the_diagram_has_another_block() -> None:
    assert factor(quadvis.load("mine.yaml", variant="half")) == 0.5
    assert factor(quadvis.load("mine.yaml", variant="third")) == 3.0


def test_a_diagram_may_make_a_slot_of_a_block_of_its_base() -> None:
    Path("slots.yaml").write_text(
        "{quadvis: 1, name: slots, base: shared/base.yaml, blocks: {wave: {slot: true, block: sources.sine}},"
        " variants: {steady: {slots: {wave: {block: sources.constant, with: {value: 2}}}}}}"
    )
    assert quadvis.load("slots.yaml", variant="steady").graph["wave"].kind == "sources.constant"


def test_a_base_may_have_a_base_and_a_variant_and_then_its_variants_stay_behind() -> None:
    diagram = quadvis.load("top.yaml")
    assert (factor(diagram), diagram.graph["wave"].kind, diagram.variants) == (0.5, "sources.constant", ())
    assert diagram.run()["more.y"][-1] == 1.0


def test_all_files_are_sources_and_inputs() -> None:
    assert list(map(str, quadvis.load("top.yaml").sources)) == ["top.yaml", "mine.yaml", "shared/base.yaml"]
    diagram = quadvis.load("top.yaml")
    assert {Path("mine.yaml"), Path("shared/base.yaml")} <= set(diagram.inputs)
    Path("plain.yaml").write_text("{quadvis: 1, name: plain, base: shared/base.yaml}")
    assert Path("shared/parts/law.yaml").resolve() in [
        path.resolve() for path in quadvis.load("plain.yaml").sources
    ]


def test_without_changes_it_is_the_base_but_for_its_name() -> None:
    Path("plain.yaml").write_text("{quadvis: 1, name: base, base: shared/base.yaml}")
    for variant in (None, "half", "step"):
        ours = quadvis.load("plain.yaml", variant=variant)
        assert ours.hash == quadvis.load("shared/base.yaml", variant=variant).hash


def test_a_chosen_variant_is_that_of_the_base() -> None:
    Path("plain.yaml").write_text("{quadvis: 1, name: base, base: {file: shared/base.yaml, variant: half}}")
    assert quadvis.load("plain.yaml").hash == quadvis.load("shared/base.yaml", variant="half").hash


def test_settings_and_parameter_files_reach_what_the_base_has() -> None:
    Path("set.yaml").write_text("{quadvis: 1, name: set, set: {bias: 3, wave.amplitude: 8}}")
    wave = quadvis.load("top.yaml", settings={"law.factor": 9}).graph["law"].block
    assert wave.factor == 9.0
    wave = quadvis.load("mine.yaml", params="set.yaml").graph["wave"].block
    assert (wave.amplitude, wave.bias) == (8.0, 3.0)


def test_what_is_written_out_is_the_diagram_again_and_so_is_the_log_of_a_run() -> None:
    for name in ("mine.yaml", "top.yaml"):
        diagram = quadvis.load(name)
        assert load_text(diagram.resolved).hash == diagram.hash
        diagram.run(log=f"{name}.mcap")
        assert read_log(f"{name}.mcap").diagram == diagram.resolved


def test_a_text_may_have_a_base() -> None:
    assert load_text(FILES["top.yaml"]).hash == quadvis.load("top.yaml").hash


def test_parameters_and_rates_of_the_base_that_nothing_uses_any_more_cause_no_warning() -> None:
    Path("less.yaml").write_text(
        "{quadvis: 1, name: less, base: {file: shared/base.yaml, variant: step}, params: {mine: 1},"
        " rates: {mine: 1 Hz}, without: {blocks: [wave, last], summary: [last]}, expect: []}"
    )
    assert [warning.problem for warning in check("less.yaml").warnings] == [
        "parameter 'mine' is not used", "no block runs at the rate 'mine'"
    ]  # fmt: skip


def test_a_chain_of_bases_has_an_end() -> None:
    for number in range(40):
        Path(f"b{number}.yaml").write_text(f"{{quadvis: 1, name: b, base: b{number + 1}.yaml}}")
    with pytest.raises(DiagramError, match=r"b30\.yaml:1:\d+: files build on files more than 30 deep"):
        quadvis.load("b0.yaml")


@pytest.mark.parametrize(
    "command",
    [
        ("check", "mine.yaml"),
        ("draw", "mine.yaml", "-o", "mine.svg"),
        ("run", "top.yaml", "--log", ""),
        ("program", "mine.yaml"),
    ],
    ids=" ".join,
)
def test_commands_take_it_as_any_diagram(
    command: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(command) == 0
    assert capsys.readouterr().err == ""


def test_a_resumed_sweep_repeats_the_runs_of_a_base_that_changed() -> None:
    over: Any = {"seed": [1, 2]}
    quadvis.sweep("mine.yaml", over, output="x.csv", workers=1)
    before = Path("x.csv").read_bytes()
    quadvis.sweep("mine.yaml", over, output="x.csv", resume=True, workers=1)
    assert Path("x.csv").read_bytes() == before
    Path("shared/base.yaml").write_text(BASE.replace("bias: 0}", "bias: 1}"))
    quadvis.sweep("mine.yaml", over, output="x.csv", resume=True, workers=1)
    assert len(Path("x.csv").read_bytes().splitlines()) == len(before.splitlines())
    assert not set(Path("x.csv").read_bytes().splitlines()[1:]) & set(before.splitlines()[1:])
