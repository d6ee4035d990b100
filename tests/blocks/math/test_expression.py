"""Formulas against Python's own arithmetic, their units, and what is wrong with some."""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_array_equal
from pytest import approx

from quadvis.block import Block, ParameterError
from quadvis.errors import RunError
from quadvis.testing import drive
from quadvis.testing.conformance import CHECKS, Subject
from quadvis_blocks.math.expression import Expression

X = np.array([-7.0, -1.5, -0.5, 0.0, 0.25, 1.0, 2.5, 7.0])


def block(*inputs: str, **given: Any) -> Block:
    return Expression.named(given, inputs)(**given)


def test_the_block_of_the_readme() -> None:
    a, b = np.linspace(0, 3, 7), np.linspace(-1, 1, 7)
    found = drive(block("a", "b", y="k * sin(a) + max(b, 0)", k=2.0), a=a, b=b)
    assert found.y == approx(2 * np.sin(a) + np.maximum(b, 0), rel=1e-15)


@pytest.mark.parametrize(
    ("formula", "expected"),
    [
        ("x^2 - 3 * x + 1", lambda x: x**2 - 3 * x + 1),
        ("-x^2", lambda x: -(x**2)),
        ("abs(x) ^ 0.5", lambda x: np.sqrt(abs(x))),
        ("sqrt(abs(x)) / 2", lambda x: np.sqrt(abs(x)) / 2),
        ("mod(x, 3)", lambda x: np.mod(x, 3)),
        ("rem(x, -3)", lambda x: np.fmod(x, -3)),
        ("round(x)", lambda x: np.sign(x) * np.floor(abs(x) + 0.5)),
        ("floor(x) + ceil(x) + fix(x)", lambda x: np.floor(x) + np.ceil(x) + np.fix(x)),
        ("min(x, 1, -x) + max(x, 0)", lambda x: np.minimum(np.minimum(x, 1), -x) + np.maximum(x, 0)),
        ("if(x > 0 and 1 / x < 1, 5, sign(x))", lambda x: np.where(x > 1, 5, np.sign(x))),
        ("atan2(x, 2) / (1 rad)", lambda x: np.arctan2(x, 2)),
        ("cos(x * pi * 1 rad) + exp(x) + tanh(x)", lambda x: np.cos(x * np.pi) + np.exp(x) + np.tanh(x)),
    ],
)  # fmt: skip
def test_formulas_are_those_of_python(formula: str, expected: Any) -> None:
    one = drive(block("x", y=formula), x=X).y
    assert one == approx(expected(X), rel=1e-14, abs=1e-15)
    assert_array_equal(drive(block("x", y=formula), x=[X], steps=1).y[0], one)


@pytest.mark.parametrize(
    ("formula", "expected"), [("x > 1", X > 1), ("not (x <= 0 or x == 1)", (X > 0) & (X != 1))]
)
def test_conditions_are_truth_values(formula: str, expected: Any) -> None:
    kind = Expression.named({"y": formula}, ("x",))
    assert kind.interface.outputs["y"].type == "bool[*]"
    assert_array_equal(drive(kind(y=formula), x=X).y, expected)
    assert_array_equal(drive(kind(y=formula), x=[X]).y[0], expected)


def test_truth_values_and_numbers_may_be_mixed() -> None:
    found = drive(block("on", "u", y="if(on, u, -u)", off="not on"), on=[True, False], u=[3.0, 4.0])
    assert found.y.tolist() == [3, -4]
    assert found.off.tolist() == [False, True]


def test_an_output_may_use_others_in_any_order() -> None:
    found = drive(
        block("r", "y", u="k * e + time / (1 s)", e="r - y", k=3.0), r=[1.0, 2.0], y=[0.5, 0.5], rate="1 Hz"
    )
    assert found.u.tolist() == [1.5, 5.5]
    assert found.e.tolist() == [0.5, 1.5]


def test_a_quantity_is_a_value_though_its_unit_is_the_name_of_an_input() -> None:
    assert units("s", y="k * s", k="100 V*s") == {"k": "a_0", "s": "a_1", "y": "a_0*a_1"}


def test_an_input_may_be_called_as_a_method_is() -> None:
    assert drive(block("start", "update", y="start - update"), start=[3.0], update=[1.0]).y.tolist() == [2]


def test_a_parameter_has_a_number_for_each_element() -> None:
    assert drive(block("u", y="k * u", k=[1.0, 2.0]), u=[[3.0, 4.0]]).y[0].tolist() == [3, 8]


def units(*inputs: str, **given: str) -> dict[str, str]:
    interface = Expression.named(given, inputs).interface
    ports = {**interface.params, **interface.inputs, **interface.outputs}
    return {name: port.unit for name, port in ports.items()}


def test_units_follow_from_formulas() -> None:
    assert units("a", "b", y="k * sin(a) + max(b, 0)", k="2 N") == {
        "k": "a_0",
        "a": "rad",
        "b": "a_0",
        "y": "a_0",
    }
    assert units("v", y="v^2 / (2 * 9.81 m/s^2) + 3 m") == {
        "v": "m/s",
        "y": "m",
    }
    assert units("p", "q", y="p * q", z="sqrt(p)") == {
        "p": "a_0",
        "q": "a_1",
        "y": "a_0*a_1",
        "z": "a_0^(1/2)",
    }
    assert units("p", y="p > 2 m and p < 3 m") == {"p": "m", "y": "1"}
    assert units("c", y="atan2(c, 1 N)", z="c * time") == {"c": "N", "y": "rad", "z": "N*s"}


