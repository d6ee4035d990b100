"""Tests of the block math.modulo."""

from pathlib import Path

import numpy as np
import pytest

from quadvis.api import load_text
from quadvis.errors import RunError
from quadvis.testing import drive
from quadvis_blocks.math.modulo import Modulo

A = [7.0, -7.0, 7.0, -7.0, 5.5, -0.5, 6.0, -6.0]
B = [3.0, 3.0, -3.0, -3.0, 2.0, 2.0, 3.0, 3.0]
MOD = [1.0, 2.0, -2.0, -1.0, 1.5, 1.5, 0.0, 0.0]
REM = [1.0, -1.0, 1.0, -1.0, 1.5, -0.5, 0.0, 0.0]
LOAD = """quadvis: 1
name: modulo
rates: {fast: 10 Hz}
stop_time: 1 s
blocks:
  x: {block: sources.step, rate: fast, with: {before: 2, after: 0, at: 0.5 s}}
  y: {block: math.modulo, rate: fast, in: {u: 7, divisor: x.y}}
"""


@pytest.mark.parametrize(("function", "wanted"), [("mod", MOD), ("rem", REM)])
def test_the_sign_is_that_of_the_divisor_or_of_the_dividend(function: str, wanted: list[float]) -> None:
    assert drive(Modulo(function=function), u=A, divisor=B).y.tolist() == wanted
    assert drive(Modulo(function=function), u=[A], divisor=[B]).y[0].tolist() == wanted


def test_it_is_numpy_s_for_random_numbers() -> None:
    u, divisor = np.random.default_rng(1).normal(size=(2, 200)) * [[10.0], [1.0]]
    assert drive(Modulo(), u=u, divisor=divisor).y == pytest.approx(np.mod(u, divisor), abs=1e-14)
    assert drive(Modulo(function="rem"), u=u, divisor=divisor).y == pytest.approx(
        np.fmod(u, divisor), abs=1e-14
    )


def test_a_divisor_of_zero_ends_the_run_with_block_and_time() -> None:
    with pytest.raises(RunError, match=r"block 'y'.*t = 0\.5 s.*divisor = 0"):
        load_text(LOAD, Path.cwd()).run()
