"""The life of a run around its ticks: phases, safe values, clocks, taps, tuning, memory."""

from __future__ import annotations

import mmap
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from quadvis.block import Block, In, Out, Param, ParameterError, Safe, State, Work
from quadvis.engine.engine import Engine
from quadvis.engine.taps import Tap
from quadvis.engine.tuning import NewValue
from quadvis.errors import RunError
from quadvis.graph.graph import Constant, Graph, Node, Task, Wire
from quadvis.native.choice import NATIVE, choose, use
from quadvis.testing.alone import alone

FAST, SLOW = Task("fast", Fraction(1, 10)), Task("slow", Fraction(1, 5))
EVENTS: list[Any] = []


class Sensor(Block, numeric=False):
    y = Out()
    level = Work()

    def read(self, time):
        EVENTS.append("read")
        self.level = time

    def output(self):
        EVENTS.append("output")
        return self.level

    def update(self):
        EVENTS.append("update")


class Motor(Block, numeric=False):
    u = In()
    speed = Safe("u")
    bad = Param(False, type="bool")
    refuses = Param(False, type="bool")

    def open(self):
        EVENTS.append("open")
        if self.refuses:
            raise OSError("no such device")

    def write(self, u):
        EVENTS.append(("write", float(u)))
        if self.bad and u > 0.0:
            raise RuntimeError("the cable broke")

    def close(self):
        EVENTS.append("close")


class Triple(Block):
    y = Out("float64[n]")
    values = Param([1, 2, 3], type="float64[n]", tune=True)

    def output(self):
        return self.values


class Gain(Block):
    u = In(default=1.0)
    y = Out()
    factor = Param(2.0, above=0.0, below=10.0, unit="m", tune=True)
    limit = Param(5.0, tune=True)
    fixed = Param(1.0)
    last = State()

    def check(self):
        if self.limit < self.factor:
            raise ParameterError("limit", "limit must be at least factor")

    def output(self, u):
        return self.factor * u

    def update(self, u):
        self.last = u


class Fails(Gain):
    def output(self, u):
        return np.nan


def engine(*nodes: Node, **more: Any) -> Engine:
    EVENTS.clear()
    return Engine(Graph("test", list(nodes)), **more)


def node(path: str, block: Block, task: Task = FAST, **inputs: str) -> Node:
    made: dict[str, Any] = {name: Constant(port.default) for name, port in block.interface.inputs.items()}
    for name, source in inputs.items():
        made[name] = Wire(*source.split("."))
    return Node(path, "test", block, task, made)


def loop(**parameters: Any) -> Engine:
    motor = Motor(speed=-7.0, **parameters)
    return engine(node("sensor", Sensor()), node("motor", motor, u="sensor.y"))


def test_a_tick_reads_then_computes_then_writes_then_updates() -> None:
    with loop() as made:
        EVENTS.clear()
        made.run(2)
        assert [
            *("read", "output"),
            ("write", 0.0),
            "update",
            *("read", "output"),
            ("write", 0.1),
            "update",
        ] == EVENTS


def test_taps_see_the_outputs_after_they_were_written() -> None:
    made = loop()
    made.observe("fast", lambda tick: EVENTS.append(f"tap {tick}"))
    with made:
        EVENTS.clear()
        made.run(1)
    assert EVENTS[:5] == ["read", "output", ("write", 0.0), "tap 0", "update"]


@pytest.mark.parametrize("native", [False, True])
def test_once_the_safe_values_are_to_be_held_no_block_writes_and_all_else_goes_on(native: bool) -> None:
    made = loop()
    if native:
        use(made, choose(made, 0, NATIVE))
    with made:
        made.run(1)
        EVENTS.clear()
        made.hold_safe()
        made.run(2)
        assert [("write", -7.0), *("read", "output", "update") * 2] == EVENTS
        made.observe("fast", lambda tick: EVENTS.append(tick))  # a new list of calls
        made.run(1)
        assert EVENTS[-4:] == ["read", "output", 3, "update"]


