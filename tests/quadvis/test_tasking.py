"""Tasking: what `multi` gives, held against Simulink's rules and against tasks that interrupt each other."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import quadvis
from quadvis.api import load_text
from quadvis.block import Block, In, Out, State
from quadvis.engine.engine import Engine
from quadvis.engine.interpreter import Interpreter
from quadvis.engine.program import Program, TaskProgram, make_program
from quadvis.errors import DiagramError
from quadvis.graph.graph import MULTI, Constant, Graph, Node, Task, Wire
from quadvis.graph.order import execution_order
from quadvis.graph.tasking import with_transitions

FAST, SLOW = Task("fast", Fraction(1, 10)), Task("slow", Fraction(1, 5))


class Count(Block):
    """Counts its ticks and adds its input, so that each value says when it was made and from what."""

    u = In("float64[2]", default=(0.0, 0.0))
    v = In(default=0.0)
    y = Out("float64[2]")
    ticks = State()

    def output(self, u, v):
        return np.array([self.ticks, 0.5 * u[0] + 0.25 * v])

    def update(self, u, v):
        self.ticks = self.ticks + 1.0


def node(path: str, task: Task, **inputs: Wire) -> Node:
    block = Count()
    made: dict[str, Any] = {name: Constant(port.default) for name, port in block.interface.inputs.items()}
    return Node(path, "test", block, task, made | inputs)


def graph(*nodes: Node) -> Graph:
    with_transitions(nodes)
    order, loops = execution_order(nodes)
    assert not loops
    return Graph("test", order, tasking=MULTI)


def rows(engine: Engine, path: str, ticks: int) -> list[list[float]]:
    found: list[list[float]] = []
    engine.observe(engine.graph[path].task.name, lambda _: found.append(engine.read(path, "y").tolist()))
    with engine:
        engine.run(ticks)
    return found


def test_a_slower_task_reads_what_the_faster_gave_at_the_same_tick() -> None:
    made = Engine(graph(node("fast", FAST), node("slow", SLOW, u=Wire("fast", "y", (), "sample"))))
    assert rows(made, "slow", 6) == [[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]]


def test_a_faster_task_reads_what_the_slower_gave_one_of_its_periods_ago() -> None:
    made = Engine(graph(node("slow", SLOW), node("fast", FAST, u=Wire("slow", "y", (), "hold"))))
    # Slow gives 0, 1, 2 at ticks 0, 2, 4; fast sees the initial 0, from tick 2 on 0, from tick 4 on 1.
    assert [row[1] for row in rows(made, "fast", 8)] == [0.0, 0.0, 0.0, 0.0, 0.5, 0.5, 1.0, 1.0]


def test_a_loop_between_rates_is_no_algebraic_loop() -> None:
    nodes = [
        node("slow", SLOW, u=Wire("fast", "y", (), "sample")),
        node("fast", FAST, u=Wire("slow", "y", (), "hold")),
    ]
    assert execution_order(nodes)[1]
    made = graph(*nodes)
    assert [each.path for each in made.nodes]


def test_the_continuous_task_reads_slower_ones_one_period_later() -> None:
    plant = Task("continuous", Fraction(1, 10), continuous=True)
    made = Engine(graph(node("slow", SLOW), node("plant", plant, u=Wire("slow", "y", (), "hold"))))
    assert [row[1] for row in rows(made, "plant", 6)] == [0.0, 0.0, 0.0, 0.0, 0.5, 0.5]


PERIODS = st.sampled_from([1, 2, 3, 4, 6])
OFFSETS = st.sampled_from([0, 1, 2])


@st.composite
def graphs(draw: Any) -> Graph:
    """Graphs of up to six blocks in up to four tasks, wired at random."""
    count = draw(st.integers(2, 4))
    tasks = []
    for number in range(count):
        period = draw(PERIODS)
        tasks.append(Task(f"t{number}", Fraction(period, 10), Fraction(draw(OFFSETS) % period, 10)))
    paths = [f"b{number}" for number in range(draw(st.integers(2, 6)))]
    owner = {path: draw(st.sampled_from(tasks)) for path in paths}
    nodes = []
    for number, path in enumerate(paths):
        inputs = {}
        for port, index in (("u", ()), ("v", (1,))):
            source = draw(st.sampled_from([None, *paths]))
            if source is None or (owner[source] == owner[path] and paths.index(source) >= number):
                continue  # within a task only earlier blocks, so that no algebraic loop is drawn
            inputs[port] = Wire(source, "y", index, None if owner[source] == owner[path] else "newest")
        nodes.append(node(path, owner[path], **inputs))
    return graph(*nodes)


class Preempted:
    """Runs each task by itself: slower ones are interrupted anywhere before they are due again.

    At each tick the copies for all due tasks are made as a real-time kernel makes them: delays at once, and
    a task's latches once the faster tasks are through, which never wait for a slower one. Then random
    numbers say how many calls of each unfinished task run before the next tick; whatever is left of a task
    runs when it is due again.
    """

    def __init__(self, program: Program, blocks: list[Block], random: np.random.Generator) -> None:
        self.program, self.random = program, random
        self.machine = Interpreter(program, blocks)
        self.left: dict[str, list[Any]] = {task.name: [] for task in program.tasks}
        self.rows: dict[str, list[list[float]]] = {block.path: [] for block in program.blocks}

    def run(self, ticks: int) -> None:
        for tick in range(ticks):
            due = [
                task for task in self.program.tasks
                if tick >= task.offset and (tick - task.offset) % task.every == 0
            ]  # fmt: skip
            for task in due:
                self.finish(task)
            for task in due:
                for op in task.delays:
                    self.machine.call(op)()
            for task in due:
                if task.latches:
                    for faster in self.program.tasks[: self.program.tasks.index(task)]:
                        self.finish(faster)
                for op in task.latches:
                    self.machine.call(op)()
                self.left[task.name] = [*task.outputs, None, *task.updates]
            for task in self.program.tasks:
                for _ in range(int(self.random.integers(0, 6))):
                    self.step(task)
        for task in self.program.tasks:
            self.finish(task)

    def step(self, task: TaskProgram) -> None:
        if not self.left[task.name]:
            return
        op = self.left[task.name].pop(0)
        if op is not None:
            self.machine.call(op)()
            return
        for block in self.program.blocks:
            if block.task == task.name:
                self.rows[block.path].append(self.machine.memory.read(block.outputs["y"]).tolist())

    def finish(self, task: TaskProgram) -> None:
        while self.left[task.name]:
            self.step(task)


@settings(deadline=None, max_examples=60)
@given(graphs(), st.integers(0, 2**32))
def test_however_tasks_interrupt_each_other_the_signals_are_those_of_the_simulation(
    made: Graph, seed: int
) -> None:
    engine = Engine(made)
    seen: dict[str, list[list[float]]] = {each.path: [] for each in made.nodes}
    for each in made.nodes:
        engine.observe(
            each.task.name, lambda _, path=each.path: seen[path].append(engine.read(path, "y").tolist())
        )
    with engine:
        engine.run(24)
    other = Preempted(make_program(made, 0), [each.block for each in made.nodes], np.random.default_rng(seed))
    other.run(24)
    assert other.rows == seen


FOLDER = Path(__file__).parents[2] / "diagrams"


def test_a_diagram_says_multi_and_its_hash_and_resolved_form_say_so_too() -> None:
    text = (FOLDER / "hover.yaml").read_text()
    single, multi = (load_text(f"tasking: {word}\n{text}", FOLDER) for word in ("single", "multi"))
    assert single.hash == quadvis.load(FOLDER / "hover.yaml").hash
    assert multi.graph.tasking == "multi" and multi.hash != single.hash
    again = load_text(multi.resolved, FOLDER)
    assert again.hash == multi.hash and "tasking: multi" in multi.resolved


@pytest.mark.parametrize("word", ["both", "Multi", "[multi]"])
def test_another_word_is_refused(word: str) -> None:
    with pytest.raises(DiagramError, match=r"1:10: 'tasking' must be"):
        load_text(f"tasking: {word}\n" + (FOLDER / "hover.yaml").read_text(), FOLDER)


def test_what_is_analysed_has_the_delays_of_what_is_run() -> None:
    """Torques reach the craft one period of control later, 50 ms; frames the law one of vision, 100 ms."""
    text = (FOLDER / "sampled_margins.yaml").read_text()
    single, multi = (
        load_text(f"tasking: {word}\n{text}", FOLDER).analyse().loops for word in ("single", "multi")
    )
    for cut, delay in (("torque", 0.05), ("vision", 0.1)):
        assert single[cut].margins.delay - multi[cut].margins.delay == pytest.approx(delay, abs=0.005)
