"""Where scopes find their signals, and how samples come from rows of several rates."""

from __future__ import annotations

import numpy as np
import pytest

from quadvis.api import load_text
from quadvis.engine.engine import Engine
from quadvis.errors import QuadvisError
from quadvis.scopes.board import ScopeBoard
from quadvis.scopes.package import Package
from quadvis.scopes.settings import ScopeSettings
from quadvis.scopes.source import ScopeSource
from tests.quadvis.scopes.model import source

DIAGRAM = load_text("""\
quadvis: 1
name: scoped
rates: {fast: 100 Hz, slow: {rate: 20 Hz, offset: 10 ms}}
stop_time: 1 s
blocks:
  wave: {block: sources.sine, rate: fast}
  late: {block: sources.sine, rate: slow, with: {amplitude: 3}}
""")


def test_the_elements_of_a_signal_are_traces_with_their_own_names() -> None:
    made = source()
    names = [trace.name for trace in made.plan(["fast.v", "fast.v[1]", "fast.v[1:]", "slow.on"]).traces]
    assert names == ["fast.v[0]", "fast.v[1]", "fast.v[1]", "fast.v[1]", "slow.on"]
    assert [trace.slot for trace in made.plan(["fast.v"]).traces] == [1, 2]
    assert {trace.unit for trace in made.plan(["fast.v"]).traces} == {"m"}


def test_the_elements_of_a_port_of_a_part_are_counted_from_0() -> None:
    found = ScopeSource(source().tick, [], {})
    assert found.names == ()
    graph = DIAGRAM.graph
    made = ScopeSource.of(graph, {"part.out": "wave.y"})
    assert [trace.name for trace in made.plan(["part.out"]).traces] == ["part.out"]
    assert made.plan(["part.out"]).traces[0].block == "wave"


def test_a_scope_runs_at_the_rate_of_the_fastest_of_its_signals() -> None:
    made = source()
    assert made.plan(["slow.z"]).spacing == 3
    plan = made.plan(["slow.z", "mid.n", "twin.y"])
    assert (plan.spacing, plan.rate, plan.grid) == (2, "every 2", ("mid", "twin"))
    assert made.plan(["slow.z"], "fast.x").spacing == 1


@pytest.mark.parametrize(
    "signals, trigger, message",
    [
        (["fast.xx"], "", "there is no signal 'fast.xx'; did you mean 'fast.x'?"),
        (["fast.v[2]"], "", "there is no 'fast.v[2]': 'fast.v' has the shape [2], count from 0"),
        (
            ["fast.x"],
            "fast.v",
            "'fast.v' has 2 elements; name one of them as the TriggerSignal, such as 'fast.v[0]'",
        ),
    ],
)
def test_a_signal_that_does_not_exist_is_named_in_a_sentence(
    signals: list[str], trigger: str, message: str
) -> None:
    with pytest.raises(QuadvisError) as found:
        source().plan(signals, trigger)
    assert str(found.value) == message


def test_scopes_tap_a_run_and_repeat_the_samples_of_slower_signals() -> None:
    packages: list[Package] = []
    board = ScopeBoard(ScopeSource.of(DIAGRAM.graph), packages.append)
    board.start(board.add(ScopeSettings(Signals=("late.y", "wave.y"), NumSamples=12)))
    with Engine(DIAGRAM.graph) as engine:
        for tap in board.taps():
            engine.attach(tap)
        engine.run(12)
    board.settle(12)
    (package,) = packages
    run = DIAGRAM.run()
    assert package.samples[:, 1].tolist() == run["wave.y"][:12].tolist()
    late = run["late.y"]  # at the ticks 1, 6, 11
    assert np.isnan(package.samples[0, 0])
    assert package.samples[1:, 0].tolist() == [late[0]] * 5 + [late[1]] * 5 + [late[2]]
    assert package.times.tolist() == run.times("wave.y")[:12].tolist()
