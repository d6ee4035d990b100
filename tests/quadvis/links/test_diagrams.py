"""Diagrams on several computers: they load, run and are analysed as one, and are written out whole."""

from __future__ import annotations

import json
from contextlib import ExitStack
from dataclasses import astuple
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
import yaml

from quadvis.api import Diagram, load, load_text
from quadvis.cli import main
from quadvis.engine.engine import Engine
from quadvis.links.endpoints import links_of, live, open_carriers

# A double integrator under sampled gains; WORLD and TARGET stand where a block says who runs it.
LOOP = """
quadvis: 1
name: loop
rates: {fast: 20 Hz, step: 100 Hz}
solver: {method: ode4, step: 10 ms}
stop_time: 3 s
NETWORK
blocks:
  speed: {block: signal.integrator, rate: continuous, WORLD in: {u: {from: FORCE, across: hold}}}
  place: {block: signal.integrator, rate: continuous, WORLD with: {initial: 0.5 m}, in: {u: speed.y}}
  spring:
    {block: signal.gain, rate: fast, TARGET with: {factor: 2 1/s^2}, in: {u: {from: PLACE, across: sample}}}
  damper:
    {block: signal.gain, rate: fast, TARGET with: {factor: 1.5 1/s}, in: {u: {from: SPEED, across: sample}}}
  both: {block: signal.sum, rate: fast, TARGET in: {u: [spring.y, damper.y]}}
  push: {block: signal.gain, rate: fast, TARGET with: {factor: -1}, in: {u: both.y}}
DELAYS
analyse:
  cuts: {push: push.y}
"""
COMPUTERS = "computers: {world: {}, target: {}}\n"
ENDS = (("force", "push", "hold"), ("place", "place", "sample"), ("speed", "speed", "sample"))
DELAYS = "".join(
    f"""
  one_{name}: {{block: signal.concatenate, rate: step, in: {{u: [{{from: {source}.y, across: {across}}}]}}}}
  late_{name}:
    {{block: signal.transport_delay, rate: step, with: {{delay: {name}_DELAY}}, in: {{u: one_{name}.y}}}}
"""
    for name, source, across in ENDS
)


def linked(links: str = "", extra: str = "") -> Diagram:
    """Return the loop on two computers."""
    text = LOOP.replace("NETWORK", COMPUTERS + links).replace("DELAYS", extra)
    text = text.replace("WORLD", "at: world,").replace("TARGET", "at: target,")
    return load_text(text.replace("FORCE", "push.y").replace("PLACE", "place.y").replace("SPEED", "speed.y"))


def delayed(force: str, place: str) -> Diagram:
    """Return the loop on one computer, with delays in the place of links."""
    text = LOOP.replace("NETWORK", "").replace("WORLD", "").replace("TARGET", "")
    for name, _, _ in ENDS:
        text = text.replace(name.upper(), f'"late_{name}.y[0]"')
    delays = DELAYS.replace("force_DELAY", force).replace("place_DELAY", place)
    return load_text(text.replace("DELAYS", delays.replace("speed_DELAY", place)))


SERIAL = """
links:
  up: {from: world, to: target, via: serial, baud: 38400}
  down: {from: target, to: world, via: serial, baud: 9600}
"""
# A message to the target has 33 bytes and takes 8.6 ms, so that of 10 ms ago has come at each tick of 50 ms.
# A message to the world has 25 bytes, takes 26 ms, and is read at the next step of 10 ms.
CASES = [("", "10 ms", "10 ms"), (SERIAL, "30 ms", "10 ms")]


@pytest.mark.parametrize(("links", "force", "place"), CASES, ids=["memory", "serial"])
def test_a_link_is_a_delay_in_a_run_and_in_an_analysis(links: str, force: str, place: str) -> None:
    one, other = linked(links), delayed(force, place)
    first, second = one.run(), other.run()
    for signal in ("place.y", "speed.y", "push.y"):
        np.testing.assert_array_equal(first[signal], second[signal])
    found, wanted = (diagram.analyse().loops["push"].margins for diagram in (one, other))
    np.testing.assert_allclose(astuple(found), astuple(wanted), rtol=1e-9)


ONE_LINK = """
quadvis: 1
name: one
rates: {slow: 10 Hz}
stop_time: 20 s
computers: {near: {}, far: {}}
links: {line: {from: near, to: far, via: serial, baud: 9600, loss: 10 %, jitter: 50 ms, flips: 1e-3}}
blocks:
  wave: {block: sources.sine, rate: slow, at: near}
  read: {block: signal.gain, rate: slow, at: far, in: {u: wave.y}}
"""


@pytest.mark.slow
def test_machine_code_gives_the_same_bits() -> None:
    diagram = load_text(ONE_LINK)
    one, other = diagram.run(engine="python"), diagram.run(engine="native")
    assert one["line.lost"][-1] > one["line.refused"][-1] > 0
    for signal in one:
        np.testing.assert_array_equal(one[signal], other[signal])


