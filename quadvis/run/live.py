"""A run by hand: advance it step by step, read and tune its values, and restore snapshots."""

from __future__ import annotations

import math
from contextlib import ExitStack
from fractions import Fraction
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

from quadvis.diagram.diagram import Diagram
from quadvis.diagram.times import read_duration
from quadvis.document import YamlScalar
from quadvis.engine.clock import Clock
from quadvis.engine.engine import Engine, Snapshot
from quadvis.engine.tuning import Change
from quadvis.errors import QuadvisError
from quadvis.graph.devices import refuse_devices
from quadvis.run.played_files import files_text, played_files
from quadvis.run.row_tap import RowTap, Taker
from quadvis.run.rows import inputs_of, signals_of
from quadvis.run.session import metadata
from quadvis.run.tuned import find_value, new_values

if TYPE_CHECKING:
    from quadvis.output.log import LogWriter


class LiveRun:
    """A run of a diagram between its beginning and its end: use it as a context manager.

    ``run["craft.position"]`` is the present value of a signal, parameter or state, in SI units; an index is
    allowed, and so are the ports of parts. ``run["control/roll.bandwidth"] = "3 rad/s"`` lets a tunable
    parameter have a new value from the next tick on; numbers are in SI units. ``run["bandwidth"]`` is a
    parameter of the diagram, ``run["control.bandwidth"]`` of a part: all blocks that have it change. Blocks
    are closed, and outputs left at their safe values, when the context ends. ``log`` is the path of a log,
    which can be replayed.
    """

    def __init__(self, diagram: Diagram, clock: Clock | None = None, log: str | Path | None = None) -> None:
        refuse_devices(diagram.graph)
        self.diagram = diagram
        self._log = log
        self._writer: LogWriter | None = None
        self._engine = Engine(diagram.graph, diagram.seed, clock)
        self._reached = Fraction(0)  # s; the run has passed all ticks before that
        self._stack = ExitStack()

    def __enter__(self) -> Self:
        with ExitStack() as stack:
            stack.enter_context(self.diagram.guarded(self._log))
            if self._log is not None:
                self._writer = stack.enter_context(self._begin_log(self._log))
            stack.enter_context(self._engine)
            self._stack = stack.pop_all()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        writer, early = self._writer, self._engine.tick != self.diagram.ticks
        if writer is not None and error is None and early:
            self._stack.callback(writer.close, {"stopped": f"it was ended at t = {self.time:.9g} s"})
        self._stack.__exit__(kind, error, trace)

    def _begin_log(self, path: str | Path) -> LogWriter:
        """Return the log, to which all rows and changes go from now on."""
        from quadvis.output.log import LogWriter  # only a run with a log waits for this import

        logged = [*signals_of(self.diagram), *inputs_of(self.diagram, [self.diagram.graph])]
        about = metadata(self.diagram) | {"files": files_text(played_files(self.diagram))}
        writer = LogWriter(path, [each.block for each in logged], about)
        for index, each in enumerate(logged):
            taker = Taker(partial(writer.write, index), partial(writer.write_rows, index))
            self._engine.attach(RowTap(each.node.path, each.every, self._engine.period, [taker]))
        self._engine.tuning.noted = lambda change: writer.write_change(*change)
        return writer

    @property
    def time(self) -> float:
        """The time of the next tick (s)."""
        return self._engine.time

    @property
    def changes(self) -> tuple[Change, ...]:
        """The parameters that were tuned, with the ticks before which they took their values."""
        return tuple(self._engine.tuning.changes)

    def advance(self, duration: str | float = 0.0) -> None:
        """Run all ticks of the next ``duration``, such as "1 s" or a number of seconds; if 0, one tick."""
        engine = self._engine
        if duration:
            self._reached += _seconds(duration)
            engine.run(max(0, math.ceil(self._reached / engine.period) - engine.tick))
        else:
            engine.run(1)
            self._reached = max(self._reached, engine.tick * engine.period)
        if self._writer is not None:
            self._writer.flush_late()

    def __getitem__(self, name: str) -> Any:
        path, port, index = find_value(self.diagram, name)
        value = self._engine.read(path, port)
        return value[index] if index else value

    def __setitem__(self, name: str, value: Any) -> None:
        self._engine.tuning.set_all(new_values(self.diagram, {name: value}))

    def snapshot(self) -> Snapshot:
        """Return the whole state of the run, between two ticks."""
        return self._engine.snapshot()

    def restore(self, snapshot: Snapshot) -> None:
        """Go back to a snapshot of this diagram; the run from there repeats to the bit.

        QuadvisError if it writes a log, in which time cannot go back.
        """
        if self._writer is not None:
            raise QuadvisError("a run that writes a log cannot go back; start one without a log")
        self._engine.restore(snapshot)
        self._reached = snapshot.tick * self._engine.period


def _seconds(duration: str | float) -> Fraction:
    text = duration if isinstance(duration, str) else f"{float(duration)!r} s"
    return read_duration(YamlScalar(text, False, "advance", 0, 0))
