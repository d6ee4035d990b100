"""Single blocks that do not always run: each is what a part with this block alone would be."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import quadvis
from quadvis.api import load_text
from quadvis.cli import main
from quadvis.diagram.picture import draw_diagram
from quadvis.document.source import parse_yaml
from quadvis.target.newest import NewestValues
from tests.quadvis.test_conditions import HEAD, ROWS, of, run, table

PART = """
quadvis: 1
name: {name}
ports: {{in: [u], out: {{y: {name}.y}}}}
blocks:
  {name}: {{block: {block}, in: {{u: in.u}}}}
"""
BLOCKS = {
    "sum": "signal.discrete_integrator, with: {initial: 5 s}",
    "path": "signal.integrator, with: {initial: 5 s}",
    "held": "signal.gain, with: {factor: 2}",
}
SIGNALS = table("on", ROWS) + table("off", "000001100000010001000")
CONDITIONS = {
    "held": "rate: fast, when: on.y",
    "initial": "rate: fast, when: on.y, initial: {y: 7 s}",
    "states": "rate: fast, when: {from: on.y, states: reset}, reset: falling off.y",
    "outputs": "rate: fast, when: {from: on.y, outputs: reset}",
    "both": "rate: fast, when: {from: on.y, outputs: reset, states: reset}, initial: {y: 8 s}",
    "reset": "rate: fast, reset: off.y",
    "triggered": "rate: fast, triggered: either off.y",
    "enabled": "rate: fast, when: on.y, triggered: rising off.y, initial: {y: -1 s}",
}


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name, block in BLOCKS.items():
        Path(f"{name}.yaml").write_text(PART.format(name=name, block=block))


def both(kind: str, condition: str, wire: str) -> str:
    """A block under a condition, a part with the same block alone, and what reads both."""
    return f"""
  alone: {{block: {BLOCKS[kind]}, {condition}, in: {{u: {wire}}}}}
  part: {{part: {kind}.yaml, {condition}, in: {{u: {wire}}}}}
  reads: {{block: signal.difference, rate: fast, in: {{plus: alone.y, minus: part.y}}}}
"""


@pytest.mark.parametrize("condition", CONDITIONS)
@pytest.mark.parametrize("kind", ["sum", "held"])
def test_a_block_is_what_a_part_with_it_alone_is(kind: str, condition: str) -> None:
    wire = "one.y" if kind == "sum" else "time.y"
    result = run(SIGNALS + both(kind, CONDITIONS[condition], wire))
    assert of(result, "alone.y").tobytes() == of(result, "part.y").tobytes()
    assert not of(result, "reads.y").any()
    assert len(set(of(result, "alone.y").tolist())) > 2


TEXT = (
    HEAD
    + SIGNALS
    + """
  path: {block: signal.integrator, when: {from: on.y, across: hold, states: reset},
      with: {initial: 5 s}, in: {u: {from: one.y, across: hold}}}
  sum:
    block: signal.discrete_integrator
    rate: fast
    when: {from: on.y, outputs: reset}
    initial: {y: 9 s}
    with: {initial: 5 s}
    in: {u: one.y}
  twice: {block: signal.gain, rate: fast, triggered: falling off.y, with: {factor: 2}, in: {u: sum.y}}
expect:
  - {signal: sum.y, after: 2 s, within: 0 s, of: 9 s}
summary:
  sum: {signal: sum.y, show: [highest]}
"""
)
NAMES = ["path.y", "sum.y", "twice.y"]


def test_machine_code_gives_the_same_bits() -> None:
    one, other = (load_text(TEXT).run(engine=engine) for engine in ("python", "native"))
    for name in NAMES:
        assert of(one, name).tobytes() == of(other, name).tobytes(), name


def test_its_name_means_what_readers_see_in_verdicts_logs_and_targets() -> None:
    diagram = load_text(TEXT)
    result = diagram.run(log="run.mcap", engine="python")
    assert result.passed
    assert of(result, "sum.y")[-1] == 9.0
    log = quadvis.read_log("run.mcap")
    assert log["sum.y"].tobytes() == of(result, "sum.y").tobytes()
    assert "sum.y" not in log.names and "sum/y.y" in log.names and "twice.y" in log.names
    assert NewestValues(diagram).place("sum.y").block == "sum/y"


def test_a_run_is_replayed_and_the_resolved_diagram_gives_it_again() -> None:
    diagram = load_text(TEXT)
    result = diagram.run(log="run.mcap", engine="python")
    found = quadvis.replay("run.mcap")
    assert found.same and found.whole
    again = load_text(diagram.resolved)
    assert again.resolved == diagram.resolved
    other = again.run(engine="python")
    for name, path in (("path.y", "path.y"), ("sum.y", "sum/y.y"), ("twice.y", "twice.y")):
        assert of(result, name).tobytes() == of(other, path).tobytes()


def test_a_block_that_holds_its_outputs_has_no_other_block_to_show_them() -> None:
    paths = load_text(TEXT).listing
    assert [path for path in paths if "/" in path] == ["path/when", "sum/when", "twice/when", "sum/y"]


def test_its_noise_is_that_of_its_path_as_without_a_condition() -> None:
    noise = "  noise: {block: sources.noise, rate: fast, with: {sigma: 1 m}}\n"
    one, other = run(noise), run(noise.replace("rate: fast", "rate: fast, when: true"))
    assert of(one, "noise.y").tobytes() == of(other, "noise.y").tobytes()


def test_a_parameter_is_set_by_the_name_of_the_block() -> None:
    Path("test.yaml").write_text(TEXT)
    result = quadvis.load("test.yaml", settings={"sum.initial": "6 s"}).run(engine="python")
    assert 6.0 in of(result, "sum.y") and 5.0 not in of(result, "sum.y")


def test_a_block_in_a_part_that_pauses_runs_only_while_that_runs() -> None:
    Path("inner.yaml").write_text(
        """
