import math
from fractions import Fraction
from itertools import product
from typing import Any

import numpy as np
import pytest

from quadvis.block import Block, In, Out, Param, Random, State
from quadvis.engine.layout import TIME, Placed
from quadvis.engine.memory import Memory, Record, Slot
from quadvis.testing.alone import alone, parameter_sizes
from tests.stages import mostly_slow

numba = pytest.importorskip("numba")

from quadvis.native.compiler import Compiler  # noqa: E402 - it needs numba only when it compiles

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


def slots(block: Block, placed: Placed, method: str) -> tuple[list[Slot], list[Slot]]:
    names = block.interface.arguments[method]
    arguments = [TIME if name == "time" else placed.inputs[name] for name in names]
    return arguments, list(placed.outputs.values()) if method == "output" else []


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
    placed, memory = engine.program["block"], engine.memory
    memory.write(Slot("float64", (), 0), 1.25)
    before = engine.snapshot()
    (engine.bound("block").start if method == "start" else engine.call("block", method))()
    interpreted = engine.snapshot().memory
    assert interpreted != before.memory
    engine.restore(before)
    call = Compiler(Everything, placed.record).compile(method, *slots(block, placed, method))
    call(memory, placed.position)
    assert engine.snapshot().memory == interpreted


def test_one_compiled_method_serves_every_block_of_its_type() -> None:
    class Gain(Block):
        u = In()
        y = Out()
        factor = Param(2.0)

        def output(self, u):
            return self.factor * u

    record = Record.of(Gain(), {})
    memory = Memory(2 + 2 * record.size)
    for place, factor in ((2, 3.0), (2 + record.size, 5.0)):
        memory.fill(Gain(factor=factor), record, place, 1.0)
    source, target = Slot("float64", (), 0), Slot("float64", (), 1)
    memory.write(source, 7.0)
    call = Compiler(Gain, record).compile("output", [source], [target])
    for place, expected in ((2, 21.0), (2 + record.size, 35.0)):
        call(memory, place)
        assert memory.read(target) == expected


def test_dividing_by_zero_gives_infinity_as_in_numpy() -> None:
    class Inverse(Block):
        u = In()
        y = Out()

        def output(self, u):
            return 1.0 / u

    engine = alone(Inverse(), {"u": 0.0}, {}, Fraction(1))
    placed = engine.program["block"]
    call = Compiler(Inverse, placed.record).compile("output", *slots(engine.bound("block"), placed, "output"))
    call(engine.memory, placed.position)
    assert engine.read("block", "y") == math.inf


def test_what_numba_cannot_compile_is_told_with_its_line() -> None:
    class Words(Block):
        u = In("float64[2]")
        y = Out("float64[2]")
        last = State("float64[2]")

        def output(self, u):
            return u

        def update(self, u):
            self.last = u
            CALLS.append(f"{u}")

    engine = alone(Words(), {"u": [0.0, 0.0]}, parameter_sizes(Words()), Fraction(1))
    placed = engine.program["block"]
    line = Words.update.__code__.co_firstlineno + 2
    with pytest.raises(numba.core.errors.NumbaError, match=rf"test_compiled\.py.*\(?{line}\)?"):
        Compiler(Words, placed.record).compile("update", *slots(engine.bound("block"), placed, "update"))
