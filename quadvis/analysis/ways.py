"""The ways of transfers through a graph; those of one rhythm are linearised together."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from typing import NamedTuple

from quadvis.analysis.cut import break_path, with_breaks
from quadvis.analysis.linearise import Linear, linearised_part
from quadvis.analysis.loops import AnalysisError, blocks_between, hyperperiod
from quadvis.diagram.sections.cuts import Cut, CutSignal
from quadvis.diagram.sections.transfers import Transfer
from quadvis.graph.graph import Graph


class Way(NamedTuple):
    """The blocks from the source of a transfer to its target, with the loops that they are on.

    Its rhythm is their hyperperiod in ticks, and whether all of them are continuous.
    """

    transfer: Transfer
    blocks: frozenset[str]
    rhythm: tuple[int, bool]


class Ways:
    """The ways of some transfers. What has one rhythm has one operating point, and is linearised once."""

    def __init__(self, graph: Graph, transfers: Mapping[str, Transfer], at: float, engine: str) -> None:
        self._graph, self._transfers, self._at, self._engine = graph, transfers, at, engine
        self._linears: dict[str, Linear] = {}
        self._alone: set[str] = set()  # those whose company cannot be linearised

    def linear(self, label: str) -> Linear:
        """Return the matrices in which a transfer has its channels, each labelled by `channel_label`.

        AnalysisError if nothing gets from the one signal to the other, or as for `linearised`.
        """
        if label not in self._linears:
            way = way_of(self._opened, self._transfers[label])
            mates = self._mates(way) if label not in self._alone else [way]
            try:
                found = self._linearised(mates)
            except AnalysisError:
                if len(mates) == 1:
                    raise
                self._alone |= {each.transfer.label for each in mates}
                mates, found = [way], self._linearised([way])
            self._linears |= {each.transfer.label: found for each in mates}
        return self._linears[label]

    @cached_property
    def _opened(self) -> Graph:
        signals = (signal for each in self._transfers.values() for signal in _signals(each))
        return with_breaks(self._graph, signals)

    def _mates(self, way: Way) -> list[Way]:
        """Return the ways of the rhythm of one that are not known to go alone, that one included."""
        found = []
        for label, transfer in self._transfers.items():
            try:
                other = way if label == way.transfer.label else way_of(self._opened, transfer)
            except AnalysisError:
                continue  # reported when that transfer is asked for
            if other.rhythm == way.rhythm and label not in self._alone:
                found.append(other)
        return found

    def _linearised(self, ways: Sequence[Way]) -> Linear:
        blocks = set[str]().union(*(way.blocks for way in ways))
        cuts = _cuts(way.transfer for way in ways)
        return linearised_part(self._opened, blocks, cuts, self._at, self._engine)


def way_of(opened: Graph, transfer: Transfer) -> Way:
    """Return the way of a transfer in a graph that has its breaks; AnalysisError if there is none."""
    source, target = transfer.source, transfer.target
    begin, end = break_path(source.block, source.port), _reading(opened, target)
    if not blocks_between(opened, [begin], [end]):
        problem = f"transfer '{transfer.label}': no way leads from '{source.text}' to '{target.text}'"
        raise AnalysisError(f"{problem}; name a signal that depends on the first one")
    begins = [begin, *(break_path(signal.block, signal.port) for signal in transfer.opened)]
    blocks = blocks_between(opened, begins, [end, *(signal.block for signal in transfer.opened)])
    tasks = {node.task for node in opened.nodes if node.path in blocks}
    return Way(
        transfer, frozenset(blocks), (hyperperiod(opened, tasks), all(each.continuous for each in tasks))
    )


def channel_label(signal: CutSignal) -> str:
    """Return the label of the channels of a signal, which transfers that name it share."""
    return f"{break_path(signal.block, signal.port)}{list(signal.elements)}"


def _signals(transfer: Transfer) -> tuple[CutSignal, ...]:
    return (transfer.source, transfer.target, *transfer.opened)


def _cuts(transfers: Iterable[Transfer]) -> list[Cut]:
    """Return a cut for each signal; those that only answer are never disturbed."""
    signals: dict[str, CutSignal] = {}
    disturbed: set[str] = set()
    for transfer in transfers:
        signals |= {channel_label(signal): signal for signal in _signals(transfer)}
        disturbed |= {channel_label(signal) for signal in (transfer.source, *transfer.opened)}
    return [Cut(label, (signal,), label not in disturbed) for label, signal in signals.items()]


def _reading(graph: Graph, signal: CutSignal) -> str:
    """Return the block that gives a signal as it is read: an input's is behind its break."""
    is_input = signal.feed is not None or signal.port in graph[signal.block].inputs
    return break_path(signal.block, signal.port) if is_input else signal.block