@pytest.mark.slow
def test_machine_code_gives_the_same_bits_of_a_loop() -> None:
    diagram = linked(SERIAL.replace("9600}", "9600, loss: 10 %, jitter: 5 ms, flips: 1e-4}"))
    one, other = diagram.run(engine="python"), diagram.run(engine="native")
    assert one["down.lost"][-1] > 0 and one["down.refused"][-1] > 0
    for signal in one:
        np.testing.assert_array_equal(one[signal], other[signal])


def test_the_order_of_the_blocks_in_the_file_changes_nothing() -> None:
    diagram = linked(SERIAL)
    plain = yaml.safe_load(diagram.resolved)
    plain["blocks"] = dict(reversed(plain["blocks"].items()))
    plain["links"] = dict(reversed(plain["links"].items()))
    del plain["log"]
    one, other = diagram.run(), load_text(yaml.safe_dump(plain, sort_keys=False)).run()
    assert sorted(one) == sorted(other)
    for signal in one:
        np.testing.assert_array_equal(one[signal], other[signal])


def test_a_diagram_written_out_has_its_computers_and_links_and_is_itself_again() -> None:
    text = SERIAL.replace("9600}", "9600, loss: 10 %, jitter: 5 ms, flips: 1e-4, port: /dev/ttyS7}")
    diagram = linked(text)
    again = load_text(diagram.resolved)
    assert again.hash == diagram.hash and again.resolved == diagram.resolved
    plain = yaml.safe_load(diagram.resolved)
    assert plain["computers"] == {"world": {}, "target": {}}
    assert plain["links"]["down"] == {
        "from": "target", "to": "world", "via": "serial", "baud": 9600, "jitter": "0.005 s", "loss": 0.1,
        "flips": 1e-4,
        "port": {"from": "/dev/ttyS7", "to": "/dev/ttyS7"},
    }  # fmt: skip
    assert plain["blocks"]["spring"]["in"] == {"u": {"from": "place.y", "across": "sample", "over": "up"}}
    assert set(plain["blocks"]) == {"speed", "place", "spring", "damper", "both", "push"}
    assert plain["log"]["signals"] and "up/sender" not in plain["log"]["signals"]
    hashes = {linked(change).hash for change in ("", SERIAL, text, SERIAL.replace("9600", "19200"))}
    assert len(hashes) == 4


def test_each_part_has_its_blocks_and_its_ends_of_links() -> None:
    graph = linked(SERIAL).graph
    assert {node.path for node in graph.part_of("world").nodes} == {"speed", "place", "up/sender", "down"}
    assert {node.path for node in graph.part_of("target").nodes} == {
        "spring", "damper", "both", "push", "down/sender", "up",
    }  # fmt: skip
    assert {graph.part_of(name).tick for name in graph.computers} == {Fraction(1, 100)}
    assert [link.name for link in links_of(graph.part_of("world"))] == ["down", "up"]


def test_the_names_of_signals_in_a_link_can_be_logged_judged_and_drawn() -> None:
    diagram = linked(SERIAL, "expect: [{signal: down.age, below: 90 ms}, {signal: up.place_y, within: 1 m}]")
    result = diagram.run()
    assert [verdict.met for verdict in result.outcome.verdicts] == [True, True]
    assert result["down.age"].max() == pytest.approx(0.07)
    drawn = diagram.draw()
    for text in ("down", "target to world: serial, 9600 baud", "place_y", "refused"):
        assert f">{text}</text>" in drawn
    assert "sender" not in drawn


def test_first_values_hold_until_the_first_message() -> None:
    text = """
quadvis: 1
name: first
rates: {slow: 10 Hz}
stop_time: 0.3 s
computers: {near: {}, far: {}}
blocks:
  three: {block: sources.constant, rate: slow, at: near, with: {value: {value: [1, 2, 3], unit: m}}}
  whole: {block: signal.gain, rate: slow, at: far, in: {u: {from: three.y, initial: [1 cm, 2 cm, 3 cm]}}}
  one: {block: signal.gain, rate: slow, at: far, in: {u: {from: "three.y[1]", initial: 2 cm}}}
"""
    diagram = load_text(text)
    result = diagram.run()
    np.testing.assert_allclose(result["whole.y"], [[0.01, 0.02, 0.03], [1, 2, 3], [1, 2, 3], [1, 2, 3]])
    np.testing.assert_allclose(result["one.y"], [0.02, 2, 2, 2])
    inputs = yaml.safe_load(diagram.resolved)["blocks"]["one"]["in"]["u"]
    assert inputs == {"from": "three.y[1]", "initial": "0.02 m"}
    assert load_text(diagram.resolved).hash == diagram.hash


