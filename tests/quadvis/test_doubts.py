"""Warnings: a diagram that runs, but is surely a mistake, is reported beside the faults."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from quadvis.api import check, load
from quadvis.cli import main

DIAGRAMS = Path(__file__).parents[2] / "diagrams"
CASE = """\
quadvis: 1
name: case
params: {size: 2 m}
rates: {c: 10 Hz}
stop_time: 1 s
blocks:
  s: {block: sources.step, rate: c, with: {after: $size}}
"""
SLOT = CASE.replace("rate: c,", "rate: c, slot: true,")
PART = """\
quadvis: 1
name: part
params: {size: 1 m, other: 2}
ports: {out: {y: s.y}}
blocks:
  s: {block: sources.step, with: {after: $size}}
"""
WITH_PART = (
    CASE.replace("rates: {c: 10 Hz}", "rates: {c: 10 Hz, d: 5 Hz}") + "  p: {part: part.yaml, rate: d}\n"
)
SINE = CASE + "  w: {block: sources.sine, rate: c, with: {frequency: FREQUENCY}}\n"
PULSE = CASE + "  w: {block: sources.pulse, rate: c, with: {width: WIDTH}}\n"
BEYOND = "but the run ends at 1 s; begin earlier, or choose a longer stop time"
IDLE = "no block runs at the rate 'd'; leave it out, or give it to a block"
FAST = "above half the rate of the block, 5 Hz; its samples are those of a slower wave"


@pytest.mark.parametrize(
    ("text", "place", "words"),
    [
        (
            CASE + "expect: [{signal: s.y, after: 5 s, within: 9 m}]\n",
            "8:31",
            f"expect: 'after' is 5 s, {BEYOND}",
        ),
        (
            CASE + "expect: [{signal: s.y, after: 1001 ms, within: 9 m}]\n",
            "8:31",
            f"expect: 'after' is 1.001 s, {BEYOND}",
        ),
        (
            CASE + "expect: [{signal: s.y, after: 0.5 s, before: 0.4 s, within: 9 m}]\n",
            "8:46",
            "expect: 'before' is 400 ms, which is before 500 ms; end later than 'after'",
        ),
        (
            CASE + "summary: {x: {signal: s.y, after: 2 s}}\n",
            "8:35",
            f"summary: 'after' is 2 s, {BEYOND}",
        ),
        (
            CASE + "figures: [{title: x, from: 3 s, signals: [s.y]}]\n",
            "8:28",
            f"figures: 'from' is 3 s, {BEYOND}",
        ),
        (
            CASE.replace("$size", "1 m"),
            "3:16",
            "parameter 'size' is not used; write '$size' where it belongs",
        ),
        (
            CASE.replace("{size: 2 m}", "{size: 2 m, more: [1, 2]}"),
            "3:27",
            "parameter 'more' is not used; write '$more' where it belongs",
        ),
        (CASE.replace("10 Hz}", "10 Hz, d: 5 Hz}"), "4:22", IDLE),
        (CASE.replace("10 Hz}", "10 Hz, d: {rate: 5 Hz, offset: 10 ms}}"), "4:22", IDLE),
        (SINE.replace("FREQUENCY", "6 Hz"), "8:55", f"block 'w': frequency is 6 Hz, {FAST}"),
        (SINE.replace("FREQUENCY", "1 kHz"), "8:55", f"block 'w': frequency is 1000 Hz, {FAST}"),
        (
            PULSE.replace("WIDTH", "20 ms"),
            "8:52",
            "block 'w': width is 0.02 s, shorter than the period of the block, 0.1 s; some pulses are missed",
        ),
        (
            CASE.replace("$size", "2 m").replace(
                "params: {size: 2 m}", "overload: {tasks: {fats: {max: 1}}}"
            ),
            "3:20",
            "no block runs at the rate 'fats'; use 'c'",
        ),
        (WITH_PART, "part", "parameter 'other' is not used; write '$other' where it belongs"),
    ],
)
def test_a_certain_mistake_that_can_be_run_is_warned_of(
    text: str, place: str, words: str, tmp_path: Path
) -> None:
    path = tmp_path / "case.yaml"
    path.write_text(text, encoding="utf-8")
    (tmp_path / "part.yaml").write_text(PART, encoding="utf-8")
    wanted = f"{tmp_path}/part.yaml:3:28" if place == "part" else f"{path}:{place}"
    for diagram in (check(path), load(path)):
        assert [str(warning) for warning in diagram.warnings] == [f"{wanted}: warning: {words}"]


@pytest.mark.parametrize(
    "text",
    [
        CASE,
        CASE + "expect: [{signal: s.y, after: 1 s, within: 9 m}]\n",
        CASE + "expect: [{signal: s.y, after: 0.5 s, before: 5 s, within: 9 m}]\n",
        CASE.replace("2 m}", "[2 m, 3 m]}").replace("$size", "'$size[1]'"),
        CASE.replace("$size", "1 m") + "  g: {block: signal.gain, rate: c, in: {u: $size}}\n",
        SLOT.replace("$size", "1 m")
        + "variants: {v: {slots: {s: {block: sources.step, with: {after: $size}}}}}\n",
        SLOT.replace("10 Hz}", "10 Hz, d: 5 Hz}")
        + "variants: {v: {slots: {s: {block: sources.step, rate: d, with: {after: 1 m}}}}}\n",
        WITH_PART.replace("part.yaml", "whole.yaml"),
        SINE.replace("FREQUENCY", "5 Hz"),
        PULSE.replace("WIDTH", "100 ms"),
    ],
)
def test_what_is_right_is_not(text: str, tmp_path: Path) -> None:
    path = tmp_path / "case.yaml"
    path.write_text(text, encoding="utf-8")
    (tmp_path / "whole.yaml").write_text(PART.replace(", other: 2", ""), encoding="utf-8")
    assert load(path).warnings == check(path).warnings == ()


@pytest.mark.parametrize("path", sorted(DIAGRAMS.glob("*.yaml")), ids=lambda path: path.stem)
def test_no_diagram_of_the_project_is_warned_of(path: Path) -> None:
    diagram = check(path)
    assert diagram.warnings == ()
    for variant in diagram.variants:
        assert load(path, variant=variant).warnings == ()


def test_a_warning_leaves_the_exit_code(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("case.yaml").write_text(CASE.replace("$size", "1 m"), encoding="utf-8")
    told = "case.yaml:3:16: warning: parameter 'size' is not used; write '$size' where it belongs\n"
    for command in (["check", "case.yaml"], ["run", "case.yaml", "--log", ""]):
        assert main(command) == 0
        assert capsys.readouterr().err.startswith(told)
        assert main([*command, "--json"]) == 0
        captured = capsys.readouterr()
        (warning,) = json.loads(captured.out)["warnings"]
        assert (warning["line"], warning["column"], warning["file"]) == (3, 16, "case.yaml")
        assert "warning" not in captured.err


STICK = """\
quadvis: 1
name: stick
solver: {method: METHOD, step: 1 ms}
stop_time: 1 s
blocks:
  drag: {block: signal.friction, rate: continuous, with: {coulomb: 1 m/s^2}, in: {u: SPEED}}
  force: {block: signal.sum, rate: continuous, with: {signs: +-}, in: {u: [2 m/s^2, drag.y]}}
  speed: {block: signal.integrator, in: {u: force.y}}
