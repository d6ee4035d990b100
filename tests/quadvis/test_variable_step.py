"""Solvers that choose their steps: against scipy on whole problems, against closed forms, and to the bit."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from quadvis.api import Diagram, load, load_text
from quadvis.engine.engine import Engine
from quadvis.engine.variable_step import VariableSolver
from quadvis.errors import DiagramError, QuadvisError, RunError
from quadvis.graph.graph import VARIABLE
from quadvis.realtime.options import RealTime
from quadvis.testing import drive
from quadvis_blocks.signal.integrator import Integrator
from tests.quadvis.oscillators import van_der_pol
from tests.quadvis.restored import check_repeats

SLOW = pytest.mark.slow
STIFF = ("Radau", "BDF", "LSODA")
ROBERTSON = """\
quadvis: 1
name: Robertson
params: {k1: 0.04 1/s, k2: 3e7 1/s, k3: 1e4 1/s}
solver: {method: METHOD, step: 1 s, rtol: 1e-8, atol: 1e-12}
stop_time: 200 s
blocks:
  law:
    block: math.expression
    rate: continuous
    with:
      a: -k1 * x + k3 * y * z
      b: k1 * x - k3 * y * z - k2 * y * y
      c: k2 * y * y
      k1: $k1
      k2: $k2
      k3: $k3
    in: {x: x.y, y: y.y, z: z.y}
  x: {block: signal.integrator, with: {initial: 1}, in: {u: law.a}}
  y: {block: signal.integrator, in: {u: law.b}}
  z: {block: signal.integrator, in: {u: law.c}}
"""
VAN_DER_POL = van_der_pol("{method: METHOD, step: 10 s, rtol: 1e-7, atol: 1e-9}", "1000 s")
# A ladder of three resistors and capacitors, with time constants from 1 us to 1 s.
LADDER = """\
quadvis: 1
name: ladder
solver: {method: METHOD, step: 20 ms, rtol: 1e-9, atol: 1e-12}
stop_time: 2 s
blocks:
  slope:
    block: math.matrix_gain
    rate: continuous
    with: {gain: {value: [[-2e6, 1e6, 0], [1e3, -2e3, 1e3], [0, 1, -1]], unit: 1/s}}
    in: {u: v.y}
  feed: {block: signal.sum, rate: continuous, in: {u: [slope.y, {value: [5e6, 0, 0], unit: V/s}]}}
  v: {block: signal.integrator, with: {initial: {value: [0, 0, 0], unit: V}}, in: {u: feed.y}}
"""
SAMPLED = """\
quadvis: 1
name: sampled
rates: {control: 10 Hz, idle: 20 Hz}
solver: {method: METHOD, step: 25 ms, rtol: 1e-10, atol: 1e-12}
stop_time: 3 s
blocks:
  law: {block: signal.gain, rate: control, with: {factor: -2 1/s}, in: {u: {from: x.y, across: sample}}}
  fall: {block: signal.gain, rate: continuous, with: {factor: -3 1/s}, in: {u: x.y}}
  sum: {block: signal.sum, rate: continuous, in: {u: [fall.y, {from: law.y, across: hold}]}}
  x: {block: signal.integrator, with: {initial: 1 m}, in: {u: sum.y}}
  noise: {block: sources.noise, rate: idle}