WRONG = [
    (
        {"y": "x + z"},
        "'x + z' holds 'z', which is neither an input nor a parameter; choose from 'y', 'x', 'time', 'pi'",
    ),
    ({"y": "1 m + sin(x) + x"}, "'+' joins m and a plain number; give both the same unit"),
    ({"y": "sin(x) + x"}, "'+' joins a plain number and rad; give both the same unit"),
    ({"y": "exp(x) + x * 1 m"}, "'+' joins a plain number and m; give both the same unit"),
    ({"y": "x ^ x + 1 m"}, "'+' joins a plain number and m; give both the same unit"),
    (
        {"y": "x and x > 1"},
        "'>' takes a number, and gets a truth value; choose numbers, as in 'if(on, 1, 0)'",
    ),
    ({"y": "not (x + 1)"}, "'not' takes a truth value, and gets a number; compare it, as in 'u > 0'"),
    (
        {"y": "if(x, 1, x > 2)"},
        "'if' takes a number, and gets a truth value; choose numbers, as in 'if(on, 1, 0)'",
    ),
    ({"y": "y + x"}, "'y' is computed from itself; use another name"),
    ({"y": "z", "z": "y * x"}, "'y' is computed from itself; use another name"),
    ({"y": "2 * x", "k": "3"}, "no formula has 'k'; leave it out, or use it"),
    ({"k": "3"}, "there is no formula; give one under 'with', such as y: \"2 * u\""),
    ({"y": "2 x"}, "'2 x' lacks a sign before 'x'; write '*' for a product"),
    ({"y": "sine(x)"}, "'sine(x)' calls 'sine', which is not a function here; did you mean 'sin'?"),
    ({"lambda": "x + 1"}, "'lambda' cannot be a name here; choose another one"),
    ({"_y": "x + 1"}, "'_y' cannot be a name here; choose another one"),
    ({"update": "x + 1"}, "'update' cannot be a name under 'with'; choose another one"),
    ({"y": "x.__class__"}, "'x.__class__' holds '.'; that is no part of one"),
]


@pytest.mark.parametrize(("given", "words"), WRONG)
def test_faults_say_what_is_wrong(given: dict[str, str], words: str) -> None:
    with pytest.raises(ParameterError, match=f"^{re.escape(words)}$"):
        Expression.named(given, ("x",))


@pytest.mark.parametrize("formula", ["1 / x", "sqrt(-1 - x)", "log(x)", "asin(2 + x) / (1 rad)", "mod(1, x)"])
def test_a_value_that_a_function_does_not_have_ends_the_run(formula: str) -> None:
    with pytest.raises(RunError, match=r"became|does not have"):
        drive(block("x", y=formula), x=[0.0])


leaves = st.sampled_from(["x", "y", "0.5", "2", "3.25"])
formulas = st.recursive(
    leaves,
    lambda inner: (
        st.tuples(inner, st.sampled_from(["+", "-", "*"]), inner).map(lambda parts: f"({' '.join(parts)})")
        | st.tuples(st.sampled_from(["min", "max"]), inner, inner).map(
            lambda parts: f"{parts[0]}({parts[1]}, {parts[2]})"
        )
        | inner.map(lambda text: f"abs({text})")
        | inner.map(lambda text: f"(-{text})")
    ),
    max_leaves=10,
).filter(lambda text: "x" in text.replace("max", ""))


@settings(max_examples=40)
@given(formulas, st.floats(-10, 10), st.floats(-10, 10))
def test_any_formula_is_that_of_python(formula: str, x: float, y: float) -> None:
    found = drive(block("x", "y", z=formula), x=[x], y=[y]).z[0]
    assert found == eval(formula, {"x": x, "y": y, "min": min, "max": max, "abs": abs})
    assert math.isfinite(found)


SUBJECTS = {
    "numbers": ({"y": "k * sin(a) + max(b, 0)", "z": "a^2 * time"}, {"k": 2.0}, ("a", "b")),
    "truths": ({"y": "if(on and a > b, a, b)", "low": "not on or a < 0.5"}, {}, ("a", "b", "on")),
}


def subject(name: str) -> Subject:
    texts, values, inputs = SUBJECTS[name]
    kind = Expression.named({**texts, **{key: str(value) for key, value in values.items()}}, inputs)
    return Subject(kind, {**texts, **values})


@pytest.mark.parametrize("name", SUBJECTS)
@pytest.mark.parametrize("check", [check for check in CHECKS if check not in ("tested", "compiles")])
def test_formulas_conform(name: str, check: str) -> None:
    CHECKS[check](subject(name))


@pytest.mark.slow
@pytest.mark.parametrize("name", SUBJECTS)
def test_formulas_are_compiled(name: str) -> None:
    CHECKS["compiles"](subject(name))
