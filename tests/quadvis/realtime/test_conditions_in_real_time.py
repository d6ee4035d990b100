"""Blocks under conditions in real time, in one loop and in threads of their own: the bits of a simulation."""

from __future__ import annotations

import sys

import pytest

from quadvis.api import Diagram, load_text
from quadvis.engine.engine import Engine
from quadvis.realtime.streams import streams_of
from tests.quadvis.realtime.fakes import CrewClock, Paced
from tests.quadvis.realtime.test_streams import Kept

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="real time is Linux's")

TEXT = """\
quadvis: 1
name: conditions
tasking: multi
rates: {fast: 1 kHz, slow: 250 Hz}
stop_time: 100 s
overload: {action: warn}
blocks:
  wave: {block: sources.sine, rate: fast, with: {frequency: 7 Hz, amplitude: 1 m}}
  high: {block: logic.compare, rate: fast, with: {operator: ">"}, in: {a: wave.y, b: 0.3 m}}
  low: {block: logic.compare, rate: fast, with: {operator: "<"}, in: {a: wave.y, b: -0.3 m}}
  deep: {block: logic.compare, rate: fast, with: {operator: "<"}, in: {a: wave.y, b: -0.6 m}}
  on: {block: logic.run_condition, rate: fast, with: {states: reset}, in: {when: high.y}}
  sum: {block: signal.discrete_integrator, rate: fast, condition: on, in: {u: wave.y}}
  shown:
    block: logic.part_output
    rate: fast
    in: {u: sum.y, shown: on.shown, initial: 1 m*s}
  slow:
    block: logic.run_condition
    rate: slow
    with: {reset_on: rising}
    in: {when: {from: low.y, across: sample}, reset: {from: high.y, across: sample}}
  late: {block: signal.low_pass, rate: slow, condition: slow, with: {time_constant: 9 ms},
         in: {u: {from: shown.y, across: sample}}}
  edge:
    block: logic.run_condition
    rate: slow
    condition: slow
    with: {trigger_on: rising}
    in:
      trigger: {from: deep.y, across: delay}
      around_enabled: slow.enabled
      around_active: slow.active
  held: {block: signal.gain, rate: slow, condition: edge, in: {u: late.y}}
  back: {block: signal.gain, rate: fast, in: {u: {from: late.y, across: hold}}}
"""
BLOCKS = ("on", "sum", "shown", "slow", "late", "edge", "held", "back")
TICKS = 601


def simulated(made: Diagram) -> list[dict[int, bytes]]:
    engine, taps = Engine(made.graph, made.seed), [Kept(block) for block in BLOCKS]
    for tap in taps:
        engine.attach(tap)
    with engine:
        engine.run(TICKS)
    return [tap.rows for tap in taps]


@pytest.mark.parametrize("engine", ["python", pytest.param("native", marks=pytest.mark.slow)])
@pytest.mark.parametrize("tasking", ["single", "multi"])
def test_the_signals_are_those_of_the_simulation(engine: str, tasking: str) -> None:
    made = load_text(TEXT.replace("multi", tasking))
    taps = [Kept(block) for block in BLOCKS]
    pairs = streams_of(made.graph, taps)
    paced = Paced(made, CrewClock(), streams=[stream for stream, _ in pairs], engine=engine)
    paced.run(TICKS)
    for (stream, group), ring in zip(pairs, paced.shared.rings, strict=True):
        stream.hand_on(ring.take(last=True), group)
    wanted = simulated(made)
    assert [tap.rows for tap in taps] == wanted
    assert all(len({*rows.values()}) > 1 for rows in wanted)
