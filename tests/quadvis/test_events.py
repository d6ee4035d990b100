"""Events between two ticks: located on the solver's own step, against closed forms."""

from __future__ import annotations

import math
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from quadvis.api import load, load_text
from quadvis.block import Block, In, Out, Param, State
from quadvis.engine.engine import Engine
from quadvis.engine.events import LOCATED
from quadvis.errors import RunError
from quadvis.graph.graph import Constant, Graph, Node, Task, Wire
from tests.quadvis.restored import check_repeats

# A lag behind a relay with hysteresis: x runs up to the threshold and down to the other one, for ever.
RELAY = """\
quadvis: 1
name: relay
solver: {method: ode4, step: 10 ms}
stop_time: 6 s
blocks:
  relay:
    block: signal.relay
    rate: continuous
    with: {on_at: BAND, off_at: -BAND, on_value: -1, off_value: 1}
    in: {u: x.y}
  slope:
    block: math.expression
    rate: continuous
    with: {y: "(u - x) / tau", tau: 0.4 s}
    in: {u: relay.y, x: x.y}
  x: {block: signal.integrator, in: {u: slope.y}}
"""
STEP = Fraction(1, 100)


class Turning(Block):
    """Runs at a speed that turns round at an instant, and notes what it knew then."""

    at = Param(0.0333, unit="s")
    x = Out("float64")
    place = State("float64", continuous=True)
    back = State("bool")
    seen = State("float64")

    def output(self) -> Any:
        return self.place

    def deriv(self) -> Any:
        return -1.0 if self.back else 1.0

    def crossing(self, time: Any) -> Any:
        return 1.0 if self.back else self.at - time

    def event(self, time: Any) -> None:
        self.back = True
        self.seen = time


class Failing(Turning):
    """Fails at its event."""

    def event(self, time: Any) -> None:
        raise ValueError("no way")


class Follower(Block):
    """Has an event at once when its input jumps."""

    u = In("float64")
    y = Out("float64")
    count = State("int64")

    def output(self) -> Any:
        return float(self.count)

    def update(self, u: Any) -> None:
        pass

    def crossing(self, u: Any) -> Any:
        return 0.5 - u if self.count == 0 else 1.0

    def event(self, u: Any) -> None:
        self.count = self.count + 1


class Switched(Turning):
    """The same, with an output that jumps."""

    x = Out("float64")

    def output(self) -> Any:
        return 1.0 if self.back else 0.0


def engine(*blocks: tuple[str, Block, dict[str, Any]]) -> Engine:
    task = Task("continuous", STEP, continuous=True)
    nodes = [Node(path, "test", block, task, inputs, {}) for path, block, inputs in blocks]
    return Engine(Graph("test", nodes, "ode4", STEP))


def period(band: float) -> float:
    """Return the period of the limit cycle: twice tau ln((1 + band) / (1 - band))."""
    return 2 * 0.4 * math.log((1 + band) / (1 - band))


@pytest.mark.parametrize("band", [0.5, 0.1, 0.0123])
def test_the_limit_cycle_of_a_relay_has_the_period_of_the_closed_form(band: float) -> None:
    result = load_text(RELAY.replace("BAND", str(band))).run(engine="python")
    half = period(band) / 2
    first = -0.4 * math.log(1 - band)  # from 0 to the threshold

    def truth(time: float) -> float:
        if time < first:
            return 1 - math.exp(-time / 0.4)
        turns, since = divmod(time - first, half)
        sign = 1 if turns % 2 == 0 else -1
        return sign * ((1 + band) * math.exp(-since / 0.4) - 1)

    expected = [truth(time) for time in result.times("x.y")]
    assert result["x.y"] == pytest.approx(np.array(expected), abs=1e-7)
    assert np.abs(result["x.y"]).max() <= band * (1 + 1e-9)


def test_a_relay_follows_the_closed_form_in_both_engines_to_the_bit() -> None:
    diagram = load_text(RELAY.replace("BAND", "0.1"))
    assert diagram.run(engine="native")["x.y"].tobytes() == diagram.run(engine="python")["x.y"].tobytes()


def test_an_event_is_located_to_a_part_of_a_step() -> None:
    made = engine(("x", Turning(at=0.0333), {}))
    with made:
        made.run(10)
        seen = made.read("x", "seen")
        assert 0.0333 <= seen <= 0.0333 + LOCATED * float(STEP)
        assert LOCATED <= 1e-9
        assert made.read("x", "place") == pytest.approx(0.0333 - (0.1 - 0.0333), abs=1e-11)


