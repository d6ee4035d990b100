"""Margins that a diagram expects, judged on loops with closed forms; and what no margin can be met by."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from pytest import approx

import quadvis
from quadvis.analysis.analyse import Analysis
from quadvis.analysis.verdict import UNSTABLE, LoopVerdict, judge_margin
from quadvis.api import load_text
from quadvis.cli import main
from quadvis.diagram.loop_requirements import RequiredMargin
from quadvis.errors import DiagramError

from .loops import DIAGRAMS

CHAIN = (DIAGRAMS / "margins.yaml").read_text()
BARE = CHAIN.partition("expect:")[0]
CUTS = """
analyse:
  cuts:
    torque: roll.torque
    vision: [vision.right, vision.right_velocity]
    imu: [side.angle, side.angular_rate]
"""
# Of four integrators under (s + 1)^4 - s^4, opened at each cut: numerator and denominator, and the gains at
# which Routh's criterion finds an imaginary pole, as the smaller distance from 1.
FORMS = {
    "torque": (Polynomial([1, 4, 6, 4]), Polynomial([0, 0, 0, 0, 1]), 5.0),
    "vision": (Polynomial([1, 4]), Polynomial([0, 0, 6, 4, 1]), 5.0),
    "imu": (Polynomial([0, 0, 6, 4]), Polynomial([1, 4, 0, 0, 1]), math.sqrt(5.0)),
}


def crossings(cut: str) -> list[tuple[float, float]]:
    """Return the frequencies (rad/s) at which the loop's gain is 1, each with the phase above -180 deg."""
    above, below, _ = FORMS[cut]
    square = Polynomial([1.0])
    for sign, form in ((1.0, above), (-1.0, below)):
        turned = Polynomial(form.coef * 1j ** np.arange(len(form.coef)))
        size = turned * Polynomial(turned.coef.conjugate())
        square = sign * size + (square if sign < 0 else 0.0)
    roots = [root.real for root in square.roots() if abs(root.imag) < 1e-9 and root.real > 1e-6]
    return [(w, float(np.angle(-above(1j * w) / below(1j * w))) % (2 * math.pi)) for w in roots]


def closed_form(cut: str, kind: str) -> float:
    if kind == "gain":
        return FORMS[cut][2]
    found = crossings(cut)
    assert found
    if kind == "phase":
        return min(min(angle, 2 * math.pi - angle) for _, angle in found)
    return min(angle / w for w, angle in found)


@pytest.fixture(scope="module")
def chain() -> Analysis:
    return load_text(BARE + CUTS, DIAGRAMS).analyse()


@pytest.mark.parametrize("cut", FORMS)
@pytest.mark.parametrize(("kind", "unit"), [("gain", ""), ("gain", "dB"), ("phase", "deg"), ("delay", "ms")])
def test_a_margin_is_met_up_to_its_closed_form(chain: Analysis, cut: str, kind: str, unit: str) -> None:
    wanted = closed_form(cut, kind)
    loop = chain.loops[cut]
    place = next(each for each in chain.diagram.questions.cuts if each.label == cut)
    for share, met in ((0.999, True), (1.001, False)):
        verdict = judge_margin(RequiredMargin(place, kind, share * wanted, unit), loop)
        assert (verdict.found, verdict.met, verdict.lack) == (approx(wanted, rel=1e-4), met, "")


def test_the_closed_forms_are_those_of_the_paper_s_loop() -> None:
    (crossover, angle), *_ = crossings("torque")
    assert (crossover, math.degrees(angle)) == (approx(4.03, abs=0.005), approx(68.6, abs=0.05))
    assert math.degrees(closed_form("vision", "phase")) == approx(43.55, abs=0.01)


def judged(folder: Path, expect: str, text: str = BARE + CUTS, **settings: str) -> tuple[LoopVerdict, ...]:
    path = folder / "loop.yaml"
    path.write_text(f"{text}\nexpect:\n{expect}")
    return quadvis.load(path, settings=settings).analyse().verdicts


