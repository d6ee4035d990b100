"""Steps that are too large for a pole: limits of the formulas, poles of diagrams, and what is said."""

from __future__ import annotations

import math
import re
from fractions import Fraction

import numpy as np
import pytest

from quadvis.api import load_text
from quadvis.engine.engine import Engine
from quadvis.engine.stability import Marks, StatePole, poles, stable_to, too_large
from quadvis.errors import RunError
from tests.quadvis.oscillators import van_der_pol
from tests.stages import mostly_slow

FALL = """\
quadvis: 1
name: fall
solver: {method: METHOD, step: STEP}
stop_time: 4 s
blocks:
  slope: {block: signal.gain, rate: continuous, with: {factor: -1000 1/s}, in: {u: fast.y}}
  fast: {block: signal.integrator, with: {initial: 2 m}, in: {u: slope.y}}
  fall: {block: signal.gain, rate: continuous, with: {factor: -0.2 1/s}, in: {u: slow.y}}
  slow: {block: signal.integrator, in: {u: fall.y}}
"""
ESCAPE = """\
quadvis: 1
name: escape
solver: {method: ode4, step: 1 ms}
stop_time: 4 s
blocks:
  law: {block: math.expression, rate: continuous, with: {y: k * x * x, k: 1 1/s}, in: {x: x.y}}
  x: {block: signal.integrator, with: {initial: 1}, in: {u: law.y}}
"""


def oscillation(step: str) -> str:
    return van_der_pol(f"{{method: ode4, step: {step}}}", "20 ms")


def fall(method: str, step: str) -> str:
    return FALL.replace("METHOD", method).replace("STEP", step)


@pytest.mark.parametrize(
    ("method", "limit"), [("ode1", 2.0), ("ode2", 2.0), ("ode3", 2.5127453266), ("ode4", 2.7852935634)]
)
def test_the_limit_for_a_real_pole_is_that_of_the_literature(method: str, limit: float) -> None:
    assert stable_to(method, -50.0 + 0j) == pytest.approx(limit / 50, rel=1e-9)


@pytest.mark.parametrize(("method", "limit"), [("ode3", math.sqrt(3)), ("ode4", math.sqrt(8))])
def test_the_limit_on_the_imaginary_axis_is_that_of_the_literature(method: str, limit: float) -> None:
    assert stable_to(method, complex(-1e-6, 10.0)) == pytest.approx(limit / 10, rel=1e-4)


def test_the_limit_of_euler_is_that_of_its_circle() -> None:
    pole = complex(-3.0, 7.0)
    assert stable_to("ode1", pole) == pytest.approx(-2 * pole.real / abs(pole) ** 2, rel=1e-9)


@pytest.mark.parametrize("pole", [0j, 3.0 + 0j, 5j, complex(1e-3, 9.0)])
def test_a_pole_that_does_not_decay_asks_for_no_step(pole: complex) -> None:
    assert stable_to("ode4", pole) == math.inf


def test_the_pole_that_asks_for_the_smallest_step_is_named() -> None:
    found = [StatePole(-10 + 0j, "a"), StatePole(-100 + 0j, "b"), StatePole(7 + 0j, "c")]
    excess = too_large("ode4", Fraction(1, 10), found)
    assert excess is not None and excess.pole.block == "b"
    assert too_large("ode4", Fraction(1, 100), found) is None


def test_the_poles_of_a_diagram_have_their_blocks() -> None:
    engine = Engine(load_text(fall("ode4", "1 ms")).graph)
    with engine:
        before = engine.memory.content()
        found = engine.poles()
        assert engine.memory.content() == before
    assert [pole.block for pole in found] == ["fast", "slow"]
    assert [pole.value.real for pole in found] == pytest.approx([-1000.0, -0.2], rel=1e-6)


def test_complex_poles_are_shown_with_both_parts() -> None:
    assert StatePole(complex(-3, 40), "x").shown == "-3 +- 40j 1/s"
    assert StatePole(complex(-3, 0), "x").shown == "-3 1/s"


@pytest.mark.parametrize("engine", mostly_slow(["python", "native"]))
def test_a_run_that_diverges_names_the_pole(engine: str) -> None:
    words = (
        "block 'fast', t = 1.34 s: state 'integral' left the finite numbers, as the solver's step of 5 ms is "
        "too large for 'fast', whose fastest pole is at -1000 1/s (ode4 is stable up to 2.79 ms); make the "
        "step smaller, or use 'method: Radau'"
    )
    with pytest.raises(RunError, match=re.escape(words)):
        load_text(fall("ode4", "5 ms")).run(engine=engine)


def test_an_overflow_in_a_stiff_equation_names_the_pole() -> None:
    words = (
        r"'v', whose fastest pole is at -3000 1/s \(ode4 is stable up to 928 us\); make the step smaller, or"
    )
    with pytest.raises(RunError, match=words):
        load_text(oscillation("5 ms")).run()
    load_text(oscillation("0.5 ms")).run()


def test_an_equation_that_escapes_by_itself_is_no_fault_of_the_step() -> None:
    with pytest.raises(RunError, match=r"left the finite numbers; a smaller solver step may help|became inf"):
        load_text(ESCAPE).run(engine="python")


@pytest.mark.parametrize("step", ["2.5 ms", "3 ms"])
def test_check_accuracy_names_the_pole_only_beyond_the_limit(step: str) -> None:
    found = load_text(fall("ode4", step).replace("stop_time: 4 s", "stop_time: 60 ms")).accuracy()
    assert (found.too_large is not None) == (step == "3 ms")
    if found.too_large is not None:
        assert not found.converged
        assert found.too_large.limit == pytest.approx(2.7852935634e-3, rel=1e-6)
        assert found.verdict.endswith(
            "(ode4 is stable up to 2.79 ms); make the step smaller, or use 'method: Radau'"
        )
        assert found.facts()["too_large"]["block"] == "fast"


def test_marks_find_the_cause_where_it_began_and_keep_few() -> None:
    engine = Engine(load_text(oscillation("5 ms")).graph)
    interpreter = engine._interpreter
    marks = Marks(interpreter)
    with engine:
        for _ in range(100):
            marks.note()
        assert len(marks._found) <= Marks.KEPT
        engine.memory.floats[list(interpreter.program.states)] = np.nan
        assert poles(interpreter) == []
        now = engine.memory.content()
        cause = marks.cause()
        assert cause is not None and cause.pole.block == "v"
        assert engine.memory.content() == now