def test_the_safe_values_are_written_before_anything_is_closed() -> None:
    made = engine(
        node("a", Motor(speed=-7.0), u="s.y"), node("s", Sensor()), node("b", Motor(speed=3.0), u="s.y")
    )
    with made:
        made.run(1)
        EVENTS.clear()
    assert EVENTS == [("write", 3.0), ("write", -7.0), "close", "close"]


@pytest.mark.parametrize("ending", [KeyboardInterrupt, SystemExit, RuntimeError])
def test_the_safe_values_are_written_however_a_run_ends(ending: type[BaseException]) -> None:
    with pytest.raises(ending), loop() as made:
        made.run(1)
        EVENTS.clear()
        raise ending
    assert EVENTS == [("write", -7.0), "close"]


def test_no_number_that_is_not_finite_is_ever_written() -> None:
    made = engine(node("bad", Fails()), node("motor", Motor(speed=-7.0), u="bad.y"))
    with pytest.raises(RunError, match="became nan"), made:
        made.run(1)
    assert [event for event in EVENTS if isinstance(event, tuple)] == [("write", -7.0)]


def test_a_write_that_fails_stops_the_run_and_the_safe_value_still_goes_out() -> None:
    made = loop(bad=True)
    with pytest.raises(RunError, match=r"block 'motor', t = 0.1 s: RuntimeError: the cable broke"), made:
        made.run(5)
    assert EVENTS[-2:] == [("write", -7.0), "close"]


def test_what_was_never_opened_is_not_written_to() -> None:
    made = engine(
        node("s", Sensor()),
        node("a", Motor(speed=1.0), u="s.y"),
        node("b", Motor(speed=2.0, refuses=True), u="s.y"),
        node("c", Motor(speed=3.0), u="s.y"),
    )
    with pytest.raises(RunError, match="cannot open"), made:
        raise AssertionError("it opened")
    assert EVENTS == ["open", "open", ("write", 1.0), "close", "close"]


class Stepped:
    """A clock that leaves some ticks out, lets two at a time go, and remembers what it was asked."""

    def __init__(self, left_out: int = 0) -> None:
        self.left_out = left_out
        self.asked: list[tuple[int, int]] = []

    def wait(self, tick: int, end: int) -> range:
        self.asked.append((tick, end))
        first = min(tick + self.left_out, end)
        return range(first, min(first + 2, end))


def test_the_loop_asks_its_clock_before_ticks_and_runs_no_further_than_it_allows() -> None:
    clock = Stepped()
    made = engine(node("gain", Gain()), clock=clock)
    with made:
        made.run(5)
    assert clock.asked == [(0, 5), (2, 5), (4, 5)] and made.tick == 5


def test_ticks_that_the_clock_leaves_out_do_not_run() -> None:
    clock = Stepped(left_out=3)
    made = engine(node("gain", Gain()), clock=clock)
    ticks: list[int] = []
    made.observe(made.graph.tasks[0].name, ticks.append)
    with made:
        made.run(12)
    assert (ticks, made.tick) == ([3, 4, 8, 9], 12)
    assert clock.asked == [(0, 12), (5, 12), (10, 12)]


class Keeps(Tap):
    """A tap that keeps copies of rows."""

    def __init__(self, block: str, every: int = 1) -> None:
        self.block, self.every = block, every
        self.rows: list[tuple[int, list[float]]] = []

    def take(self, tick: int, row: memoryview) -> None:
        self.rows.append((tick, np.frombuffer(bytes(row)).tolist()))


def test_a_tap_takes_rows_at_its_blocks_ticks() -> None:
    made = engine(node("sensor", Sensor()), node("slow", Gain(), SLOW, u="sensor.y"))
    taps = [Keeps("sensor"), Keeps("slow"), Keeps("sensor", 3)]
    for tap in taps:
        made.attach(tap)
    with made:
        made.run(5)
    assert [tick for tick, _ in taps[0].rows] == [0, 1, 2, 3, 4]
    assert taps[1].rows == [(0, [0.0]), (2, [0.4]), (4, [0.8])]
    assert [tick for tick, _ in taps[2].rows] == [0, 3]


