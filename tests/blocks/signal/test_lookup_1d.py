"""Tests of the block signal.lookup_1d."""

from pathlib import Path

import numpy as np
import pytest

from quadvis.api import load_text
from quadvis.block import ParameterError
from quadvis.errors import RunError
from quadvis.testing import drive
from quadvis_blocks.signal.lookup_1d import Lookup1d

BREAKPOINTS, VALUES = [0, 1, 2.5, 4, 4.5], [1, 3, 2, 2, -1]
U = [-1, 0, 0.25, 1, 2, 2.5, 3.3, 4, 4.4, 4.5, 6]
HELD = [1.0, 1.0, 1.5, 3.0, 2.3333333333333335, 2.0, 2.0, 2.0, -0.4, -1.0, -1.0]
GOES_ON = [-1.0, 1.0, 1.5, 3.0, 2.3333333333333335, 2.0, 2.0, 2.0, -0.4, -1.0, -10.0]
FLAT = [1, 1, 1, 3, 3, 2, 2, 2, 2, -1, -1]
LOAD = """quadvis: 1
name: table
rates: {fast: 10 Hz}
stop_time: 1 s
blocks:
  u: {block: sources.ramp, rate: fast, with: {slope: 10 m/s}}
  y:
    block: signal.lookup_1d
    rate: fast
    with: {breakpoints: {value: [0, 5], unit: m}, values: {value: [0, 1], unit: N}, outside: refuse}
    in: {u: u.y}
"""


def table(**given: object) -> Lookup1d:
    return Lookup1d(breakpoints=BREAKPOINTS, values=VALUES, **given)


@pytest.mark.parametrize(
    ("given", "wanted"),
    [({}, HELD), ({"outside": "linear"}, GOES_ON), ({"interpolation": "hold"}, FLAT)],
)
def test_the_value_between_and_outside_the_breakpoints(given: dict[str, str], wanted: list[float]) -> None:
    assert drive(table(**given), u=U).y == pytest.approx(wanted, abs=1e-12)
    assert drive(table(**given), u=[U]).y[0] == pytest.approx(wanted, abs=1e-12)


def test_it_is_numpy_s_interpolation() -> None:
    rng = np.random.default_rng(1)
    breakpoints, values = np.sort(rng.normal(size=30)), rng.normal(size=30)
    u = rng.normal(size=500)
    found = drive(Lookup1d(breakpoints=breakpoints, values=values), u=u).y
    assert found == pytest.approx(np.interp(u, breakpoints, values), abs=1e-12)


def test_at_every_breakpoint_it_is_the_value_of_the_table_to_the_bit() -> None:
    rng = np.random.default_rng(2)
    breakpoints, values = np.sort(rng.normal(size=50)), rng.normal(size=50) * 1e3
    for given in ({}, {"outside": "linear"}, {"outside": "refuse"}, {"interpolation": "hold"}):
        block = Lookup1d(breakpoints=breakpoints, values=values, **given)
        assert np.array_equal(drive(block, u=breakpoints).y, values)


def test_an_input_outside_may_end_the_run_with_block_time_and_value() -> None:
    with pytest.raises(RunError, match=r"block 'y'.*t = 0\.6 s.*outside the table \(u = 6\)"):
        load_text(LOAD, Path.cwd()).run()
    assert load_text(LOAD, Path.cwd(), "table.yaml").graph["y"].unit("y") == "N"


def test_what_is_missing_is_missing_in_every_method() -> None:
    for given in ({}, {"outside": "linear"}, {"outside": "refuse"}, {"interpolation": "hold"}):
        block = table(**given)
        assert np.isnan(type(block).output(block, float("nan")))


@pytest.mark.parametrize(
    ("given", "problem"),
    [
        ({"breakpoints": [0, 2, 2], "values": [0, 1, 2]}, r"breakpoints must rise; \[2\] is 2, after 2"),
        ({"breakpoints": [0, 2, 1], "values": [0, 1, 2]}, r"breakpoints must rise; \[2\] is 1, after 2"),
        ({"breakpoints": [0], "values": [0]}, "breakpoints must be 2 at least, got 1"),
        ({"breakpoints": [0, 1], "values": [0, np.nan]}, "values must be"),
        ({"breakpoints": [0, 1], "values": [0, np.inf]}, "values must be finite"),
    ],
)  # fmt: skip
def test_a_table_that_says_nothing_sure_is_refused(given: dict[str, object], problem: str) -> None:
    with pytest.raises(ParameterError, match=problem):
        Lookup1d(**given)


def test_steps_have_no_slope_to_go_on_with() -> None:
    with pytest.raises(
        ParameterError, match="outside must be hold or refuse where the table holds its values"
    ):
        table(interpolation="hold", outside="linear")
