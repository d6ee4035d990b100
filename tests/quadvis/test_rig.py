from fractions import Fraction

import numpy as np

from quadvis.block import Block, In, Out, Param, ParameterError, State, parameter_sizes
from quadvis.testing.alone import alone
from quadvis.testing.rig import STEPS, VECTOR, Rig, Subject, rigs


class Blend(Block):
    """A block with a free shape, choices, a switch and bounds."""

    u = In("float64[*]", doc="in")
    count = In("int64", doc="count")
    y = Out("float64[*]", doc="out")
    share = Param(0.5, min=0.4, max=0.6, doc="share")
    offset = Param(0.0, type="float64[*]", doc="offset")
    mode = Param("plain", choices=("plain", "other", "never"), doc="mode")
    on = Param(True, type="bool", doc="on")
    last = State("float64[*]")

    def check(self):
        if self.mode == 2:
            raise ParameterError("mode", "mode must not be never")

    def output(self, u):
        return self.share * u + self.offset if self.on else 0.0 * self.last

    def update(self, u, count):
        self.last = u + count


class Table(Block):
    values = Param(type="float64[k,n]", doc="rows")
    x = In("float64[m]", doc="in")
    y = Out("float64[n]", doc="out")

    def output(self, x):
        return self.values[0] + x.sum()


def parameters(rig: Rig) -> tuple:
    block = rig.block
    return float(block.share), int(block.mode), bool(block.on)


def test_a_block_runs_alone_on_the_inputs_that_are_written() -> None:
    engine = alone(Blend(), {"u": 4.0, "count": 1}, {"*": ()}, Fraction(1, 10))
    with engine:
        engine.run(1)
        assert engine.read("block", "y") == 2.0
        engine.write("block", "u", 6.0)
        engine.run(1)
        assert engine.read("block", "y") == 3.0 and engine.time == 0.2


def test_parameters_fix_the_sizes_that_they_share_with_ports() -> None:
    assert parameter_sizes(Table(values=[[1.0, 2.0, 3.0]])) == {"k": 1, "n": 3}


def test_there_is_a_rig_for_each_shape_choice_and_switch_and_one_with_other_numbers() -> None:
    found = list(rigs(Subject(Blend)))
    assert [rig.placed.inputs["u"].shape for rig in found] == [()] * 4 + [(VECTOR,)] * 4
    plain, other, off, shaken = map(parameters, found[:4])
    assert (plain, other, off) == ((0.5, 0, True), (0.5, 1, True), (0.5, 0, False))
    assert shaken[0] != 0.5 and 0.4 <= shaken[0] <= 0.6


def test_what_is_given_stays_as_it_is() -> None:
    found = list(rigs(Subject(Blend, given={"share": 0.45, "mode": "other"}, inputs={"u": [1.0, 2.0]})))
    assert {parameters(rig)[:2] for rig in found} == {(0.45, 1)}
    assert [row["u"] for row in found[0].series] == [1.0, 2.0] * (STEPS // 2)


def test_sizes_that_nothing_fixes_are_those_of_a_short_vector() -> None:
    (rig,) = rigs(Subject(Table, given={"values": [[1.0, 2.0]]}))
    assert rig.placed.inputs["x"].shape == (VECTOR,) and rig.placed.outputs["y"].shape == (2,)


def test_the_same_subject_has_the_same_inputs_every_time() -> None:
    first, again = (next(iter(rigs(Subject(Blend)))).series for _ in range(2))
    assert [row["u"].tolist() for row in first] == [row["u"].tolist() for row in again]
    assert all(np.isfinite(row["u"]).all() for row in first)


def test_values_are_missing_only_if_they_are_to_be() -> None:
    found = [np.isnan(row["u"]).any() for rig in rigs(Subject(Blend), missing=True) for row in rig.series]
    assert any(found) and not all(found)