def test_gains_are_factors_or_decibels_and_are_said_as_they_are_written(tmp_path: Path) -> None:
    verdicts = judged(
        tmp_path, "  - {margin: torque, gain: 13.9 dB}\n  - {margin: torque, gain: 5.1, phase: 1 rad}\n"
    )
    assert list(map(str, verdicts)) == [
        "met: torque: gain margin at least 13.9 dB: 13.98 dB",
        "NOT MET: torque: gain margin at least x 5.1: x 5",
        "met: torque: phase margin at least 1 rad: 1.197 rad",
    ]
    assert verdicts[0].requirement.bound == approx(10 ** (13.9 / 20), rel=1e-15)


def test_an_unstable_loop_meets_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "loop.yaml"
    path.write_text(f"{BARE}{CUTS}expect: [{{margin: torque, gain: 2, phase: 9 deg, delay: 1 ms}}]\n")
    found = quadvis.load(path, settings={"lag": "0.6 s"}).analyse()
    assert not found.passed
    assert [(verdict.met, verdict.lack) for verdict in found.verdicts] == [(False, UNSTABLE)] * 3
    assert main(["analyse", str(path), "--set", "lag=0.6 s"]) == 1
    out = capsys.readouterr().out.splitlines()
    assert out[-1] == "FAILED: 3 of 3 requirements on loops not met"
    assert out[-2].startswith("NOT STABLE: ")


# x' = -x + y / 2 with y = x fed back: its gain is nowhere 1.
QUIET = """
quadvis: 1
name: quiet
solver: {method: ode4, step: 10 ms}
stop_time: 1 s
params: {further: 0 1/s}
blocks:
  place: {block: signal.integrator, rate: continuous, with: {initial: 0 m}, in: {u: change.y}}
  decay: {block: signal.gain, rate: continuous, with: {factor: -1 1/s}, in: {u: place.y}}
  feed: {block: signal.gain, rate: continuous, with: {factor: 0.5 1/s}, in: {u: place.y}}
  more: {block: signal.gain, rate: continuous, with: {factor: $further}, in: {u: place.y}}
  change: {block: signal.sum, rate: continuous, in: {u: [decay.y, feed.y, more.y]}}
analyse:
  cuts: {feed: feed.y, more: more.y, both: [feed.y, more.y], all: [decay.y, feed.y, more.y]}
  limits:
    more: {vary: more.factor, from: 0.4 1/s, to: -2 1/s}
    far: {vary: more.factor, from: 0 1/s, to: 2 1/s}
    lost: {vary: more.factor, from: 1 1/s, to: 2 1/s}
"""


def test_a_loop_without_a_crossover_may_be_turned_and_delayed_as_one_likes(tmp_path: Path) -> None:
    expect = "  - {margin: feed, phase: 180 deg, delay: 1000 s, gain: 1.99}\n  - {margin: feed, gain: 2.01}\n"
    verdicts = judged(tmp_path, expect, QUIET)
    by_kind = {str(verdict.requirement): (verdict.met, verdict.shown) for verdict in verdicts}
    assert by_kind == {
        "feed: phase margin at least 180 deg": (True, "any"),
        "feed: delay margin at least 1000 s": (True, "any"),
        "feed: gain margin at least x 1.99": (True, "x 2"),
        "feed: gain margin at least x 2.01": (False, "x 2"),
    }


@pytest.mark.parametrize("cut", ["more", "both", "all"])
def test_a_cut_through_which_no_loop_passes_meets_no_margin(cut: str, tmp_path: Path) -> None:
    verdicts = judged(tmp_path, f"  - {{margin: {cut}, gain: 1.1, phase: 1 deg, delay: 1 ms}}\n", QUIET)
    assert [verdict.met for verdict in verdicts] == [False] * 3
    assert {verdict.lack for verdict in verdicts} == {"no loop passes through more.y"}


def test_with_an_effect_the_same_cut_counts(tmp_path: Path) -> None:
    verdicts = judged(tmp_path, "  - {margin: both, gain: 1.1}\n", QUIET, further="0.1 1/s")
    assert [(verdict.met, verdict.found) for verdict in verdicts] == [(True, approx(1 / 0.6, rel=1e-5))]


