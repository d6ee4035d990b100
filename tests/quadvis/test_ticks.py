"""A run that would never end is a fault of its rates, found when the diagram is checked."""

from __future__ import annotations

import pytest

from quadvis.api import load_text
from quadvis.errors import DiagramError, Fault


def diagram(rates: dict[str, str], stop: str, step: str = "") -> str:
    """Return a diagram with a block at each rate, and one more if there is a solver step."""
    blocks = [f"  b_{name}: {{block: sources.constant, rate: {name}}}" for name in rates]
    blocks += ["  x: {block: signal.integrator, in: {u: 0}}"] if step else []
    solver = [f"solver: {{step: {step}}}"] if step else []
    named = [f"rates: {{{', '.join(f'{name}: {rate}' for name, rate in rates.items())}}}"]
    head = ["quadvis: 1", "name: case", *named, *solver, f"stop_time: {stop}", "blocks:"]
    return "\n".join(head + blocks) + "\n"


def faults(text: str) -> list[Fault]:
    """Return what is wrong."""
    try:
        load_text(text)
    except DiagramError as error:
        return error.faults
    return []


@pytest.mark.parametrize(
    ("rates", "stop", "guilty"),
    [
        ({"a": "9999991 Hz", "b": "9999973 Hz", "c": "9999971 Hz"}, "1 s", "ab"),
        ({"a": "1 kHz"}, "1e6 s", "a"),
        ({"a": "1 kHz", "b": "100 Hz", "c": "50 Hz"}, "1e7 s", "a"),
        ({"a": "1 ns"}, "1 s", "a"),
        ({"a": "1 Hz"}, "1e9 s", "a"),
        ({"a": "99991 Hz", "b": "99989 Hz", "c": "10 Hz"}, "1 s", "ab"),
        ({"a": "10 Hz", "b": "{rate: 10 Hz, offset: 0.123456789123 s}"}, "10 s", "b"),
        ({"a": "10 Hz", "b": "{rate: 10 Hz, offset: 1e-12 s}"}, "1 s", "b"),
        ({"a": "30.000001 Hz", "b": "29.999999 Hz"}, "100 s", "ab"),
        ({"a": "0.033333333333 s", "b": "20 ms"}, "100 s", "ab"),
        ({"a": "100 Hz", "b": "16.6666666 ms", "c": "33.3333333 ms"}, "140 s", "ab"),
        ({"a": "7919 Hz", "b": "7907 Hz", "c": "7901 Hz"}, "10 s", "abc"),
    ],
)
def test_rates_whose_run_never_ends_are_told_with_their_names(
    rates: dict[str, str], stop: str, guilty: str
) -> None:
    (fault,) = faults(diagram(rates, stop))
    assert "ticks, and must have fewer than 1e9" in fault.problem
    assert [name for name in rates if f"'{name}' (" in fault.problem] == list(guilty)
    assert fault.place.line == 3
    assert fault.remedy


@pytest.mark.parametrize(
    ("rates", "stop"),
    [
        ({"a": "1 kHz", "b": "30 Hz"}, "1000 s"),
        ({"a": "1/30 s", "b": "20 ms", "c": "100 Hz"}, "140 s"),
        ({"a": "29.97 Hz", "b": "100 Hz"}, "140 s"),
        ({"a": "1 Hz"}, "999999999 s"),
        ({"a": "1 ns"}, "0 s"),
        ({"a": "9999991 Hz", "b": "9999973 Hz"}, "0 s"),
        ({"a": "10 Hz", "b": "{rate: 10 Hz, offset: 1 ms}"}, "1000 s"),
    ],
)
def test_runs_that_end_are_not(rates: dict[str, str], stop: str) -> None:
    assert faults(diagram(rates, stop)) == []


def test_a_step_that_is_too_fine_is_told_at_the_step() -> None:
    (fault,) = faults(diagram({"a": "10 Hz"}, "100 s", step="1 ns"))
    assert fault.place.line == 4
    assert (
        fault.problem == "with a step of 1e-09 s a run of 100 s has 1e+11 ticks, and must have fewer than 1e9"
    )


def test_a_rate_that_is_wrong_anyhow_is_told_once() -> None:
    text = diagram({"a": "10 Hz"}, "1 s").replace("rate: a", "rate: b")
    assert len(faults(text)) == 1
