import math
import re
from fractions import Fraction

import numpy as np
import pytest

from quadvis.block import ParameterError
from quadvis.engine.engine import Engine
from quadvis.graph.graph import Constant, Graph, Node, Task, Wire
from quadvis.testing import drive
from quadvis_blocks.signal.integrator import Integrator
from quadvis_blocks.signal.transport_delay import TransportDelay


def held(values: list[float], ticks: int) -> np.ndarray:
    """Each value for so many ticks, on two channels with opposite signs."""
    series = np.repeat(values, ticks)
    return np.column_stack((series, -series))


def test_a_held_signal_arrives_later_by_the_delay() -> None:
    u = held([1.0, 5.0, 2.0], 50)  # 20 Hz, seen at 1 kHz
    y = drive(TransportDelay(delay=0.022, initial=9.0), u=u, rate="1 kHz").y
    assert (y[:22] == 9.0).all()
    assert np.array_equal(y[22:], u[:-22])


def test_a_delay_that_is_no_whole_number_of_ticks_ends_at_the_next_one() -> None:
    y = drive(TransportDelay(delay=0.0215), u=held([1.0], 30), rate="1 kHz").y
    assert np.flatnonzero(y[:, 0])[0] == 22


def test_a_signal_that_changes_at_every_tick_is_delayed_whole() -> None:
    u = np.random.default_rng(2).normal(size=(3000, 4))
    y = drive(TransportDelay(delay=0.4), u=u, rate="1 kHz").y
    assert np.array_equal(y[400:], u[:-400])


def test_inside_a_solver_step_it_changes_within_that_step() -> None:
    step = Fraction(1, 100)
    # The solver's formula meets an edge half way through one of its steps: the rest of the run is exact.
    assert integral_of_a_delayed_one(step, 0.015, continuous=True) == pytest.approx(
        1.0 - 0.015, abs=float(step) / 2
    )


def test_at_a_discrete_rate_the_solver_sees_no_edge_inside_its_steps() -> None:
    assert integral_of_a_delayed_one(Fraction(1, 100), 0.02, continuous=False) == pytest.approx(
        0.98, abs=1e-12
    )


def integral_of_a_delayed_one(step: Fraction, delay: float, *, continuous: bool) -> float:
    fast = Task("fast", step, continuous=True)
    link = fast if continuous else Task("link", step)
    inputs = {"u": Wire("delay", "y"), "reset": Constant(False), "value": Constant(0.0)}
    nodes = [
        Node("delay", "", TransportDelay(delay=delay), link, {"u": Constant(1.0)}, {"*": ()}),
        Node("integral", "", Integrator(), fast, inputs, {"*": ()}),
    ]
    engine = Engine(Graph("test", nodes, "ode4", step))
    with engine:
        engine.run(int(1 / step) + 1)
        return float(engine.read("integral", "y"))


def test_what_waits_does_not_depend_on_the_values() -> None:
    still, moving = (
        drive(TransportDelay(delay=0.0215), u=u[:, None], rate="1 kHz")
        for u in (np.ones(100), np.arange(100.0))
    )
    assert still.state("waiting") == moving.state("waiting") == 22
    assert np.array_equal(still.state("since"), moving.state("since"))


@pytest.mark.parametrize("ticks", [1, 2, 3.5, 510.5, 511])
def test_a_delay_of_up_to_511_ticks_has_room(ticks: float) -> None:
    y = drive(TransportDelay(delay=ticks / 1000), u=np.arange(1, 1101.0)[:, None], rate="1 kHz").y[:, 0]
    late = math.ceil(ticks)
    assert np.array_equal(y, np.concatenate((np.zeros(late), np.arange(1, 1101 - late))))


@pytest.mark.parametrize("delay", [0.5111, 0.512, 1.0, 1e9])
def test_a_longer_delay_is_refused_before_the_run(delay: float) -> None:
    problem = rf"delay must be at most 511 ticks of the block, 0\.511 s, got {re.escape(f'{delay:g}')} s"
    with pytest.raises(ParameterError, match=problem):
        drive(TransportDelay(delay=delay), u=np.arange(3.0)[:, None], rate="1 kHz")


def test_it_breaks_loops() -> None:
    assert TransportDelay.interface.feedthrough == frozenset()


def test_a_delay_of_zero_is_refused() -> None:
    with pytest.raises(ParameterError, match="delay must be above 0 s, got 0 s"):
        TransportDelay(delay=0.0)
