"""A small flight that reads the world, and logs written again with other rows."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import quadvis
from quadvis import Log, read_log
from quadvis.output.log import LogWriter

TEXT = """\
quadvis: 1
name: flight
rates: {fast: 30 Hz, slow: 10 Hz}
stop_time: 2 s
seed: 7
blocks:
  noise: {block: sources.noise, rate: fast, with: {sigma: 0.1 m}}
  outside: {block: own.outside, rate: fast}
  sum: {block: signal.sum, rate: fast, in: {u: [noise.y, outside.y]}}
  filter: {block: signal.low_pass, rate: fast, with: {time_constant: 0.2 s}, in: {u: sum.y}}
  slow: {block: signal.gain, rate: slow, with: {factor: 2}, in: {u: {from: filter.y, across: sample}}}
log: {every: {fast: 4}}
"""
OUTSIDE = '''
"""A block that reads what the world says."""

from pathlib import Path

from quadvis.block import Block, Out


class Outside(Block, numeric=False):
    """Reads a number from the file 'world', and adds one to it."""

    not_replayable = "it reads the world"

    y = Out(unit="m", nan=True)
    even = Out("bool")

    def read(self):
        self.number = int(Path("world").read_text())
        Path("world").write_text(str(self.number + 1))

    def output(self):
        return 0.1 * self.number, self.number % 2 == 0
'''
Rows = NDArray[np.int64]
Edit = Callable[[str, Rows, Rows], tuple[Rows, Rows]]


def write_flight(text: str = TEXT) -> None:
    """Write the diagram, its own block, and the world of this block, into the working directory."""
    Path("flight.yaml").write_text(text)
    Path("blocks/own").mkdir(parents=True, exist_ok=True)
    Path("blocks/own/outside.py").write_text(OUTSIDE)
    Path("world").write_text("5")


def flown(log: str = "run.mcap", **more: Any) -> Log:
    quadvis.load("flight.yaml", **more).run(log=log)
    return read_log(log)


def rewritten(log: Log, edit: Edit, summary: Mapping[str, str] | None = None, path: str = "new.mcap") -> Log:
    """Write a log again, with the stamps and rows of each topic as ``edit`` returns them."""
    blocks = [*log.blocks, *log.hidden.blocks]
    with LogWriter(path, blocks, {**log.metadata, "diagram": log.diagram}) as writer:
        for index, block in enumerate(blocks):
            where = log.hidden if block.hidden else log
            writer.write_rows(index, *edit(block.path, *where.arrays(block.path)))
        writer.close(log.summary if summary is None else summary)
    return read_log(path)


def without(topic: str, *rows: int) -> Edit:
    """Leave rows of a topic out."""

    def edit(path: str, stamps: Rows, slots: Rows) -> tuple[Rows, Rows]:
        some = np.array([row not in rows or path != topic for row in range(len(stamps))], bool)
        return stamps[some], slots[some]

    return edit


def flipped(topic: str, row: int, slot: int, bit: int = 0) -> Edit:
    """Flip a bit of a value, by default the last one."""

    def edit(path: str, stamps: Rows, slots: Rows) -> tuple[Rows, Rows]:
        slots = slots.copy()
        if path == topic:
            slots[row, slot] ^= 1 << bit
        return stamps, slots

    return edit
