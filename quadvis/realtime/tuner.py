"""New values of parameters on their way to the loops: checked here, put into their boxes, noted at a tick.

A loop says twice that it has taken a group: at once in its box, for who waits for the tick, and in its notes,
which come together with the rows, for the log.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

import numpy as np

from quadvis.block import Block
from quadvis.engine.memory import Memory, Slot
from quadvis.engine.program import Tunable
from quadvis.engine.tuning import Acceptance, Change, Key
from quadvis.errors import QuadvisError
from quadvis.graph.graph import Graph
from quadvis.realtime.box import ENTRY, ParameterBox
from quadvis.realtime.dispatch import bit
from quadvis.realtime.helm import Wanted, too_late
from quadvis.realtime.ring import Words

AHEAD = 0.01  # s that several computers have until all of them hold a group
LEAST = 2  # ticks, likewise
BEFORE = -1  # in place of a tick: no computer has begun


@dataclass(frozen=True)
class Tuned:
    """A computer whose parameters are tuned: its graph, its box, and where its program has parameters."""

    part: Graph
    box: ParameterBox
    tunables: Sequence[Tunable]


@dataclass
class _Group:
    """A group that was accepted; ``ticks`` are those from which on it holds, by computer."""

    accepted: Mapping[Key, Any]
    computers: frozenset[str]
    future: Future[int]
    ticks: dict[str, int] = field(default_factory=dict)


class Tuner:
    """Takes groups of new values for the computers of a run; ``changed`` takes what holds, with its tick.

    A box has one group at a time. What comes meanwhile waits, and then goes together: all of it holds from
    one tick on, and of one parameter the last value counts.
    """

    def __init__(
        self, tuned: Mapping[str, Tuned], period: Fraction, changed: Callable[[Change], None]
    ) -> None:
        self._tuned, self._changed = tuned, changed
        self._ahead = max(LEAST, math.ceil(AHEAD / period))
        self._computers: dict[str, str] = {}
        blocks: dict[str, Block] = {}
        tunables = []
        for computer, each in tuned.items():
            own = {node.path: node.block for node in each.part.nodes}
            tunables += [found for found in each.tunables if found.path in own]
            self._computers |= dict.fromkeys(own, computer)
            blocks |= own
        self._values: dict[Key, Any] = {}
        self._acceptance = Acceptance(tunables, blocks, self._now)
        self._waiting: list[_Group] = []
        self._flying: dict[str, tuple[int, list[_Group]]] = {}  # by computer: what is in its box
        self._lost: set[str] = set()  # computers
        self._taken: dict[tuple[str, int], list[_Group]] = {}  # by computer and number: not yet in its notes

    @property
    def waits_for(self) -> Collection[str]:
        """The computers whose loops have not yet taken what they were given."""
        return self._flying.keys()

    def offer(self, wanted: Wanted, tick: int) -> None:
        """Take a group if its blocks accept it; ``tick`` is the present one."""
        if not wanted.future.set_running_or_notify_cancel():
            return
        try:
            accepted = self._acceptance.accept(wanted.group)
        except Exception as error:
            wanted.future.set_exception(error)
            return
        if not accepted:
            wanted.future.set_result(tick)
            return
        computers = frozenset(self._computers[path] for path, _ in accepted)
        if lost := computers & self._lost:
            wanted.future.set_exception(_without(min(lost)))
            return
        self._values |= accepted
        self._waiting.append(_Group(accepted, computers, wanted.future))

    def send(self, tick: int) -> None:
        """Put what waits into the boxes that are free; ``tick`` is the latest of the computers, or `BEFORE`.

        A group for several computers holds from one tick on, which lies a little ahead.
        """
        taken = set(self._flying)
        chosen: list[_Group] = []
        left: list[_Group] = []
        for group in self._waiting:
            if taken.isdisjoint(group.computers):
                chosen.append(group)
            else:  # its computers keep the order of the groups
                taken |= group.computers
                left.append(group)
        self._waiting = left
        together = {name for group in chosen for name in group.computers if len(group.computers) > 1}
        for computer in {name for group in chosen for name in group.computers}:
            mine = [group for group in chosen if computer in group.computers]
            not_before = tick + self._ahead if computer in together and tick != BEFORE else 0
            self._flying[computer] = self._put(computer, mine, not_before), mine

    def answer(self) -> None:
        """Report their ticks to those who wait for groups that the loops have taken."""
        for computer, (number, _) in list(self._flying.items()):
            tick = self._tuned[computer].box.taken(number)
            if tick is not None:
                self._take(computer, tick)

    def _take(self, computer: str, tick: int) -> None:
        """Note that a computer has taken what is in its box."""
        number, groups = self._flying.pop(computer)
        self._taken[computer, number] = groups
        for group in groups:
            group.ticks[computer] = tick
            if group.ticks.keys() == group.computers and not group.future.done():
                group.future.set_result(max(group.ticks.values()))

    def noted(self, computer: str, records: Words) -> None:
        """Take what a loop has noted: the number of a group, and its tick."""
        for number, tick in records.tolist():
            if self._flying.get(computer, (0, []))[0] == number:
                self._take(computer, tick)
            for group in self._taken.pop((computer, number), ()):
                self._note(group, computer, tick)

    def _note(self, group: _Group, computer: str, tick: int) -> None:
        for (path, name), accepted in group.accepted.items():
            if self._computers[path] == computer:
                value = self._acceptance.as_given(path, name, accepted)
                self._changed(Change(tick, path, name, value))

    def lose(self, computer: str) -> None:
        """Wait no more for a computer that has been lost, and give it nothing any more."""
        self._lost.add(computer)
        _, flying = self._flying.pop(computer, (0, []))
        for group in [*flying, *(group for group in self._waiting if computer in group.computers)]:
            if not group.future.done():
                group.future.set_exception(_without(computer))
        self._waiting = [group for group in self._waiting if computer not in group.computers]

    def end(self) -> None:
        """Report to all who wait that nothing changes any more."""
        flying = [group for _, groups in self._flying.values() for group in groups]
        for group in (*self._waiting, *flying):
            if not group.future.done():
                group.future.set_exception(too_late())
        self._waiting, self._flying = [], {}

    def _put(self, computer: str, groups: Sequence[_Group], not_before: int) -> int:
        part = self._tuned[computer].part
        numbers = {task: number for number, task in enumerate(part.tasks)}
        values = {key: value for group in groups for key, value in group.accepted.items()}
        mine = {key: value for key, value in values.items() if self._computers[key[0]] == computer}
        tasks = 0
        for path, _ in mine:
            tasks |= 1 << bit(numbers[part[path].task])
        entries = [_entry(self._acceptance.tunables[key].slot, value) for key, value in mine.items()]
        return self._tuned[computer].box.put(entries, tasks, not_before)

    def _now(self, tunable: Tunable) -> Any:
        """Return the value in force, with the groups that are on their way."""
        key = tunable.path, tunable.name
        if key in self._values:
            return self._values[key]
        part = self._tuned[self._computers[tunable.path]].part
        return getattr(part[tunable.path].block, tunable.name)


def _without(computer: str) -> QuadvisError:
    return QuadvisError(f"the computer '{computer}' has been lost")


def box_room(part: Graph) -> int:
    """Return how many words a box needs that has new values of all tunable parameters of a graph."""
    found = 0
    for node in part.nodes:
        for param in node.block.interface.params.values():
            if param.tune and not param.is_text:
                found += ENTRY + np.size(getattr(node.block, param.name))
    return found


def _entry(slot: Slot, value: Any) -> tuple[int, list[int]]:
    """Return the first slot of a parameter, and its words with a value."""
    memory = Memory(slot.size)
    memory.write(slot._replace(position=0), value)
    return slot.position, memory.raw.cast("q").tolist()
