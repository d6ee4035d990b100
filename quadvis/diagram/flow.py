"""The flow of facts along wires before a run, from declarations and given values."""

from __future__ import annotations

from collections.abc import Collection, Hashable, Iterator, Mapping, Sequence
from heapq import heappop, heappush
from typing import Any

from quadvis.diagram.draft import Draft, DraftWire, Key
from quadvis.errors import Faults, Place
from quadvis.graph.graph import Node

Cases = dict[Hashable, Any]  # what was found, by the case


class Flow:
    """Lets known facts flow along the wires until all is known, each block after the blocks that feed it.

    ``unknown`` are inputs without any known fact: blocks that depend on them are left out. A cycle has no
    first block: there one block goes ahead with what it has. What is found does not depend on the order of
    the blocks in the file: where a choice is left the names decide.

    Blocks of one class with equal inputs are one case: what follows is worked out for the first of them, and
    kept in ``cases``, which the variants of a diagram share. A case with a fault is never kept.
    """

    def __init__(self, drafts: Mapping[str, Draft], nodes: Mapping[str, Node], links: Sequence[DraftWire],
                 unknown: Collection[Key], faults: Faults, cases: Cases) -> None:  # fmt: skip
        self.drafts, self.nodes, self.faults, self.cases = drafts, nodes, faults, cases
        self.unknown = set(unknown)
        self._settled: set[str] = set()
        self._reported: set[Place] = set()
        self._faulty = False  # whether anything was found wrong in the present case
        self._declared = False  # whether blocks in rings have passed on what they know by declaration
        self._begun: set[str] = set()  # blocks that know some of their facts before the others
        # By reader and port, in the order of the names and ports: wires that still carry no fact, and those
        # of them that wait only for the other inputs of their block.
        self._waiting: dict[str, dict[str, DraftWire]] = {}
        self._ready: dict[str, set[str]] = {path: set() for path in drafts}
        self._early: list[tuple[str, int, str]] = []  # a heap of the latter
        self._from: dict[str, list[DraftWire]] = {path: [] for path in drafts}
        given: dict[str, dict[str, DraftWire]] = {}
        for link in links:
            given.setdefault(link.draft.path, {})[link.port] = link
        for path in sorted(given):
            ports, found = drafts[path].interface.inputs, given[path]
            self._waiting[path] = {port: found[port] for port in ports if port in found}
            for link in self._waiting[path].values():
                self._from[link.wire.block].append(link)

    def run(self) -> None:
        """Follow every wire."""
        for path in sorted(self.drafts):
            if path not in self._waiting and path not in self._settled:
                self._enter(path)
                self._spread(path)
        producers = sorted(self._from, reverse=True)
        while self._waiting:
            link = self._first_early()
            if link is not None:
                self._begun.add(link.draft.path)
                self._take(link)
                self._spread(link.draft.path)
                continue
            if not self._declared:
                # Only rings wait: what declarations fix is known there, too, before a block goes ahead.
                self._declared = True
                for path in sorted(self._waiting):
                    self._spread(path)
                continue
            while not any(map(self._waits, self._from[producers[-1]])):
                producers.pop()
            path = max(sorted(self._first_ring(producers[-1])), key=self.knowledge)
            self._begun.add(path)
            if self.prepare(path):
                self._spread(path)
            else:
                self._settled.add(path)
                self.settle(path)
                self._spread(path)

    def _waits(self, link: DraftWire) -> bool:
        return link.port in self._waiting.get(link.draft.path, ())

    def _first_early(self) -> DraftWire | None:
        """Return the first wire that waits only for the other inputs of its block."""
        while self._early:
            path, _, port = heappop(self._early)
            if port in self._waiting.get(path, ()):
                return self._waiting[path][port]
        return None

    def _first_ring(self, start: str) -> list[str]:
        """Return blocks that wait for each other and for no others.

        They are the first strongly connected component that Tarjan's search closes on its way from a block
        against the signals.
        """
        number: dict[str, int] = {}
        lowest: dict[str, int] = {}
        trail: list[tuple[str, Iterator[DraftWire]]] = []

        def enter(path: str) -> None:
            number[path] = lowest[path] = len(number)
            trail.append((path, iter(self._waiting.get(path, {}).values())))

        enter(start)
        while True:
            path, links = trail[-1]
            link = next(links, None)
            if link is not None and link.wire.block not in number:
                enter(link.wire.block)
            elif link is not None:
                lowest[path] = min(lowest[path], number[link.wire.block])
            elif lowest[path] == number[path]:
                return [member for member, count in number.items() if count >= number[path]]
            else:
                trail.pop()
                before = trail[-1][0]
                lowest[before] = min(lowest[before], lowest[path])

    def _spread(self, path: str) -> None:
        """Pass the known facts of a block to its readers, and from them to their readers."""
        changed = [path]
        while changed:
            path = changed.pop()
            for link in self._from[path]:
                reader = link.draft.path
                if self._waits(link) and (self.knows(link) or path in self._settled):
                    ready = self._ready[reader]
                    ready.add(link.port)
                    if len(ready) == len(self._waiting[reader]):
                        self._enter(reader)
                        changed.append(reader)
                    else:
                        place = list(link.draft.interface.inputs).index(link.port)
                        heappush(self._early, (reader, place, link.port))

    def _enter(self, path: str) -> None:
        """Let a block take all wires that it waits for, and decide what stays open; or do as in its case."""
        # In the order of the ports, so that of two that disagree the second is wrong.
        links = list(self._waiting.get(path, {}).values())
        case = None
        if path not in self._begun:
            case = (type(self), self.drafts[path].type, self.case(path, links))
            if case in self.cases:
                self._waiting.pop(path, None)
                self._settled.add(path)
                self.adopt(path, self.cases[case])
                return
        self._faulty = False
        for link in links:
            self._take(link)
        if path not in self._settled:
            self._settled.add(path)
            self.settle(path)
        if case is not None and not self._faulty:
            self.cases[case] = self.found(path)

    def _take(self, link: DraftWire) -> None:
        path = link.draft.path
        del self._waiting[path][link.port]
        if not self._waiting[path]:
            del self._waiting[path]
        self._ready[path].discard(link.port)
        if not self.knows(link) or not self.take(link):
            self.unknown.add(link.key)
            self._faulty = True

    def fault(self, path: str, place: Place, problem: str, remedy: str = "") -> None:
        """Report a fault of a block, once for a wire that leads to several blocks of a part."""
        self._faulty = True
        if place not in self._reported:
            self._reported.add(place)
            self.faults.add(place, problem, remedy, subject=f"block '{path}'")

    def undecided(self, path: str) -> tuple[str, ...]:
        """Return the inputs of a block of which nothing is known."""
        return tuple([port for port in self.drafts[path].interface.inputs if (path, port) in self.unknown])

    def knows(self, link: DraftWire) -> bool:
        """Return whether the fact that a wire carries is known."""
        raise NotImplementedError

    def case(self, path: str, links: Sequence[DraftWire]) -> Hashable:
        """Return all from which the facts of a block follow, besides its class, when it takes these wires."""
        raise NotImplementedError

    def found(self, path: str) -> Any:
        """Return the facts that were found for a block."""
        raise NotImplementedError

    def adopt(self, path: str, found: Any) -> None:
        """Give a block the facts that were found for another one in the same case."""
        raise NotImplementedError

    def take(self, link: DraftWire) -> bool:
        """Give it to the consumer; False if it does not fit, which is reported."""
        raise NotImplementedError

    def settle(self, path: str) -> None:
        """Decide the open facts of a block, because no more will become known."""
        raise NotImplementedError

    def prepare(self, path: str) -> bool:
        """Let a block in a cycle use its certain facts, before anything is decided; False if it has none."""
        return False

    def knowledge(self, path: str) -> int:
        """Return how well a block can go ahead in a ring; higher is better."""
        return 0
