"""Tests of the block signal.trapezoidal_integrator."""

import numpy as np
import pytest
from scipy.signal import lfilter

from quadvis.testing import drive
from quadvis_blocks.signal.trapezoidal_integrator import TrapezoidalIntegrator


def test_it_is_the_bilinear_transform_of_an_integral() -> None:
    u = np.random.default_rng(4).normal(size=50)
    wanted = lfilter([0.05, 0.05], [1.0, -1.0], u)
    assert drive(TrapezoidalIntegrator(), u=u, rate="10 Hz").y == pytest.approx(wanted, abs=1e-12)


def test_a_parabola_is_integrated_to_second_order() -> None:
    t = np.arange(101) * 0.01
    y = drive(TrapezoidalIntegrator(), u=3 * t**2, rate="100 Hz").y
    assert y[-1] == pytest.approx(1.0, abs=1e-4)


def test_it_leaves_a_limit_with_the_first_input_that_points_inward() -> None:
    y = drive(TrapezoidalIntegrator(lower=-1.0, upper=1.0), u=[4.0] * 9 + [-1.0] * 3, rate="1 Hz").y
    assert y.tolist() == [1.0] * 9 + [0.5, -0.5, -1.0]


def test_it_stands_still_while_frozen_and_resets_at_once() -> None:
    freeze = [False, False, True, True, False]
    y = drive(TrapezoidalIntegrator(), u=[1.0] * 5, freeze=freeze, rate="1 Hz").y
    assert y.tolist() == [0.5, 1.5, 2.0, 2.0, 2.5]
    y = drive(TrapezoidalIntegrator(), u=[1.0] * 4, reset=[0, 0, 1, 1], value=10.0, rate="1 Hz").y
    assert y.tolist() == [0.5, 1.5, 10.0, 11.0]


def test_arrays_are_integrated_element_by_element() -> None:
    y = drive(TrapezoidalIntegrator(upper=[1.0, 9.0]), u=np.full((3, 2), 2.0), rate="1 Hz").y
    assert np.array_equal(y, [[1.0, 1.0], [1.0, 3.0], [1.0, 5.0]])
