"""Statistics and expectations against numpy and by hand, on signals made for the purpose."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray

from quadvis.output.verdict import EXPECTATIONS, STATISTICS, Entry, Expectation, Outcome, Part, statistic
from quadvis.units import Unit

METRE, CENTIMETRE, RADIAN, DEGREE = map(Unit.parse, ("m", "cm", "rad", "deg"))


class Signals:
    """One signal, sampled every 0.1 s."""

    def __init__(self, rows: Any) -> None:
        self.rows = np.asarray(rows)

    def __getitem__(self, name: str) -> NDArray[Any]:
        assert name == "craft.position"
        return self.rows

    def times(self, name: str) -> NDArray[np.float64]:
        return np.arange(len(self.rows)) / 10


def part(**changes: Any) -> Part:
    return Part(
        **{"name": "craft.position", "text": "craft.position", "unit": METRE, "shown": METRE} | changes
    )


def found(kind: str, rows: Any, limit: float = 0.0, **changes: Any) -> float:
    return Expectation(part(**changes), kind, limit).judge(Signals(rows)).found


SAMPLES = arrays(float, st.tuples(st.integers(1, 20), st.integers(1, 4)), elements=st.floats(-1e3, 1e3))


@given(SAMPLES)
def test_statistics_are_those_of_numpy(values: NDArray[np.float64]) -> None:
    assert statistic("rms", values) == pytest.approx(math.sqrt(sum(x * x for x in values.flat) / values.size))
    assert statistic("max", values) == max(abs(x) for x in values.flat)
    assert statistic("mean", values) == pytest.approx(sum(values.flat) / values.size, abs=1e-9)
    assert statistic("lowest", values) == min(values.flat)
    assert statistic("highest", values) == max(values.flat)
    assert statistic("final", values) == values[-1, 0]
    assert statistic("count", values) == sum(any(row) for row in values.tolist())


@pytest.mark.parametrize("name", [name for name in STATISTICS if name != "count"])
def test_a_missing_sample_leaves_no_number(name: str) -> None:
    assert math.isnan(statistic(name, np.array([[1.0], [math.nan]])))
    assert math.isnan(statistic(name, np.zeros((0, 1))))


def test_elements_are_judged_one_by_one() -> None:
    rows = [[3.0, -4.0, 0.0], [0.0, 0.0, 9.0]]
    assert found("within", rows, index=(slice(0, 2),)) == 4
    assert found("rms", rows, index=(slice(0, 2),)) == 2.5
    assert found("within", rows, index=(2,)) == 9


def test_a_stretch_of_the_run_includes_both_ends() -> None:
    rows = [9.0, 1.0, 2.0, 3.0, 9.0]
    assert found("within", rows, after=0.1, before=0.3) == 3
    assert found("within", rows, after=0.4) == 9
    assert math.isnan(found("within", rows, after=0.5))


def test_what_is_judged_is_the_distance_from_a_value() -> None:
    rows = [1.4, 1.5, 1.7]
    assert found("within", rows, of=1.5) == pytest.approx(0.2)
    assert found("above", rows, of=1.5) == pytest.approx(-0.1)
    assert found("below", rows, of=1.5) == pytest.approx(0.2)


@pytest.mark.parametrize(
    ("kind", "limit", "met"),
    [("within", 3.0, True), ("within", 2.9, False), ("rms", 2.2, True), ("rms", 2.0, False),
     ("below", 2.0, False), ("below", 2.1, True), ("above", -3.0, False), ("above", -3.1, True),
     ("count", 2, True), ("count", 1, False)],
)  # fmt: skip
def test_limits_are_inclusive_but_for_below_and_above(kind: str, limit: float, met: bool) -> None:
    assert Expectation(part(), kind, limit).judge(Signals([2.0, -3.0, 0.0])).met is met


@pytest.mark.parametrize("kind", [kind for kind in EXPECTATIONS if kind != "count"])
@pytest.mark.parametrize("rows", [[1.0, math.nan], np.zeros(0)])
def test_nothing_to_judge_meets_no_expectation(kind: str, rows: Any) -> None:
    verdict = Expectation(part(), kind, -1e9 if kind == "above" else 1e9).judge(Signals(rows))
    assert not verdict.met
    assert str(verdict).endswith(": nothing to judge")
    assert verdict.facts()["found"] is None


def test_truths_are_counted() -> None:
    assert found("count", [True, False, True]) == 2
    assert found("count", np.array([0, 5, 0])) == 1


@pytest.mark.parametrize(
    ("kind", "changes", "words"),
    [
        ("within", {}, "met: craft.position within 0.5 m: 0.25 m"),
        (
            "rms",
            {"shown": CENTIMETRE, "after": 0.1},
            "met: craft.position rms at most 50 cm after 0.1 s: 25 cm",
        ),
        ("below", {"of": 1.0}, "met: craft.position always below 0.5 m of 1 m: -0.75 m"),
        ("above", {"before": 2.0}, "NOT MET: craft.position always above 0.5 m before 2 s: 0.25 m"),
        ("count", {"unit": Unit(), "shown": Unit()}, "NOT MET: craft.position true at most 0.5 times: 3"),
        ("within", {"unit": RADIAN, "shown": DEGREE}, "met: craft.position within 28.65 deg: 14.32 deg"),
    ],
)
def test_verdicts_are_said_in_the_unit_that_people_read(
    kind: str, changes: dict[str, Any], words: str
) -> None:
    assert str(Expectation(part(**changes), kind, 0.5).judge(Signals([0.25, 0.25, 0.25]))) == words


def test_an_outcome_passes_if_every_expectation_is_met() -> None:
    good = Expectation(part(), "within", 2.0).judge(Signals([1.0]))
    bad = Expectation(part(), "within", 0.5).judge(Signals([1.0]))
    assert Outcome().passed
    assert Outcome(verdicts=(good, good)).passed
    assert not Outcome(verdicts=(good, bad)).passed


def test_a_line_of_the_summary_shows_its_statistics_in_its_unit() -> None:
    entry = Entry("x", part(shown=CENTIMETRE), ("rms", "count"))
    values = entry.compute(Signals([0.5, -0.5]))
    assert values == {"rms": 0.5, "count": 2}
    assert [entry.shows(name, value) for name, value in values.items()] == ["50 cm", "2"]
    assert entry.shows("rms", math.nan) == "none"
