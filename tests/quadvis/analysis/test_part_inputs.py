"""Inputs of parts as the ends of transfers, against closed forms and against other ends of the same loop."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import control
import numpy as np
import pytest
from pytest import approx

from quadvis.api import load_text
from quadvis.errors import DiagramError

LAW = """
quadvis: 1
name: law
ports: {in: [u, more], out: {y: force.y}}
blocks:
  p: {block: signal.gain, with: {factor: -3 1/s}, in: {u: in.u}}
  inner: {part: inner.yaml, in: {v: in.u}}
  force: {block: signal.sum, in: {u: [p.y, inner.y]}}
"""
INNER = """
quadvis: 1
name: inner
ports: {in: [v], out: {y: gain.y}}
blocks:
  sum: {block: signal.integrator, in: {u: in.v}}
  gain: {block: signal.gain, with: {factor: -2 1/s^2}, in: {u: sum.y}}
"""
LOOP = """
quadvis: 1
name: loop
rates: {fast: 100 Hz}
solver: {method: ode4, step: 1 ms}
stop_time: 1 s
blocks:
  law: {part: law.yaml, rate: continuous, in: {u: "both.y[1]"}}
  plant: {block: signal.integrator, in: {u: law.y}}
  other: {block: systems.transfer_function, with: {numerator: [5], denominator: [1, 7]}, in: {u: "both.y[1]"}}
  both: {block: signal.concatenate, rate: continuous, in: {u: [1 m, plant.y]}}
analyse: {at: 100 ms}
"""
S = control.tf("s")
C, P = 3 + 2 / S, 1 / S
FORMS = {
    ("law.u", "plant.y"): -C * P / (1 + C * P),
    ("law/inner.v", "plant.y"): -(2 / S) * P / (1 + C * P),
    ("law.u", "law/p.y"): -3 / (1 + C * P),
    ("law.u", "law/inner.v"): 1 / (1 + C * P),
    ("law.y", "law.u"): P / (1 + C * P),
    ("law.u", "law.u"): 1 / (1 + C * P),
    ("law/inner.v", "law.u"): -(2 / S) * P / (1 + C * P),
    ("both.y[1]", "law.u"): 1 / (1 + C * P),
    ("law.u", "other.y"): -C * P / (1 + C * P) * 5 / (S + 7),
}
GRID = 1j * np.geomspace(0.1, 100.0, 30)


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("law.yaml").write_text(LAW)
    Path("inner.yaml").write_text(INNER)


def analysed(text: str, **transfers: tuple[str, str]) -> Any:
    return load_text(text).analyse(transfers=transfers)


def test_a_continuous_transfer_is_its_closed_form() -> None:
    ends = {f"way{number}": pair for number, pair in enumerate(FORMS)}
    found = analysed(LOOP, **ends)
    for name, pair in ends.items():
        assert found.transfer(name)(GRID) == approx(FORMS[pair](GRID), rel=1e-6, abs=1e-9), pair
    assert str(found.transfers["way0"].transfer.unit) == "1"
    assert str(found.transfers["way2"].transfer.unit) == "1/s"


SAMPLED = """
quadvis: 1
name: sampled
rates: {fast: 100 Hz}
solver: {method: ode4, step: 5 ms}
stop_time: 1 s
blocks:
  law: {part: law.yaml, rate: fast, in: {u: {from: plant.y, across: sample}}}
  plant: {block: signal.integrator, with: {initial: 0 m}, in: {u: {from: law.y, across: hold}}}
analyse: {at: 100 ms}
"""


def test_what_only_a_part_reads_is_the_same_from_its_producer() -> None:
    """A sampled law, which reads across rates."""
    Path("inner.yaml").write_text(INNER.replace("signal.integrator", "signal.discrete_integrator"))
    found = analysed(SAMPLED, one=("law.u", "law.y"), two=("plant.y", "law.y"))
    one, two = found.transfers["one"], found.transfers["two"]
    for omega in (0.5, 2.0, 10.0):
        assert one.at(omega) == approx(two.at(omega), rel=1e-6)


@pytest.mark.parametrize(
    ("end", "words"),
    [
        ("law.more", "no signal feeds 'law.more'; name an input that is wired to a block"),
        ("law.u[0]", "index [0] does not fit 'law.u', which has one value; leave it out"),
        ("law.w", "block 'law' has no output 'w'"),
    ],
)
def test_what_is_no_end_is_refused(end: str, words: str) -> None:
    with pytest.raises(DiagramError) as caught:
        analysed(LOOP, way=(end, "plant.y"))
    assert words in str(caught.value)


def test_two_inputs_with_one_signal_are_not_told_apart() -> None:
    Path("law.yaml").write_text(LAW.replace("1/s}, in: {u: in.u}", "1/s}, in: {u: in.more}"))
    text = LOOP.replace('u: "both.y[1]"', 'u: "both.y[1]", more: "both.y[1]"', 1)
    with pytest.raises(DiagramError, match=r"another input of 'law' has the signal of 'law\.u', too; name"):
        analysed(text, way=("law.u", "plant.y"))
