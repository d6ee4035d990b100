"""Rows through rings are those that taps of a simulation get, to the bit, with either engine."""

from __future__ import annotations

import numpy as np
import pytest

from quadvis.api import load_text
from quadvis.engine.taps import Tap
from quadvis.realtime.streams import streams_of
from tests.quadvis.realtime.fakes import FakeClock, Paced
from tests.stages import mostly_slow

TEXT = """\
quadvis: 1
name: rows
rates: {fast: 1 kHz, slow: 250 Hz}
solver: {step: 1 ms}
stop_time: 100 s
seed: 3
blocks:
  noise: {block: sources.noise, rate: fast, with: {sigma: 1 rad}}
  lag: {block: signal.low_pass, rate: fast, with: {time_constant: 0.1 s}, in: {u: noise.y}}
  wave: {block: sources.sine, rate: fast}
  three: {block: sources.constant, rate: slow, with: {value: {value: [1, 2, 3]}}}
  held: {block: signal.hold_valid, rate: slow, in: {value: {from: lag.y, across: sample}}}
"""


class Kept(Tap):
    """Keeps the rows of a block by tick."""

    def __init__(self, block: str, every: int = 1) -> None:
        self.block, self.every = block, every
        self.rows: dict[int, bytes] = {}

    def take(self, tick: int, row: memoryview) -> None:
        self.rows[tick] = bytes(row)


def taps() -> list[Kept]:
    """Return taps whose rows lie side by side, apart, and at different rhythms; nothing of 'three'.

    Two of them take the same rows.
    """
    found = [Kept("noise"), Kept("wave"), Kept("lag"), Kept("held"), Kept("wave", 3), Kept("held", 2)]
    return [*found, Kept("wave")]


@pytest.mark.parametrize("engine", mostly_slow(["python", "native"]))
def test_rows_through_rings_are_those_of_taps_to_the_bit(engine: str) -> None:
    diagram = load_text(TEXT)
    simulated, received = taps(), taps()
    plain = Paced(diagram, FakeClock(), engine=engine)
    for tap in simulated:
        plain.engine.attach(tap)
    plain.run(400)
    pairs = streams_of(diagram.graph, received)
    assert len(pairs) == 4
    assert all(
        stream.room * stream.every >= 2 / diagram.graph[stream.blocks[0]].task.period for stream, _ in pairs
    )
    paced = Paced(diagram, FakeClock(), streams=[stream for stream, _ in pairs], engine=engine)
    with paced.engine:
        for _ in range(8):
            paced.engine.run(50)
            for (stream, group), ring in zip(pairs, paced.shared.rings, strict=True):
                stream.hand_on(ring.take(), group)
        for (stream, group), ring in zip(pairs, paced.shared.rings, strict=True):
            stream.hand_on(ring.take(last=True), group)
            assert ring.lost == 0
    assert [tap.rows for tap in received] == [tap.rows for tap in simulated]
    assert list(received[4].rows) == list(range(0, 400, 3))


def test_a_stream_carries_a_block_once_for_all_its_taps() -> None:
    diagram = load_text(TEXT)
    wanted = [Kept("wave"), Kept("noise"), Kept("wave"), Kept("wave", 3), Kept("wave")]
    (stream, own), (slow, _) = streams_of(diagram.graph, wanted)
    assert (stream.blocks, stream.ring[1]) == (("wave", "noise"), 3)
    assert list(map(list, own)) == [[wanted[0], wanted[2], wanted[4]], [wanted[1]]]
    assert slow.blocks == ("wave",)
    stream.hand_on(np.arange(6).reshape(2, 3), own)
    assert wanted[0].rows == wanted[2].rows == wanted[4].rows
    assert list(wanted[0].rows) == [0, 3]


def test_after_a_skip_rows_are_those_of_the_ticks_that_ran() -> None:
    diagram = load_text(TEXT)
    clock = FakeClock()
    tap, slow = Kept("wave"), Kept("wave", 3)
    pairs = streams_of(diagram.graph, [tap, slow])
    paced = Paced(diagram, clock, streams=[stream for stream, _ in pairs])

    def work(tick: int) -> None:
        clock.instant += 4_500_000 if tick == 10 else 0

    paced.engine.observe("fast", work)
    paced.run(30)
    for (stream, group), ring in zip(pairs, paced.shared.rings, strict=True):
        stream.hand_on(ring.take(last=True), group)
    assert list(tap.rows) == [*range(11), *range(15, 30)]
    assert list(slow.rows) == [0, 3, 6, 9, 15, 18, 21, 24, 27]  # 12 was missed
    values = [np.frombuffer(row)[0] for row in tap.rows.values()]
    np.testing.assert_array_equal(values, [np.sin(2 * np.pi * (tick / 1000)) for tick in tap.rows])
