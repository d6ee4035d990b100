"""What a log holds of a run, as a replay needs it: ticks, outputs from outside, tuned parameters."""

from __future__ import annotations

import json
from collections.abc import Iterator
from fractions import Fraction
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from quadvis.diagram.diagram import Diagram
from quadvis.engine.tuning import Change
from quadvis.errors import QuadvisError, quoted
from quadvis.graph.graph import MULTI, Graph, Node, Task
from quadvis.links.endpoints import live_parts
from quadvis.output.log_reader import Log
from quadvis.output.recording import RecordedBlock, Slots, ports
from quadvis.output.stretch import NANOSECONDS, stamps_of
from quadvis.output.wrapped_log import WRAPS
from quadvis.run.loops import REAL_TIME, SIMULATED
from quadvis.run.outside import outside
from quadvis.run.played_tasks import begins, without
from quadvis.run.rows import all_logged, input_topic, left_out, releases

Whole = NDArray[np.int64]
NOTED = tuple(block.path.strip("/") for block in (left_out(""), releases("")))
COMPUTERS = "computers"  # a fact of a log: the computers of the machine on which it was written
AGAIN = "run the diagram again with this quadvis"


class RecordedRun:
    """The run that a log holds. ``parts`` are its computers, each with a graph that runs by itself.

    ``clock`` is that of the run. ``whole`` is true if it reached its stop time and the log has all of it.
    QuadvisError says in a sentence what a replay needs and the log does not hold.
    """

    def __init__(self, log: Log, diagram: Diagram) -> None:
        if WRAPS in log.metadata:
            problem = f"the log '{log.path}' has the end of its run alone, which a replay cannot begin with"
            raise QuadvisError(f"{problem}: it was bounded")
        self._log, self._diagram = log, diagram
        self.clock = log.metadata.get("clock", SIMULATED)
        self.whole = log.complete and not {"stopped", "lost"} & log.summary.keys() and not _lost_rows(log)
        is_paced = self.clock == REAL_TIME
        graphs = live_parts(diagram.graph) if is_paced else {"": diagram.graph}
        if is_paced:
            graphs = {name: graph for name, graph in graphs.items() if name in diagram.computers}
        self.parts = [
            RecordedPart(log, diagram, computer, graph, is_paced) for computer, graph in graphs.items()
        ]

    @cached_property
    def ticks(self) -> int:
        """The number of ticks up to which it can be repeated, with those that were left out."""
        if self.whole:
            return self._diagram.ticks
        ends = [
            int(recording.stamps(name)[-1])
            for recording in (self._log, self._log.hidden)
            for name in recording.names
            if len(recording.stamps(name)) and not name.startswith(NOTED)
        ]
        if not ends:
            raise QuadvisError(f"the log '{self._log.path}' holds no row that a replay could repeat")
        last = _tick_of(max(ends), self._diagram.graph.tick) + 1
        return min(part.known_to(last) for part in self.parts)

    @property
    def end(self) -> float:
        """The time of its last tick (s)."""
        return float((self.ticks - 1) * self._diagram.graph.tick)


