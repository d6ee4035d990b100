"""What a run does: crossings, delays, integration, determinism, snapshots, and how it ends on a failure."""

import math
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.block import Block, Frame, In, Out, Param, ParameterError, Random, State, uniform
from quadvis.engine.engine import Engine
from quadvis.errors import QuadvisError, RunError
from quadvis.graph.graph import Constant, Graph, Node, Task, Wire
from quadvis.graph.order import execution_order

STEP = Fraction(1, 100)
CONTINUOUS = Task("continuous", STEP, continuous=True)


class Clock(Block):
    """The time of its last tick."""

    y = Out()

    def output(self, time):
        return time


class Pass(Block):
    """The input, in the same tick."""

    u = In("float64[*]")
    y = Out("float64[*]")

    def output(self, u):
        return u


class Delay(Block):
    """The input of one sample ago."""

    u = In()
    y = Out()
    last = State(init=-1.0)

    def output(self):
        return self.last

    def update(self, u):
        self.last = u


class Integral(Block):
    """The integral of its input from zero."""

    u = In(default=1.0)
    y = Out()
    x = State(continuous=True)

    def output(self):
        return self.x

    def deriv(self, u):
        return u


class Noise(Block):
    """A fresh number at each tick."""

    y = Out()
    drawn = State()
    stream = Random()

    def start(self):
        self.drawn = uniform(self.stream)

    def output(self):
        return self.drawn

    def update(self):
        self.drawn = uniform(self.stream)


class Camera(Block, numeric=False):
    """A small picture at each tick."""

    frame = Out("frame")
    count = State("int64")

    def output(self, time):
        return Frame(np.full((2, 2, 3), self.count % 256, np.uint8), time, self.count + 1)

    def update(self):
        self.count += 1


class Look(Block, numeric=False):
    """The number of a picture."""

    frame = In("frame")
    y = Out("int64")

    def output(self, frame):
        return frame.sequence


def hz(rate: int, offset: Fraction | int = 0) -> Task:
    return Task(f"{rate} Hz + {offset}", Fraction(1, rate), Fraction(offset))


def node(path: str, block: Block, task: Task = CONTINUOUS, **inputs: object) -> Node:
    """Return a node; an input is a number, "block.port", or that with a crossing: "block.port delay"."""
    made: dict = {name: Constant(port.default) for name, port in block.interface.inputs.items()}
    for name, source in inputs.items():
        if isinstance(source, str):
            reference, _, crossing = source.partition(" ")
            made[name] = Wire(*reference.split("."), (), crossing or None)
        else:
            made[name] = source if isinstance(source, Wire) else Constant(source)
    return Node(path, "test", block, task, made, {"*": ()} if isinstance(block, Pass) else {})


def engine(*nodes: Node, solver: str = "ode4", seed: int = 0) -> Engine:
    order, loops = execution_order(nodes)
    assert not loops
    step = STEP if any(made.task.continuous for made in nodes) else None
    return Engine(Graph("test", order, solver, step), seed)


def record(made: Engine, path: str, port: str = "y") -> list[tuple[float, object]]:
    """Return a list that will hold (time, value) for each tick of the block."""
    rows: list[tuple[float, object]] = []
    task = made.graph[path].task.name
    made.observe(task, lambda tick: rows.append((float(tick * made.period), made.read(path, port))))
    return rows


def run(made: Engine, ticks: int) -> None:
    with made:
        made.run(ticks)


# Order and delays


@pytest.mark.parametrize("count", [1, 7, 30])
def test_a_chain_of_unit_delays_delays_by_exactly_as_many_samples(count: int) -> None:
    task = hz(10)
    chain = [node("d0", Delay(), task, u="clock.y")]
    chain += [node(f"d{k}", Delay(), task, u=f"d{k - 1}.y") for k in range(1, count)]
    made = engine(*chain[::-1], node("clock", Clock(), task))
    rows = record(made, f"d{count - 1}")
    run(made, count + 40)
    assert [value for _, value in rows[:count]] == [-1.0] * count
    assert [value for _, value in rows[count:]] == [k / 10 for k in range(40)]


