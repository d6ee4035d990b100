import pickle
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.block import Block, In, Out, Param, Random, State
from quadvis.block.random import M1, M2
from quadvis.engine.engine import Engine
from quadvis.engine.layout import TIME
from quadvis.engine.memory import SLOT
from quadvis.engine.program import Program, make_program
from quadvis.graph.graph import Constant, Graph, Node, Task, Wire
from quadvis.run.listing import program_lines

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


def program(*nodes: Node, seed: int = 0) -> Program:
    return make_program(Graph("test", list(nodes), "ode4", STEP), seed)


def engine(*nodes: Node, seed: int = 0) -> Engine:
    return Engine(Graph("test", list(nodes), "ode4", STEP), seed)


def test_time_comes_first_then_the_signals_of_the_continuous_task() -> None:
    made = program(
        node("slow", Passes(), SLOW, u="fast.y sample"), node("fast", Moves()), node("faster", Moves())
    )
    assert TIME.position == 0
    assert [made[path].outputs["y"].position for path in ("fast", "faster", "slow")] == [1, 2, 3]
    assert made.held == 3


def test_no_two_things_share_a_slot() -> None:
    made = program(node("a", Plant()), node("b", Moves(), u="c.y delay"), node("c", Draws(), SLOW))
    taken = [TIME.position]
    for block in made.blocks:
        slots = [
            *block.outputs.values(),
            *block.slopes.values(),
            *(block.field(item.name) for item in block.record.fields),
            *block.inputs.values(),
        ]
        taken += [slot.position + k for slot in slots if slot.scalar != "frame" for k in range(slot.size)]
    assert len(taken) == len(set(taken)) and max(taken) < len(made.image) // SLOT


def test_the_outputs_of_a_block_lie_side_by_side_as_one_row() -> None:
    made = program(node("a", Plant()))["a"]
    start = made.outputs["position"].position
    assert [made.outputs[name].position - start for name in ("missing", "ok")] == [3, 4]
    assert made.row == slice(start * SLOT, (start + 5) * SLOT)


def test_a_block_without_numbers_has_an_empty_row() -> None:
    class Silent(Block):
        u = In(default=0.0)

        def update(self, u):
            pass

    assert program(node("a", Silent()))["a"].row == slice(0, 0)


def test_what_must_be_finite_is_every_float_that_may_not_be_missing() -> None:
    made = program(node("a", Plant()))
    start = made["a"].outputs["position"].position
    assert made.task("continuous").finite == (start, start + 1, start + 2)


def test_states_and_derivatives_are_in_one_order() -> None:
    made = engine(node("m", Moves()), node("a", Plant()))
    for path in ("m", "a"):
        made.call(path, "deriv")()
    floats = made.memory.floats
    assert floats[list(made.program.slopes)].tolist() == [0.0, 1.0, 2.0, 3.0]
    floats[list(made.program.states)] = [10.0, 20.0, 30.0, 40.0]
    assert made.read("m", "x") == 10.0
    assert made.read("a", "x").tolist() == [20.0, 30.0] and made.read("a", "v") == 40.0


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
    made = program(
        node("x", Moves()),
        node("slow", Draws(), SLOW),
        node("b", block(), u=source),
        node("z", Moves(), u="b.y"),
    )
    minor = {made.blocks[op.block].path for op in made.minor}
    assert ("b" in minor) == again
    # x is computed again if its derivative needs it: through b, when b passes it on.
    assert ("x" in minor) == (again and source == "x.y")
    assert "z" not in minor


def test_minor_steps_keep_the_order_of_execution() -> None:
    made = program(node("x", Moves(), u="c.y"), node("b", Passes(), u="x.y"), node("c", Passes(), u="b.y"))
    assert made.minor == tuple(made.op(path, "output") for path in ("x", "b", "c"))


def test_a_constant_input_is_in_the_image() -> None:
    made = engine(node("a", Plant()))
    assert made.read("a", "u").tolist() == [1.0, 2.0] and bytes(made.memory.raw) == made.program.image


@given(st.integers(0, 2**64), st.text("ab/", min_size=1, max_size=5))
def test_a_stream_is_valid_and_follows_from_seed_and_path(seed: int, path: str) -> None:
    made, again = (engine(node(path, Draws(), SLOW), seed=seed) for _ in range(2))
    stream = made.read(path, "stream")
    assert (stream > 0).all() and (stream < min(M1, M2)).all()
    assert np.array_equal(stream, again.read(path, "stream"))
    other = engine(node(path + "x", Draws(), SLOW), node(path, Draws(), SLOW), seed=seed)
    assert np.array_equal(stream, other.read(path, "stream"))
    assert not np.array_equal(stream, other.read(path + "x", "stream"))


class Pair(Block):
    y = Out("float64[2]")
    level = Param(1.0, unit="m", tune=True)

    def output(self):
        return [self.level, 2.0]


def nodes() -> list[Node]:
    wire = Wire("plant", "position", (0,), "sample")
    return [
        node("plant", Plant(), u="pair.y delay"),
        Node("passes", "test", Passes(), SLOW, {"u": wire}),
        node("pair", Pair(), SLOW),
        node("moves", Moves(), u="passes.y hold"),
        node("draws", Draws(), SLOW),
    ]


def test_a_program_is_data_that_pickles_compares_and_hashes() -> None:
    made = program(*nodes())
    again = pickle.loads(pickle.dumps(made))
    assert again == made == program(*nodes()) and hash(again) == hash(made) and again.hash == made.hash
    assert len(made.hash) == 64
    assert program(*nodes(), seed=1).hash != made.hash


def test_any_change_of_a_graph_changes_the_hash_of_its_program() -> None:
    first = program(*nodes()).hash
    changed = [
        program(*nodes()[:-1]),
        make_program(Graph("test", nodes(), "ode1", STEP), 0),
        make_program(Graph("test", nodes(), "ode4", STEP / 2), 0),
    ]
    parameter = nodes()
    parameter[2].block.level = 2.0
    assert first not in [made.hash for made in changed] + [program(*parameter).hash]


def test_tunable_parameters_are_listed_with_unit_and_slot() -> None:
    (tunable,) = program(*nodes()).tunables
    assert (tunable.path, tunable.name, tunable.unit) == ("pair", "level", "m")
    assert tunable.slot == program(*nodes())["pair"].field("level")


def test_a_program_is_printed_as_a_table_that_names_signals_and_not_slots() -> None:
    lines = program_lines(program(*nodes()))
    text = "\n".join(lines)
    assert "slow" in text and "100 ms" in text
    assert any("copy" in line and "pair.y" in line for line in lines)
    assert any(line.split()[:4] == ["output", "1", "passes", "plant.position[0]"] for line in lines)