class RecordedPart:
    """What a log holds of one computer; ``computer`` is "" in a diagram without computers.

    ``left_out`` are the ticks that it left out: the first, and how many (N, 2). ``releases`` are what tasks
    that run by themselves missed, as the log has it (N, 4); none in other runs.
    """

    def __init__(self, log: Log, diagram: Diagram, computer: str, graph: Graph, may_leave_out: bool) -> None:
        self._log, self._diagram = log, diagram
        self.computer, self.graph = computer, graph
        self.dispatched = may_leave_out and graph.tasking == MULTI
        self.left_out = self._noted(left_out(computer), may_leave_out, by=0)
        self.releases = self._noted(releases(computer), self.dispatched, by=1)

    def _noted(self, block: RecordedBlock, wanted: bool, by: int) -> Whole:
        """Return what a run has noted, in the order of one column; nothing if it is not wanted."""
        if not wanted:
            return np.zeros((0, len(block.ports)), np.int64)
        if self._log.hidden.block(block.path) is None:
            problem = f"the log '{self._log.path}' does not say which ticks the real-time run left out"
            raise QuadvisError(f"{problem}: it is of an earlier quadvis; {AGAIN}")
        found = self._log.hidden.arrays(block.path)[1].reshape(-1, len(block.ports))
        return found[np.argsort(found[:, by], kind="stable")]

    @cached_property
    def played(self) -> frozenset[str]:
        """The paths of the blocks that reach outside, which a replay does not run."""
        return frozenset(node.path for node in outside(self.graph))

    def missed(self, end: int) -> int:
        """Return how many ticks before ``end`` were left out."""
        first, count = self.left_out[:, 0], self.left_out[:, 1]
        return int(np.clip(end - first, 0, count).sum())

    def begun(self, task: Task, end: int) -> Whole:
        """Return the ticks before ``end`` at which a task was due and began, and those at which it did."""
        number = self.graph.tasks.index(task)
        if number and self.dispatched:
            return begins(self.graph, number, self.left_out, self.releases, end)
        due = np.arange(self.graph.ticks(task.offset), end, self.graph.ticks(task.period), dtype=np.int64)
        ran = due[without(due, self.left_out)]
        return np.stack((ran, ran), axis=1)

    def ticks_of(self, path: str, every: int, end: int) -> Whole:
        """Return the ticks before ``end`` at which a block had a row, if one in ``every`` was taken."""
        task = self.graph[path].task
        ran: Whole = self.begun(task, end)[:, 0]
        rhythm = self.graph.ticks(task.period) * every
        rows: Whole = ran[(ran - self.graph.ticks(task.offset)) % rhythm == 0]
        return rows

    def known_to(self, end: int) -> int:
        """Return the number of ticks, up to ``end``, whose outputs from outside the log holds."""
        for node in self._outside():
            ticks, count = self.ticks_of(node.path, 1, end), len(self._rows(node)[0])
            end = int(ticks[count]) if count < len(ticks) else end
        return end

    def inputs(self, end: int) -> dict[str, Slots]:
        """Return the rows of the blocks that reach outside, by path: one for each of their ticks."""
        found = {}
        for node in self._outside():
            stamps, rows = self._rows(node)
            wanted = stamps_of(self.ticks_of(node.path, 1, end), self.graph.tick)
            count = min(len(stamps), len(wanted))
            wrong = np.flatnonzero(stamps[:count] != wanted[:count])
            row = int(wrong[0]) if len(wrong) else count
            if row < len(wanted):
                moment = f"t = {wanted[row] / NANOSECONDS:.9g} s"
                problem = f"the log '{self._log.path}' lacks the outputs of {quoted(node.path)} at {moment}"
                raise QuadvisError(f"{problem}, and they came from outside")
            found[node.path] = rows[:count]
        return found

    def _outside(self) -> Iterator[Node]:
        yield from (node for node in outside(self.graph) if ports(node))

    def _rows(self, node: Node) -> tuple[Whole, Slots]:
        """Return the stamps and the rows of a block that reaches outside."""
        visible = all_logged(self._diagram, node.path)
        where, topic = (self._log, f"/{node.path}") if visible else (self._log.hidden, input_topic(node.path))
        block = where.block(topic)
        if block is None:
            problem = f"the log '{self._log.path}' does not hold all outputs of {quoted(node.path)}"
            raise QuadvisError(f"{problem}, which come from outside; {AGAIN}")
        check_ports(self._log, block, node)
        return where.arrays(topic)

    def changes(self) -> list[Change]:
        """Return the parameters that were tuned."""
        found = []
        for entries in self._log.changes:
            try:
                path, name = entries["block"], entries["parameter"]
                found.append(Change(int(entries["tick"]), path, name, json.loads(entries["value"])))
            except (LookupError, ValueError):
                problem = f"the log '{self._log.path}' describes a change of a parameter"
                raise QuadvisError(f"{problem} in a way that this quadvis does not know") from None
        return [change for change in found if change.path in self.graph]


def check_ports(log: Log, block: RecordedBlock, node: Node) -> None:
    """Refuse rows of a block that has other outputs now."""
    now, then = ([port[:3] for port in found] for found in (ports(node), block.ports))
    if now != then:
        problem = f"in the log '{log.path}' {quoted(node.path)} has other outputs than the block has now"
        raise QuadvisError(f"{problem}; replay it with quadvis {log.metadata.get('quadvis', '')}".rstrip())


def _lost_rows(log: Log) -> bool:
    """Whether rows of a real-time run found no room on their way to its log."""
    try:
        return bool(json.loads(log.summary.get("real time", "{}")).get("lost_rows"))
    except (ValueError, AttributeError):
        return False


def _tick_of(stamp: int, period: Fraction) -> int:
    """Return the tick of a stamp (ns) that was rounded down."""
    numerator, denominator = (period * NANOSECONDS).as_integer_ratio()
    return -(-stamp * denominator // numerator)