@pytest.mark.parametrize("count", [2, 5])
def test_a_ring_of_unit_delays_turns_one_place_a_sample(count: int) -> None:
    ring = [node(f"d{k}", Delay(), hz(10), u=f"d{(k - 1) % count}.y") for k in range(count)]
    made = engine(*ring)
    rows = record(made, "d0")
    with made:
        for k in range(count):
            made.write(f"d{k}", "last", float(k))
        made.run(3 * count)
    assert [value for _, value in rows] == [(-k) % count for k in range(3 * count)]


def last_tick(task: Task, time: Fraction) -> int:
    """Return the number of a task's last tick at or before a time; negative before its first."""
    return math.floor((time - task.offset) / task.period)


RATES = [
    (10, 0),
    (20, 0),
    (20, Fraction(1, 40)),
    (5, 0),
    (5, Fraction(1, 10)),
    (10, Fraction(3, 100)),
    (7, 0),
]


@pytest.mark.parametrize("consumer", RATES, ids=str)
@pytest.mark.parametrize("producer", RATES, ids=str)
@pytest.mark.parametrize("crossing", ["sample", "hold", "newest", "delay"])
def test_what_crosses_is_the_producers_last_value_or_the_one_a_producer_period_before(
    crossing: str, producer: tuple, consumer: tuple
) -> None:
    source, target = hz(*producer), hz(*consumer)
    made = engine(node("in", Pass(), target, u=f"clock.y {crossing}"), node("clock", Clock(), source))
    rows = record(made, "in")
    run(made, int(Fraction(2) / made.period))
    back = 1 if crossing == "delay" else 0
    assert len(rows) == sum(1 for k in range(100) if target.offset + k * target.period < 2)
    for time, value in rows:
        count = last_tick(source, Fraction(time).limit_denominator(10**6)) - back
        expected = float(source.offset + count * source.period) if count >= 0 else 0.0
        assert value == expected, time


@pytest.mark.parametrize("order", [("in", "x"), ("x", "in")])
@pytest.mark.parametrize("solver", ["ode1", "ode2", "ode3", "ode4"])
def test_a_delay_behind_a_continuous_block_gives_its_value_of_one_solver_step_before(
    solver: str, order: tuple
) -> None:
    nodes = {"in": node("in", Pass(), hz(50), u="x.y delay"), "x": node("x", Integral())}
    # The derivative of another integral needs x at minor steps too, which write over its output.
    made = engine(*(nodes[path] for path in order), node("xx", Integral(), u="x.y"), solver=solver)
    rows = record(made, "in")
    run(made, 40)
    assert [value for _, value in rows] == pytest.approx(
        [max(0.0, time - 0.01) for time, _ in rows], abs=1e-14
    )


def test_a_delay_in_a_loop_is_one_sample() -> None:
    made = engine(node("a", Pass(), hz(10), u="b.y delay"), node("b", Pass(), hz(10), u="a.y"))
    with made:
        made.run(1)
        made.write("b", "y", 5.0)
        made.run(1)
        assert made.read("a", "y") == 5.0


def test_frames_cross_by_reference_at_every_crossing() -> None:
    made = engine(
        node("camera", Camera(), hz(10)),
        node("now", Look(), hz(20), frame="camera.frame hold"),
        node("late", Look(), hz(20), frame="camera.frame delay"),
        node("slow", Look(), hz(5), frame="camera.frame sample"),
    )
    now, late, slow = (record(made, path) for path in ("now", "late", "slow"))
    run(made, 8)
    assert [value for _, value in now] == [1, 1, 2, 2, 3, 3, 4, 4]
    assert [value for _, value in late] == [0, 0, 1, 1, 2, 2, 3, 3]
    assert [value for _, value in slow] == [1, 3]
    assert made.read("camera", "frame") is made.memory.frames[made.slot("now", "frame").position]