def test_a_tuned_parameter_counts_from_the_next_tick_and_is_kept_with_its_tick() -> None:
    made = engine(node("gain", Gain()))
    with made:
        made.run(1)
        made.tuning.set("gain", "factor", 3.0)
        assert made.read("gain", "factor") == 2.0
        made.run(1)
        assert made.read("gain", "y") == 3.0
        (change,) = made.tuning.changes
    assert (change.tick, change.path, change.name, change.value) == (1, "gain", "factor", 3.0)


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("factor", -1.0, "factor must be above 0 m"),
        ("factor", "x", "factor must be a number"),
        ("factor", 6.0, "limit must be at least factor"),
        ("fixed", 2.0, "'gain.fixed' cannot be tuned; block 'gain' can be tuned in factor, limit"),
        ("facto", 2.0, "did you mean 'gain.factor'"),
    ],
)
def test_a_value_that_cannot_be_is_refused_and_changes_nothing(name: str, value: Any, words: str) -> None:
    made = engine(node("gain", Gain()))
    with made:
        with pytest.raises(ParameterError, match=words):
            made.tuning.set("gain", name, value)
        made.run(1)
        assert made.read("gain", "y") == 2.0 and made.tuning.changes == []


def test_values_set_together_are_checked_together_and_count_at_one_tick() -> None:
    made = engine(node("gain", Gain()))
    with made:
        made.tuning.set("gain", "limit", 8.0)
        made.tuning.set("gain", "factor", 6.0)
        made.run(1)
    assert [change.tick for change in made.tuning.changes] == [0, 0]


def test_a_group_is_checked_as_a_whole_whatever_its_order() -> None:
    made = engine(node("gain", Gain()))
    with made:
        made.tuning.set_all([NewValue("gain", "factor", 6.0), NewValue("gain", "limit", 8.0)])
        made.run(1)
        assert made.read("gain", "factor") == 6.0
        with pytest.raises(ParameterError, match="limit must be at least factor"):
            made.tuning.set_all([NewValue("gain", "limit", 9.0), NewValue("gain", "factor", 9.5)])
        made.run(1)
        assert (made.read("gain", "factor"), made.read("gain", "limit")) == (6.0, 8.0)


def test_an_array_keeps_its_size() -> None:
    made = alone(Triple(), {}, {"n": 3}, Fraction(1, 10))
    with made:
        (tunable,) = made.program.tunables
        with pytest.raises(ParameterError, match="values has 3 values in this run, got 4 values"):
            made.tuning.set(tunable.path, "values", [1, 2, 3, 4])
        made.tuning.set(tunable.path, "values", [4, 5, 6])
        made.run(1)
        assert made.read(tunable.path, "y").tolist() == [4, 5, 6]


def test_memory_can_live_in_a_buffer_that_others_see() -> None:
    shared = mmap.mmap(-1, 4096)
    made = engine(node("gain", Gain()), buffer=shared)
    slot = made.slot("gain", "y")
    with made:
        made.run(1)
        assert np.frombuffer(shared, np.float64)[slot.position] == 2.0
        np.frombuffer(shared, np.float64)[made.slot("gain", "factor").position] = 4.0
        made.run(1)
        assert made.read("gain", "y") == 4.0


def test_a_run_in_a_shared_buffer_is_the_same_to_the_bit() -> None:
    runs = []
    for buffer in (None, mmap.mmap(-1, 4096)):
        made = engine(node("sensor", Sensor()), node("gain", Gain(), u="sensor.y"), buffer=buffer)
        with made:
            made.run(20)
            runs.append(made.snapshot())
    assert runs[0].memory == runs[1].memory
