"""Programs as machine code: the same bits as interpreted, the same faults, a cache that is never stale."""

import enum
import math
import os
import random
import subprocess
import sys
import types
from collections.abc import Callable
from contextlib import ExitStack
from fractions import Fraction
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import quadvis
from quadvis.block import Block, Derived, In, Out, Param, Random, State, Work
from quadvis.engine.engine import Engine
from quadvis.engine.memory import Memory, Record, Slot
from quadvis.engine.program import Op
from quadvis.engine.solver import TABLEAUS
from quadvis.engine.taps import Tap
from quadvis.errors import QuadvisError, RunError
from quadvis.graph.graph import MULTI, Graph, Node, Task, Wire
from quadvis.graph.order import execution_order
from quadvis.graph.tasking import with_transitions
from quadvis.native import cache
from quadvis.native.block_type import BlockType, MethodType
from quadvis.native.choice import AUTO, NATIVE, PYTHON, choose, use
from quadvis.native.library import Library, block_types, library
from quadvis.native.source import fingerprint
from quadvis.testing.alone import ALONE, alone
from tests.quadvis.test_engine import (
    CONTINUOUS,
    STEP,
    Camera,
    Clock,
    Delay,
    Integral,
    Look,
    Noise,
    Pass,
    hz,
    node,
)
from tests.stages import mostly_slow

DIAGRAMS = Path(__file__).parents[2] / "diagrams"
CALLS: list[str] = []
LIMIT = 3.0


def squared(value: Any) -> Any:
    return value * value


def limited(value: float, limit: float = LIMIT) -> float:
    return min(squared(value), limit)


class Everything(Block):
    """Uses what the contract allows: all kinds, helpers, choices, arrays, tuples."""

    u = In("float64[*]")
    flag = In("bool")
    flags = In("bool[2]")
    y = Out("float64[*]")
    z = Out()
    on = Out("bool")
    which = Out("bool[2]")
    count = Out("int64")
    mode = Param("up", choices=("up", "down"))
    enabled = Param(True, type="bool")
    mask = Param((True, False), type="bool[2]")
    last = State("float64[*]")
    total = State()
    seen = State("int64")
    on_ = State("bool")
    marks = State("bool[2]")
    stream = Random()

    def start(self):
        self.last = 2.0

    def output(self, u, flag, flags, time):
        sign = 1.0 if self.mode == 0 else -1.0
        return sign * u + self.last, limited(time), flag and self.enabled, flags & (flags | flags), self.seen

    def update(self, u, flag, flags):
        self.last = self.last + squared(u)
        self.total, self.seen = self.total + 1.5, self.seen + 1
        self.on_ = not flag
        self.marks = flags
        if self.mask[0]:
            self.stream[0] = self.stream[0] * 3 % 1000003


def natively(engine: Engine) -> Engine:
    """Return the engine, which runs as machine code from now on."""
    use(engine, choose(engine, 0, NATIVE))
    return engine


def compiled(engine: Engine) -> list[str]:
    """Return the blocks of an engine that are machine code."""
    kinds = block_types(engine.program, [node.block for node in engine.graph.nodes])
    return [engine.program.blocks[number].path for number in kinds if kinds[number] not in library().refusals]


# Block types


@pytest.mark.parametrize(
    ("method", "mode", "shape"),
    mostly_slow(
        [
            ("output", "up", (3,)), ("output", "down", ()), ("output", "down", (2, 2)),
            *product(["start", "update"], ["down"], [(3,), (), (2, 2)]),
        ]
    ),
)  # fmt: skip
def test_a_compiled_method_does_to_memory_what_the_interpreted_one_does(
    method: str, mode: str, shape: tuple
) -> None:
    block = Everything(mode=mode)
    u = np.arange(1.0, 1.0 + math.prod(shape)).reshape(shape)
    inputs = {"u": u, "flag": True, "flags": [False, True]}
    engine = alone(block, inputs, {"*": shape}, Fraction(1, 10), seed=4)
    placed, memory = engine.program[ALONE], engine.memory
    memory.write(Slot("float64", (), 0), 1.25)
    before = engine.snapshot()
    (engine.bound(ALONE).start if method == "start" else engine.call(ALONE, method))()
    interpreted = engine.snapshot().memory
    assert interpreted != before.memory
    engine.restore(before)
    op = Op(0, "start", (), ()) if method == "start" else engine.program.op(ALONE, method)
    kind = BlockType.of(Everything, placed.record, (MethodType.of(op),))
    library().prepare([kind])
    assert library().call(kind, op, memory, placed.position)
    assert engine.snapshot().memory == interpreted


