"""Logs written again with other rows."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from quadvis import Log, read_log
from quadvis.output.log import LogWriter

Rows = NDArray[np.int64]
Edit = Callable[[str, Rows, Rows], tuple[Rows, Rows]]


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


def flipped(topic: str, row: int, slot: int) -> Edit:
    """Flip the last bit of a value."""

    def edit(path: str, stamps: Rows, slots: Rows) -> tuple[Rows, Rows]:
        slots = slots.copy()
        if path == topic:
            slots[row, slot] ^= 1
        return stamps, slots

    return edit