quadvis: 1
name: inner
ports: {in: [u, on], out: {y: sum.y}}
blocks:
  sum: {block: signal.discrete_integrator, when: {from: in.on, outputs: reset}, in: {u: in.u}}
"""
    )
    part = "  part: {part: inner.yaml, rate: fast, when: on.y, in: {u: one.y, on: off.y}}\n"
    result = run(table("on", "000111111100000000000") + table("off", "111110011111111111111") + part)
    wanted = [0.0] * 3 + [0.0, 0.1, 0.0, 0.0, 0.2, 0.3, 0.4] + [0.4] * 11
    assert of(result, "part.y") == pytest.approx(wanted, abs=1e-12)


def test_a_variant_keeps_the_condition_of_a_slot_and_its_names() -> None:
    text = TEXT.replace("  sum:\n", "  sum:\n    slot: true\n") + (
        "variants:\n  other: {slots: {sum: {block: signal.gain, with: {factor: 3 s}}}}\n"
    )
    Path("test.yaml").write_text(text)
    result = quadvis.load("test.yaml", variant="other").run(engine="python")
    assert sorted(set(of(result, "sum.y").tolist())) == [3.0, 9.0]


def test_a_picture_has_block_and_condition_as_one_box() -> None:
    picture = draw_diagram(load_text(TEXT))
    for words in ("on.y → path.when", "on.y → sum.when", "off.y → twice.trigger", "sum.y → twice.u",
                  "initial outputs while disabled", "runs at falling edges"):  # fmt: skip
        assert words in picture, words
    assert "run_condition" not in picture and "part_output" not in picture
    assert draw_diagram(load_text(TEXT), depth=1) == picture
    assert "sum.when" in draw_diagram(load_text(load_text(TEXT).resolved))


def test_a_picture_with_faults_has_one_box_too(capsys: pytest.CaptureFixture[str]) -> None:
    Path("faulty.yaml").write_text(TEXT.replace("in: {u: sum.y}", "in: {u: som.y}"))
    assert main(["draw", "faulty.yaml", "-o", "faulty.svg"]) == 2
    assert "there is no block 'som'" in capsys.readouterr().err
    picture = Path("faulty.svg").read_text()
    assert "on.y → sum.when" in picture and "part_output" not in picture


def test_an_input_of_the_block_and_one_of_its_condition_keep_apart_in_a_picture() -> None:
    block = (
        "  sum: {block: signal.discrete_integrator, rate: fast, reset: off.y, in: {u: one.y, reset: on.y}}\n"
    )
    picture = draw_diagram(load_text(HEAD + SIGNALS + block))
    assert "on.y → sum.reset" in picture and "off.y → sum.reset of the condition" in picture


def test_fmt_puts_the_words_before_with_and_in(capsys: pytest.CaptureFixture[str]) -> None:
    entry = (
        "  sum: {in: {u: one.y}, with: {initial: 5 s}, when: on.y, rate: fast, block: signal.integrator}\n"
    )
    Path("test.yaml").write_text(HEAD.lstrip() + SIGNALS + entry)
    assert main(["fmt", "test.yaml"]) == 0
    found = parse_yaml(Path("test.yaml").read_text())
    assert [*found["blocks"]["sum"]] == ["block", "rate", "when", "with", "in"]
    capsys.readouterr()


@pytest.mark.parametrize("runs", [True, False])
def test_an_analysis_takes_it_as_it_is_at_the_operating_point(runs: bool) -> None:
    text = f"""
quadvis: 1
name: loop
rates: {{fast: 10 Hz}}
solver: {{method: ode4, step: 50 ms}}
stop_time: 1 s
blocks:
  law: {{block: signal.gain, rate: fast, when: {str(runs).lower()}, with: {{factor: -1 1/s}},
      in: {{u: {{from: plant.y, across: sample}}}}}}
  plant: {{block: signal.integrator, with: {{initial: 1 m}}, in: {{u: {{from: law.y, across: hold}}}}}}
analyse: {{cuts: {{law: law.y}}}}
"""
    found: Any = load_text(text).analyse()
    assert found.linear.parts == {"law": runs}
    # 10 Hz times the logarithm of 1 - 0.1, or an integrator that nothing drives.
    assert found.poles == pytest.approx([10 * np.log(0.9) if runs else 0.0], abs=1e-6)


def test_the_program_and_the_description_say_when_it_runs(capsys: pytest.CaptureFixture[str]) -> None:
    Path("test.yaml").write_text(TEXT)
    assert main(["program", "test.yaml"]) == 0
    lines = [" ".join(line.split()) for line in capsys.readouterr().out.splitlines()]
    assert any("update" in line and "while sum/when.active" in line for line in lines)
    assert main(["check", "test.yaml"]) == 0