def test_parts_of_a_signal_are_wired_without_a_block() -> None:
    class Grid(Block):
        flags = Out("bool[3]")
        counts = Out("int64[2]")
        grid = Out("float64[4,2]")

        def output(self, time):
            return np.array([True, time > 0.05, False]), np.array([3, 4]), time + np.arange(8.0).reshape(4, 2)

    class Seen(Block):
        flag = In("bool")
        count = In("int64")
        row = In("float64[2]")
        cell = In("float64")
        y = Out()

        def output(self, flag, count, row, cell):
            assert type(flag) is bool and type(count) is int and type(cell) is float
            return 1000.0 * flag + 100.0 * count + 10.0 * row.sum() + cell

    wires = {"flag": (1,), "count": (1,), "row": (2,), "cell": (3, 1)}
    ports = {"flag": "flags", "count": "counts", "row": "grid", "cell": "grid"}
    inputs = {name: Wire("grid", ports[name], index) for name, index in wires.items()}
    made = engine(node("grid", Grid(), hz(10)), node("seen", Seen(), hz(10), **inputs))
    rows = record(made, "seen")
    run(made, 2)
    assert [value for _, value in rows] == pytest.approx([400 + 90 + 7, 1000 + 400 + 92 + 7.1])


@given(st.lists(st.tuples(st.integers(1, 40), st.integers(0, 50)), min_size=1, max_size=4))
def test_every_task_runs_at_its_own_times_and_at_no_other(rates: list[tuple[int, int]]) -> None:
    tasks = [
        Task(str(k), Fraction(1, rate), Fraction(late, 20 * rate)) for k, (rate, late) in enumerate(rates)
    ]
    made = engine(*(node(f"b{k}", Clock(), task) for k, task in enumerate(tasks)))
    rows = [record(made, f"b{k}") for k in range(len(tasks))]
    ticks = min(3000, int(Fraction(1, 2) / made.period) + 1)
    run(made, ticks)
    end = ticks * made.period
    for task, seen in zip(tasks, rows, strict=True):
        times = [task.offset + k * task.period for k in range(last_tick(task, end) + 2)]
        expected = [float(time) for time in times if time < end]
        assert [time for time, _ in seen] == expected and [value for _, value in seen] == expected


def test_time_is_the_nearest_float_to_the_exact_time_however_long_the_run() -> None:
    made = engine(node("clock", Clock(), Task("third", Fraction(1, 3))))
    made.restore(replace(made.snapshot(), tick=10**9))
    run(made, 1)
    assert made.read("clock", "y") == 10**9 / 3


# Integration


class Oscillator(Block):
    """x'' = -x + u, in two states of which one is an array."""

    u = In(default=0.0)
    x = Out()
    place = State(init=1.0, continuous=True)
    speed = State("float64[1]", continuous=True)

    def output(self):
        return self.place

    def deriv(self, u):
        return self.speed[0], np.array([u - self.place])


@pytest.mark.parametrize(("solver", "order"), [("ode1", 1), ("ode2", 2), ("ode3", 3), ("ode4", 4)])
def test_a_loop_of_blocks_converges_with_the_order_of_the_solver(solver: str, order: int) -> None:
    # x'' = -x - 2 x' with the feedback through a block of its own: x = (1 + t) exp(-t).
    class Damper(Block):
        v = In()
        y = Out()

        def output(self, v):
            return -2.0 * v

    class Mass(Oscillator):
        v = Out()

        def output(self):
            return self.place, self.speed[0]

    errors = []
    for steps in (100, 200):
        task = Task("continuous", Fraction(5, 2 * steps), continuous=True)
        nodes = [node("mass", Mass(), task, u="damper.y"), node("damper", Damper(), task, v="mass.v")]
        made = Engine(Graph("test", execution_order(nodes)[0], solver, task.period))
        run(made, steps + 1)
        errors.append(abs(made.read("mass", "x") - 3.5 * math.exp(-2.5)))
    assert math.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.1)


