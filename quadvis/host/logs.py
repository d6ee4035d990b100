"""The logs of a target: copied to here, and parts of them by the names of xPC Target."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from quadvis.errors import QuadvisError
from quadvis.machine.files import LOG, check_output, open_output
from quadvis.wire.limits import PIECE

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from quadvis.output.log_reader import Log

    Samples = NDArray[np.float64]

CONTINUOUS = "continuous"  # the task of the blocks with continuous states
TET = ".tet"  # how the name of a task's execution times ends
TIME_LOG, STATE_LOG, OUTPUT_LOG, TET_LOG = "TimeLog", "StateLog", "OutputLog", "TETLog"
# The parts of a log in xPC Target, with the names that Python's style wants.
PARTS: Mapping[str, str] = {
    TIME_LOG: "time_log", STATE_LOG: "state_log", OUTPUT_LOG: "output_log", TET_LOG: "tet_log",
}  # fmt: skip


class TargetLogs:
    """The logs of a target, which ``request`` asks."""

    def __init__(self, name: str, request: Callable[..., Any]) -> None:
        self._name, self._request = name, request
        self._folder: tempfile.TemporaryDirectory[str] | None = None
        self._copies: dict[tuple[Any, ...], Path] = {}  # by name, size and time of the last change

    def all(self) -> list[dict[str, Any]]:
        """Return what there is to know of all logs, the oldest first."""
        return list(self._request("logs"))

    def copy(self, name: str, place: Path) -> Path:
        """Copy a log to a path, where there may be another log; QuadvisError if there is another file."""
        check_output(place, LOG)
        piece = self._request("getlog", name=name, offset=0, count=PIECE)  # of no log nothing is written
        with open_output(place, LOG) as file:
            while True:
                file.write(piece["data"])
                if not piece["data"] or file.tell() >= piece["size"]:
                    return place
                piece = self._request("getlog", name=name, offset=file.tell(), count=PIECE)

    def newest_name(self) -> str:
        """Return the name of the newest log; QuadvisError if there is none."""
        return str(self._newest()[-1]["name"])

    def newest(self) -> list[Log]:
        """Return the newest log; of a bounded one what came before, too, the oldest part first."""
        from quadvis.output.log_reader import read_log

        return [read_log(self._here(each)) for each in self._newest()]

    def _newest(self) -> list[dict[str, Any]]:
        from quadvis.output.wrapped_log import BEFORE

        logs = self.all()
        whole = [each for each in logs if not each["name"].endswith(BEFORE)]
        if not whole:
            raise QuadvisError(f"{self._name} has no log")
        before = f"{whole[-1]['name']}{BEFORE}"
        return [*(each for each in logs if each["name"] == before), whole[-1]]

    def _here(self, log: Mapping[str, Any]) -> Path:
        """Return a copy of a log, which is made once as long as the log is what it was."""
        key = log["name"], log["size"], log["changed"]
        if key not in self._copies:
            if self._folder is None:
                self._folder = tempfile.TemporaryDirectory(prefix="quadvis-")
            place = self.copy(log["name"], Path(self._folder.name) / f"{log['name']}.mcap")
            self._copies = {old: path for old, path in self._copies.items() if path != place} | {key: place}
        return self._copies[key]

    def samples(self, name: str, first: int, count: int | None, decimation: int) -> Samples:
        """Return samples of a signal or of a part of the newest log; the first one has the number 1."""
        import numpy as np

        if first < 1 or decimation < 1 or (count is not None and count < 0):
            raise QuadvisError("samples are counted from 1, every one or every N-th")
        found = np.concatenate([samples_of(log, name) for log in self.newest()])
        last = None if count is None else first - 1 + count * decimation
        return found[first - 1 : last : decimation]

    def close(self) -> None:
        """Remove the copies."""
        if self._folder is not None:
            self._folder.cleanup()


def samples_of(log: Log, name: str) -> Samples:
    """Return the samples (N, ...) of a signal of a log, or of a part by its name in xPC Target.

    ``TimeLog`` (N,) are the times (s) at which the fastest task has rows, ``OutputLog`` (N, k) the numbers of
    all signals with these rows, in the order of `columns`, ``TETLog`` (N,) the execution times of this task
    (s), at each of its steps. ``StateLog`` (N, k) are those of the blocks with continuous states.
    """
    import numpy as np

    if name not in PARTS:
        return np.asarray(log[name])
    signals = [each for each, _ in columns(log, name)]
    if name == TIME_LOG:
        return log.times(signals[0])
    if name == TET_LOG:
        return log[signals[0]]
    rows = [np.asarray(log[each], np.float64) for each in signals]
    return np.column_stack([each.reshape(len(each), -1) for each in rows])


def columns(log: Log, name: str) -> Sequence[tuple[str, int]]:
    """Return the signals of a part of a log, and how many columns each has there."""
    names = [each for each in log if len(log.times(each))]
    if name == STATE_LOG:
        found = [each for each in names if log.rate(each) == CONTINUOUS]
        if not found:
            raise QuadvisError(f"the log '{log.path}' has no signal of a block with continuous states")
    elif not names:
        raise QuadvisError(f"the log '{log.path}' has no signal")
    else:
        fastest = max(names, key=lambda each: len(log.times(each)))
        found = [each for each in names if log.rate(each) == log.rate(fastest)]
    if name == TET_LOG:
        task = log.rate(found[0])
        found = [each for each in log.task_times if each.endswith(TET) and log.rate(each) == task]
        if not found:
            raise QuadvisError(f"the log '{log.path}' has no execution times of task '{task}'")
    rows = max(len(log.times(each)) for each in found)
    return [(each, log[each][0].size) for each in found if len(log.times(each)) == rows]
