"""Events between two ticks as machine code: the same bits and the same faults as interpreted."""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Callable
from fractions import Fraction
from itertools import product
from typing import Any

import numpy as np
import pytest

from quadvis.api import load_text
from quadvis.block import Block, In, Out, Param, State
from quadvis.engine.engine import Engine
from quadvis.engine.interpreter import Interpreter
from quadvis.engine.solver import TABLEAUS
from quadvis.graph.graph import Graph, Node, Task, Wire
from quadvis.native.choice import NATIVE, choose
from tests.quadvis.test_native import assert_the_same_bits, natively, outcome
from tests.stages import mostly_slow

STEP = Fraction(1, 20)
CONTINUOUS = Task("continuous", STEP, continuous=True)


class Turning(Block):
    """Runs at a speed that turns round at an instant; then, if it is ``risky``, something fails."""

    at = Param(0.0333, unit="s")
    risky = Param("", choices=("", "event", "later", "chatter", "infinite"))
    x = Out("float64")
    place = State("float64", continuous=True)
    back = State("bool")
    seen = State("float64")

    def output(self) -> Any:
        return self.place

    def deriv(self, time: Any) -> Any:
        if self.risky == 2 and self.back:
            return -1.0 / max(0.0, 0.04 - time)
        return -1.0 if self.back else 1.0

    def crossing(self, time: Any) -> Any:
        return 1.0 if self.back and self.risky != 3 else self.at - time

    def event(self, time: Any) -> None:
        self.back = True
        self.seen = time
        if self.risky == 1:
            self.seen = 1.0 / max(0.0, 0.01 - time)
        if self.risky == 3:
            self.at = time + 1e-9
        if self.risky == 4:
            self.place = 1e300 * 1e300 * time


class Following(Block):
    """Has an event at once when another block has one, which its input shows."""

    u = In("float64")
    y = Out("float64")
    count = State("int64")

    def output(self) -> Any:
        return float(self.count)

    def crossing(self, u: Any) -> Any:
        return np.array((u - 0.02, 1.0)) if self.count == 0 else np.ones(2)

    def event(self, u: Any) -> None:
        self.count = self.count + 1


class Calling(Turning):
    """Its event calls another of its methods, which only Python can."""

    def turn(self) -> None:
        self.back = True

    def event(self, time: Any) -> None:
        self.turn()


def node(path: str, block: Block, **inputs: str) -> Node:
    wires = {name: Wire(*each.split(".")) for name, each in inputs.items()}
    return Node(path, "test", block, CONTINUOUS, wires, {})


def graph(*nodes: Node) -> Graph:
    return Graph("test", list(nodes), "ode4", STEP)