@pytest.mark.parametrize(
    ("expected", "met", "shown"),
    [
        ("more, below: -1.9 1/s", True, "-2 1/s"),
        ("more, below: -2 1/s", True, "-2 1/s"),  # the whole range is stable, its end too
        ("far, above: 0.49 1/s", True, "0.5 1/s"),
        ("far, above: 0.51 1/s", False, "0.5 1/s"),
        ("far, above: 2 1/s", False, "0.5 1/s"),
        ("lost, above: 1 1/s", False, "none: unstable from 1 1/s on"),
    ],
)
def test_a_limit_is_met_if_the_loop_is_stable_beyond_it(
    expected: str, met: bool, shown: str, tmp_path: Path
) -> None:
    (verdict,) = judged(tmp_path, f"  - {{limit: {expected}}}\n", QUIET)
    assert (verdict.met, verdict.shown) == (met, shown)


def test_no_range_of_a_parameter_is_stable_enough_for_a_loop_that_is_not(tmp_path: Path) -> None:
    (verdict,) = judged(tmp_path, "  - {limit: far, above: 0.1 1/s}\n", QUIET, further="0.6 1/s")
    assert (verdict.met, verdict.lack) == (False, UNSTABLE)


def test_questions_of_the_command_line_do_not_change_what_is_judged(tmp_path: Path) -> None:
    path = tmp_path / "quiet.yaml"
    path.write_text(f"{QUIET}expect: [{{margin: feed, gain: 1.9}}, {{limit: far, above: 0.4 1/s}}]\n")
    diagram = quadvis.load(path)
    found = diagram.analyse(limits={"far": ("more.factor", "0 1/s", "0.1 1/s")})
    assert found.limits["far"].value == approx(0.1)
    assert [verdict.met for verdict in found.verdicts] == [True, True] and found.passed
    with pytest.raises(DiagramError, match="cuts: the diagram has a cut 'feed' already; choose another name"):
        diagram.analyse(cuts={"feed": "decay.y"})


@pytest.mark.slow
def test_the_command_ends_with_1_for_a_margin_that_is_not_met(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "quiet.yaml"
    expect = "[{margin: feed, gain: 3}, {margin: feed, phase: 9 deg}, {limit: far, above: 0.4 1/s}]"
    path.write_text(f"{QUIET}expect: {expect}\n")
    assert main(["analyse", str(path)]) == 1
    assert capsys.readouterr().out.splitlines()[-5:] == [
        "  NOT MET  feed: gain margin at least x 3       x 2",
        "  met      feed: phase margin at least 9 deg    any",
        "  met      far: stable up to more than 0.4 1/s  0.5 1/s",
        "STABLE",
        "FAILED: 1 of 3 requirements on loops not met",
    ]
    assert main(["analyse", str(path), "--json"]) == 1
    facts = json.loads(capsys.readouterr().out)
    assert facts["passed"] is False and facts["stable"] is True
    assert facts["expect"][1] == {
        "expectation": "feed: phase margin at least 9 deg", "label": "feed", "kind": "phase", "unit": "rad",
        "limit": approx(math.radians(9)), "found": None, "met": True, "lack": None,
    }  # fmt: skip
    path.write_text(f"{QUIET}expect: [{{margin: feed, phase: 9 deg}}]\n")
    assert main(["analyse", str(path)]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == "PASSED: 1 of 1 requirement on loops met"


def test_neither_a_run_nor_a_sweep_judges_margins_and_both_say_so(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "quiet.yaml"
    said = "  not judged by a run: 2 requirements on loops; 'quadvis analyse' does it"
    path.write_text(f"{QUIET}expect: [{{margin: feed, gain: 3, phase: 9 deg}}]\n")
    assert main(["run", str(path), "--log", ""]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == said
    assert main(["run", str(path), "--log", "", "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert (facts["margins"], facts["expect"], facts["passed"]) == (2, [], True)
    table = str(tmp_path / "table.csv")
    assert main(["sweep", str(path), "--over", "seed=0", "--workers", "1", "-o", table, "--plot", ""]) == 0
    assert said in capsys.readouterr().out.splitlines()


def test_margins_are_no_part_of_the_experiment_that_a_hash_names() -> None:
    expected = load_text(f"{QUIET}expect: [{{margin: feed, gain: 3}}, {{signal: place.y, within: 1 m}}]\n")
    without = load_text(f"{QUIET}expect: [{{signal: place.y, within: 1 m}}]\n")
    assert len(expected.loop_requirements) == 1
    assert expected.hash == without.hash and load_text(expected.resolved).hash == expected.hash