"""


def made(text: str, method: str) -> Diagram:
    return load_text(text.replace("METHOD", method))


@pytest.mark.parametrize("method", [pytest.param("Radau", marks=SLOW), "BDF", "LSODA"])
def test_robertsons_reactions_are_those_of_scipy(method: str) -> None:
    def slopes(_: float, state: np.ndarray) -> list[float]:
        x, y, z = state
        return [-0.04 * x + 1e4 * y * z, 0.04 * x - 1e4 * y * z - 3e7 * y * y, 3e7 * y * y]

    times = np.arange(0.0, 201.0)
    truth = solve_ivp(slopes, (0, 200), [1, 0, 0], "Radau", times, rtol=1e-11, atol=1e-15).y
    same = solve_ivp(slopes, (0, 200), [1, 0, 0], method, times, rtol=1e-8, atol=1e-12).y
    result = made(ROBERTSON, method).run()
    found = np.array([result[f"{name}.y"] for name in "xyz"])
    assert found == pytest.approx(truth, rel=1e-5, abs=1e-10)
    assert np.abs(found - truth).max() <= 10 * np.abs(same - truth).max() + 1e-12
    assert found.sum(axis=0) == pytest.approx(np.ones(201), abs=1e-12)


@pytest.mark.parametrize(
    "method",
    [pytest.param("Radau", marks=SLOW), pytest.param("BDF", marks=SLOW), pytest.param("LSODA", marks=SLOW)],
)
def test_van_der_pols_oscillator_of_1000_is_that_of_scipy(method: str) -> None:
    def slopes(_: float, state: np.ndarray) -> list[float]:
        return [state[1], 1000 * (1 - state[0] ** 2) * state[1] - state[0]]

    truth = solve_ivp(slopes, (0, 1000), [2, 0], "Radau", np.arange(0, 1001, 10.0), rtol=1e-11, atol=1e-13)
    found = made(VAN_DER_POL, method).run()["x.y"]
    assert np.ptp(found) > 2.0  # it has jumped
    jumps = np.abs(np.diff(found)) > 0.1  # near a jump the time of the jump is all
    calm = ~(np.append(jumps, False) | np.insert(jumps, 0, False))
    assert calm.sum() > 90
    assert found[calm] == pytest.approx(truth.y[0][calm], rel=1e-4)


@pytest.mark.parametrize("method", STIFF)
def test_a_stiff_network_is_that_of_the_matrix_exponential(method: str) -> None:
    from scipy.linalg import expm

    matrix = np.array([[-2e6, 1e6, 0], [1e3, -2e3, 1e3], [0, 1, -1]])
    rest = np.linalg.solve(matrix, [-5e6, 0, 0])
    result = made(LADDER, method).run()
    truth = [rest - expm(matrix * time) @ rest for time in result.times("v.y")]
    assert result["v.y"] == pytest.approx(np.array(truth), rel=1e-6, abs=1e-8)


@pytest.mark.parametrize("method", VARIABLE)
def test_a_sampled_loop_is_its_exact_discretisation(method: str) -> None:
    shrink = math.exp(-0.3)
    factor = shrink - 2 * (1 - shrink) / 3
    found = made(SAMPLED, method).run()["x.y"][::4]
    assert found == pytest.approx(factor ** np.arange(31), rel=1e-8, abs=1e-9)


def test_it_begins_anew_only_where_something_has_changed(monkeypatch: pytest.MonkeyPatch) -> None:
    begun: list[float] = []
    first = VariableSolver._made

    def counted(self: VariableSolver, rates, time: float, *more):
        begun.append(time)
        return first(self, rates, time, *more)

    monkeypatch.setattr(VariableSolver, "_made", counted)
    made(SAMPLED, "BDF").run()
    assert [time for time in begun if time > 0.1] == pytest.approx(np.arange(2, 31) / 10)
    assert len(begun) <= 34  # at 0 and where the first update of a block has noted something
    begun.clear()
    made(LADDER, "Radau").run()
    assert len(begun) <= 2


@pytest.mark.slow
@pytest.mark.parametrize("method", VARIABLE)
def test_both_engines_and_a_restored_run_give_the_same_bits(method: str) -> None:
    diagram = made(SAMPLED, method)
    truth = diagram.run(engine="python")["x.y"]
    native = diagram.run(engine="native")
    assert native["x.y"].tobytes() == truth.tobytes()
    assert str(native.engine) == f"native, but interpreted: the solver {method}, which is scipy's"
    check_repeats(Engine(diagram.graph), 30, 40)


def test_a_reset_of_a_state_begins_anew() -> None:
    text = """\
quadvis: 1
name: sawtooth
solver: {method: RK45, step: 100 ms, rtol: 1e-9}
stop_time: 3 s
rates: {c: 2 Hz}
blocks:
  x: {block: signal.integrator, with: {reset_on: rising}, in: {u: 1 m/s, reset: {from: p.y, across: hold}}}
  p: {block: logic.compare, rate: c, with: {operator: ">"}, in: {a: s.y, b: 0.5}}
  s: {block: sources.sine, rate: c, with: {frequency: 1 Hz, phase: 90 deg}}
"""
    found = load_text(text).run()["x.y"]
    assert found == pytest.approx(np.append(np.tile(np.arange(10) / 10, 3), 0.0), abs=1e-9)


def test_a_state_that_escapes_is_reported() -> None:
    text = """\
quadvis: 1
name: escape
solver: {method: METHOD, step: 100 ms}
stop_time: 4 s
blocks:
  law: {block: math.expression, rate: continuous, with: {y: k * x * x, k: 1 1/s}, in: {x: x.y}}
  x: {block: signal.integrator, with: {initial: 1}, in: {u: law.y}}