@pytest.fixture
def interpreted(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Return the ticks at which the interpreter integrates from now on."""
    ticks: list[int] = []
    integrate = Interpreter.integrate

    def noted(self: Interpreter) -> Any:
        ticks.append(self.tick)
        return integrate(self)

    monkeypatch.setattr(Interpreter, "integrate", noted)
    return ticks


BALL = """\
  ball:
    block: signal.second_order_integrator
    with: {{initial: {:.3f}, lower: 0, restitution: {:.3f}}}
    in: {{u: -9.81}}
"""
BALLS = """\
  balls:
    block: signal.second_order_integrator
    with:
      {{initial: [0.2, {:.3f}], initial_rate: [3, {:.3f}], lower: [-1, -0.7], upper: 1, restitution: {:.3f}}}
    in: {{u: push.y}}
  push: {{block: sources.constant, rate: continuous, with: {{value: [-0.5, 2]}}}}
"""
RELAY = """\
  relay:
    block: signal.relay
    rate: continuous
    with: {{on_at: {0:.3f}, off_at: -{0:.3f}, on_value: -{1:.3f} 1/s, off_value: 1 1/s}}
    in: {{u: y.y}}
  y: {{block: signal.integrator, in: {{u: relay.y}}}}
"""
MASS = """\
  mass:
    block: plant.sliding_mass
    with: {{coulomb: {:.3f}, breakaway: {:.3f}, surface: {}, initial: {:.3f}, initial_speed: 0.1}}
    in: {{force: spring.y}}
  spring: {{block: signal.gain, rate: continuous, with: {{factor: -30}}, in: {{u: mass.x}}}}
"""


def ball(chance: random.Random) -> str:
    return BALL.format(chance.uniform(0.1, 1.0), chance.choice([0.0, 1.0, chance.random()]))


def balls(chance: random.Random) -> str:
    return BALLS.format(chance.uniform(-0.5, 0.5), chance.uniform(-9.0, 9.0), chance.choice([0.0, 0.9, 1.0]))


def relay(chance: random.Random) -> str:
    return RELAY.format(chance.uniform(0.02, 0.5), chance.uniform(0.2, 2.0))


def mass(chance: random.Random) -> str:
    drag = chance.choice([0.0, chance.uniform(0.0, 3.0)])
    return MASS.format(
        drag, drag * chance.choice([1.0, 1.5]), chance.choice([0.0, 0.1]), chance.uniform(-1.0, 1.0)
    )


def several(chance: random.Random) -> str:
    return ball(chance) + relay(chance) + mass(chance)


SYSTEMS = (ball, relay, mass, several, balls)  # what has arrays takes long to compile


def drawn(system: Callable[[random.Random], str], seed: int) -> Graph:
    """Return a system with events, whose numbers and method are drawn."""
    chance = random.Random(seed)
    solver = f"solver: {{method: {chance.choice(sorted(TABLEAUS))}, step: 50 ms}}\nstop_time: 1 s\n"
    return load_text(f"quadvis: 1\nname: drawn\n{solver}blocks:\n{system(chance)}").graph


@pytest.mark.parametrize(("system", "seed"), mostly_slow(product(SYSTEMS, range(20)), quick=0))
def test_any_system_with_events_gives_the_same_bits_whichever_engine_runs_it(
    system: Callable[[random.Random], str], seed: int
) -> None:
    assert_the_same_bits(drawn(system, seed), 40, random.Random(seed))


@pytest.mark.parametrize("system", mostly_slow(SYSTEMS, quick=4))
def test_no_step_is_left_to_the_interpreter(
    system: Callable[[random.Random], str], interpreted: list[int]
) -> None:
    """And the bits are the same; with other numbers, and with changes on the way, in the test above."""
    wanted = Engine(drawn(system, 1))
    with wanted:
        wanted.run(15)
    assert interpreted == list(range(15))
    engine = Engine(drawn(system, 1))
    assert str(choose(engine, 0, NATIVE)) == "native"
    with natively(engine):
        engine.run(15)
    assert engine.memory.content() == wanted.memory.content()
    assert len(interpreted) == 15


def test_an_event_that_another_one_causes_comes_at_once(interpreted: list[int]) -> None:
    made = graph(node("x", Turning()), node("f", Following(), u="x.x"))
    engine = natively(Engine(made))
    with engine:
        engine.run(1)
        assert engine.read("x", "seen") == pytest.approx(0.0333, abs=1e-9)
        assert engine.read("f", "count") == 1
    assert not interpreted
    assert_the_same_bits(made, 20, random.Random(5))


@pytest.mark.parametrize("risk", ["event", "later", "chatter", "infinite"])
def test_what_fails_in_a_step_with_events_is_the_same_and_leaves_the_same_memory(
    risk: str, interpreted: list[int]
) -> None:
    def made() -> Engine:
        return Engine(graph(node("x", Turning(at=0.0833, risky=risk))))

    wanted = outcome(made(), 5)
    interpreted.clear()
    assert outcome(natively(made()), 5) == wanted
    assert wanted[0] and wanted[2] == 1
    assert interpreted == [1]  # it does again what has failed, and nothing else


def test_an_event_that_only_python_can_run_is_interpreted_and_the_choice_says_why() -> None:
    made = graph(node("x", Calling()))
    words = (
        "native, but interpreted: Calling (method 'event': it calls self.turn, which only Python can; call a "
        "plain function that takes self)"
    )
    assert str(choose(Engine(made), 0, NATIVE)) == words
    assert_the_same_bits(made, 10, random.Random(5))


def test_measured_calls_are_counted_as_interpreted() -> None:
    counts = []
    for native in (False, True):
        engine = Engine(drawn(relay, 3))
        engine.measure()
        with natively(engine) if native else engine:
            engine.run(20)
        found: Counter[tuple[str, str]] = Counter()
        for each in engine.profile().methods:  # a method may have several rows
            found[each.block, each.method] += each.calls
        counts.append(found)
    assert counts[0] == counts[1]
    assert counts[0]["relay", "event"] >= 1
