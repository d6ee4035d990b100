"""Mathematics as machine code: the bits that Python and numpy have, or no machine code."""

import math
import struct
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy import exp as exponential

from quadvis.native import compiler, functions
from quadvis.native.functions import native, prepare


def cube(x, y):
    return float(x) ** 3


def fifth(x, y):
    return x**5 + x**4


def square(x, y):
    return x**2 + y**2.0


def root(x, y):
    return abs(x) ** 0.5


def inverse(x, y):
    return x**-1 + pow(y, -3)


def two_to(x, y):
    return 2**x + math.pow(10.0, y)


def any_power(x, y):
    return x**y


def named_power(x, y):
    return math.pow(x, 3) + math.pow(y, 2)


def trigonometry(x, y):
    return math.sin(x) * math.cos(x) + math.tan(y) - math.atan2(x, y) + math.atan(y)


def growth(x, y):
    return math.exp(-x / 7.0) - math.expm1(-y / 3.0) + math.tanh(x) + math.log1p(y * y)


def products(x, y):
    """Not contracted to fused multiplications."""
    return x * x - y * y + x * y + x / 3.0


def choices(x, y):
    return max(x, y, -0.0) + min(y, x) - x % 3.0 + x // 7.0


def whole(x, y):
    return round(x) + math.floor(y) + int(x)


def few(x, y):
    return np.array([x, y, 0.1 * x]).sum() + np.mean(np.array([y, x]))


def many(x, y):
    """Sums of every length up to 40 of numbers that begin and step as they like."""
    found, numbers = 0.0, np.empty(80)
    for index in range(80):
        numbers[index] = x + y / (index + 1.0)
    for count in range(40):
        found = math.sin(found) + numbers[:count].sum() + numbers[: 2 * count : 2].sum()
    return found


def full(x, y):
    return np.sum(np.full(128, x) * (y + np.ones(128)))


def extremes(x, y):
    numbers = np.array([x, y, 1.0, -0.5 * x])
    return numbers.min() - 2.0 * np.max(numbers) + numbers.max()


def elements(x, y):
    a, b = np.array([x, y, x, 0.0]), np.array([y, x, x, abs(y)])
    return float(np.copysign(1.0, np.minimum(np.maximum(a, b), 2.0) + np.maximum(y, 0.0))[3] + np.sign(a)[0])


def zeros(x, y):
    """The bits of zeros, chosen from two."""
    return math.copysign(1.0, np.minimum(np.array([x, 1.0, 0.0]), np.array([y, 2.0, 0.0]))[0])


def values(x, y):
    return float((np.cross(np.array([x, y, 1.0]), np.array([y, 3.0 * x, x])) % 7.0)[2] + np.sqrt(abs(x)))


POWERS = (cube, fifth, square, root, inverse, two_to, any_power, named_power)
OTHERS = (
    trigonometry, growth, products, choices, whole, few, many, full, extremes, elements, zeros, values,
)  # fmt: skip
NUMBERS = st.one_of(st.floats(-10.0, 10.0), st.floats(0.0, 0.1), st.floats())


def bits(value: float) -> bytes:
    return b"nan" if math.isnan(value) else struct.pack("d", value)


def answer(function: Any, *arguments: float) -> Any:
    """Return the bits of a result, or FAILED; one NaN is as good as another."""
    try:
        with np.errstate(all="ignore"):
            return bits(float(function(*arguments)))
    except (ArithmeticError, ValueError, TypeError):
        return functions.FAILED


def machine(function: functions.NativeFunction, *arguments: float) -> Any:
    """Return the bits of machine code's own result, or FAILED where the interpreter repeats the call."""
    assert function.is_native
    found = functions._Call(function, function._address or 0, ()).run(arguments)
    return found if found is functions.FAILED else bits(found)


def agree(group: tuple[Any, ...]) -> None:
    """Machine code that answers has the interpreter's bits; what Python refuses it does not answer."""
    natives = [native(("float64", "float64"), ("float64",))(function) for function in group]
    prepare(natives)
    rng = np.random.default_rng(5)

    @settings(max_examples=200, deadline=None)
    @given(NUMBERS, NUMBERS)
    def check(x: float, y: float) -> None:
        for each in natives:
            found = machine(each, x, y)
            assert found in (functions.FAILED, answer(each.function, x, y)), f"{each.__name__}({x!r}, {y!r})"

    check()
    for x, y in rng.uniform(0.0, 3.0, (500, 2)).tolist():  # no edges: all answer, and last bits may differ
        for each in natives:
            assert machine(each, x, y) == answer(each.function, x, y), f"{each.__name__}({x!r}, {y!r})"


@pytest.mark.slow
def test_powers_have_the_bits_of_pythons():
    agree(POWERS)


@pytest.mark.slow
def test_mathematics_and_arrays_have_the_bits_of_pythons_and_numpys():
    agree(OTHERS)


REFUSED = {
    "math.hypot": lambda x: math.hypot(x, 1.0),
    "math.lgamma": lambda x: math.lgamma(x),
    "numpy.exp": lambda x: float(np.exp(x)),
    "numpy.linalg": lambda x: float(np.linalg.norm(np.array([x, 1.0]))),
    "std": lambda x: float(np.array([x, 1.0]).std()),
    "sum": lambda x: float(np.array([[x, 1.0]]).sum()),
    "numpy.arange": lambda x: float(np.arange(x, 2.0, 0.1).sum()),
    "numpy.cumsum": lambda x: float(np.cumsum(np.array([x, 1.0]))[1]),
}


def imported(x):
    return float(exponential(x))


@pytest.mark.parametrize("name", REFUSED)
def test_what_would_have_other_bits_stays_interpreted_and_the_refusal_names_it(name):
    refusal = refused(REFUSED[name])
    assert f"'{name}' would have other bits than interpreted" in refusal


def test_a_function_imported_by_its_name_is_known_as_well():
    assert "'numpy.exp' would have other bits than interpreted" in refused(imported)


def refused(function: Any) -> str:
    return compiler.compile_functions([native(("float64",), ("float64",))(function)], "test").refusal