"""
    for method in ("Radau", "RK45", "BDF"):
        with pytest.raises(
            RunError, match=f"the solver {method} cannot go on|left the finite|became inf|large"
        ):
            made(text, method).run()


def test_accuracy_makes_the_tolerance_smaller() -> None:
    found = made(ROBERTSON, "BDF").accuracy()
    assert found.converged and found.worst is not None
    assert found.verdict.endswith("with 'rtol: 1e-08'")
    assert found.worst.share < 1e-5


def test_a_resolved_diagram_keeps_the_solver() -> None:
    diagram = made(ROBERTSON, "LSODA")
    again = load_text(diagram.resolved)
    assert again.graph.solver == "LSODA" and again.graph.tolerances == (1e-8, 1e-12)
    assert again.hash == diagram.hash
    assert (
        "rtol"
        not in load_text(
            ROBERTSON.replace("METHOD", "ode4").replace(", rtol: 1e-8, atol: 1e-12", "")
        ).resolved
    )


@pytest.mark.parametrize(
    ("solver", "words"),
    [
        ("{method: ode15s, step: 1 s}", "there is no method 'ode15s'; did you mean 'BDF'?"),
        ("{method: ode45, step: 1 s}", "there is no method 'ode45'; did you mean 'RK45'?"),
        ("{method: Radua, step: 1 s}", "did you mean 'Radau'?"),
        (
            "{method: ode4, step: 1 s, rtol: 1e-6}",
            "'rtol' is for a method that chooses its steps, not for ode4; leave it out, or choose one of "
            "RK45, Radau, BDF, LSODA",
        ),
        ("{method: BDF, step: 1 s, rtol: 0}", "'rtol' must be above 1e-13 and below 1; write such as 1e-6"),
        ("{method: BDF, step: 1 s, atol: -1}", "'atol' must be above 0 and below 1"),
    ],
)
def test_a_solver_that_cannot_be_is_refused_in_a_sentence(solver: str, words: str) -> None:
    text = ROBERTSON.replace("{method: METHOD, step: 1 s, rtol: 1e-8, atol: 1e-12}", solver)
    with pytest.raises(DiagramError) as caught:
        load_text(text)
    assert words in str(caught.value)
    assert str(caught.value).count("\n") == 0


def test_real_time_and_exports_refuse_it_in_a_sentence(tmp_path: Path) -> None:
    diagram = made(SAMPLED, "Radau")
    words = (
        "the solver 'Radau' takes as many steps as it needs, for which no clock waits; choose one of fixed"
    )
    with pytest.raises(QuadvisError, match=words):
        RealTime().check(diagram.graph)
    with pytest.raises(QuadvisError, match="the solver 'Radau' cannot be exported; choose one of fixed step"):
        diagram.export_fmu(".", tmp_path / "x.fmu")


def test_a_log_of_it_is_replayed_to_the_bit(tmp_path: Path) -> None:
    from quadvis.output.log_reader import read_log
    from quadvis.run.replay import replay

    file = tmp_path / "sampled.yaml"
    file.write_text(SAMPLED.replace("METHOD", "Radau"))
    load(file).run(log=tmp_path / "x.mcap")
    assert replay(read_log(tmp_path / "x.mcap")).same


def test_a_block_alone_can_be_driven_by_it() -> None:
    assert drive(Integrator(), u=[1.0, 1.0, 1.0], rate="10 Hz", solver="RK45").y == pytest.approx(
        [0, 0.1, 0.2]
    )


@pytest.mark.parametrize("method", VARIABLE)
def test_a_solver_at_rest_sees_a_short_push(method: str) -> None:
    """x' = u, a triangle of 0.1 s and height 1 after 5 s of rest: x ends at its area."""
    result = load_text(f"""
quadvis: 1
name: push
solver: {{method: {method}, step: 20 ms, rtol: 1e-6, atol: 1e-9}}
stop_time: 6 s
blocks:
  push:
    block: sources.table
    with:
      times: {{value: [0, 5, 5.05, 5.1], unit: s}}
      values: [[0], [0], [1], [0]]
      interpolation: linear
  x: {{block: signal.integrator, in: {{u: "push.y[0]"}}}}
""").run(engine="python")
    assert result["x.y"][-1] == pytest.approx(0.05, rel=1e-3)
