"""Tests of the block math.function."""

from pathlib import Path

import numpy as np
import pytest

from quadvis.api import load_text
from quadvis.errors import RunError
from quadvis.testing import drive
from quadvis_blocks.math.function import FUNCTIONS, Function

X = np.array([-2.5, -1.0, -0.5, -0.1, 0.0, 0.1, 0.49999999999999994, 0.5, 1.0, 1.5, 2.5])
ALL = {
    "sin": np.sin, "cos": np.cos, "tan": np.tan, "atan": np.arctan, "sinh": np.sinh, "cosh": np.cosh,
    "tanh": np.tanh, "exp": np.exp, "abs": np.abs, "sign": np.sign, "square": np.square, "floor": np.floor,
    "ceil": np.ceil, "fix": np.trunc, "round": lambda x: np.trunc(x) + np.sign(x) * (np.abs(x) % 1 >= 0.5),
}  # fmt: skip
SOME = {
    "asin": (np.arcsin, np.abs(X) <= 1), "acos": (np.arccos, np.abs(X) <= 1), "log": (np.log, X > 0),
    "log10": (np.log10, X > 0), "sqrt": (np.sqrt, X >= 0), "reciprocal": (np.reciprocal, X != 0),
}  # fmt: skip
LOAD = """quadvis: 1
name: function
rates: {fast: 10 Hz}
stop_time: 0.1 s
blocks:
  x: {block: sources.constant, rate: fast, with: {value: VALUE}}
  y: {block: math.function, rate: fast, with: {function: NAME}, in: {u: x.y}}
"""


def test_every_function_is_compared_with_numpy_s() -> None:
    assert {*ALL, *SOME} == {*FUNCTIONS}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_it_is_numpy_s_function_for_scalars_and_arrays(name: str) -> None:
    function, mask = SOME.get(name) or (ALL[name], np.ones(len(X), bool))
    x = X[mask]
    wanted = pytest.approx(function(x), rel=1e-12, abs=1e-15)
    assert drive(Function(function=name), u=x).y == wanted
    assert drive(Function(function=name), u=x.reshape(1, -1)).y[0] == wanted


@pytest.mark.parametrize(
    ("name", "value", "unit"),
    [
        ("sin", "30 deg", "1"), ("acos", "0.5", "rad"), ("abs", "-2 m", "m"), ("sign", "-2 m", "1"),
        ("square", "2 m", "m^2"), ("sqrt", "4 m^2", "m"), ("sqrt", "4 m", "m^(1/2)"),
        ("reciprocal", "4 s", "1/s"), ("round", "2.5 m", "m"), ("exp", "1", "1"),
    ],
)  # fmt: skip
def test_the_unit_follows_from_the_function(name: str, value: str, unit: str) -> None:
    text = LOAD.replace("VALUE", value).replace("NAME", name)
    assert load_text(text, Path.cwd()).graph["y"].unit("y") == unit


def test_a_plain_number_is_no_angle() -> None:
    with pytest.raises(Exception, match=r"input 'u' takes rad, 'x\.y' has no unit"):
        load_text(LOAD.replace("VALUE", "1").replace("NAME", "sin"), Path.cwd())


@pytest.mark.parametrize(("name", "value"), [("sqrt", "-1"), ("log", "0"), ("asin", "1.5"), ("exp", "1000")])
def test_a_value_that_a_function_does_not_have_ends_the_run_with_block_time_and_value(
    name: str, value: str
) -> None:
    text = LOAD.replace("VALUE", value).replace("NAME", name)
    with pytest.raises(RunError, match=rf"block 'y'.*\(u = {value}\)"):
        load_text(text, Path.cwd()).run()


def test_missing_values_stay_missing() -> None:
    text = LOAD.replace(
        "  x: {block: sources.constant, rate: fast, with: {value: VALUE}}\n",
        "  w: {block: sources.constant, rate: fast, with: {value: 1}}\n"
        "  x: {block: signal.outage, rate: fast, with: {during: [[0 s, 1 s]]}, in: {u: w.y}}\n",
    )
    assert load_text(text.replace("NAME", "round"), Path.cwd()).run()["y.y"].tolist() == [0.0, 0.0]
