import numpy as np
import pytest

from quadvis.block import Block, Frame, In, Out, Param, State, Work
from quadvis.engine.memory import SLOT, Memory, Record, Slot
from quadvis.testing import drive


class Mixed(Block):
    """Parameters and states of every kind."""

    u = In("float64[*]")
    y = Out("float64[*]")
    gain = Param(2.5)
    count = Param(7, type="int64")
    on = Param(True, type="bool")
    mode = Param("b", choices=("a", "b", "c"))
    path = Param("file.txt", type="str")
    matrix = Param(((1.0, 2.0), (3.0, 4.0)), type="float64[2,2]")
    flags = Param((True, False, True), type="bool[3]")
    level = State(init=0.5)
    hits = State("int64")
    open_ = State("bool")
    last = State("float64[*]", init=1.5)
    places = State("int64[2]")

    def output(self, u):
        return u


def bound(sizes: dict, position: int = 3) -> tuple[Memory, Record, Block]:
    record = Record.of(Mixed(), sizes)
    memory = Memory(position + record.size + 2)
    return memory, record, placed(memory, Mixed(), record, position, 0.25)


def placed(
    memory: Memory, block: Block, record: Record, position: int, period: float, **frames: Slot
) -> Block:
    memory.fill(block, record, position, period)
    return memory.bind(block, record, position, frames)


def slot(record: Record, name: str, position: int = 3) -> Slot:
    field = record[name]
    return Slot(field.scalar, field.shape, position + field.offset)


def test_a_record_has_the_period_the_parameters_and_the_states_one_slot_for_each_element() -> None:
    record = Record.of(Mixed(), {"*": (3,)})
    names = "period gain count on mode matrix flags level hits open_ last places"
    assert [field.name for field in record.fields] == names.split()
    ends = [field.offset + int(np.prod(field.shape)) for field in record.fields]
    assert [field.offset for field in record.fields[1:]] == ends[:-1] and record.size == ends[-1]


def test_a_bound_block_begins_with_its_parameters_and_initial_states() -> None:
    _, _, block = bound({"*": (3,)})
    assert (block.period, block.gain, block.count, block.on, block.mode) == (0.25, 2.5, 7, True, 1)
    assert block.path == "file.txt"
    assert block.matrix.tolist() == [[1.0, 2.0], [3.0, 4.0]] and block.flags.tolist() == [True, False, True]
    assert (block.level, block.hits, block.open_) == (0.5, 0, False)
    assert block.last.tolist() == [1.5] * 3 and block.places.tolist() == [0, 0]


def test_scalars_are_plain_python_when_interpreted() -> None:
    _, _, block = bound({"*": ()})
    assert [type(value) for value in (block.gain, block.hits, block.open_, block.last)] == [
        float,
        int,
        bool,
        float,
    ]


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("level", -2.25),
        ("hits", -(2**40)),
        ("open_", True),
        ("last", [1.0, 2.0, 3.0]),
        ("places", [5, -6]),
        ("flags", [False, True, True]),
    ],
)
def test_the_block_and_the_memory_see_the_same_bytes(name: str, value: object) -> None:
    memory, record, block = bound({"*": (3,)})
    setattr(block, name, value)
    assert np.array_equal(memory.read(slot(record, name)), value)
    memory.write(slot(record, name), 0)
    assert not np.any(getattr(block, name))


def test_a_number_given_to_an_array_state_fills_it() -> None:
    _, _, block = bound({"*": (3,)})
    block.last = 4.0
    assert block.last.tolist() == [4.0] * 3


def test_the_numpy_record_has_the_same_layout() -> None:
    memory, record, block = bound({"*": (2,)})
    block.last, block.places, block.hits, block.open_ = [8.0, 9.0], [1, 2], 3, True
    view = np.frombuffer(memory.raw, record.dtype, 1, 3 * SLOT)[0]
    assert view["last"].tolist() == [8.0, 9.0] and view["places"].tolist() == [1, 2]
    assert (view["hits"], view["open_"], view["gain"], view["period"]) == (3, True, 2.5, 0.25)
    assert view["flags"].tolist() == [1, 0, 1]


def test_a_truth_value_fills_its_slot_with_zero_or_one() -> None:
    memory, record, block = bound({"*": ()})
    block.open_ = True
    for name in ("open_", "on", "flags"):
        field = record[name]
        start = (3 + field.offset) * SLOT
        whole = np.frombuffer(memory.raw, np.int64, int(np.prod(field.shape)), start)
        assert np.array_equal(whole, np.ravel(getattr(block, name)).astype(int))


def test_blocks_side_by_side_do_not_touch_each_other() -> None:
    record = Record.of(Mixed(), {"*": (2,)})
    memory = Memory(2 * record.size)
    first, second = (placed(memory, Mixed(), record, k * record.size, 1.0) for k in range(2))
    before = bytes(memory.raw[record.size * SLOT :])
    first.last, first.hits, first.level = [7.0, 7.0], 7, 7.0
    assert bytes(memory.raw[record.size * SLOT :]) == before and second.hits == 0


