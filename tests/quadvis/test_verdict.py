"""Expectations and lines of the summary against numpy and by hand, on signals made for the purpose."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from quadvis.diagram.requirements import EXPECTATIONS, Entry, Expectation, Selection
from quadvis.output.statistics import COUNT, STATISTICS, finite
from quadvis.output.stretch import Sampling, Stretch
from quadvis.run.verdict import Judging, Outcome, Verdict
from quadvis.units import Unit

METRE, CENTIMETRE, RADIAN, DEGREE = map(Unit.parse, ("m", "cm", "rad", "deg"))
NAME = "craft.position"


class Signals:
    """One signal, sampled every 0.1 s."""

    def __init__(self, rows: Any) -> None:
        self.rows = np.asarray(rows)

    def __getitem__(self, name: str) -> NDArray[Any]:
        assert name == NAME
        return self.rows

    def stamps(self, name: str) -> NDArray[np.int64]:
        return np.arange(len(self.rows)) * 100_000_000


def part(rows: Any, after: str = "0", before: str | None = None, **changes: Any) -> Selection:
    """Return a part of the signal in a run that ends with these rows."""
    shape = np.shape(rows)[1:]
    sampling = Sampling(spacing=Fraction(1, 10), end=Fraction(max(len(rows) - 1, 0), 10))
    stretch = Stretch(sampling, Fraction(after), None if before is None else Fraction(before))
    given = {"text": NAME, "unit": METRE, "shown": METRE, "stretch": stretch, "shape": shape}
    return Selection(NAME, **given | changes)


def judged(kind: str, rows: Any, limit: float = 0.0, **changes: Any) -> Verdict:
    """Return the verdict on a recording, after checking that one on the rows as they come is the same."""
    expectation = Expectation(part(rows, **changes), kind, limit)
    whole, piecewise = Judging([], [expectation]), Judging([], [expectation])
    whole.read(Signals(rows))
    for number in range(len(rows)):
        piecewise.take(NAME, number, np.asarray(rows)[number : number + 1])
    verdict, again = (judging.outcome().verdicts[0] for judging in (whole, piecewise))
    assert (repr(verdict.found), verdict.met, str(verdict)) == (repr(again.found), again.met, str(again))
    return verdict


def found(kind: str, rows: Any, limit: float = 0.0, **changes: Any) -> float:
    return judged(kind, rows, limit, **changes).found


def test_elements_are_judged_one_by_one() -> None:
    rows = [[3.0, -4.0, 0.0], [0.0, 0.0, 9.0]]
    assert found("within", rows, index=(slice(0, 2),)) == 4
    assert found("rms", rows, index=(slice(0, 2),)) == 2.5
    assert found("within", rows, index=(2,)) == 9


def test_a_stretch_of_the_run_includes_both_ends() -> None:
    rows = [9.0, 1.0, 2.0, 3.0, 9.0]
    assert found("within", rows, after="0.1", before="0.3") == 3
    assert found("within", rows, after="0.4") == 9
    assert math.isnan(found("within", rows, after="0.5"))


def test_what_is_judged_is_the_distance_from_a_value() -> None:
    rows = [1.4, 1.5, 1.7]
    assert found("within", rows, of=1.5) == pytest.approx(0.2)
    assert found("above", rows, of=1.5) == pytest.approx(-0.1)
    assert found("below", rows, of=1.5) == pytest.approx(0.2)


@pytest.mark.parametrize(
    ("kind", "limit", "met"),
    [("within", 3.0, True), ("within", 2.9, False), ("rms", 2.2, True), ("rms", 2.0, False),
     ("below", 2.0, False), ("below", 2.1, True), ("above", -3.0, False), ("above", -3.1, True),
     ("count", 2, True), ("count", 1, False), ("at_least", 2, True), ("at_least", 3, False)],
)  # fmt: skip
def test_limits_are_inclusive_but_for_below_and_above(kind: str, limit: float, met: bool) -> None:
    assert judged(kind, [2.0, -3.0, 0.0], limit).met is met


@pytest.mark.parametrize("kind", EXPECTATIONS)
@pytest.mark.parametrize("rows", [[1.0, math.nan], [math.nan], np.zeros(0)])
def test_nothing_to_judge_meets_no_expectation(kind: str, rows: Any) -> None:
    verdict = judged(kind, rows, -1e9 if kind in ("above", "at_least") else 1e9)
    assert not verdict.met
    assert ": nothing to judge" in str(verdict)
    assert verdict.facts()["found"] is None


def test_truths_are_counted() -> None:
    assert found("count", [True, False, True]) == 2
    assert found("count", np.array([0, 5, 0])) == 1
    assert found("at_least", np.array([[0, 5], [0, 0], [1, 0]])) == 2


@pytest.mark.parametrize(
    ("kind", "changes", "words"),
    [
        ("within", {}, "met: craft.position within 0.5 m: 0.25 m"),
        (
            "rms",
            {"shown": CENTIMETRE, "after": "0.1"},
            "met: craft.position rms at most 50 cm after 0.1 s: 25 cm",
        ),
        ("below", {"of": 1.0}, "met: craft.position always below 0.5 m of 1 m: -0.75 m"),
        ("above", {"before": "0.2"}, "NOT MET: craft.position always above 0.5 m before 0.2 s: 0.25 m"),
        ("count", {"unit": Unit(), "shown": Unit()}, "NOT MET: craft.position true at most 0.5 times: 3"),
        ("at_least", {"unit": Unit(), "shown": Unit()}, "met: craft.position true at least 0.5 times: 3"),
        ("within", {"unit": RADIAN, "shown": DEGREE}, "met: craft.position within 28.65 deg: 14.32 deg"),
        (
            "within",
            {"before": "2"},
            "NOT MET: craft.position within 0.5 m before 2 s: 0.25 m: "
            "the run ends at 0.2 s, the window at 2 s",
        ),
        (
            "within",
            {"after": "1/3"},
            "NOT MET: craft.position within 0.5 m after 1/3 s: nothing to judge: "
            "the run ends at 0.2 s, the window begins at 1/3 s",
        ),
    ],
)
def test_verdicts_are_said_in_the_unit_that_people_read(
    kind: str, changes: dict[str, Any], words: str
) -> None:
    assert str(judged(kind, [0.25, 0.25, 0.25], 0.5, **changes)) == words


@pytest.mark.parametrize("kind", EXPECTATIONS)
@pytest.mark.parametrize("missing", [0, 4, 9])
def test_a_recording_in_which_a_sample_is_missing_meets_no_expectation(kind: str, missing: int) -> None:
    class Gap(Signals):
        def stamps(self, name: str) -> NDArray[np.int64]:
            return np.delete(np.arange(10), missing) * 100_000_000

    rows = np.ones(9)
    expectation = Expectation(part(np.ones(10)), kind, 1.0 if kind != "above" else 0.0)
    judging = Judging([], [expectation])
    judging.read(Gap(rows))
    (verdict,) = judging.outcome().verdicts
    assert not verdict.met
    assert verdict.lack == "9 of its 10 samples are there"


def test_an_outcome_passes_if_every_expectation_is_met() -> None:
    good, bad = judged("within", [1.0], 2.0), judged("within", [1.0], 0.5)
    assert Outcome().passed
    assert Outcome(verdicts=(good, good)).passed
    assert not Outcome(verdicts=(good, bad)).passed


def summary(rows: Any, *names: str, **changes: Any) -> tuple[Entry, dict[str, Any]]:
    entry = Entry("x", part(rows, **changes), names)
    judging = Judging([entry], [])
    judging.read(Signals(rows))
    return entry, dict(judging.outcome().summary["x"])


def test_a_line_of_the_summary_shows_its_statistics_in_its_unit() -> None:
    entry, values = summary([0.5, -0.5], "rms", COUNT, shown=CENTIMETRE)
    assert values == {"rms": 0.5, "count": 2}
    assert [entry.shows(name, value) for name, value in values.items()] == ["50 cm", "2"]
    assert entry.shows("rms", math.nan) == "none"


@pytest.mark.parametrize(
    ("rows", "index", "value", "elements"),
    [
        ([0.0, 1.0], (), 1.0, ("",)),
        ([[0, 0, 0], [1, 2, 3]], (), (1.0, 2.0, 3.0), ("[0]", "[1]", "[2]")),
        ([[0, 0, 0], [1, 2, 3]], (2,), 3.0, ("",)),
        ([[0, 0, 0], [1, 2, 3]], (slice(1, 3),), (2.0, 3.0), ("[1]", "[2]")),
        ([[0, 0, 0], [1, 2, 3]], (slice(None, 1),), 1.0, ("",)),
        ([[[0, 0]], [[1, 2]]], (), (1.0, 2.0), ("[0,0]", "[0,1]")),
        ([[[0, 0], [0, 0]], [[1, 2], [3, 4]]], (1,), (3.0, 4.0), ("[1,0]", "[1,1]")),
        ([[[0, 0], [0, 0]], [[1, 2], [3, 4]]], (1, 0), 3.0, ("",)),
        ([[True, False], [False, True]], (), (0.0, 1.0), ("[0]", "[1]")),
        ([[1.0, math.nan]], (), (1.0, math.nan), ("[0]", "[1]")),
    ],
)  # fmt: skip
def test_the_final_value_of_several_elements_has_all_of_them(
    rows: Any, index: Any, value: Any, elements: tuple[str, ...]
) -> None:
    entry, values = summary(rows, "final", index=index)
    assert repr(values["final"]) == repr(value)
    assert entry.selection.elements == elements
    assert finite(values["final"]) == ([1.0, None] if repr(math.nan) in repr(value) else (
        list(value) if isinstance(value, tuple) else value
    ))  # fmt: skip


def test_several_final_values_are_shown_in_one_unit() -> None:
    entry, values = summary([[0.01, -0.5]], "final", shown=CENTIMETRE)
    assert entry.shows("final", values["final"]) == "(1, -50) cm"


def test_every_statistic_can_be_shown() -> None:
    _, values = summary([[3.0, -4.0]], *STATISTICS)
    assert values == {
        "rms": math.sqrt(12.5), "max": 4, "mean": -0.5, "lowest": -4, "highest": 3,
        "final": (3, -4), "count": 1,
    }  # fmt: skip