def test_between_ticks_signals_are_those_of_the_tick() -> None:
    made = engine(node("clock", Clock()), node("x", Integral(), u="clock.y"), node("xx", Integral(), u="x.y"))
    with made:
        for tick in range(5):
            made.run(1)
            assert made.read("clock", "y") == tick / 100
            assert made.read("x", "y") == pytest.approx((tick / 100) ** 2 / 2, abs=1e-15)


def test_discrete_inputs_stand_still_during_a_solver_step() -> None:
    # With u held over steps of 20 ms the integral of the clock is the sum of its values.
    made = engine(node("clock", Clock(), hz(50)), node("x", Integral(), u="clock.y hold"))
    run(made, 101)
    assert made.read("x", "y") == pytest.approx(sum(k * 0.02 * 0.02 for k in range(50)), abs=1e-14)


@pytest.mark.parametrize("block", [Noise, Delay])
def test_a_sampled_block_in_the_continuous_task_stands_still_during_a_step(block: type[Block]) -> None:
    inputs = {"u": "clock.y"} if block is Delay else {}
    made = engine(
        node("clock", Clock()), node("b", block(), **inputs), node("x", Integral(), u="b.y"), seed=3
    )
    held = record(made, "b")
    run(made, 51)
    assert made.read("x", "y") == pytest.approx(sum(0.01 * value for _, value in held[:-1]), abs=1e-14)


def test_a_block_that_is_not_numeric_is_run_at_ticks_only() -> None:
    calls = []

    class Port(Block, numeric=False):
        y = Out()

        def output(self, time):
            calls.append(time)
            return 1.0

    run(engine(node("port", Port()), node("x", Integral(), u="port.y")), 5)
    assert calls == [k / 100 for k in range(5)]


def test_only_what_feeds_a_derivative_is_computed_at_minor_steps() -> None:
    calls = {"feeds": 0, "watches": 0}

    class Count(Block):
        u = In()
        y = Out()
        name = Param("feeds", type="str")

        def output(self, u):
            calls[self.name] += 1
            return u

    made = engine(
        node("x", Integral(), u="feeds.y"),
        node("feeds", Count(), u="x.y"),
        node("watches", Count(name="watches"), u="x.y"),
    )
    run(made, 10)
    assert calls == {"feeds": 40, "watches": 10}


def test_the_hybrid_loop_agrees_with_an_adaptive_solver_restarted_at_each_sample() -> None:
    """Rotorcraft with rotor lag under the paper's laws (17)-(23) at 20 Hz, RK4 at 1 ms, against DOP853."""
    integrate = pytest.importorskip("scipy.integrate")
    from quadvis_blocks.control.altitude import Altitude
    from quadvis_blocks.control.mixer import Mixer
    from quadvis_blocks.control.nested_saturation import NestedSaturation
    from quadvis_blocks.control.yaw import Yaw
    from quadvis_blocks.plant.rotorcraft import Rotorcraft

    control, plant = hz(20), Task("continuous", Fraction(1, 1000), continuous=True)
    begin = {"initial_position": [1.0, -1.0, 1.0], "initial_attitude": [0.0, 0.0, 0.2]}

    def part(port: str, index: int) -> Wire:
        return Wire("craft", port, (index,), "sample")

    def lateral(axis: str, place: int, angle: int) -> Node:
        wires = {"position": part("position", place), "velocity": part("velocity", place)}
        wires |= {"angle": part("attitude", angle), "angular_rate": part("rates", angle)}
        return node(axis, NestedSaturation(axis=axis, bandwidth=1.0), control, **wires)

    nodes = [
        node("craft", Rotorcraft(**begin), plant, thrust="mixer.thrust hold"),
        lateral("roll", 1, 0),
        lateral("pitch", 0, 1),
        node("height", Altitude(), control, height=part("position", 2), climb=part("velocity", 2),
             roll=part("attitude", 0), pitch=part("attitude", 1), height_reference=0.0),
        node("yaw", Yaw(), control, angle=part("attitude", 2), angular_rate=part("rates", 2)),
        node("mixer", Mixer(), control, collective="height.thrust", roll="roll.torque", pitch="pitch.torque",
             yaw="yaw.torque"),
    ]  # fmt: skip
    made = Engine(Graph("hybrid", execution_order(nodes)[0], "ode4", plant.period))
    run(made, 5001)
    state = np.array([0.5 * 9.81 / 4] * 4 + [1.0, -1.0, 1.0] + [0.0] * 5 + [0.2] + [0.0] * 3)
    for k in range(100):
        command = _paper_command(state)
        span = (k * 0.05, k * 0.05 + 0.05)
        solved = integrate.solve_ivp(
            _paper_plant, span, state, "DOP853", rtol=1e-13, atol=1e-15, args=(command,)
        )
        state = solved.y[:, -1]
    assert np.linalg.norm(state[4:7]) > 0.1, "the loop must still move, or the comparison proves nothing"
    found = [made.read("craft", port) for port in ("position", "velocity", "attitude", "rates")]
    assert np.concatenate(found) == pytest.approx(state[4:], abs=1e-9)