def test_an_attribute_of_the_author_never_hides_a_state() -> None:
    class Cached(Block, numeric=False):
        last = State("float64[2]")
        seen = State("bool")

        def update(self):
            self._last = "cache"
            self._last_slots = self._seen_rest = "cache"
            self.last = [1.0, 2.0]

    record = Record.of(Cached(), {})
    memory = Memory(record.size)
    block = placed(memory, Cached(), record, 0, 1.0)
    block.update()
    assert block.last.tolist() == [1.0, 2.0] and block._last == "cache"


@pytest.mark.parametrize(
    ("scalar", "shape", "values"),
    [
        ("float64", (), [1.5, -2.0]),
        ("int64", (), [3, -(2**50)]),
        ("bool", (), [True, False]),
        ("float64", (4, 2), [np.arange(8.0).reshape(4, 2), np.ones((4, 2))]),
        ("int64", (3,), [np.array([1, 2, 3]), np.array([0, -1, 5])]),
        ("bool", (2,), [np.array([True, False]), np.array([False, True])]),
        ("frame", (), [Frame(np.ones((2, 2, 3), np.uint8), 0.5, 1), Frame.none()]),
    ],
)
def test_a_call_carries_every_kind_from_slot_to_slot(scalar: str, shape: tuple, values: list) -> None:
    memory = Memory(40, [None, None])
    frame = scalar == "frame"
    source, target = Slot(scalar, shape, 0 if frame else 2), Slot(scalar, shape, 1 if frame else 20)
    call, copy = memory.call(lambda value: value, [source], [target]), memory.copy(source, target)
    for run, value in zip((call, copy), values, strict=True):
        memory.write(source, value)
        run()
        found = memory.read(target)
        assert found is value if frame else np.array_equal(found, value)
        assert frame or type(found) is type(memory.read(source))


def test_a_call_takes_several_arguments_and_gives_several_results() -> None:
    memory = Memory(12)
    a, flag, pair = Slot("float64", (), 1), Slot("bool", (), 2), Slot("float64", (2,), 3)
    total, positive, doubled = Slot("float64", (), 6), Slot("bool", (), 7), Slot("float64", (2,), 8)
    memory.write(a, 0.5)
    memory.write(flag, True)
    memory.write(pair, [1.0, 2.0])
    memory.call(
        lambda x, up, v: (x + v.sum(), up and x > 0, 2 * v), [a, flag, pair], [total, positive, doubled]
    )()
    assert memory.read(total) == 3.5 and memory.read(positive) is True
    assert memory.read(doubled).tolist() == [2.0, 4.0]


def test_an_array_argument_cannot_be_written_to() -> None:
    memory = Memory(8)

    def scale(u):
        u *= 2.0
        return u

    call = memory.call(scale, [Slot("float64", (3,), 1)], [Slot("float64", (3,), 4)])
    memory.floats[1:4] = 3.0
    with pytest.raises(ValueError):
        call()
    assert (memory.floats[1:4] == 3.0).all()


@pytest.mark.parametrize("result", [np.zeros(4), (1.0, 2.0)])
def test_a_result_of_another_shape_is_an_error(result: object) -> None:
    memory = Memory(8)
    with pytest.raises(ValueError):
        memory.call(lambda: result, [], [Slot("float64", (3,), 1)])()


@pytest.mark.parametrize("result", [None, "1", 1j])
def test_a_result_that_is_no_number_is_an_error(result: object) -> None:
    memory = Memory(2)
    with pytest.raises(TypeError):
        memory.call(lambda: result, [], [Slot("float64", (), 1)])()


def test_what_is_read_is_a_copy_and_a_view_is_not() -> None:
    memory = Memory(4)
    place = Slot("float64", (2,), 1)
    read, view = memory.read(place), memory.view(place)
    memory.write(place, [5.0, 6.0])
    assert read.tolist() == [0.0, 0.0] and view.tolist() == [5.0, 6.0]


class Keeper(Block, numeric=False):
    """A block that keeps the two frames before."""

    frame = In("frame")
    older = Out("frame")
    one = State("frame")
    two = State("frame")

    def output(self):
        return self.two

    def update(self, frame):
        self.one, self.two = frame, self.one


def test_a_frame_that_is_a_state_lives_in_memory_beside_the_frames_of_ports() -> None:
    block = Keeper()
    record = Record.of(block, {})
    memory = Memory(record.size, [Frame.none()] * 5)
    places = [
        {name: Slot("frame", (), first + k) for k, name in enumerate(("one", "two"))} for first in (1, 3)
    ]
    first, second = (placed(memory, block, record, 0, 0.1, **each) for each in places)
    frame = Frame(np.zeros((2, 2, 3), np.uint8), 0.0, 1)
    assert [field.name for field in record.fields] == ["period"] and len(memory.frames) == 5
    assert first.one.sequence == 0
    first.one = frame
    assert first.one is frame and memory.frames[1] is frame and second.one.sequence == 0


