"""The transfers of a diagram: how one signal answers a disturbance of another one, in matrices.

Only the blocks on the way are linearised, with the loops that they are on. Where a transfer is open, the
returning signal is taken out of the matrices again: its readers get what they get at the operating point.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from quadvis.analysis.linearise import Linear
from quadvis.analysis.loops import AnalysisError
from quadvis.analysis.probe import Matrix, Positions
from quadvis.analysis.progress import task
from quadvis.analysis.response import Response
from quadvis.analysis.ways import Ways, channel_label
from quadvis.diagram.sections.cuts import CutSignal
from quadvis.diagram.sections.transfers import Transfer
from quadvis.errors import quoted, sentence, suggestion
from quadvis.graph.graph import Graph
from quadvis.native.choice import AUTO

FAINT = 1e-10  # an entry of a matrix below this share of what it was made from is the noise of differences


class Transfers(Mapping[str, Response]):
    """The responses of all transfers, by name; each is computed when it is first read.

    The first one linearises what it shares with others. AnalysisError if nothing gets from the one signal to
    the other, or as for `linearised`.
    """

    def __init__(self, graph: Graph, transfers: Sequence[Transfer], at: float, engine: str = AUTO) -> None:
        self._transfers = {transfer.label: transfer for transfer in transfers}
        self._ways = Ways(graph, self._transfers, at, engine)
        self._found: dict[str, Response] = {}

    def __getitem__(self, label: str) -> Response:
        if label not in self._transfers:
            remedy = suggestion(label, self._transfers) or "declare it under 'analyse: {transfer: ...}'"
            raise AnalysisError(sentence(f"there is no transfer {quoted(label)}", remedy))
        if label not in self._found:
            with task(f"transfer '{label}'"):
                self._found[label] = _response(self._transfers[label], self._ways.linear(label))
        return self._found[label]

    def __iter__(self) -> Iterator[str]:
        return iter(self._transfers)

    def __len__(self) -> int:
        return len(self._transfers)


def _response(transfer: Transfer, linear: Linear) -> Response:
    """Return the matrices from the source to the target, without the states that are on no way."""
    source, target = (_places(linear, (end,)) for end in (transfer.source, transfer.target))
    a, b, c, d = _without_returns(linear, source, target, _places(linear, transfer.opened))
    kept = _on_the_way(a, b, c)
    times = [[linear.channels[index].time for index in places] for places in (source, target)]
    return Response(
        transfer,
        (a[np.ix_(kept, kept)], b[kept], c[:, kept], d),
        linear.period,
        tuple(linear.states[index] for index in kept),
        (np.array(times[0]), np.array(times[1])),
    )


def _places(linear: Linear, signals: Sequence[CutSignal]) -> Positions:
    """Return the numbers of the channels of some signals."""
    labels = {channel_label(signal) for signal in signals}
    return np.array([index for index, each in enumerate(linear.channels) if each.cut in labels], np.intp)


def _without_returns(
    linear: Linear, source: Positions, target: Positions, opened: Positions
) -> tuple[Matrix, Matrix, Matrix, Matrix]:
    """Return the matrices of the ends, with minus what returns at the open signals added there."""
    a, b, c, d = linear.a, linear.b, linear.c, linear.d
    back = np.linalg.inv(np.eye(opened.size) + d[np.ix_(opened, opened)])
    state, through = back @ c[opened], back @ d[np.ix_(opened, source)]
    return (
        _less(a, b[:, opened], state),
        _less(b[:, source], b[:, opened], through),
        _less(c[target], d[np.ix_(target, opened)], state),
        _less(d[np.ix_(target, source)], d[np.ix_(target, opened)], through),
    )


def _less(whole: Matrix, left: Matrix, right: Matrix) -> Matrix:
    """Return ``whole - left @ right`` without what is only the noise of its parts."""
    sizes = np.abs(whole) + np.abs(left) @ np.abs(right)
    noise = FAINT * (1.0 + sizes.max(axis=1, initial=0.0, keepdims=True))
    found = whole - left @ right
    return np.where(np.abs(found) < noise, 0.0, found)


def _on_the_way(a: Matrix, b: Matrix, c: Matrix) -> Positions:
    """Return the states that a disturbance of the source can reach and that the target depends on."""
    linked = a != 0.0
    reached, matters = (b != 0.0).any(axis=1), (c != 0.0).any(axis=0)
    for _ in range(len(a)):
        reached = reached | (linked & reached).any(axis=1)
        matters = matters | (linked.T & matters).any(axis=1)
    return np.flatnonzero(reached & matters)