def _paper_plant(_: float, s: np.ndarray, command: np.ndarray) -> np.ndarray:
    """Equations (11)-(16) with a first-order lag of the rotors and linear drag."""
    f, v, (roll, pitch, _), rates = s[:4], s[7:10], s[10:13], s[13:16]
    u = f.sum() / 0.5
    acceleration = u * np.array(
        [-math.sin(pitch), math.cos(pitch) * math.sin(roll), math.cos(pitch) * math.cos(roll)]
    )
    torque = [
        0.24 * (f[3] - f[1]) / 5e-3,
        0.24 * (f[0] - f[2]) / 5e-3,
        0.016 * (f[0] + f[2] - f[1] - f[3]) / 9e-3,
    ]
    return np.concatenate(
        [(command - f) / 0.08, v, acceleration - 0.1 / 0.5 * v - [0, 0, 9.81], rates, torque]
    )


def _paper_command(s: np.ndarray) -> np.ndarray:
    """Equations (17)-(23), bandwidth 1, and the rotors' thrusts that give them."""
    (x, y, h), (vx, vy, vh), (roll, pitch, yaw), (p, q, r) = s[4:7], s[7:10], s[10:13], s[13:16]
    lift = np.clip(-vh - 0.5 * h, -2.0, 2.0)  # a1 = 2 m, a2 = m
    u = (lift + 0.5 * 9.81) / (math.cos(pitch) * math.cos(roll))

    def nested(place: float, speed: float, angle: float, rate: float) -> float:
        x1, x2 = place / 9.81, speed / 9.81
        s4 = np.clip(rate + 3 * angle + 3 * x2 + x1, -0.19, 0.19)
        s3 = np.clip(2 * angle + rate + x2 + s4, -0.4, 0.4)
        return float(-np.clip(rate + np.clip(angle + rate + s3, -0.9, 0.9), -2.0, 2.0))

    a = 5e-3 * nested(y, vy, roll, p) / 0.24 / 2
    b = 5e-3 * nested(-x, -vx, pitch, q) / 0.24 / 2
    c = 9e-3 * (-2 * r - yaw) / 0.016 / 4
    thrusts = np.array([u / 4 + b + c, u / 4 - a - c, u / 4 - b + c, u / 4 + a - c])
    assert thrusts.min() >= 0.0 and thrusts.max() <= 2.0, "the comparison is without rotor limits"
    return thrusts


# Determinism, snapshots


