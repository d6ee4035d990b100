import enum
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.block import (
    Block,
    Frame,
    In,
    Out,
    Param,
    ParameterError,
    Random,
    Safe,
    SignalType,
    State,
    Work,
    units_of,
)
from quadvis.diagram.settings import setting_texts


class Filter(Block):
    """A block with one of everything."""

    u = In("float64[n]", unit="a", doc="in")
    trust = In(default=1.0, doc="share")
    y = Out("float64[n]", unit="a", doc="out")
    good = Out("bool", doc="good")
    gain = Param(2.0, unit="rad/s", above=0.0, max=10.0, tune=True, doc="gain")
    mode = Param("fast", choices=("fast", "slow"), doc="mode")
    count = Param(3, type="int64", min=1, doc="count")
    weights = Param((1.0, 2.0), type="float64[2]", unit="m", min=0.0, doc="weights")
    label = Param("x", type="str", doc="label")
    last = State("float64[n]")
    level = State(unit="m", continuous=True)

    def output(self, u, time):
        return u, time > 1.0

    def update(self, u, trust):
        self.last = trust * u

    def deriv(self):
        return 1.0


@pytest.mark.parametrize(
    ("text", "scalar", "shape"),
    [
        ("float64", "float64", ()),
        ("int64[3]", "int64", (3,)),
        ("float64[4,2]", "float64", (4, 2)),
        ("float64[4, n]", "float64", (4, "n")),
        ("bool[*]", "bool", ("*",)),
        ("frame", "frame", ()),
        ("frame[16]", "frame", (16,)),
    ],
)
def test_a_type_is_a_scalar_kind_and_a_shape(text: str, scalar: str, shape: tuple) -> None:
    signal = SignalType.parse(text)
    assert (signal.scalar, signal.shape) == (scalar, shape)
    assert str(signal) == text.replace(" ", "")


@pytest.mark.parametrize(
    "text",
    [
        "",
        "float",
        "float32",
        "double[2]",
        "float64[",
        "float64[]",
        "float64[0]",
        "float64[-1]",
        "float64[*,3]",
        "frame[0]",
        "frame[n]",
        "frame[4,4]",
    ],
)
def test_what_is_not_a_type_is_refused(text: str) -> None:
    with pytest.raises(TypeError, match="is not a signal type; write float64, int64 or bool"):
        SignalType.parse(text)


@given(
    st.lists(st.sampled_from(["n", "m", 2, 5]), max_size=3),
    st.dictionaries(st.sampled_from("nm"), st.integers(1, 9)),
)
def test_a_shape_that_fits_fixes_the_sizes_that_give_it_back(pattern: list, sizes: dict) -> None:
    signal = SignalType("float64", tuple(pattern))
    shape = signal.resolve(sizes)
    found: dict = {}
    assert signal.unify(shape, found) and signal.resolve(found) == shape


@pytest.mark.parametrize(
    ("text", "shape"),
    [
        ("float64", (1,)),
        ("float64[3]", ()),
        ("float64[3]", (4,)),
        ("float64[n,n]", (2, 3)),
        ("float64[n]", (2, 2)),
    ],
)
def test_a_shape_that_does_not_fit_is_told(text: str, shape: tuple) -> None:
    assert not SignalType.parse(text).unify(shape, {})


def test_sizes_that_nothing_fixes_are_one_and_a_free_shape_is_a_scalar() -> None:
    assert SignalType.parse("float64[n,3]").resolve({}) == (1, 3)
    assert SignalType.parse("float64[*]").resolve({}) == ()


def test_the_interface_holds_what_the_class_declares() -> None:
    interface = Filter.interface
    assert list(interface.inputs) == ["u", "trust"] and list(interface.outputs) == ["y", "good"]
    assert list(interface.params) == ["gain", "mode", "count", "weights", "label"]
    assert [state.name for state in interface.continuous] == ["level"]
    assert interface.arguments == {"output": ("u", "time"), "update": ("u", "trust"), "deriv": ()}


def test_direct_feedthrough_is_what_output_asks_for() -> None:
    assert Filter.interface.feedthrough == {"u"}


def test_a_block_inherits_ports_and_methods() -> None:
    class Wider(Filter):
        extra = In(doc="more")

        def output(self, u, extra):
            return u, extra > 0.0

    assert list(Wider.interface.inputs) == ["u", "trust", "extra"]
    assert Wider.interface.feedthrough == {"u", "extra"} and Wider.interface.arguments["update"] == (
        "u",
        "trust",
    )
    assert Filter.interface.feedthrough == {"u"}


