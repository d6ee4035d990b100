import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.block import Block, In, Out, State
from quadvis.graph.graph import Constant, Graph, Node, Task, Wire, common_divisor, selected
from quadvis.graph.order import execution_order

TASK = Task("main", Fraction(1, 10))
TIMES = st.fractions(min_value=Fraction(1, 10**6), max_value=100, max_denominator=10**6)


class Sum(Block):
    """Three inputs, all of them fed through."""

    a, b, c = In(default=0.0), In(default=0.0), In(default=0.0)
    y = Out()

    def output(self, a, b, c):
        return a + b + c


class Delay(Block):
    """One input that the output does not need."""

    a = In()
    y = Out()
    last = State()

    def output(self):
        return self.last

    def update(self, a):
        self.last = a


def node(path: str, *sources: str, block: type[Block] = Sum, crossing: str | None = None) -> Node:
    inputs: dict = {port: Constant(0.0) for port in block.interface.inputs}
    inputs |= {port: Wire(source, "y", (), crossing) for port, source in zip("abc", sources, strict=False)}
    return Node(path, "test", block(), TASK, inputs)


@given(st.lists(TIMES, min_size=1, max_size=6))
def test_the_tick_is_the_longest_that_divides_every_period(periods: list[Fraction]) -> None:
    graph = Graph(
        "g", [Node(f"b{i}", "", Sum(), Task(f"t{i}", period), {}) for i, period in enumerate(periods)]
    )
    counts = [period / graph.tick for period in periods]
    assert all(count.denominator == 1 for count in counts)
    assert math.gcd(*(count.numerator for count in counts)) == 1


@given(st.lists(TIMES, min_size=1, max_size=4), st.lists(TIMES, max_size=3))
def test_the_tick_divides_offsets_too(periods: list[Fraction], offsets: list[Fraction]) -> None:
    tasks = [
        Task(f"t{i}", period, offset)
        for i, (period, offset) in enumerate(zip(periods, offsets, strict=False))
    ]
    graph = Graph("g", [Node(task.name, "", Sum(), task, {}) for task in tasks])
    assert all(graph.ticks(task.period) * graph.tick == task.period for task in tasks)
    assert all(graph.ticks(task.offset) * graph.tick == task.offset for task in tasks)


def test_the_solver_step_is_the_tick_and_a_period_that_it_does_not_divide_is_refused() -> None:
    graph = Graph("g", [node("a")], step=Fraction(1, 30))
    assert graph.tick == Fraction(1, 30)
    with pytest.raises(ValueError, match="1/10 s is not a whole number of ticks of 1/25 s"):
        Graph("g", [node("a")], step=Fraction(1, 25)).ticks(TASK.period)


def test_a_common_divisor_of_incommensurate_looking_periods_is_exact() -> None:
    assert common_divisor([Fraction(1, 3), Fraction(1, 10)]) == Fraction(1, 30)


def test_tasks_come_fastest_first_and_the_continuous_one_before_all() -> None:
    tasks = [
        Task("slow", Fraction(1)),
        Task("continuous", Fraction(1, 100), continuous=True),
        Task("fast", Fraction(1, 200)),
    ]
    graph = Graph("g", [Node(task.name, "", Sum(), task, {}) for task in tasks], step=Fraction(1, 200))
    assert [task.name for task in graph.tasks] == ["continuous", "fast", "slow"]


INDICES = st.one_of(
    st.integers(-4, 3),
    st.builds(slice, *[st.one_of(st.none(), st.integers(-4, 4))] * 2, st.sampled_from([None, 1, 2, -1])),
)


@given(st.sampled_from([(4,), (4, 3), (2, 3, 4)]), st.lists(INDICES, max_size=3).map(tuple))
def test_a_part_is_a_run_of_elements_or_none_and_must_lie_within(shape: tuple, index: tuple) -> None:
    whole = np.arange(math.prod(shape)).reshape(shape)
    try:
        part = whole[index]
    except IndexError:
        part = whole[:0]
    if part.size == 0 or any(
        isinstance(i, slice) and (i.stop or 0) > n for i, n in zip(index, shape, strict=False)
    ):
        with pytest.raises(IndexError):
            selected(shape, index)
        return
    run = np.array_equal(part.ravel(), np.arange(part.size) + part.flat[0])
    found = selected(shape, index)
    assert (found is not None) == run
    if found is not None:
        assert found[1] == part.shape
        assert np.array_equal(whole.ravel()[found[0] : found[0] + part.size].reshape(part.shape), part)


@st.composite
def acyclic(draw: st.DrawFn) -> list[Node]:
    """Blocks in any order, wired so that each needs only blocks of a lower number."""
    count = draw(st.integers(1, 12))
    made = []
    for number in range(count):
        sources = draw(st.lists(st.integers(0, number - 1), max_size=3)) if number else []
        made.append(node(f"b{number}", *(f"b{source}" for source in sources)))
    return draw(st.permutations(made))


@given(acyclic())
def test_every_block_comes_after_what_its_output_needs(nodes: list[Node]) -> None:
    order, loops = execution_order(nodes)
    place = {found.path: index for index, found in enumerate(order)}
    assert not loops and sorted(place) == sorted(found.path for found in nodes)
    assert all(place[wire.block] < place[found.path] for found in order for _, wire in found.wires())
    again, _ = execution_order(order)
    assert [found.path for found in again] == [found.path for found in order]


@given(acyclic(), st.data())
def test_a_wire_back_makes_a_loop_that_is_told_with_its_path(nodes: list[Node], data: st.DataObject) -> None:
    first, last = data.draw(st.sampled_from(nodes)), data.draw(st.sampled_from(nodes))
    by_path = {found.path: found for found in nodes}
    needs: set[str] = set()
    waiting = [first.path]
    while waiting:
        path = waiting.pop()
        if path not in needs:
            needs.add(path)
            waiting += [wire.block for _, wire in by_path[path].wires()]
    last.inputs["a"] = Wire(first.path, "y")
    loops = execution_order(nodes)[1]
    closes = last.path in needs
    # What the wire replaced may have been the way from the one block to the other.
    if not closes:
        assert not loops
    for loop in loops:
        for (path, port), (following, _) in zip(loop, [*loop[1:], loop[0]], strict=True):
            source = by_path[path].inputs[port]
            assert isinstance(source, Wire) and source.block == following
    if first is last:
        assert [(first.path, "a")] in loops


def test_blocks_keep_their_order_where_the_wires_allow_it() -> None:
    nodes = [node("d"), node("a", "c"), node("b"), node("c")]
    assert [found.path for found in execution_order(nodes)[0]] == ["d", "c", "a", "b"]


def test_a_loop_is_told_as_the_inputs_that_close_it() -> None:
    nodes = [node("out", "x"), node("x", "out", "z"), node("z", "y"), node("y", "x")]
    _, loops = execution_order(nodes)
    assert loops == [[("out", "a"), ("x", "a")], [("x", "b"), ("z", "a"), ("y", "a")]]


def test_a_block_without_feedthrough_breaks_a_loop() -> None:
    order, loops = execution_order([node("sum", "delay"), node("delay", "sum", block=Delay)])
    assert not loops and [found.path for found in order] == ["delay", "sum"]


def test_a_delay_on_the_wire_breaks_a_loop() -> None:
    assert not execution_order([node("x", "y", crossing="delay"), node("y", "x")])[1]


def test_long_chains_need_no_recursion() -> None:
    nodes = [node(f"b{k}", f"b{k + 1}") for k in range(5000)] + [node("b5000")]
    order, loops = execution_order(nodes)
    assert not loops and order[0].path == "b5000" and order[-1].path == "b0"