def test_a_frame_that_is_a_state_comes_back_with_a_snapshot() -> None:
    frames = [Frame(np.full((2, 2, 3), k, np.uint8), 0.1 * k, k + 1) for k in range(6)]
    assert [frame.sequence for frame in drive(Keeper(), frame=frames, rate="10 Hz").older] == [
        0,
        0,
        1,
        2,
        3,
        4,
    ]
    engine = drive(Keeper(), frame=frames, rate="10 Hz").engine
    snapshot = engine.snapshot()
    block = engine.bound("block")
    block.two = frames[0]
    engine.restore(snapshot)
    assert block.two is frames[4] and block.one is frames[5]


class Ring(Block, numeric=False):
    """A block that keeps the four frames before."""

    frame = In("frame")
    older = Out("frame")
    first = State("frame")
    ring = State("frame[4]")
    count = State("int64")

    def output(self):
        return self.ring[self.count % 4]

    def update(self, frame):
        if self.count == 0:
            self.first = frame
        self.ring[self.count % 4] = frame
        self.count += 1


def numbered(count: int) -> list[Frame]:
    return [Frame(np.full((2, 2, 3), k, np.uint8), 0.1 * k, k + 1) for k in range(count)]


def test_a_state_holds_several_frames() -> None:
    driven = drive(Ring(), frame=numbered(7), rate="10 Hz")
    assert [frame.sequence for frame in driven.older] == [0, 0, 0, 0, 1, 2, 3]
    engine = driven.engine
    assert [frame.sequence for frame in engine.read("block", "ring")] == [5, 6, 7, 4]
    assert engine.read("block", "first").sequence == 1
    block = engine.bound("block")
    assert len(block.ring) == 4 and block.ring[-1].sequence == 4
    assert [frame.sequence for frame in block.ring[1:3]] == [6, 7]


def test_several_frames_come_back_with_a_snapshot() -> None:
    engine = drive(Ring(), frame=numbered(7), rate="10 Hz").engine
    snapshot, before = engine.snapshot(), engine.read("block", "ring")
    block = engine.bound("block")
    block.ring[2] = Frame.none()
    assert before[2].sequence == 7 and engine.read("block", "ring")[2].sequence == 0
    engine.restore(snapshot)
    assert all(one is other for one, other in zip(block.ring, before, strict=True))


def test_a_state_of_several_frames_is_replaced_as_a_whole_or_not_at_all() -> None:
    engine = drive(Ring(), frame=numbered(7), rate="10 Hz").engine
    block, first = engine.bound("block"), engine.read("block", "first")
    block.ring = reversed(block.ring)
    assert [frame.sequence for frame in block.ring] == [4, 7, 6, 5] and block.first is first
    with pytest.raises(ValueError, match="3 frames for a state that holds 4"):
        block.ring = numbered(3)
    with pytest.raises(IndexError):
        block.ring[4] = first
    assert [frame.sequence for frame in block.ring] == [4, 7, 6, 5]
    engine.memory.write(engine.program["block"].field("ring"), numbered(4))
    assert [frame.sequence for frame in block.ring] == [1, 2, 3, 4]


def test_a_numeric_block_may_not_keep_a_frame() -> None:
    with pytest.raises(TypeError, match="Wrong keeps a frame as a state"):
        type("Wrong", (Block,), {"one": State("frame")})
    with pytest.raises(TypeError, match="Wrong keeps a frame as a state"):
        type("Wrong", (Block,), {"ring": State("frame[2]")})


class Twice(Block):
    u = In("float64[2]")
    y = Out("float64[2]")
    last = State("float64[2]")
    sum = Work("float64[2]")
    hit = Work("bool")

    def output(self, u):
        self.sum = self.last + u
        self.hit = u[0] > 1.0
        return self.sum

    def update(self):
        if self.hit:
            self.last = self.sum


def test_work_goes_from_output_to_update_of_a_tick_and_is_no_part_of_a_snapshot() -> None:
    driven = drive(Twice(), u=[[2.0, 1.0], [0.5, 0.0], [3.0, 1.0]], rate="10 Hz")
    assert driven.y.tolist() == [[2.0, 1.0], [2.5, 1.0], [5.0, 2.0]]
    engine = driven.engine
    record = engine.program["block"].record
    assert record.size - record.kept == 3 and record["sum"].offset == record.kept
    assert engine.read("block", "sum").tolist() == [5.0, 2.0] and engine.bound("block").hit
    engine.restore(engine.snapshot())
    left = {name: np.asarray(engine.read("block", name)).tolist() for name in ("last", "sum", "hit")}
    assert left == {"last": [5.0, 2.0], "sum": [0.0, 0.0], "hit": False}


@pytest.mark.parametrize(
    ("members", "sentence"),
    [
        ({"held": Work("frame")}, "keep it in an attribute"),
        ({"held": Work(), "update": lambda self: None}, "goes from output to update, but has not both"),
    ],
)  # fmt: skip
def test_work_that_cannot_be_is_refused(members: dict[str, object], sentence: str) -> None:
    with pytest.raises(TypeError, match=sentence):
        type("Wrong", (Block,), members)