def test_a_method_may_not_ask_for_what_is_no_input() -> None:
    with pytest.raises(TypeError, match=r"Slip\.output asks for 'sped', .* did you mean 'speed'\?"):

        class Slip(Block):
            speed = In()
            y = Out()

            def output(self, sped):
                return sped


def test_start_sees_no_inputs() -> None:
    with pytest.raises(TypeError, match="start asks for 'u'"):

        class Eager(Block):
            u = In()

            def start(self, u):
                pass


@pytest.mark.parametrize("name", ["time", "period", "output", "open"])
def test_names_of_the_contract_are_reserved(name: str) -> None:
    with pytest.raises(TypeError, match=f"'{name}' is reserved"):
        type("Taken", (Block,), {name: In()})


def test_continuous_states_and_deriv_go_together() -> None:
    with pytest.raises(TypeError, match="go together"):
        type("Idle", (Block,), {"x": State(continuous=True)})
    with pytest.raises(TypeError, match="go together"):
        type("Lost", (Block,), {"x": State(), "deriv": lambda self: 0.0})


def test_outputs_need_an_output_method() -> None:
    with pytest.raises(TypeError, match="no output method"):
        type("Mute", (Block,), {"y": Out()})


def test_parameters_come_as_the_methods_see_them() -> None:
    block = Filter(mode="slow", weights=[3, 4], count=2.0)
    assert block.mode == 1 and type(block.mode) is int
    assert block.gain == 2.0 and type(block.gain) is float
    assert block.count == 2 and type(block.count) is int
    assert block.weights.dtype == np.float64 and block.weights.tolist() == [3.0, 4.0]
    assert block.label == "x"


@pytest.mark.parametrize(
    ("parameters", "sentence"),
    [
        ({"gain": 0.0}, "gain must be above 0 rad/s, got 0 rad/s"),
        ({"gain": 10.5}, "gain must be at most 10 rad/s, got 10.5 rad/s"),
        ({"gain": math.nan}, "gain must be a number in rad/s, got nan"),
        ({"gain": "2"}, "gain must be a number in rad/s, got '2'"),
        ({"gain": [1.0, 2.0]}, "gain must be a number in rad/s, got 2 values"),
        ({"gain": {}}, "gain must be a number in rad/s, got {}"),
        ({"mode": "quick"}, "mode must be one of fast, slow, got 'quick'; choose from 'fast', 'slow'"),
        ({"mode": "slwo"}, "mode must be one of fast, slow, got 'slwo'; did you mean 'slow'?"),
        ({"mode": 1}, "mode must be one of fast, slow, got 1; choose from 'fast', 'slow'"),
        ({"count": 2.5}, "count must be a whole number, got 2.5"),
        ({"count": math.inf}, "count must be a whole number, got inf"),
        ({"count": 1e300}, "count must be a whole number, got 1e+300"),
        ({"count": 0}, "count must be at least 1, got 0"),
        ({"weights": [1.0]}, "weights must be 2 values, numbers in m, got 1 values"),
        ({"weights": [1.0, -2.0]}, "weights must be at least 0 m, got -2 m"),
        ({"weights": [[1.0], [1.0, 2.0]]}, "weights must be 2 values, numbers in m, got [[1.0], [1.0, 2.0]]"),
        ({"weights": ["1", "2"]}, "weights must be 2 values, numbers in m, got ['1', '2']"),
        ({"label": 3}, "label must be a text, got 3"),
        ({"gian": 1.0}, "Filter has no parameter 'gian'; did you mean 'gain'?"),
    ],
)
def test_a_bad_parameter_gets_one_clear_sentence(parameters: dict, sentence: str) -> None:
    with pytest.raises(ParameterError) as caught:
        Filter(**parameters)
    assert str(caught.value) == sentence
    assert caught.value.parameter == next(iter(parameters))


def test_a_truth_value_is_neither_a_number_nor_a_text() -> None:
    class Switch(Block):
        on = Param(False, type="bool", doc="on")

    assert Switch(on=True).on is True and Switch(on=np.True_).on is True
    for wrong in (2, 0.5, "yes"):
        with pytest.raises(ParameterError, match="on must be true or false"):
            Switch(on=wrong)


def test_a_parameter_without_default_must_be_given() -> None:
    class Needy(Block):
        path = Param(type="file", doc="path")

    assert Needy.interface.params["path"].required
    with pytest.raises(ParameterError, match="parameter 'path' is missing; give a path"):
        Needy()


