"""`quadvis tune`: the least number of a summary, where closed forms know it."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import pytest

import quadvis
from quadvis.cli import main
from quadvis.errors import DiagramError, QuadvisError
from quadvis.sweeps.tune import METHODS
from tests.stages import mostly_slow

Captured = pytest.CaptureFixture[str]

# The distance from (3 m, -2) is sqrt((x - 3)^2 + (y + 2)^2); noise moves it by its seed.
VALLEY = """
quadvis: 1
name: valley
params: {x: 1 m, y: {value: [0, 5]}, level: 0 m}
rates: {fast: 10 Hz}
stop_time: 100 ms
seed: 1
blocks:
  x: {block: sources.constant, rate: fast, with: {value: $x}}
  y: {block: sources.constant, rate: fast, with: {value: "$y[0]"}}
  noise: {block: sources.noise, rate: fast, with: {sigma: $level}}
  dx: {block: signal.sum, rate: fast, with: {signs: "+-"}, in: {u: [x.y, 3 m]}}
  dy: {block: signal.sum, rate: fast, in: {u: [y.y, 2]}}
  metres: {block: signal.gain, rate: fast, with: {factor: 1 m}, in: {u: dy.y}}
  away: {block: signal.concatenate, rate: fast, in: {u: [dx.y, metres.y]}}
  square: {block: math.dot, rate: fast, in: {a: away.y, b: away.y}}
  distance: {block: math.function, rate: fast, with: {function: sqrt}, in: {u: square.y}}
summary:
  distance: {signal: distance.y, unit: cm, show: [max]}
"""
WALL = """\
  wall:
    block: signal.lookup_1d
    rate: fast
    with: {breakpoints: {value: [0, 2], unit: m}, values: [0, 1], outside: refuse}
    in: {u: x.y}
"""
EXPECT = "expect:\n  - {signal: x.y, below: 2 m}\n"


@pytest.fixture
def valley(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.chdir(tmp_path)
    Path("valley.yaml").write_text(VALLEY)
    return "valley.yaml"


def test_one_parameter_is_found_by_the_bounded_method(valley: str) -> None:
    result = quadvis.tune(valley, "distance.max", {"x": "0..10 m"}, settings=["y=[-2, 0]"])
    assert result.best.values["x"] == pytest.approx(3.0, abs=0.02)
    assert result.own is not None and result.own.values == {"x": 1.0}
    assert result.own.found == pytest.approx(200.0)
    assert result.quantity.unit == "cm" and result.best.passed and not result.at_ends
    assert quadvis.load(valley, settings=[*(f"{k}={v}" for k, v in result.settings.items())])


@pytest.mark.parametrize("method", mostly_slow([None, "powell", "evolution"]))
def test_two_parameters_are_found_by_each_method(method: str | None, valley: str) -> None:
    over = {"x": "0 m..500 cm", "y[0]": "-5..5"}
    result = quadvis.tune(valley, "distance.max", over, method=method, most=400)
    assert result.best.values == pytest.approx({"x": 3.0, "y[0]": -2.0}, abs=0.1)
    assert result.settings["x"].endswith(" cm")


def test_no_more_trials_than_asked_for(valley: str) -> None:
    seen: list[Any] = []
    result = quadvis.tune(
        valley, "distance.max", {"x": "0..10 m"}, most=5, progress=lambda *trials: seen.append(trials)
    )
    assert len(result.trials) == len(seen) == 5
    assert repr(result) == f"<TuneResult of valley: distance.max {result.best.found:.4g} cm in 5 trials>"
    assert all(best.found <= trial.found for trial, best in seen)


def test_the_number_is_the_mean_over_seeds(valley: str) -> None:
    text = VALLEY.replace('signs: "+-"}, in: {u: [x.y, 3 m]}', 'signs: "+-+"}, in: {u: [x.y, 3 m, noise.y]}')
    Path(valley).write_text(text)
    settings = ["level=10 cm"]
    result = quadvis.tune(
        valley, "distance.max", {"x": "0..10 m"}, settings=settings, seeds=(1, 2, 3), most=1
    )
    singles = [
        quadvis.tune(valley, "distance.max", {"x": "0..10 m"}, settings=settings, seeds=(seed,), most=1)
        for seed in (1, 2, 3)
    ]
    found = [each.best.found for each in singles]
    assert len(set(found)) == 3
    assert result.best.found == pytest.approx(math.fsum(found) / 3)


def test_a_best_value_at_an_end_is_said_and_one_that_misses_an_expectation(
    valley: str, capsys: Captured
) -> None:
    Path(valley).write_text(VALLEY + EXPECT)
    words = ["tune", valley, "--minimise", "distance.max", "--over", "x=0..2.5 m"]
    assert main(words) == 1
    out = capsys.readouterr().out
    assert "'x' is at an end of its range" in out and "--passing leaves such out" in out
    assert main([*words, "--passing"]) == 0
    assert re.search(r"--set 'x=(1.9|2)", capsys.readouterr().out)


def test_the_file_is_one_for_params(valley: str, capsys: Captured) -> None:
    words = ["tune", valley, "--minimise", "distance.max", "--over", "x=0..10 m", "--trials", "30"]
    assert main([*words, "-o", "best.yaml"]) == 0
    shown = capsys.readouterr().out
    assert "distance.max" in shown and "as it is" in shown and "parameters: best.yaml" in shown
    assert main(["run", valley, "--params", "best.yaml", "--log", ""]) == 0
    assert main([*words, "-o", valley]) == 2
    assert Path(valley).read_text() == VALLEY


@pytest.mark.parametrize(
    ("number", "over", "more", "sentence"),
    [
        (
            "distance.mx",
            {"x": "0..10 m"},
            {},
            "the summary has no 'distance.mx'; did you mean 'distance.max'?",
        ),
        ("distance.max", {"z": "0..10 m"}, {}, "over: the diagram has no parameter 'z'"),
        ("distance.max", {"x": "0..10 s"}, {}, "over: "),
        ("distance.max", {"x": "10 m"}, {}, "x: '10 m' is no range; write one such as '1..6 rad/s'"),
        ("distance.max", {}, {}, "there is nothing to tune"),
        ("distance.max", {"x": "0..10 m"}, {"method": "newton"}, "there is no method 'newton'"),
        ("distance.max", {"x": "0..1 m", "y[0]": "0..1"}, {"method": "bounded"}, "is for one parameter"),
    ],
)
def test_what_cannot_be_tuned_gets_a_sentence(
    number: str, over: dict[str, str], more: dict[str, Any], sentence: str, valley: str
) -> None:
    with pytest.raises((QuadvisError, DiagramError)) as caught:
        quadvis.tune(valley, number, over, **more)
    assert sentence in str(caught.value)


def test_trials_that_stop_count_as_infinite_and_all_of_them_as_an_error(valley: str) -> None:
    text = VALLEY.replace("summary:", f"{WALL}summary:")
    Path(valley).write_text(text)
    result = quadvis.tune(valley, "distance.max", {"x": "1..10 m"}, most=20)
    assert any(math.isinf(trial.found) and trial.failure for trial in result.trials)
    assert result.best.values["x"] <= 2.0
    with pytest.raises(QuadvisError, match="no trial gave a number"):
        quadvis.tune(valley, "distance.max", {"x": "5..10 m"}, settings=["x=7 m"], most=4)


def test_the_methods_are_those_of_scipy() -> None:
    assert METHODS == ("bounded", "nelder-mead", "powell", "evolution")
