"""Arithmetic with units against Python's own, with fractions and floats, and against the rules of units."""

from __future__ import annotations

import contextlib
import math
import operator
import re
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.units import Unit, UnitError, parse_period, parse_quantity, parse_rational, plain_text
from quadvis.units.arithmetic import Value, arithmetic, evaluate
from quadvis.units.expression import FUNCTIONS, parse_expression

numbers = st.decimals(-1000, 1000, places=3, allow_nan=False).map(lambda value: f"{value:f}".lstrip("-"))
trees = st.recursive(
    numbers,
    lambda inner: (
        st.tuples(inner, st.sampled_from("+-*/"), inner).map(lambda parts: f"({' '.join(parts)})")
        | inner.map(lambda text: f"-{text}")
    ),
    max_leaves=12,
)
EXACT = {
    "1/30 s": (Fraction(1, 30), "s"), "2*5/s": (Fraction(10), "1/s"), "20 ms + 5 ms": (Fraction(1, 40), "s"),
    "12 V / (2 A)": (Fraction(6), "ohm"), "sqrt(4 m^2)": (Fraction(2), "m"), "-2^2": (Fraction(-4), "1"),
    "2^3^2": (Fraction(512), "1"), "(2 m)^-2": (Fraction(1, 4), "1/m^2"), "pi rad / pi": (Fraction(1), "rad"),
    "max(1 m, 20 cm, 0)": (Fraction(1), "m"), "mod(-7, 3)": (Fraction(2), "1"),
    "rem(-7, 3)": (Fraction(-1), "1"), "180 deg / pi": (Fraction(1), "rad"),
    "mod(7, -3)": (Fraction(-2), "1"), "round(-2.5)": (Fraction(-3), "1"), "floor(-2.5)": (Fraction(-3), "1"),
    "50 % * 3 m": (Fraction(3, 2), "m"), "3 rad/(kg*m^2)": (Fraction(3), "rad/(kg*m^2)"),
    "2 rpm * 1 min / (2 pi rad)": (Fraction(2), "1"), "1 N*m - 1 J": (Fraction(0), "J"),
    "0.1 + 0.2": (Fraction(3, 10), "1"), "6 m/2": (Fraction(3), "m"), "(1 + 2) m/s": (Fraction(3), "m/s"),
}  # fmt: skip
FLOATS = {
    "2 pi": 2 * math.pi, "pi/2 rad": math.pi / 2, "sin(30 deg)": math.sin(math.radians(30)),
    "asin(1)": math.pi / 2, "2^0.5": math.sqrt(2), "exp(1)": math.e, "atan2(1 m, -1 m)": math.atan2(1, -1),
    "log10(1e5)": 5.0, "2 pi^2": 2 * math.pi**2, "cosh(0.5)": math.cosh(0.5), "1/(2*pi)": 1 / (2 * math.pi),
}  # fmt: skip
WRONG = {
    "1 m + 1 s": "'+' joins m and s; give both the same unit",
    "1 m + 1": "'+' joins m and a plain number; give both the same unit",
    "1/0": "there is a division by zero; divide by another value",
    "mod(1, 0)": "there is a division by zero; divide by another value",
    "0^-1": "there is a division by zero; divide by another value",
    "sin(1)": "'sin' takes an angle, and gets a number; write it in rad or deg",
    "exp(1 m)": "'exp' takes a number, and gets m",
    "2^(1 m)": "'^' takes a number without unit, and gets m",
    "sqrt(-1)": "a negative number has no square root; give one above zero",
    "log(0)": "'log' has no value at 0",
    "asin(2)": "'asin' has no value at 2",
    "sqr(2)": "'sqr(2)' calls 'sqr', which is not a function here; did you mean 'sqrt'?",
    "pow(2, 3)": "'pow(2, 3)' calls 'pow', which is not a function here; write a ^ b",
    "sin(1 rad, 2)": "'sin(1 rad, 2)' gives 'sin' 2 arguments; give 1 argument",
    "2 * (3": "'2 * (3' lacks a ')'",
    "2 *": "'2 *' ends too early",
    "2 * 3 4": "'2 * 3 4' lacks a sign before '4'; write '*' for a product",
    "2 * size": "'2 * size' holds 'size', which is no number; write '$size' for a parameter",
    "2 * 3 a": "'a' is not a unit; use m, s, rad, kg, N, V, Hz, px ...",
    "6 m * 2 / 2 s": "'6 m * 2 / 2 s' has a unit behind a divisor, which can be read in two ways; "
    "put the divisor in brackets, as in a/(2 s), or what is before it",
    "2 * 5 m/s2": "'m/s2' is not a unit; did you mean 'm/s^2'?",
    "9^9^9": "'^' leaves the range of numbers",
    "exp(1000)": "'exp' leaves the range of numbers",
    "1 < 2": "'<' is for signals; leave it out of the value of a parameter",
    "2 # 3": "'2 # 3' holds '#'; that is no part of one",
}  # fmt: skip


