from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.block import Block, In, Out, Param, Random, State
from quadvis.engine.graph import Constant, Graph, Node, Task, Wire
from quadvis.engine.memory import SLOT
from quadvis.engine.plan import STREAM_MODULUS, TIME, Plan, make_plan

STEP = Fraction(1, 100)
CONTINUOUS = Task("continuous", STEP, continuous=True)
SLOW = Task("slow", Fraction(1, 10))


class Plant(Block):
    """Two states and several outputs."""

    u = In("float64[2]", default=(1.0, 2.0))
    gain = Param(2.0)
    position = Out("float64[3]")
    picture = Out("frame")
    missing = Out(nan=True)
    ok = Out("bool")
    x = State("float64[2]", continuous=True)
    v = State(continuous=True)

    def output(self):
        raise NotImplementedError

    def deriv(self, u):
        return u, 3.0


class Passes(Block):
    u = In()
    y = Out()

    def output(self, u):
        return u


class Samples(Passes):
    last = State()

    def update(self, u):
        self.last = u


class Follows(Samples):
    def output(self, u, time):
        return u + time


class Outside(Passes, numeric=False):
    pass


class Moves(Block):
    u = In(default=0.0)
    y = Out()
    x = State(continuous=True)

    def output(self):
        return self.x

    def deriv(self, u):
        return u


class Draws(Block):
    y = Out()
    stream = Random()

    def output(self):
        return 0.0


def node(path: str, block: Block, task: Task = CONTINUOUS, **inputs: str) -> Node:
    made: dict = {name: Constant(port.default) for name, port in block.interface.inputs.items()}
    for name, text in inputs.items():
        reference, _, crossing = text.partition(" ")
        made[name] = Wire(*reference.split("."), (), crossing or None)
    return Node(path, "test", block, task, made)


def plan(*nodes: Node, seed: int = 0) -> Plan:
    return make_plan(Graph("test", list(nodes), "ode4", STEP), seed)


def test_time_comes_first_then_the_signals_of_the_continuous_task() -> None:
    made = plan(
        node("slow", Passes(), SLOW, u="fast.y sample"), node("fast", Moves()), node("faster", Moves())
    )
    assert TIME.position == 0
    assert [made[path].outputs["y"].position for path in ("fast", "faster", "slow")] == [1, 2, 3]
    assert made.held == slice(0, 3 * SLOT)


def test_no_two_things_share_a_slot() -> None:
    made = plan(node("a", Plant()), node("b", Moves(), u="c.y delay"), node("c", Draws(), SLOW))
    taken = [TIME.position]
    for step in made.steps:
        slots = [
            *step.outputs.values(),
            *step.slopes.values(),
            *(step.field(item.name) for item in step.record.fields),
        ]
        slots += [step.inputs[name] for name in step.inputs]
        taken += [slot.position + k for slot in slots if slot.scalar != "frame" for k in range(slot.size)]
    assert len(taken) == len(set(taken)) and max(taken) < made.memory.floats.size


def test_the_outputs_of_a_block_lie_side_by_side_as_one_row() -> None:
    made = plan(node("a", Plant()))["a"]
    start = made.outputs["position"].position
    assert [made.outputs[name].position - start for name in ("missing", "ok")] == [3, 4]
    assert made.row == slice(start * SLOT, (start + 5) * SLOT)


def test_a_block_without_numbers_has_an_empty_row() -> None:
    class Silent(Block):
        u = In(default=0.0)

        def update(self, u):
            pass

    assert plan(node("a", Silent()))["a"].row == slice(0, 0)


def test_what_must_be_finite_is_every_float_that_may_not_be_missing() -> None:
    made = plan(node("a", Plant()))
    start = made["a"].outputs["position"].position
    assert made.finite(made.steps).tolist() == [start, start + 1, start + 2]


def test_states_and_derivatives_are_in_one_order() -> None:
    made = plan(node("m", Moves()), node("a", Plant()))
    for call in made.derivatives:
        call()
    floats = made.memory.floats
    assert floats[made.slopes].tolist() == [0.0, 1.0, 2.0, 3.0]
    floats[made.continuous] = [10.0, 20.0, 30.0, 40.0]
    assert made["m"].self.x == 10.0 and made["a"].self.x.tolist() == [20.0, 30.0] and made["a"].self.v == 40.0


@pytest.mark.parametrize(
    ("block", "source", "again"),
    [
        (Passes, "x.y", True),
        (Passes, "x.y delay", False),
        (Samples, "x.y", False),
        (Follows, "x.y", True),
        (Outside, "x.y", False),
        (Passes, "slow.y hold", False),
    ],
)
def test_minor_steps_compute_again_what_moves_between_ticks(
    block: type[Block], source: str, again: bool
) -> None:
    made = plan(
        node("x", Moves()),
        node("slow", Draws(), SLOW),
        node("b", block(), u=source),
        node("z", Moves(), u="b.y"),
    )
    assert (made["b"].output in made.minor) == again
    # x is computed again if its derivative needs it: through b, when b passes it on.
    assert (made["x"].output in made.minor) == (again and source == "x.y")
    assert made["z"].output not in made.minor


def test_minor_steps_keep_the_order_of_execution() -> None:
    made = plan(node("x", Moves(), u="c.y"), node("b", Passes(), u="x.y"), node("c", Passes(), u="b.y"))
    assert made.minor == [made[path].output for path in ("x", "b", "c")]


def test_a_call_is_traced_to_its_block() -> None:
    made = plan(node("x", Moves()), node("b", Samples(), u="x.y"))
    assert made.owner(made["b"].update) is made["b"] and made.owner(made["x"].deriv) is made["x"]


def test_a_constant_input_is_written_once() -> None:
    made = plan(node("a", Plant()))
    assert made.memory.read(made["a"].inputs["u"]).tolist() == [1.0, 2.0]


@given(st.integers(0, 2**64), st.text("ab/", min_size=1, max_size=5))
def test_a_stream_is_valid_and_follows_from_seed_and_path(seed: int, path: str) -> None:
    made, again = (plan(node(path, Draws(), SLOW), seed=seed) for _ in range(2))
    stream = made.memory.read(made[path].field("stream"))
    assert (stream > 0).all() and (stream < STREAM_MODULUS).all()
    assert np.array_equal(stream, again.memory.read(again[path].field("stream")))
    other = plan(node(path + "x", Draws(), SLOW), node(path, Draws(), SLOW), seed=seed)
    assert np.array_equal(stream, other.memory.read(other[path].field("stream")))
    assert not np.array_equal(stream, other.memory.read(other[path + "x"].field("stream")))
