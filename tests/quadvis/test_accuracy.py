"""`check --accuracy`: what half the solver's step changes, against the closed form of each solver."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest

from quadvis.api import load, load_text
from quadvis.cli import main
from quadvis.engine.solver import ORDERS
from quadvis.errors import QuadvisError
from quadvis.graph.graph import SOLVERS

HEAD = "signal half the step of 100 ms changes it by of its range at order"
DIAGRAMS = Path(__file__).parents[2] / "diagrams"
DECAY = """\
quadvis: 1
name: decay
solver: {method: METHOD, step: STEP}
stop_time: 1 s
blocks:
  slope: {block: signal.gain, rate: continuous, with: {factor: -1 1/s}, in: {u: x.y}}
  x: {block: signal.integrator, with: {initial: 2 m}, in: {u: slope.y}}
"""
SAMPLED = """\
quadvis: 1
name: sampled
rates: {c: 10 Hz}
stop_time: 1 s
blocks:
  s: {block: sources.sine, rate: c}
"""
DRIVEN = """\
quadvis: 1
name: driven
solver: {method: ode4, step: 100 ms}
stop_time: 1 s
blocks:
  push: {block: sources.step, rate: continuous, with: {after: 1 m/s, at: AT}}
  x: {block: signal.integrator, in: {u: push.y}}
"""


def decay(method: str, step: str = "100 ms") -> str:
    return DECAY.replace("METHOD", method).replace("STEP", step)


def factor(order: int, step: float) -> float:
    """Return by what x' = -x shrinks in a step of a Runge-Kutta formula of order = stages."""
    return sum((-step) ** power / math.factorial(power) for power in range(order + 1))


@pytest.mark.parametrize("method", SOLVERS)
def test_the_difference_and_the_order_are_those_of_the_formula(method: str) -> None:
    found = load_text(decay(method)).accuracy()
    order = ORDERS[method]
    ends = [2.0 * factor(order, 0.1 / part) ** (10 * part) for part in (1, 2, 4)]
    x = next(each for each in found.signals if each.name == "x.y")
    assert x.difference == pytest.approx(abs(ends[0] - ends[1]), rel=1e-6 if order < 4 else 1e-4)
    assert x.time == 1.0 and x.unit == "m"
    assert x.share == pytest.approx(x.difference / (2.0 - ends[2]), rel=1e-6)
    assert x.order == pytest.approx(math.log2(abs((ends[0] - ends[1]) / (ends[1] - ends[2]))), abs=1e-3)
    assert x.order == pytest.approx(order, abs=0.15)
    if method == "ode1":
        words = (
            r"not converged: half the step of 100 ms changes '.*' by 1.54 % of its range; make it smaller, "
        )
        assert re.fullmatch(words + "such as 50 ms", found.verdict)
    else:
        assert found.converged
        assert found.verdict.endswith(
            f"with a step of 100 ms; order seen: {x.order:.1f}, of {order} for {method}"
        )


def test_the_step_that_it_proposes_converges() -> None:
    assert not load_text(decay("ode1")).accuracy().converged
    assert load_text(decay("ode1", "50 ms")).accuracy().converged


def test_the_largest_share_comes_first() -> None:
    shares = [each.share for each in load_text(decay("ode2")).accuracy().signals]
    assert shares == sorted(shares, reverse=True) and len(shares) == 2


def test_a_diagram_without_continuous_states_has_nothing_to_refine(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "sampled.yaml"
    file.write_text(SAMPLED)
    assert main(["check", str(file), "--accuracy"]) == 0
    assert capsys.readouterr().out.endswith("nothing to refine: no block has a continuous state\n")


def test_the_command_prints_a_table_and_one_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "decay.yaml"
    file.write_text(decay("ode4"))
    assert main(["check", str(file), "--accuracy"]) == 0
    first, head, *rows, verdict = capsys.readouterr().out.splitlines()
    assert first.endswith("no fault")
    assert head.split() == HEAD.split(" ")
    assert sorted(row.split()[0] for row in rows) == ["slope.y", "x.y"]
    assert verdict.startswith("converged to ")


def test_a_step_that_is_too_large_ends_with_one(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "decay.yaml"
    file.write_text(decay("ode1"))
    assert main(["check", str(file), "--accuracy", "--json"]) == 1
    found = json.loads(capsys.readouterr().out)
    assert found["ok"] and not found["accuracy"]["converged"]
    assert found["accuracy"]["step_s"] == 0.1
    assert {each["signal"] for each in found["accuracy"]["signals"]} == {"x.y", "slope.y"}


def test_a_jump_between_two_steps_is_named_by_the_order() -> None:
    found = load_text(DRIVEN.replace("AT", "0.331 s").replace("100 ms", "10 ms")).accuracy()
    assert found.worst is not None and found.worst.order < 3.0
    assert "not 4 as ode4 has: something jumps between two steps" in found.verdict


def test_noise_at_every_step_is_named() -> None:
    noisy = decay("ode4") + ("  n: {block: sources.noise, rate: continuous, with: {sigma: 1 m}}\n")
    assert load_text(noisy).accuracy().remarks == (
        "noise drawn at every step is other noise with half of it: 'n'",
    )


def test_stop_time_settings_and_what_is_logged_stay(tmp_path: Path) -> None:
    file = tmp_path / "decay.yaml"
    file.write_text(decay("ode2") + "log: {signals: [x.y], every: {continuous: 2}}\n")
    found = load(file, stop_time="0.4 s", settings={"x.initial": "4 m"}).accuracy()
    ends = [4.0 * factor(2, 0.1 / part) ** (4 * part) for part in (1, 2)]
    assert [each.name for each in found.signals] == ["x.y"]
    assert found.signals[0].difference == pytest.approx(abs(ends[0] - ends[1]), rel=1e-6)


def test_an_element_of_a_vector_is_named_with_its_index() -> None:
    text = """\
quadvis: 1
name: vector
solver: {method: ode2, step: 100 ms}
stop_time: 1 s
blocks:
  x: {block: signal.integrator, with: {initial: {value: [1, 1], unit: m}}, in: {u: slope.y}}
  slope:
    block: math.matrix_gain
    rate: continuous
    with: {gain: {value: [[-1, 0], [0, -3]], unit: 1/s}}
    in: {u: x.y}
"""
    x = next(each for each in load_text(text).accuracy().signals if each.name.startswith("x"))
    assert x.name == "x.y[1]"
    times = np.arange(1, 11)
    first, second = factor(2, 0.3) ** times, factor(2, 0.15) ** (2 * times)
    assert x.difference == pytest.approx(np.abs(first - second).max(), rel=1e-9)


def test_a_block_that_writes_files_is_named() -> None:
    text = (DIAGRAMS / "record.yaml").read_text().replace("rates:", "solver: {step: 1 ms}\nrates:")
    text = text.replace("blocks:\n", "blocks:\n  x: {block: signal.integrator, in: {u: 1 m/s}}\n", 1)
    with pytest.raises(
        QuadvisError, match=r"the accuracy takes 3 runs, and each would write '.*'; leave out"
    ):
        load_text(text, DIAGRAMS).accuracy()