def mixed(seed: int, *more: Node) -> Engine:
    """Return an engine with something of everything that has a memory."""
    return engine(
        node("noise", Noise(), hz(20)),
        node("other", Noise(), hz(10, Fraction(1, 20))),
        node("x", Integral(), u="noise.y hold"),
        node("late", Delay(), hz(10), u="x.y sample"),
        node("back", Pass(), hz(20), u="late.y delay"),
        node("camera", Camera(), hz(10)),
        node("look", Look(), hz(20), frame="camera.frame delay"),
        *more,
        seed=seed,
    )


def history(made: Engine, path: str, ticks: int) -> list:
    rows = record(made, path)
    run(made, ticks)
    return rows


def test_the_same_seed_gives_the_same_bytes_and_another_seed_others() -> None:
    first, again, other = (mixed(seed) for seed in (1, 1, 2))
    for made in (first, again, other):
        run(made, 200)
    memories = [made.snapshot().memory for made in (first, again, other)]
    assert memories[0] == memories[1] and memories[0] != memories[2]


def test_a_random_stream_does_not_depend_on_other_blocks() -> None:
    alone = engine(node("noise", Noise(), hz(20)), seed=5)
    among = mixed(5, node("aaa", Noise(), hz(20)), node("zzz", Noise()))
    assert [v for _, v in history(alone, "noise", 30)] == [v for _, v in history(among, "noise", 150)]


def test_two_blocks_have_different_streams() -> None:
    made = engine(node("a", Noise(), hz(20)), node("b", Noise(), hz(20)))
    a, b = record(made, "a"), record(made, "b")
    run(made, 50)
    assert not {value for _, value in a} & {value for _, value in b}


@pytest.mark.parametrize("before", [0, 1, 37, 100])
def test_a_run_from_a_snapshot_repeats_to_the_bit_with_its_frames_and_rows(before: int) -> None:
    made, fresh = mixed(1), mixed(1)
    rows: dict[int, list] = {id(made): [], id(fresh): []}
    for one in (made, fresh):
        one.observe(
            "20 Hz + 0", lambda tick, one=one: rows[id(one)].append((tick, one.read("back", "y"))), every=3
        )
    with made, fresh:
        made.run(before)
        snapshot = made.snapshot()
        rows[id(made)].clear()
        made.run(120)
        first, expected = made.snapshot(), list(rows[id(made)])
        assert expected
        for again in (made, fresh):
            again.restore(snapshot)
            assert again.tick == before and again.snapshot() == snapshot
            rows[id(again)].clear()
            again.run(120)
            assert again.snapshot().memory == first.memory and rows[id(again)] == expected
            for one, other in zip(again.snapshot().frames, first.frames, strict=True):
                assert np.array_equal(one.pixels, other.pixels) and (one.stamp, one.sequence) == (
                    other.stamp,
                    other.sequence,
                )


def test_a_snapshot_of_another_graph_is_refused() -> None:
    with pytest.raises(ValueError, match="another graph"):
        engine(node("x", Integral())).restore(mixed(1).snapshot())


def test_observers_see_every_nth_tick_of_their_task_from_its_first_on() -> None:
    made = engine(node("a", Clock(), hz(20)), node("b", Clock(), hz(10, Fraction(1, 20))))
    seen: list[int] = []
    made.observe("10 Hz + 1/20", seen.append, every=3)
    run(made, 20)
    assert seen == [1, 7, 13, 19]


def test_observers_see_states_as_the_outputs_did() -> None:
    made = engine(node("clock", Clock(), hz(10)), node("late", Delay(), hz(10), u="clock.y"))
    seen: list[tuple[float, float]] = []
    late = made.bound("late")
    made.observe("10 Hz + 0", lambda _: seen.append((made.read("late", "y"), late.last)))
    run(made, 3)
    assert seen == [(-1.0, -1.0), (0.0, 0.0), (0.1, 0.1)]


def test_running_in_pieces_is_running_at_once() -> None:
    whole, pieces = mixed(1), mixed(1)
    run(whole, 100)
    with pieces:
        for count in (1, 0, 9, 40, 50):
            pieces.run(count)
    assert whole.snapshot().memory == pieces.snapshot().memory


