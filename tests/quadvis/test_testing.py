from fractions import Fraction

import numpy as np
import pytest

from quadvis.block import Block, Frame, In, Out, Param, Random, State, uniform
from quadvis.errors import QuadvisError
from quadvis.native.executor import NativeExecutor
from quadvis.testing import drive


class Sum(Block):
    u = In("float64[*]")
    v = In("float64[*]", default=0.0)
    total = Out("float64[*]")
    count = Out("int64")
    odd = Out("bool")
    steps = State("int64")

    def output(self, u, v):
        return u + v, self.steps, self.steps % 2 == 1

    def update(self):
        self.steps += 1


class Norm(Block):
    vector = In("float64[n]")
    weights = Param((1.0, 1.0), type="float64[n]")
    y = Out()

    def output(self, vector):
        return float((self.weights * vector * vector).sum())


class Integral(Block):
    u = In()
    y = Out()
    x = State(continuous=True)

    def output(self):
        return self.x

    def deriv(self, u):
        return u


class Numbered(Block, numeric=False):
    frame = In("frame")
    out = Out("frame")
    number = Out("int64")

    def output(self, frame):
        return frame, frame.sequence


def test_outputs_have_a_leading_time_axis_and_their_kinds() -> None:
    driven = drive(Sum(), u=[1, 2, 3], v=[0.5, 0.5, 0.5])
    assert driven.total.tolist() == [1.5, 2.5, 3.5] and driven.count.tolist() == [0, 1, 2]
    assert driven.odd.tolist() == [False, True, False]
    assert (driven.total.dtype, driven.count.dtype, driven.odd.dtype) == (np.float64, np.int64, np.bool_)


def test_one_value_is_constant_and_optional_inputs_have_their_default() -> None:
    assert drive(Sum(), u=2.0, steps=3).total.tolist() == [2.0] * 3
    assert drive(Sum(), u=[[1.0, 2.0], [3.0, 4.0]], v=1.0).total.tolist() == [[2.0, 3.0], [4.0, 5.0]]


def test_a_vector_that_fits_the_port_is_one_value() -> None:
    assert drive(Norm(), vector=[3.0, 4.0], steps=2).y.tolist() == [25.0, 25.0]
    assert drive(Norm(weights=(1.0, 1.0, 1.0)), vector=[[1.0, 1.0, 1.0], [2.0, 0.0, 0.0]]).y.tolist() == [
        3.0,
        4.0,
    ]


def test_steps_may_be_fewer_than_the_samples() -> None:
    assert drive(Sum(), u=[1.0, 2.0, 3.0], steps=2).total.tolist() == [1.0, 2.0]


@pytest.mark.parametrize(("rate", "period"), [("10 Hz", 0.1), ("5 ms", 0.005), (20, 0.05), (0.1, 10.0)])
def test_the_rate_is_a_rate_a_period_or_a_number_of_hertz(rate: object, period: float) -> None:
    driven = drive(Sum(), u=1.0, steps=4, rate=rate)
    assert driven.time == pytest.approx([k * period for k in range(4)])
    assert driven.engine.period == Fraction(str(period))


def test_continuous_states_are_integrated_with_the_input_held() -> None:
    assert drive(Integral(), u=[1.0, 2.0, 0.0], rate="10 Hz").y == pytest.approx([0.0, 0.1, 0.3])
    assert drive(Integral(), u=1.0, steps=11, rate="10 Hz", solver="ode1").y[-1] == pytest.approx(1.0)


def test_frames_are_given_and_come_back_as_lists() -> None:
    frames = [Frame(np.zeros((2, 2, 3), np.uint8), 0.1 * k, k + 1) for k in range(3)]
    driven = drive(Numbered(), frame=frames)
    assert driven.out == frames and driven.number.tolist() == [1, 2, 3]
    assert drive(Numbered(), frame=frames[0], steps=2).number.tolist() == [1, 1]


@pytest.mark.parametrize(
    ("block", "inputs"), [(Sum, {"u": [1.0, 2.0, 4.0]}), (Integral, {"u": [1.0, 0.5, 0.25]})]
)
def test_machine_code_gives_the_same_bits(
    block: type[Block], inputs: dict[str, list[float]], monkeypatch: pytest.MonkeyPatch
) -> None:
    until: list[int] = []
    run = NativeExecutor.run
    monkeypatch.setattr(NativeExecutor, "run", lambda self, tick: until.append(tick) or run(self, tick))
    interpreted = drive(block(), rate="10 Hz", **inputs)
    compiled = drive(block(), rate="10 Hz", engine="native", **inputs)
    assert until == [1, 2, 3]
    for name, values in interpreted.signals.items():
        assert compiled.signals[name].tobytes() == values.tobytes()


def test_an_unknown_engine_is_refused() -> None:
    with pytest.raises(QuadvisError, match="there is no engine 'nativ'; did you mean 'native'"):
        drive(Sum(), u=[1.0], engine="nativ")


def test_the_last_states_can_be_read() -> None:
    assert drive(Sum(), u=[1.0] * 5).state("steps") == 5


def test_the_seed_decides_random_numbers() -> None:
    class Noise(Block):
        y = Out()
        stream = Random()

        def output(self):
            return self.stream[0] / 2**32

        def update(self):
            uniform(self.stream)

    first, again, other = (drive(Noise(), steps=4, seed=seed).y.tolist() for seed in (1, 1, 2))
    assert first == again != other


@pytest.mark.parametrize(
    ("inputs", "sentence"),
    [
        ({"w": 1.0, "steps": 1}, "Sum has no input 'w'; it has u, v"),
        ({"steps": 1}, "Sum needs its input 'u'"),
        ({"u": 1.0}, "inputs must have one length, or give steps"),
        ({"u": [1.0], "v": [1.0, 2.0]}, "inputs must have one length, or give steps"),
        ({"u": []}, "inputs must have at least one sample"),
        (
            {"u": [1.0, 2.0], "steps": 3},
            "inputs must have at least one sample, and one for each of the steps",
        ),
        (
            {"u": [[1.0, 2.0]], "v": [[1.0, 2.0, 3.0]]},
            r"input 'v' has shape \(1, 3\), the block wants float64\[\*\]",
        ),
    ],
)
def test_inputs_that_do_not_fit_are_refused(inputs: dict, sentence: str) -> None:
    with pytest.raises(TypeError, match=sentence):
        drive(Sum(), **inputs)


def test_an_output_that_is_not_there_is_reported() -> None:
    with pytest.raises(AttributeError, match="the block has no output 'sum'"):
        _ = drive(Sum(), u=1.0, steps=1).sum