def test_an_event_that_another_one_causes_comes_at_once() -> None:
    made = engine(("a", Switched(at=0.0333), {}), ("b", Follower(), {"u": Wire("a", "x")}))
    with made:
        made.run(3)
        assert made.read("b", "count") == 0
        made.run(1)
        assert made.read("b", "count") == 1
        made.run(5)
        assert made.read("b", "count") == 1


def test_a_restored_run_has_the_same_events() -> None:
    check_repeats(Engine(load_text(RELAY.replace("BAND", "0.05")).graph), 7, 100)


def test_an_event_that_fails_is_reported_with_its_block() -> None:
    made = engine(("x", Failing(), {}))
    with pytest.raises(RunError, match=r"block 'x', t = 0.03 s: ValueError: no way"), made:
        made.run(10)


def test_chatter_ends_the_run_and_names_the_block() -> None:
    words = (
        r"block 'relay', t = 0 s: more than 100 events within one step of 0.01 s; it chatters; give it a "
        r"hysteresis or a state of rest, or make the step smaller"
    )
    with pytest.raises(RunError, match=words):
        load_text(RELAY.replace("BAND", "1e-5")).run()


def test_check_accuracy_sees_that_nothing_is_lost_between_ticks() -> None:
    found = load_text(RELAY.replace("BAND", "0.1")).accuracy()
    x = next(each for each in found.signals if each.name == "x.y")
    assert x.share < 1e-6
    assert x.order == pytest.approx(4.0, abs=0.3)


def test_a_class_must_have_both_methods() -> None:
    with pytest.raises(TypeError, match="Half: the methods crossing and event go together"):
        type("Half", (Block,), {"crossing": lambda self: 1.0})


def test_a_method_asks_for_inputs_that_exist() -> None:
    def crossing(self: Any, speed: Any) -> Any:
        return speed

    with pytest.raises(TypeError, match=r"crossing asks for 'speed', which is not one of its inputs"):
        type("Wrong", (Block,), {"crossing": crossing, "event": lambda self: None})


def test_blocks_at_a_sampled_rate_have_no_events_between_ticks(tmp_path: Path) -> None:
    text = RELAY.replace("BAND", "0.1").replace("solver:", "rates: {c: 50 Hz}\nsolver:")
    text = text.replace("rate: continuous\n    with: {on_at", "rate: c\n    with: {on_at")
    text = text.replace("in: {u: x.y}\n  slope", "in: {u: {from: x.y, across: sample}}\n  slope")
    text = text.replace("in: {u: relay.y, x", "in: {u: {from: relay.y, across: hold}, x")
    diagram = load_text(text)
    assert not Engine(diagram.graph).program.crossings
    assert np.abs(diagram.run()["x.y"]).max() > 0.1


def test_constants_feed_blocks_with_events() -> None:
    made = engine(("b", Follower(), {"u": Constant(0.0)}), ("x", Turning(), {}))
    with made:
        made.run(10)
        assert made.read("b", "count") == 0


def test_a_part_that_pauses_has_no_events_meanwhile_and_goes_on_as_it_was(tmp_path: Path) -> None:
    plain = RELAY.replace("BAND", "0.5")
    part = plain.replace("solver: {method: ode4, step: 10 ms}\nstop_time: 6 s\n", "ports: {out: {x: x.y}}\n")
    (tmp_path / "relay.yaml").write_text(part)
    (tmp_path / "pausing.yaml").write_text(
        """\
quadvis: 1
name: pausing
rates: {c: 100 Hz}
solver: {method: ode4, step: 10 ms}
stop_time: 3 s
blocks:
  pulse: {block: sources.pulse, rate: c, with: {interval: 2 s, width: 1 s}}
  runs: {block: logic.compare, rate: c, with: {operator: ">"}, in: {a: pulse.y, b: 0.5}}
  inside: {part: relay.yaml, when: {from: runs.y, across: hold}}
"""
    )
    steady = load_text(plain).run(keep=("*",), engine="python")["x.y"]
    paused = load(tmp_path / "pausing.yaml").run(keep=("*",), engine="python")["inside/x.y"]
    assert paused[:100] == pytest.approx(steady[:100], abs=1e-12)
    assert paused[100:200] == pytest.approx(np.full(100, steady[99]), abs=1e-12)  # as it was when it last ran
    assert paused[200:300] == pytest.approx(steady[100:200], abs=1e-9) and np.ptp(steady[100:200]) > 0.9