# What goes wrong


class Faulty(Block, numeric=False):
    """Does something in one of its methods once the time has come."""

    u = In(default=0.0)
    y = Out("float64[2]")
    ok = Out()
    where = Param("output", type="str")
    when = Param(0.03)
    x = State(continuous=True)
    fault: Callable[[], object] = staticmethod(lambda: 1 / 0)

    def act(self, where: str, time: float = math.inf) -> float:
        found = self.fault() if self.where == where and time > self.when - 1e-9 else 0.0
        return found if isinstance(found, float) else 0.0

    def open(self):
        self.act("open")

    def start(self):
        self.x = self.act("start")

    def output(self, time):
        return np.array([0.0, self.act("output", time)]), 1.0 + self.x

    def update(self, time):
        self.act("update", time)

    def deriv(self, time):
        return self.act("deriv", time)


def faulty(where: str, fault: Callable[[], object]) -> Engine:
    block = type("Faulty", (Faulty,), {"fault": staticmethod(fault)}, numeric=False)(where=where)
    return engine(node("before", Clock()), node("bad", block), node("after", Clock()))


@pytest.mark.parametrize(
    ("where", "time"), [("open", 0.0), ("start", 0.0), ("output", 0.03), ("update", 0.03), ("deriv", 0.02)]
)
def test_an_exception_stops_the_run_and_says_in_which_block_and_when(where: str, time: float) -> None:
    with pytest.raises(RunError) as caught:
        run(faulty(where, lambda: 1 / 0), 10)
    assert (caught.value.block, caught.value.time) == ("bad", time)
    assert "a division by zero" in str(caught.value)
    assert isinstance(caught.value.__cause__, ZeroDivisionError)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_an_output_that_is_not_finite_stops_the_run_with_block_port_and_time(value: float) -> None:
    with pytest.raises(RunError) as caught:
        run(faulty("output", lambda: value), 10)
    assert (caught.value.block, caught.value.port, caught.value.time) == ("bad", "y", 0.03)
    assert str(caught.value).startswith("block 'bad', port 'y', t = 0.03 s: the output became [")
    assert f"{value}]" in str(caught.value)


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_a_derivative_that_is_not_finite_stops_the_run_and_names_the_state(value: float) -> None:
    with pytest.raises(RunError, match="state 'x' left the finite numbers") as caught:
        run(faulty("deriv", lambda: value), 10)
    assert (caught.value.block, caught.value.time) == ("bad", 0.02)


def test_a_state_that_starts_at_nan_stops_the_run_at_the_port_that_shows_it() -> None:
    with pytest.raises(RunError) as caught:
        run(faulty("start", lambda: math.nan), 10)
    assert (caught.value.block, caught.value.port, caught.value.time) == ("bad", "ok", 0.0)


def test_nan_passes_where_a_port_says_that_it_means_missing() -> None:
    class Missing(Block):
        y = Out(nan=True)

        def output(self):
            return math.nan

    made = engine(node("camera", Missing(), hz(10)))
    run(made, 3)
    assert math.isnan(made.read("camera", "y"))


def test_the_first_block_in_order_is_the_one_that_is_named() -> None:
    class Root(Block):
        y = Out()

        def output(self, time):
            return 1e308 * (1.0 + 1e3 * time)

    made = engine(node("z", Pass(), hz(10), u="a.y"), node("a", Root(), hz(10)))
    with pytest.raises(RunError, match=r"block 'a', port 'y', t = 0.1 s: the output became inf"):
        run(made, 10)


def test_the_engine_can_be_read_after_a_failure() -> None:
    made = faulty("output", lambda: 1 / 0)
    rows = record(made, "before")
    with pytest.raises(RunError):
        run(made, 10)
    assert [time for time, _ in rows] == [0.0, 0.01, 0.02] and made.tick == 3


