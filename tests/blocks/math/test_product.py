"""Tests of the block math.product."""

from pathlib import Path

import numpy as np
import pytest

from quadvis.api import load_text
from quadvis.block import ParameterError
from quadvis.errors import RunError
from quadvis.testing import drive
from quadvis_blocks.math.product import Product

LOAD = """quadvis: 1
name: product
rates: {fast: 10 Hz}
stop_time: 0.1 s
blocks:
  force: {block: sources.constant, rate: fast, with: {value: 6 N}}
  speed: {block: sources.constant, rate: fast, with: {value: 2 m/s}}
"""


def test_any_number_of_signals_is_multiplied_and_divided() -> None:
    assert drive(Product(), u=[[2.0, 3.0], [5.0, -1.0], 10.0]).y.tolist() == [100.0, -30.0]
    assert drive(Product(signs="*/"), u=[[6.0, 1.0], [4.0, -8.0]]).y.tolist() == [1.5, -0.125]
    assert drive(Product(signs="/"), u=[[4.0]]).y.tolist() == [0.25]
    assert drive(Product(signs="//*"), u=[[4.0], [0.5], [3.0]]).y.tolist() == [1.5]


def test_arrays_are_multiplied_element_by_element_and_scaled_as_a_whole() -> None:
    found = drive(Product(), u=[[[1.0, 2.0]], [[3.0, -5.0]]], scale=[2.0]).y
    assert np.array_equal(found, [[6.0, -20.0]])


def test_it_is_numpy_s_product_in_the_order_of_the_list() -> None:
    a, b, c = np.random.default_rng(1).normal(size=(3, 50))
    assert np.array_equal(drive(Product(signs="*/*"), u=[a, b, c]).y, a / b * c)


def test_the_units_follow() -> None:
    block = (
        "  y: {block: math.product, rate: fast, with: {signs: '%s'}, in: {u: [force.y, speed.y], scale: %s}}"
    )
    for signs, scale, unit in (("**", "1", "W"), ("*/", "1", "N*s/m"), ("", "2 s", "N*m")):
        diagram = load_text(f"{LOAD}{block % (signs, scale)}\n", Path.cwd())
        assert diagram.graph["y"].unit("y") == unit


def test_a_division_by_zero_ends_the_run_with_block_and_time() -> None:
    text = LOAD + "  y: {block: math.product, rate: fast, with: {signs: '*/'}, in: {u: [force.y, 0 s]}}\n"
    with pytest.raises(RunError, match=r"block 'y'.*t = 0 s.*a division by zero"):
        load_text(text, Path.cwd()).run()


@pytest.mark.parametrize("signs", ["*", "*/*", "+-"])
def test_signs_that_do_not_fit_the_signals_are_refused(signs: str) -> None:
    with pytest.raises(ParameterError, match=r"signs must be \* or / for each signal"):
        Product(signs=signs).with_entries(u=2)