def test_a_link_that_carries_nothing_and_an_idle_computer_are_warned_of(tmp_path: Path) -> None:
    links = (
        "links: {up: {from: world, to: target, via: serial, baud: 115200}, spare: {from: target, to: spare}}"
    )
    text = LOOP.replace("NETWORK", COMPUTERS.replace("}}", "}, spare: {}}") + links).replace("DELAYS", "")
    text = text.replace("WORLD", "at: world,").replace("TARGET", "at: target,")
    text = text.replace("FORCE", "push.y").replace("PLACE", "place.y").replace("SPEED", "speed.y")
    (tmp_path / "loop.yaml").write_text(text)
    diagram = load(tmp_path / "loop.yaml")
    assert {doubt.problem for doubt in diagram.warnings} > {
        "no block runs on the computer 'spare'",
        "link 'spare' carries nothing",
    }


def test_a_computer_may_have_limits_of_its_own() -> None:
    text = "overload: {max: 7}\n" + LOOP.replace(
        "NETWORK", "computers: {world: {overload: {max: 2}}, target: {}}"
    )
    text = text.replace("DELAYS", "").replace("WORLD", "at: world,").replace("TARGET", "at: target,")
    diagram = load_text(
        text.replace("FORCE", "push.y").replace("PLACE", "place.y").replace("SPEED", "speed.y")
    )
    assert (diagram.overload_of("world").max, diagram.overload_of("target").max) == (2, 7)


def test_a_base_gives_its_computers_and_links_and_a_variant_its_places(tmp_path: Path) -> None:
    base = (
        ONE_LINK.replace("read: {", "read: {slot: true, ")
        + """
variants:
  other: {slots: {read: {block: signal.saturation, with: {lower: -1, upper: 1}}}}
"""
    )
    (tmp_path / "base.yaml").write_text(base)
    (tmp_path / "over.yaml").write_text(
        "quadvis: 1\nname: over\nbase: base.yaml\nwithout: {links: [line]}\n"
        "links: {air: {from: near, to: far, via: udp}}\ncomputers: {far: {priority: 7}}\n"
    )
    other = load(tmp_path / "base.yaml", variant="other")
    assert other.graph["read"].kind == "signal.saturation" and other.graph["read"].computer == "far"
    over = load(tmp_path / "over.yaml")
    assert [link.name for link in over.links] == ["air"] and over.links[0].via == "udp"
    assert yaml.safe_load(over.resolved)["computers"] == {"near": {}, "far": {"priority": 7}}


@pytest.mark.parametrize("first", ["world", "target"])
def test_two_computers_with_live_links_fly_the_simulated_loop(first: str) -> None:
    """Whoever is the first at an instant: a message counts from the next instant on."""
    diagram = linked()
    wanted = diagram.run()
    words = {link.name: bytearray(8 * link.words) for link in diagram.links}
    rows: dict[str, list[float]] = {"place": [], "push": []}
    with ExitStack() as stack:
        engines = []
        for computer, block in (("world", "place"), ("target", "push")):
            part = diagram.graph.part_of(computer)
            engine = stack.enter_context(Engine(live(part, open_carriers(part, words)), diagram.seed))
            task = engine.graph[block].task.name
            engine.observe(
                task, lambda _, engine=engine, block=block: rows[block].append(engine.read(block, "y"))
            )
            engines.append(engine)
        if first == "target":
            engines.reverse()
        while engines[0].time <= 2.0:
            now = min(engine.tick * engine.period for engine in engines)
            for engine in engines:
                if engine.tick * engine.period == now:
                    engine.run(1)
    for block, found in rows.items():
        np.testing.assert_array_equal(found, wanted[f"{block}.y"][: len(found)])
        assert len(found) >= 40


def test_check_prints_the_load_of_each_link_and_the_worst_ages(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    ramp = "sources.ramp, with: {slope: 1 s/s}, rate: slow"
    text = ONE_LINK.replace("sources.sine, rate: slow", ramp)
    (tmp_path / "one.yaml").write_text(text + "expect: [{age: [wave.y, read], below: 250 ms}]\n")
    assert main(["check", str(tmp_path / "one.yaml")]) == 0
    assert capsys.readouterr().out.splitlines()[1:] == [
        "  link line: 25 bytes a frame, 10 a second: 26 % of 9600 baud",
        "  age of wave.y at read: at most 100 ms from the tick at which the stamp is given (limit 250 ms)",
    ]
    assert main(["check", "--json", str(tmp_path / "one.yaml")]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert facts["blocks"] == 2 and facts["ages"] == {"age of wave.y at read": pytest.approx(0.1)}
    assert facts["links"] == {"line": "25 bytes a frame, 10 a second: 26 % of 9600 baud"}