@pytest.mark.parametrize(("text", "value"), EXACT.items())
def test_values_are_exact(text: str, value: tuple[Fraction, str]) -> None:
    found, unit = value
    assert arithmetic(text).si.number == found
    assert arithmetic(text).unit.dimension_equals(Unit.parse(unit))


@pytest.mark.parametrize(("text", "value"), FLOATS.items())
def test_functions_are_those_of_the_mathematics(text: str, value: float) -> None:
    assert parse_quantity(text)[0] == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize(("text", "words"), WRONG.items())
def test_faults_say_what_is_wrong(text: str, words: str) -> None:
    with pytest.raises(UnitError, match=f"^{re.escape(words)}$"):
        arithmetic(text)


@given(trees)
def test_values_are_those_of_python_with_fractions(text: str) -> None:
    exact = re.sub(r"[0-9]+\.[0-9]+", lambda match: f"Fraction('{match[0]}')", text)
    try:
        expected = eval(exact, {"Fraction": Fraction})
    except ZeroDivisionError:
        with pytest.raises(UnitError, match="division by zero"):
            arithmetic(text)
        return
    assert arithmetic(text).number == expected


@given(trees)
def test_a_value_reads_back_as_written(text: str) -> None:
    try:
        value = arithmetic(f"({text}) * 1 m/s")
    except UnitError:
        return
    number, unit = parse_quantity(value.text)
    assert number == float(value.number)
    assert unit == Unit.parse("m/s") or number == 0


@given(st.text(alphabet="0123456789.+-*/^() $abpisnqrtm,<e%", max_size=30))
def test_no_text_ends_in_another_error(text: str) -> None:
    for names in (None, ("a", "b", "s")):
        with contextlib.suppress(UnitError):
            evaluate(parse_expression(text, names), lambda name: Value(Fraction(len(name)), Unit.parse("m")))


@given(
    st.sampled_from(["m", "s", "rad", "kg*m^2", "V/A", "1"]), st.sampled_from(["m", "Hz", "deg", "N", "1"])
)
def test_units_follow_their_rules(one: str, other: str) -> None:
    first, second = Unit.parse(one), Unit.parse(other)
    units = {"a": first, "b": second}

    def unit_of(text: str) -> Unit:
        found = evaluate(parse_expression(text, units), lambda name: Value(Fraction(3), units[name]))
        assert isinstance(found, Value)
        return found.unit

    assert unit_of("a * b").dimension == (first * second).dimension
    assert unit_of("a / b").dimension == (first / second).dimension
    assert unit_of("sqrt(a) ^ 4").dimension == (first**2).dimension
    for text in ("a + b", "a - b", "max(a, b)", "mod(a, b)", "atan2(a, b)"):
        if first.dimension_equals(second):
            assert unit_of(text).dimension == (Unit.parse("rad") if "atan2" in text else first).dimension
        else:
            with pytest.raises(UnitError, match="joins"):
                unit_of(text)


@given(st.sampled_from(sorted(FUNCTIONS)), st.floats(-4, 4))
def test_functions_take_numbers_as_python_does(function: str, x: float) -> None:
    compute = getattr(math, function, None)
    if compute is None or FUNCTIONS[function] != (1, 1) or function in ("floor", "ceil"):
        return
    unit = " rad" if function in ("sin", "cos", "tan") else ""
    try:
        expected = compute(x)
    except ValueError:
        with pytest.raises(UnitError):
            arithmetic(f"{function}({x!r}{unit})")
        return
    assert float(arithmetic(f"{function}({x!r}{unit})").number) == pytest.approx(expected, rel=1e-15)


def test_plain_quantities_keep_their_meaning() -> None:
    assert parse_period("1/30 s") == Fraction(1, 30)
    assert parse_rational("-1/3 m") == Fraction(-1, 3)
    for text in ("5/s", "2 N*m", "1/(kg*m^2)", "3 m^(1/2)", "data/x-1.csv", "vision", "12:30", "a-b", "1e-3"):
        assert plain_text(text) == text


def test_signs_stand_in_the_order_of_python() -> None:
    for text in ("2+3*4", "2-3-4", "16/4/2", "-3^2", "2*-3", "2^-1", "(2+3)*4", "- -2"):
        assert arithmetic(text).number == eval(text.replace("^", "**"))
    assert operator.neg(3) == arithmetic("-(3)").number


def test_an_expression_has_a_greatest_length() -> None:
    for text in (
        "1" + "+1" * 400,
        "(" * 100 + "1" + ")" * 100,
        "-(" * 200 + "1" + ")" * 200,
        "1" + "^1" * 140,
    ):
        with pytest.raises(UnitError, match=r"too long|too deep|characters"):
            arithmetic(text)
