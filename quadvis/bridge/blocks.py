"""The blocks of an application whose signals a bridge hands on, from what the target says of its signals."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from fnmatch import fnmatchcase
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadvis.errors import QuadvisError, quoted, sentence, suggestion
from quadvis.output.recording import SLOT_TYPES, RecordedBlock, RecordedPort, Slots


class BlockSamples(NamedTuple):
    """N samples of blocks of one task: ``stamps`` (N,) in ns since 1970, ``values`` (N, k) in SI units.

    The numbers of the blocks lie side by side, in the order of their ports; NaN was not there yet.
    """

    blocks: tuple[RecordedBlock, ...]
    stamps: NDArray[np.int64]
    values: NDArray[np.float64]

    def by_block(self) -> Iterator[tuple[RecordedBlock, NDArray[np.float64]]]:
        """Yield each block with its own values (N, numbers)."""
        first = 0
        for block in self.blocks:
            width = sum(port.size for port in block.ports)
            yield block, self.values[:, first : first + width]
            first += width


def chosen_signals(
    facts: Sequence[Mapping[str, Any]], names: Sequence[str], pictures: Sequence[str] = ()
) -> list[Mapping[str, Any]]:
    """Return the facts of the signals that some names mean; of all of them without names.

    A name is that of a signal, also at the port of a part, or a pattern such as "craft.*". QuadvisError if
    one means neither a signal nor one of the ``pictures``.
    """
    for name in names:
        if not any(_means(name, each) for each in facts) and not chosen_names(pictures, [name]):
            known = [*(known for each in facts for known in (each["name"], *each["also"])), *pictures]
            whole = name.partition("[")[0]
            remedy = f"name all of the signal, {quoted(whole)}" if whole in known else suggestion(name, known)
            raise QuadvisError(sentence(f"there is no signal {quoted(name)}", remedy))
    return [each for each in facts if not names or any(_means(name, each) for name in names)]


def chosen_names(known: Sequence[str], names: Sequence[str]) -> list[str]:
    """Return those of the known names that some names or patterns mean; all without names."""
    return [
        each for each in known if not names or any(each == name or fnmatchcase(each, name) for name in names)
    ]


def _means(name: str, facts: Mapping[str, Any]) -> bool:
    return bool(chosen_names((facts["name"], *facts["also"]), [name]))


def bridged_blocks(facts: Sequence[Mapping[str, Any]]) -> list[RecordedBlock]:
    """Return the blocks of signals, each with its ports as in a log, and its task as its rate."""
    found: dict[str, list[RecordedPort]] = {}
    tasks: dict[str, str] = {}
    for each in facts:
        path, _, port = str(each["name"]).rpartition(".")
        made = RecordedPort(port, str(each["type"]), tuple(each["shape"]), str(each["unit"]))
        if made.size:
            found.setdefault(path, []).append(made)
            tasks[path] = str(each["task"])
    return [RecordedBlock(f"/{path}", tuple(ports), tasks[path]) for path, ports in found.items()]


def slots_of(block: RecordedBlock, values: NDArray[np.float64]) -> Slots:
    """Return values (N, numbers) of a block as the rows of a log have them (N, slots); see `is_whole`."""
    slots = np.ascontiguousarray(values, "<f8").view(np.int64).copy()
    first = 0
    for port in block.ports:
        part = slice(first, first + port.size)
        if SLOT_TYPES[port.type] == "<i8":
            slots[:, part] = values[:, part]
        first += port.size
    return slots


def is_whole(block: RecordedBlock, values: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return whether all whole numbers and truths of rows are there, (N,): among slots these have no NaN."""
    whole = np.repeat([port.type != "float64" for port in block.ports], [port.size for port in block.ports])
    return np.asarray(~np.isnan(values[:, whole]).any(axis=1), np.bool_)
