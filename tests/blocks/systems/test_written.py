"""Transfer functions as texts say the numbers that they were made of."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis_blocks.systems._written import fraction, of_factors, polynomial
from quadvis_blocks.systems.transfer_function import TransferFunction
from quadvis_blocks.systems.zero_pole_gain import ZeroPoleGain

PLAIN = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹", "0123456789")


def value(text: str, at: float) -> float:
    """The value of a written polynomial, read term by term."""
    total = 0.0
    for sign, term in re.findall(r"(^-?|[+-] )([^ ]+(?: s[⁰-⁹¹²³]*)?)", text):
        size, variable, power = re.fullmatch(r"([\d.e+-]*) ?(s?)([⁰-⁹¹²³]*)", term).groups()  # type: ignore[union-attr]
        exponent = int(power.translate(PLAIN) or 1) if variable else 0
        total += (-1.0 if "-" in sign else 1.0) * float(size or 1.0) * at**exponent
    return total


@given(st.lists(st.integers(-9999, 9999), min_size=1, max_size=12))
def test_a_polynomial_is_written_as_it_is(coefficients: list[int]) -> None:
    text = polynomial(coefficients, "s")
    assert value(text, 0.5) == pytest.approx(float(np.polyval(coefficients, 0.5)))


@pytest.mark.parametrize(
    ("block", "found"),
    [
        (TransferFunction(numerator=[1, 3], denominator=[2, 0, -1]), ("s + 3", "2 s² - 1")),
        (TransferFunction(numerator=[0, 1], denominator=[0.1, 1], gain=2.5), ("2.5", "0.1 s + 1")),
        (TransferFunction(numerator=[1, 3], denominator=[1, 4], gain=2.0), ("2 (s + 3)", "s + 4")),
        (
            TransferFunction(numerator=[1.0], denominator=[1, -0.5], method="discrete", period=0.1),
            ("1", "z - 0.5"),
        ),
        (TransferFunction(numerator=[1.0], denominator=range(1, 12)), ("1", "D(s)")),
        (ZeroPoleGain(poles="-0.5+6j, -0.5-6j", gain=3.0), ("3", "s² + s + 36.25")),
        (ZeroPoleGain(zeros="0", poles="-1, -2", gain=3.0), ("3 s", "(s + 1)(s + 2)")),
    ],
)
def test_a_block_says_its_fraction(block: Any, found: tuple[str, str]) -> None:
    assert block.picture_formula() == found


def test_what_is_long_gets_a_name() -> None:
    assert fraction([1.0] * 20, [1.0, 1.0], 1.0, "z") == ("N(z)", "z + 1")
    assert of_factors((), [complex(-number) for number in range(9)], 1.0, "s") == ("1", "D(s)")
