"""What loops have noted in a real-time run, on its way into the log: ticks left out, releases, times."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from quadvis.graph.graph import MULTI, Graph
from quadvis.output.recording import RecordedBlock
from quadvis.output.stretch import stamps_of
from quadvis.realtime.note_taker import NoteTaker
from quadvis.realtime.tail import LogTopics
from quadvis.run.rows import left_out, releases, times_of

if TYPE_CHECKING:
    from quadvis.output.wrapped_log import RunLog

NANOSECOND = 1e-9  # s
Whole = NDArray[np.int64]
Timed = Callable[[str, str, Whole], None]  # takes a computer, a task, and times of its steps (N, 4)


class LoggedNotes:
    """The topics of the notes of computers, whose ``graphs`` are given by their names.

    ``blocks`` describes them; they follow ``before`` other blocks of the log. Times are noted only by a run
    that is ``measured``.
    """

    def __init__(self, graphs: Mapping[str, Graph], before: int, *, measured: bool) -> None:
        blocks: dict[tuple[str, ...], RecordedBlock] = {}
        for computer, graph in graphs.items():
            blocks["left out", computer] = left_out(computer)
            if graph.tasking == MULTI:
                blocks["releases", computer] = releases(computer)
            for task in graph.tasks if measured else ():
                blocks["times", computer, task.name] = times_of(computer, task.name)
        self.blocks: Sequence[RecordedBlock] = [*blocks.values()]
        self._blocks = blocks
        self._places = {key: before + number for number, key in enumerate(blocks)}
        self._periods = {computer: graph.tick for computer, graph in graphs.items()}

    def taker(self, writer: RunLog | None, timed: Timed | None = None) -> NoteTaker:
        """Return who writes notes into a log, if there is one; ``timed`` takes the times of tasks, too."""

        def write(computer: str, key: tuple[str, ...], ticks: Whole, rows: Whole) -> None:
            if writer and len(rows) and key in self._places:
                writer.write_rows(self._places[key], stamps_of(ticks, self._periods[computer]), rows)

        def leave_out(computer: str, ticks: Whole) -> None:
            write(computer, ("left out", computer), ticks[:, 0], ticks)

        def release(computer: str, missed: Whole) -> None:
            write(computer, ("releases", computer), np.maximum.accumulate(missed[:, 1]), missed)

        def time(computer: str, task: str, times: Whole) -> None:
            if timed is not None:
                timed(computer, task, times)
            rows = np.ascontiguousarray(times[:, 1:])
            rows[:, :2] = (rows[:, :2] * NANOSECOND).view(np.int64)
            write(computer, ("times", computer, task), times[:, 0], rows)

        return NoteTaker(leave_out, release, time, self._topics(writer))

    def _topics(self, writer: RunLog | None) -> LogTopics | None:
        """Return where everything goes, if this is a log that does not begin anew."""
        from quadvis.output.log import LogWriter  # only a run with a log waits for this import

        if not isinstance(writer, LogWriter):
            return None

        def named(kind: str) -> dict[str, str]:
            return {key[1]: block.path for key, block in self._blocks.items() if key[0] == kind}

        return LogTopics(str(writer.path.absolute()), named("left out"), named("releases"))