class Scaled(Block):
    u = In()
    y = Out()
    factor = Param(2.0)

    def output(self, u):
        return self.factor * u


def test_one_compiled_method_serves_every_block_of_its_type() -> None:
    record = Record.of(Scaled(), {})
    memory = Memory(2 + 2 * record.size)
    for place, factor in ((2, 3.0), (2 + record.size, 5.0)):
        memory.fill(Scaled(factor=factor), record, place, 1.0)
    op = Op(0, "output", (Slot("float64", (), 0),), (Slot("float64", (), 1),))
    memory.write(op.sources[0], 7.0)
    kind = BlockType.of(Scaled, record, (MethodType.of(op),))
    library().prepare([kind])
    for place, expected in ((2, 21.0), (2 + record.size, 35.0)):
        assert library().call(kind, op, memory, place)
        assert memory.read(op.targets[0]) == expected


def test_what_numba_cannot_compile_runs_interpreted_and_the_refusal_says_why() -> None:
    class Words(Block):
        u = In("float64[2]")
        y = Out("float64[2]")
        last = State("float64[2]")

        def output(self, u):
            return u

        def update(self, u):
            self.last = u
            CALLS.append(f"{u}")

    engine = natively(alone(Words(), {"u": [1.0, 2.0]}, {}, Fraction(1)))
    CALLS.clear()
    with engine:
        engine.run(3)
    assert CALLS == ["[1. 2.]"] * 3
    (refusal,) = [why for kind, why in library().refusals.items() if kind.block is Words]
    assert refusal == "method 'update': Untyped global name 'CALLS': Cannot type empty list"


# Faults: what raises an exception interpreted does so as machine code, and leaves the same memory


class Risky(Block):
    """Does one dangerous thing with its input, in output or half way through update."""

    u = In()
    y = Out()
    late = Param(False, type="bool")
    count = State("int64")
    total = State()
    values = State("float64[3]")
    found = Work()

    def output(self, u):
        self.found = 0.0 if self.late else danger(u, self.values)
        return self.found

    def update(self, u):
        self.count += 1
        self.values[self.count % 3] = u
        if self.late:
            self.total += danger(u, self.values)
        self.total += 1.0


def danger(u: float, values: Any) -> float:
    """Replaced by each test."""
    return u


