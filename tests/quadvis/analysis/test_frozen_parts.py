"""Parts that do not always run, in an analysis: each runs or stands still, as at the operating point."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from quadvis.analysis.analyse import analyse
from quadvis.analysis.report import analysis_lines
from quadvis.api import load_text

CONTINUOUS = """
quadvis: 1
name: frozen
params: {auto: true}
rates: {control: 10 Hz}
solver: {method: ode4, step: 10 ms}
stop_time: 10 s
blocks:
  goal: {block: sources.constant, rate: RATE, with: {value: 1 m}}
  error: {block: signal.sum, rate: RATE, with: {signs: "+-"}, in: {u: [goal.y, plant.y]}}
  law: {part: law.yaml, rate: RATE, when: $auto, in: {u: error.y}}
  plant: {block: systems.transfer_function, with: {numerator: [2], denominator: [1, 3]}, in: {u: law.y}}
"""
SAMPLED = CONTINUOUS.replace("plant.y]", "{from: plant.y, across: sample}]").replace(
    "in: {u: law.y}", "in: {u: {from: law.y, across: hold}}"
)
LAW = """
quadvis: 1
name: law
ports: {in: [u], out: {y: sum.y}}
blocks:
  integral: {block: KIND, in: {u: in.u}}
  scaled: {block: signal.gain, with: {factor: 3 1/s}, in: {u: integral.y}}
  sum: {block: signal.sum, in: {u: [scaled.y, in.u]}}
"""


@pytest.fixture(params=["continuous", "sampled"])
def text(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.chdir(tmp_path)
    continuous = request.param == "continuous"
    kind = "signal.integrator" if continuous else "signal.discrete_integrator"
    Path("law.yaml").write_text(LAW.replace("KIND", kind))
    return (CONTINUOUS if continuous else SAMPLED).replace("RATE", "continuous" if continuous else "control")


def test_an_enabled_part_has_the_poles_of_the_plain_one(text: str) -> None:
    plain = analyse(load_text(text.replace("when: $auto, ", "")), engine="python")
    found = analyse(load_text(text), engine="python")
    assert np.sort_complex(found.poles) == pytest.approx(np.sort_complex(plain.poles), rel=1e-6)
    assert len(found.poles) == 2 and found.stable
    assert "'law' runs, as at the operating point" in list(analysis_lines(found))
    assert found.facts()["parts"] == {"law": "runs"}


def test_a_disabled_part_is_frozen_and_no_pole_is_its_own(text: str) -> None:
    found = analyse(load_text(text.replace("auto: true", "auto: false")), engine="python")
    assert found.poles == pytest.approx([-3.0], rel=1e-5)
    assert "'law' stands still, its states are frozen, as at the operating point" in list(
        analysis_lines(found)
    )


def test_a_condition_near_its_limit_does_not_change_during_an_analysis(text: str) -> None:
    decides = """
  on: {block: logic.compare, rate: RATE, with: {operator: ">"}, in: {a: goal.y, b: 1 m}}
""".replace("RATE", "continuous" if "rate: continuous" in text else "control")
    found = analyse(load_text(text.replace("when: $auto", "when: on.y") + decides), engine="python")
    assert found.poles == pytest.approx([-3.0], rel=1e-5)