"""
BANG = """\
quadvis: 1
name: bang
solver: {method: METHOD, step: 1 ms}
stop_time: 1 s
blocks:
  relay:
    block: signal.relay
    rate: continuous
    with: {on_at: 0.1 m, off_at: -0.1 m, on_value: -1 m/s, off_value: 1 m/s}
    in: {u: x.y}
  x: {block: signal.integrator, in: {u: relay.y}}
"""
SLIDE = """\
quadvis: 1
name: slide
solver: {method: METHOD, step: 1 ms}
stop_time: 1 s
blocks:
  mass: {block: plant.sliding_mass, with: {mass: 1 kg, coulomb: 1 N}, in: {force: spring.y}}
  spring: {block: signal.gain, rate: continuous, with: {factor: -5 N/m}, in: {u: mass.x}}
"""
LOCATED = "; take a small step, and look at 'quadvis check --accuracy'"


def warnings(folder: Path, text: str) -> list[str]:
    """Return what a diagram is warned of."""
    file = folder / "case.yaml"
    file.write_text(text)
    return [str(each).partition("warning: ")[2] for each in load(file).warnings]


@pytest.mark.parametrize("method", ["ode4", "Radau"])
def test_a_jump_on_a_loop_of_the_solver_is_a_warning(method: str, tmp_path: Path) -> None:
    words = (
        "block 'drag': 'signal.friction' jumps on a loop that the solver integrates, and the instant is not "
    )
    text = STICK.replace("METHOD", method).replace("SPEED", "speed.y")
    remedy = LOCATED.replace("take", "take 'plant.sliding_mass', or")
    assert warnings(tmp_path, text) == [f"{words}located{remedy}"]


def test_a_jump_outside_of_loops_is_none(tmp_path: Path) -> None:
    assert not warnings(tmp_path, STICK.replace("METHOD", "ode4").replace("SPEED", "1 m/s"))


@pytest.mark.parametrize(
    ("text", "block", "kind"), [(BANG, "relay", "signal.relay"), (SLIDE, "mass", "plant.sliding_mass")]
)
def test_events_that_are_located_are_no_warning_and_others_are(
    text: str, block: str, kind: str, tmp_path: Path
) -> None:
    assert not warnings(tmp_path, text.replace("METHOD", "ode4"))
    words = f"block '{block}': BDF sees the events of '{kind}' at ticks only; choose ode1 to ode4, which "
    assert warnings(tmp_path, text.replace("METHOD", "BDF")) == [f"{words}locate them"]