DANGERS: dict[str, tuple[Callable[[float, Any], float], float]] = {
    "division": (lambda u, values: 1.0 / (u - 3.0), 3.0),
    "whole division": (lambda u, values: 7.0 // (u - 3.0), 3.0),
    "remainder": (lambda u, values: 7.0 % (u - 3.0), 3.0),
    "root": (lambda u, values: math.sqrt(2.0 - u), 3.0),
    "logarithm": (lambda u, values: math.log(3.0 - u), 3.0),
    "arc sine": (lambda u, values: math.asin(0.5 * u), 3.0),
    "overflow": (lambda u, values: math.exp(300.0 * u), 3.0),
    "power of a negative number": (lambda u, values: (2.0 - u) ** 0.5 + 0.0 * u, 3.0),
    "zero to a negative power": (lambda u, values: (3.0 - u) ** -1.0, 3.0),
    "index": (lambda u, values: values[int(u)], 3.0),
    "not a whole number": (lambda u, values: float(int(nothing(u) if u >= 3 else u)), 3.0),
    "shape": (lambda u, values: spread(int(u), values), 3.0),
}  # fmt: skip


def nothing(u: float) -> float:
    return math.inf * (u - 3.0)


def spread(count: int, values: Any) -> float:
    values[:2] = values[: count if count > 2 else 2]
    return values[0]


def outcome(engine: Engine, ticks: int) -> tuple[str, bytes, int]:
    """Return the fault of a run, and the memory and the tick where it stopped."""
    try:
        with np.errstate(all="ignore"), engine:
            engine.run(ticks)
    except RunError as error:
        return str(error), engine.snapshot().memory, engine.tick
    return "", engine.snapshot().memory, engine.tick


@pytest.mark.parametrize("late", [False, True], ids=["output", "update"])
@pytest.mark.parametrize("name", mostly_slow(DANGERS, quick=1))
def test_a_fault_is_the_same_interpreted_and_as_machine_code(
    monkeypatch: pytest.MonkeyPatch, name: str, late: bool
) -> None:
    function, bad = DANGERS[name]
    monkeypatch.setitem(globals(), "danger", function)
    task = Task("fast", Fraction(1, 10))

    class Ramp(Block):
        y = Out()
        count = State()

        def output(self):
            return self.count

        def update(self):
            self.count = self.count + 1.0

    def made() -> Engine:
        risky = Node("risky", "test", Risky(late=late), task, {"u": Wire("ramp", "y")})
        return Engine(Graph("test", [Node("ramp", "test", Ramp(), task, {}), risky]))

    interpreted, native = outcome(made(), 8), outcome(natively(made()), 8)
    assert native == interpreted
    assert interpreted[0] and interpreted[2] == int(bad)
    assert set(compiled(made())) == {"ramp", "risky"}


class Falling(Block):
    """x' = -sqrt(x): has no derivative once x is below zero; or one that is not finite."""

    x = Out()
    rooted = Param(True, type="bool")
    level = State(init=0.02, continuous=True)

    def output(self):
        return self.level

    def deriv(self):
        return -math.sqrt(self.level) if self.rooted else 1.0 / max(0.0, 1e-3 - abs(self.level)) ** 300.0


class Infinite(Block):
    y = Out()

    def output(self, time):
        return math.inf if time > 0.25 else time


@pytest.mark.parametrize("block", [Falling(), Infinite()], ids=lambda block: type(block).__name__)
@pytest.mark.parametrize("solver", mostly_slow(["ode4", "ode1", "ode2", "ode3"]))
def test_faults_of_the_solver_and_of_signals_are_the_same(block: Block, solver: str) -> None:
    continuous = Task("continuous", Fraction(1, 10), continuous=True)

    def made() -> Engine:
        return Engine(Graph("test", [Node("block", "test", block, continuous, {})], solver, Fraction(1, 10)))

    interpreted = outcome(made(), 50)
    assert interpreted[0] and outcome(natively(made()), 50) == interpreted


# Whole programs


class Rows(Tap):
    """Keeps copies of rows."""

    def __init__(self, block: str, every: int) -> None:
        self.block, self.every = block, every
        self.rows: list[tuple[int, bytes]] = []

    def take(self, tick: int, row: memoryview) -> None:
        self.rows.append((tick, bytes(row)))


def tapped(graph: Graph, seed: int) -> tuple[Engine, list[Rows]]:
    """Return an engine, and taps of all its blocks: of some at each tick, of some more rarely."""
    engine = Engine(graph, seed)
    paths = [node.path for node in graph.nodes if node.block.interface.outputs]
    taps = [Rows(path, 1 + number % 3) for number, path in enumerate(paths)]
    for tap in taps:
        engine.attach(tap)
    return engine, taps


def assert_the_same_bits(graph: Graph, ticks: int, chance: random.Random) -> None:
    """Run a graph interpreted, and again with changes of the engine and snapshots at random ticks."""
    plain, wanted = tapped(graph, 7)
    with plain:
        plain.run(ticks)
    engine, found = tapped(graph, 7)
    interpreter = engine._executor
    with engine:
        while engine.tick < ticks:
            if chance.random() < 0.7:
                natively(engine)
            else:
                engine.run_with(lambda _: interpreter)
            before, lengths = engine.snapshot(), [len(tap.rows) for tap in found]
            engine.run(min(chance.randint(1, ticks // 3), ticks - engine.tick))
            if chance.random() < 0.3:
                engine.restore(before)
                for tap, length in zip(found, lengths, strict=True):
                    del tap.rows[length:]
    assert engine.snapshot().memory == plain.snapshot().memory
    assert [tap.rows for tap in found] == [tap.rows for tap in wanted]


TASKS = [hz(100), hz(50), hz(50, Fraction(1, 100)), hz(20), hz(25), hz(20, Fraction(3, 100)), CONTINUOUS]
NUMBERS = [Clock, Pass, Delay, Delay, Integral, Noise]


def drawn(chance: random.Random) -> Graph:
    """Return a random graph of compiled and interpreted blocks, at many rates and with all crossings."""
    nodes = [node("camera", Camera(), chance.choice(TASKS[:-1])), node("clock", Clock())]
    for number in range(chance.randint(2, 12)):
        kind = chance.choice(NUMBERS)
        task = CONTINUOUS if kind is Integral else chance.choice(TASKS)
        wires = {}
        if "u" in kind.interface.inputs:
            source = chance.choice(nodes[1:])
            crossing = chance.choice(["sample", "hold", "newest", "delay"])
            if source.task == task:
                crossing = chance.choice(["", "delay"])
            wires = {"u": f"{source.path}.y {crossing}".strip()}
        nodes.append(node(f"b{number}", kind(), task, **wires))
    nodes.append(node("look", Look(), chance.choice(TASKS[:-1]), frame="camera.frame hold"))
    tasking = chance.choice(["single", MULTI])
    if tasking == MULTI:
        with_transitions(nodes)
    order, loops = execution_order(nodes)
    assert not loops
    return Graph("test", order, chance.choice(sorted(TABLEAUS)), STEP, tasking)


@given(st.integers(0, 2**32))
def test_any_program_gives_the_same_bits_whichever_engine_runs_it(seed: int) -> None:
    chance = random.Random(seed)
    assert_the_same_bits(drawn(chance), 60, chance)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "variant"),
    [("hover.yaml", "geometric"), ("hover.yaml", "fused_geometric"), ("blackout.yaml", "robust")],
)
def test_a_flight_gives_the_same_bits_whichever_engine_runs_it(name: str, variant: str) -> None:
    diagram = quadvis.load(DIAGRAMS / name, variant=variant)
    assert_the_same_bits(diagram.graph, int(2.0 / diagram.graph.tick), random.Random(3))


def test_a_full_ring_is_emptied_and_the_run_goes_on() -> None:
    engine = natively(alone(Scaled(), {"u": 3.0}, {}, Fraction(1, 1000)))
    tap = Rows(ALONE, 1)
    engine.attach(tap)
    with engine:
        engine.run(20_000)  # a ring has room for 4096 of these rows
    assert [tick for tick, _ in tap.rows] == list(range(20_000))
    assert {row for _, row in tap.rows} == {np.float64(6.0).tobytes()}


def test_a_time_that_no_float_has_exactly_is_left_to_the_interpreter() -> None:
    class Clock(Block):
        y = Out()

        def output(self, time):
            return time

    engine = natively(alone(Clock(), {}, {}, Fraction(1, 3)))
    engine.restore(engine.snapshot().__class__(2**54, engine.snapshot().memory, ()))
    with engine:
        engine.run(1)
    assert engine.read(ALONE, "y") == 2**54 / 3


class Kept(Block):
    """Copies its input to a state and the state to its output, as a delay does; the state may be wider."""

    u = In("float64[*]")
    y = Out("float64[n]")
    last = State("float64[n]")
    size = Param((0.0,), type="float64[n]")

    def output(self):
        return self.last

    def update(self, u):
        self.last = u


@pytest.mark.parametrize(
    ("u", "length", "called"),
    [(np.arange(3.0), 3, 0), (np.arange(40.0), 40, 0), (1.5, 3, 1)],
    ids=["a few slots", "many slots", "a number for all elements"],
)
def test_what_only_copies_needs_no_call_and_gives_the_same_bits(u: Any, length: int, called: int) -> None:
    sizes = {"*": np.shape(u), "n": length}
    interpreted, engine = (alone(Kept(size=np.zeros(length)), {"u": u}, sizes, Fraction(1)) for _ in range(2))
    assert outcome(natively(engine), 3) == outcome(interpreted, 3)
    assert len(engine._executor._made()._calls) == called


class Gives(Block):
    """Asks for an input that it does not use, and gives a parameter."""

    u = In()
    y = Out()
    factor = Param(2.0)
    last = State()

    def output(self, u):
        return self.factor

    def update(self, u, time):
        self.last = u


def test_a_method_that_gives_a_field_never_takes_its_input_for_it() -> None:
    interpreted, engine = (alone(Gives(), {"u": 7.0}, {}, Fraction(1)) for _ in range(2))
    assert outcome(natively(engine), 3) == outcome(interpreted, 3)
    assert [engine.read(ALONE, name) for name in ("y", "factor", "last")] == [2.0, 2.0, 7.0]


# The cache


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty cache."""
    monkeypatch.setenv(cache.FOLDER, str(tmp_path / "cache"))
    return tmp_path / "cache"


def gained(engine: Engine, library: Library) -> list[str]:
    """Return what is compiled for an engine by a library that has nothing in memory."""
    said: list[str] = []
    kinds = block_types(engine.program, [node.block for node in engine.graph.nodes])
    library.prepare(kinds.values(), said.append)
    return said


def scaled(u: float = 3.0) -> Engine:
    return alone(Scaled(), {"u": u}, {}, Fraction(1))


def test_a_block_type_is_compiled_once_and_then_loaded_in_any_process(folder: Path) -> None:
    assert len(gained(scaled(), Library())) == 1
    assert gained(scaled(), Library()) == []
    assert [path.suffix for path, _ in cache.files()] == [cache.SUFFIX]


def test_what_another_process_compiles_comes_last_and_is_loaded(folder: Path) -> None:
    first, second = (
        next(iter(block_types(engine.program, [engine.graph[ALONE].block]).values()))
        for engine in (scaled(), alone(Gives(), {"u": 7.0}, {}, Fraction(1)))
    )
    Library().prepare([first])
    ((path, _),) = cache.files()
    whole, said = path.read_bytes(), []
    path.unlink()
    with ExitStack() as elsewhere:
        assert elsewhere.enter_context(cache.claim(path.stem))

        def announce(text: str) -> None:
            said.append(text)
            if text.startswith("waiting"):
                path.write_bytes(whole)
                elsewhere.close()

        Library().prepare([first, second], announce)
    assert said == [
        "compiling Gives, 2 of 2 block types, once",
        "waiting for another process, which compiles Scaled",
    ]
    assert [each.suffix for each in folder.iterdir()] == [cache.SUFFIX] * 2


def test_a_claim_is_granted_to_one_at_a_time(folder: Path) -> None:
    with cache.claim("x") as first, cache.claim("x", wait=False) as second, cache.claim("y") as third:
        assert (first, second, third) == (True, False, True)
    with cache.claim("x", wait=False) as again:
        assert again


def cut(data: bytes) -> bytes:
    return data[:-20]


def turned(data: bytes) -> bytes:
    return data[:-200] + bytes([data[-200] ^ 1]) + data[-199:]


@pytest.mark.parametrize(
    "damage", [cut, turned, lambda data: b"", lambda data: b"\xff" * 500, lambda data: data[:90]]
)
def test_a_damaged_file_is_compiled_again(folder: Path, damage: Callable[[bytes], bytes]) -> None:
    gained(scaled(), Library())
    ((path, _),) = cache.files()
    whole = path.read_bytes()
    path.write_bytes(damage(whole))
    assert len(gained(scaled(), Library())) == 1
    assert path.read_bytes() == whole


def test_a_folder_that_takes_nothing_costs_the_cache_and_not_the_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("no folder")
    monkeypatch.setenv(cache.FOLDER, str(tmp_path / "file"))
    assert len(gained(scaled(), Library())) == 1
    assert list(cache.files()) == [] and cache.load("x") is None


def test_a_full_disk_leaves_no_half_file(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: Any) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    assert len(gained(scaled(), Library())) == 1
    assert list(folder.iterdir()) == []


PROGRAM = """
import sys, quadvis
from quadvis.native.choice import choose, use
diagram = quadvis.load("own.yaml", stop_time="1 s")
said = []
result = diagram.run(engine="native", announce=said.append)
print(len(said), result["it.y"][-1])
"""
DIAGRAM = """
quadvis: 1
name: own
rates: {fast: 10 Hz}
stop_time: 1 s
blocks:
  it: {block: own.it, rate: fast}
"""


@pytest.mark.slow  # four processes; of the fingerprint that this rests on there is a test below
def test_an_edit_two_files_away_is_never_stale(tmp_path: Path, folder: Path) -> None:
    """The block calls a helper in another file, and this a constant in a third."""
    own = tmp_path / "blocks" / "own"
    own.mkdir(parents=True)
    (tmp_path / "far.py").write_text("FACTOR = 2.0\n")
    (tmp_path / "near.py").write_text("from far import FACTOR\n\ndef twice(u):\n    return FACTOR * u\n")
    (own / "it.py").write_text(
        '''"""It."""

from near import twice
from quadvis.block import Block, Out


class It(Block):
    """It."""

    y = Out(doc="it")

    def output(self) -> float:
        """Return it."""
        return twice(21.0)
'''
    )
    (tmp_path / "own.yaml").write_text(DIAGRAM)

    def run() -> str:
        environment = {**os.environ, "PYTHONPATH": str(tmp_path), "PYTHONDONTWRITEBYTECODE": "1"}
        done = subprocess.run(
            [sys.executable, "-c", PROGRAM], cwd=tmp_path, env=environment, capture_output=True, text=True
        )
        assert done.returncode == 0, done.stderr
        return done.stdout.strip()

    assert run() == "2 42.0"
    assert run() == "0 42.0"
    (tmp_path / "far.py").write_text("FACTOR = 3.0\n")
    assert run() == "2 63.0"
    (tmp_path / "near.py").write_text("from far import FACTOR\n\ndef twice(u):\n    return FACTOR + u\n")
    assert run() == "2 24.0"


@pytest.mark.slow
def test_two_processes_that_compile_at_once_both_run(tmp_path: Path, folder: Path) -> None:
    program = (
        "import quadvis, hashlib\n"
        f"diagram = quadvis.load({str(DIAGRAMS / 'margins.yaml')!r}, stop_time='1 s')\n"
        "run = diagram.run(engine='native')\n"
        "print(hashlib.sha256(run['side.position'].tobytes()).hexdigest())\n"
    )
    both = [subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE) for _ in range(2)]
    texts = {process.communicate()[0] for process in both}
    assert [process.returncode for process in both] == [0, 0]
    assert len(texts) == 1 and len(texts.pop()) == 65
    assert not [path for path in folder.iterdir() if path.suffix != cache.SUFFIX]


def test_what_a_function_reaches_decides_over_its_fingerprint() -> None:
    def made(constant: Any, text: str = "return helper(u)") -> Any:
        scope: dict[str, Any] = {"constant": constant}
        exec(f"def helper(u):\n    return u + constant\ndef method(self, u):\n    {text}\n", scope)
        return scope["method"]

    same = fingerprint(made(1.0))
    assert same == fingerprint(made(1.0))
    others = [made(2.0), made(1), made((1.0,)), made(np.array([1.0])), made(1.0, "return helper(2 * u)")]
    assert len({same, *map(fingerprint, others)}) == 6
    long = np.zeros((2, 5000))
    long[1, 2500] = 1.0  # where a printed array has dots
    kinds = [enum.IntEnum("Kind", {"A": number}) for number in (1, 2)]
    compiled = [types.SimpleNamespace(py_func=made(number), __qualname__="method") for number in (1.0, 2.0)]
    tuples = [NamedTuple("Place", [(name, float) for name in names]) for names in ("xy", "yx")]
    for one, other in ((tuple([long[0]]), tuple([long[1]])), kinds, compiled, tuples):
        assert fingerprint(made(one)) != fingerprint(made(other))


# Numbers that a block derives from its parameters


class Curve(Block):
    u = In("float64")
    y = Out("float64")
    factors = Param((1.0, 2.0), type="float64[2]")
    squares = Derived("float64[2]", doc="the factors, squared")

    def check(self):
        self.squares = [factor * factor for factor in self.factors]

    def output(self, u):
        return self.squares[0] * u + self.squares[1]


@pytest.mark.parametrize("kind", ["python", "native"])
def test_what_check_derives_from_parameters_is_in_memory_before_a_run(kind: str) -> None:
    engine = alone(Curve(factors=(3.0, 0.5)), {"u": 2.0}, {}, Fraction(1))
    begin = engine.snapshot()  # no block is open yet
    assert engine.read(ALONE, "squares").tolist() == [9.0, 0.25]
    use(engine, choose(engine, 1, kind))
    with engine:
        engine.restore(begin)
        engine.run(1)
        assert engine.read(ALONE, "y") == 18.25


# The choice


def test_short_runs_are_interpreted_long_ones_compiled_if_that_pays(folder: Path) -> None:
    class Fresh(Scaled):  # no other test has compiled it
        def output(self, u):
            return self.factor * u + 0.25

    engine = alone(Fresh(), {"u": 3.0}, {}, Fraction(1))
    assert choose(engine, 10).engine == PYTHON
    long = choose(engine, 10**6)
    assert long.engine == PYTHON and "compiling 1 block type would take about" in long.reason
    said: list[str] = []
    assert choose(engine, 10**8, AUTO, said.append).engine == NATIVE
    assert said[0].startswith("compiling 1 block type, once: about 2 s")
    assert choose(engine, 10**6).engine == NATIVE  # it is kept now


def test_in_real_time_machine_code_is_taken_where_it_is_kept_however_long_the_run(folder: Path) -> None:
    class Paced(Scaled):  # no other test has compiled it
        def output(self, u):
            return self.factor * u + 0.125

    engine = alone(Paced(), {"u": 3.0}, {}, Fraction(1))
    for ticks in (10, 10**8):
        choice = choose(engine, ticks, paced=True)
        assert choice.engine == PYTHON
        assert choice.reason == "since 1 block type would have to be compiled, once; 'native' does it"
    assert choose(engine, 10, NATIVE, paced=True).engine == NATIVE
    assert choose(engine, 10, paced=True).engine == NATIVE

    class Outside(Scaled, numeric=False):
        """Has no machine code."""

    python = alone(Outside(), {"u": 3.0}, {}, Fraction(1))
    assert choose(python, 10**8, paced=True).reason == "since no block can be compiled"


def test_an_unknown_engine_is_refused_with_the_one_that_is_meant() -> None:
    with pytest.raises(QuadvisError, match="there is no engine 'nativ'; did you mean 'native'"):
        choose(scaled(), 1, "nativ")