def test_a_parameter_that_open_refuses_is_told_with_its_block_as_bad_input() -> None:
    def refuse() -> None:
        raise ParameterError("when", "when must be at most the period")

    with pytest.raises(ParameterError, match="block 'bad': when must be at most the period") as caught:
        run(faulty("open", refuse), 1)
    assert caught.value.parameter == "when" and caught.value.exit_code == 2


def test_an_error_in_quadvis_own_words_is_told_without_the_name_of_its_class() -> None:
    def fail() -> None:
        raise QuadvisError("the port is gone")

    with pytest.raises(RunError) as caught:
        run(faulty("update", fail), 10)
    assert str(caught.value) == "block 'bad', t = 0.03 s: the port is gone"


# Opening and closing


def ports(count: int, log: list[str], **actions: Callable[[], object]) -> Engine:
    """Return an engine of blocks that log their opening, start and end; actions are for "open1", "close0"."""

    class Port(Block, numeric=False):
        y = Out()
        number = Param(0, type="int64")

        def act(self, what: str) -> None:
            log.append(f"{what} {self.number}")
            actions.get(f"{what}{self.number}", lambda: None)()

        def open(self):
            self.act("open")

        def close(self):
            self.act("close")

        def start(self):
            self.act("start")

        def output(self):
            actions.get(f"output{self.number}", lambda: None)()
            return 0.0

    return engine(*(node(f"p{k}", Port(number=k), hz(10)) for k in range(count)))


def stop(error: BaseException) -> Callable[[], object]:
    def raise_it() -> None:
        raise error

    return raise_it


def test_all_blocks_are_opened_then_started_and_closed_in_reverse() -> None:
    log: list[str] = []
    run(ports(2, log), 1)
    assert log == ["open 0", "open 1", "start 0", "start 1", "close 1", "close 0"]


@pytest.mark.parametrize("error", [OSError("no such port"), KeyboardInterrupt(), SystemExit(3)], ids=repr)
@pytest.mark.parametrize(
    ("place", "closed"),
    [
        ("open1", ["close 1", "close 0"]),
        ("start0", ["close 2", "close 1", "close 0"]),
        ("output2", ["close 2", "close 1", "close 0"]),
    ],
)
def test_whatever_ends_a_run_every_opened_block_is_closed(
    place: str, closed: list[str], error: BaseException
) -> None:
    log: list[str] = []
    expected = RunError if isinstance(error, Exception) else type(error)
    with pytest.raises(expected):
        run(ports(3, log, **{place: stop(error)}), 1)
    assert log[-len(closed) :] == closed


@pytest.mark.parametrize("error", [OSError("stuck"), KeyboardInterrupt(), SystemExit(3)], ids=repr)
def test_a_block_that_cannot_be_closed_does_not_keep_the_others_open(error: BaseException) -> None:
    log: list[str] = []
    expected = RunError if isinstance(error, Exception) else type(error)
    with pytest.raises(expected):
        run(ports(3, log, close1=stop(error)), 1)
    assert log[-3:] == ["close 2", "close 1", "close 0"]


def test_a_failure_to_close_is_told_with_its_block() -> None:
    with pytest.raises(RunError, match=r"block 'p1', t = 0.1 s: cannot close: OSError: stuck"):
        run(ports(2, [], close1=stop(OSError("stuck"))), 1)


def test_a_failure_to_close_does_not_hide_why_the_run_ended() -> None:
    log: list[str] = []
    with pytest.raises(RunError, match=r"block 'p0', port 'y', t = 0 s: a division by zero") as caught:
        run(ports(2, log, output0=lambda: 1 / 0, close1=stop(OSError("stuck"))), 1)
    assert log[-2:] == ["close 1", "close 0"]
    assert any("cannot close: OSError: stuck" in note for note in caught.value.__notes__)


def test_blocks_are_closed_once() -> None:
    log: list[str] = []
    made = ports(1, log)
    with made:
        made.run(1)
    made.__exit__(None, None, None)
    assert log.count("close 0") == 1