def test_check_sees_the_parameters_and_may_refuse_them() -> None:
    class Window(Block):
        low = Param(0.0)
        high = Param(1.0)

        def check(self):
            if self.low > self.high:
                raise ParameterError("low", f"low must be at most high, {self.high:g}, got {self.low:g}")

    assert Window(high=3.0).high == 3.0
    with pytest.raises(ParameterError, match="low must be at most high, 1, got 2"):
        Window(low=2.0)


def test_a_state_has_no_value_before_the_block_runs() -> None:
    with pytest.raises(AttributeError, match=r"Filter\.last has no value before the block runs"):
        _ = Filter().last


def test_blocks_are_numeric_unless_they_say_otherwise() -> None:
    class Camera(Block, numeric=False):
        pass

    class Small(Camera):
        pass

    assert Filter.numeric and not Camera.numeric and not Small.numeric


def test_a_random_stream_is_six_whole_numbers() -> None:
    assert str(Random().signal) == "int64[6]"


def test_the_frame_that_is_none_has_no_pixels_and_number_zero() -> None:
    frame = Frame.none()
    assert frame.pixels.shape == (0, 0, 3) and math.isnan(frame.stamp) and frame.sequence == 0


def test_one_unit_holds_for_all_elements() -> None:
    assert [str(unit) for unit in units_of(In("float64[3]", unit="m"), 3)] == ["m"] * 3
    assert [str(unit) for unit in units_of(In("float64[2]", unit="m rad"), 2)] == ["m", "rad"]


def test_a_safe_value_takes_type_and_unit_of_the_input_that_it_stands_for() -> None:
    written: list[object] = []

    class Rotors(Block, numeric=False):
        thrust = In("float64[2]", unit="N")
        idle = Safe("thrust", doc="thrust when the run ends")

        def write(self, thrust, time):
            written.append((thrust, time))

    assert Rotors.interface.safe == {"thrust": Rotors.idle} and Rotors.interface.params["idle"].required
    with pytest.raises(ParameterError, match="idle must be 2 values, numbers in N, got one value"):
        Rotors(idle=0.0)
    Rotors(idle=[0.1, 0.2]).write_safe(4.5)
    ((values, time),) = written
    assert values.tolist() == [0.1, 0.2] and time == 4.5


def test_what_writes_needs_safe_values_unless_it_is_harmless() -> None:
    def write(self, u):
        raise AssertionError("nothing is safe to write")

    with pytest.raises(
        TypeError, match=r"write has no safe value for 'u'; declare safe_u = Safe\('u'\), or say in"
    ):
        type("Wrong", (Block,), {"u": In(), "write": write, "numeric": False})
    with pytest.raises(TypeError, match="rest stands for 'v', which is no input of its write method"):
        type("Wrong", (Block,), {"u": In(), "v": In(), "rest": Safe("v"), "write": write, "numeric": False})
    members = {"u": In("frame"), "write": write, "numeric": False, "harmless": "a file moves nothing"}
    type("Right", (Block,), members)().write_safe(0.0)


def test_what_reads_or_writes_outside_is_not_numeric_and_reads_before_there_are_inputs() -> None:
    with pytest.raises(
        TypeError, match="reads or writes outside, which no compiled method can; say numeric=False"
    ):
        type("Wrong", (Block,), {"read": lambda self: None})
    with pytest.raises(TypeError, match="read asks for 'u', which is not one of its inputs"):
        type("Wrong", (Block,), {"u": In(), "read": lambda self, u: None, "numeric": False})


@pytest.mark.parametrize("kind", [In, Out, Work])
def test_only_a_state_holds_several_frames(kind: type) -> None:
    assert State("frame[2]").signal.shape == (2,)
    with pytest.raises(
        TypeError, match=rf"{kind.__name__} cannot be 'frame\[2\]': only a state .*; write frame"
    ):
        kind("frame[2]")


class Colour(enum.Enum):
    """Choices from Python."""

    RED = "r"
    GREEN = "g"


class Lamp(Block):
    """A block with an enumeration of Python."""

    colour = Param(Colour.GREEN, choices=Colour, doc="colour")


def test_an_enumeration_gives_the_choices():
    assert Lamp.interface.params["colour"].choices == ("RED", "GREEN")
    assert [Lamp().colour, Lamp(colour="RED").colour, Lamp(colour=Colour.GREEN).colour] == [1, 0, 1]
    with pytest.raises(
        ParameterError, match="colour must be one of RED, GREEN, got 'RAD'; did you mean 'RED'"
    ):
        Lamp(colour="RAD")
    assert setting_texts({"lamp.colour": Colour.RED}) == ("lamp.colour=RED",)
