"""Nodes under conditions: what the engine calls of them, and what a reset sets back."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from typing import Any, ClassVar

import numpy as np

from quadvis.block import NO_FRAME, Block, Frame, Out, Random, State, normal
from quadvis.engine.engine import Engine
from quadvis.graph.graph import Constant, Graph, Node, Task, Wire
from quadvis.graph.order import execution_order
from quadvis_blocks.logic.run_condition import RunCondition

FAST = Task("fast", Fraction(1, 10))
LATE = Task("late", Fraction(1, 5), Fraction(1, 10))


class Script(Block, numeric=False):
    """True at some ticks."""

    y = Out("bool")
    ticks: ClassVar[tuple[int, ...]] = ()

    def output(self, time):
        return round(time * 10) in self.ticks


def script(*ticks: int) -> Block:
    return type("Scripted", (Script,), {"ticks": ticks, "__module__": __name__}, numeric=False)()


class Device(Block, numeric=False):
    """Notes each call, and keeps a picture and a noise."""

    y = Out()
    picture = State("frame")
    noise = Random()
    count = State(init=3.0)
    harmless = "a test"

    def open(self):
        self.calls.append("open")

    def start(self):
        self.calls.append("start")
        self.count = self.count + 1.0

    def read(self):
        self.calls.append("read")

    def output(self):
        self.calls.append("output")
        return self.count

    def write(self):
        self.calls.append("write")

    def update(self):
        self.calls.append("update")
        self.count = self.count + 1.0
        self.picture = Frame(np.zeros((1, 1, 3), np.uint8), 0.0, 1)
        normal(self.noise)

    calls: ClassVar[list[str]]


def device() -> Any:
    made = type("Noted", (Device,), {"calls": [], "__module__": __name__}, numeric=False)
    return made()


def node(path: str, block: Block, task: Task = FAST, condition: str = "", **wires: Wire) -> Node:
    inputs: dict[str, Any] = {
        name: Constant(port.default)
        for name, port in block.interface.inputs.items()
        if port.default is not None
    }
    return Node(path, "test", block, task, inputs | wires, condition=condition)


def graph(*nodes: Node) -> Graph:
    order, loops = execution_order(nodes)
    assert not loops
    return Graph("test", order)


def test_nothing_of_a_block_is_called_while_its_condition_is_false() -> None:
    block = device()
    made = graph(
        node("noted", block, condition="runs"),
        node("runs", RunCondition(), when=Wire("on", "y")),
        node("on", script(2, 3)),
    )
    assert [each.path for each in made.nodes] == ["on", "runs", "noted"]
    with Engine(made) as engine:
        engine.run(2)
        assert block.calls == ["open", "start"]
        engine.run(6)
    assert block.calls == ["open", "start", *2 * ["read", "output", "write", "update"]]


def test_a_reset_sets_back_states_and_pictures_but_no_noise() -> None:
    made = graph(
        node("off", script(4)),
        node("runs", RunCondition(reset_on="rising"), reset=Wire("off", "y")),
        node("noted", device(), condition="runs"),
    )
    plain = graph(node("noted", device()))
    with Engine(made, 5) as engine, Engine(plain, 5) as other:
        engine.run(4)
        assert engine.read("noted", "count") == 8.0
        assert engine.read("noted", "picture") is not NO_FRAME
        engine.run(1)
        assert engine.read("noted", "y") == 4.0  # its initial value, and what `start` makes of it
        engine.run(2)
        other.run(7)
        assert engine.read("noted", "count") == 7.0
        assert engine.read("noted", "noise").tolist() == other.read("noted", "noise").tolist()


def test_a_block_with_an_offset_looks_at_its_condition_at_its_own_ticks() -> None:
    made = graph(
        node("on", script(0, 1, 4, 5), LATE),
        node("runs", RunCondition(trigger_on="rising"), LATE, trigger=Wire("on", "y")),
        node("noted", block := device(), LATE, condition="runs"),
    )
    with Engine(made) as engine:
        engine.run(5)
        assert block.calls == ["open", "start"]  # true at its first tick is no edge
        engine.run(1)
        assert block.calls[2:] == ["read", "output", "write", "update"]


def test_conditions_in_each_other_have_the_blocks_of_both() -> None:
    inner = node("inner", RunCondition(), condition="outer", around_active=Wire("outer", "active"))
    made = graph(
        node("outer", RunCondition()), inner, node("a", device(), condition="inner"),
        node("b", device(), condition="outer"),
    )  # fmt: skip
    assert {path: [each.path for each in nodes] for path, nodes in made.conditions.items()} == {
        "outer": ["inner", "a", "b"],
        "inner": ["a"],
    }
    program = Engine(made).program
    assert program.members(program.number("outer")) == [1, 2, 3]
    assert program.gate(program.number("inner")) is None


def test_conditions_around_each_other_are_a_loop() -> None:
    one, other = node("one", RunCondition(), condition="other"), node("other", RunCondition())
    assert execution_order([one, other])[1] == []
    assert execution_order([one, replace(other, condition="one")])[1] == [
        [("one", "condition"), ("other", "condition")]
    ]
