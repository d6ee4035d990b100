"""A signal of a recording, played again."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadvis.block import Block, Out, Param, ParameterError
from quadvis.errors import QuadvisError
from quadvis.machine.inputs import read_once
from quadvis.output.foreign_signals import Played, read_recording

HOLD, LINEAR = range(2)
MISSING, REPEAT = 1, 2  # of ``before`` and ``after``
SECOND = 1e9  # ns


class Recording(Block, numeric=False):
    """A signal of a run's log, or of a file of another program: at time t its value at ``begin`` + t.

    Shape, type and unit of the output are those of the signal. With ``between: hold`` the value is that of
    the last row up to this time, of several rows with one time the last; at the ticks of the recorded run it
    is the recorded value to the bit. With ``linear`` it moves in straight lines between the rows, element by
    element. Times count in whole nanoseconds. A log that is cut or damaged is played as far as it goes.

    In a bag of ROS 2 a signal is a topic with a field, ``imu.angular_velocity``, ``imu.angular_velocity.x``;
    quaternions are x, y, z, w there; standard messages have their units; times count from the first message.
    """

    file = Param(
        type="file", doc="log of a run or bag of ROS 2 (.mcap), or .csv, .parquet, .npz, .mat of any program"
    )
    signal = Param(
        type="str", shown=True, doc="its name, such as craft.position, or an element, craft.position[2]"
    )
    begin = Param(0.0, unit="s", doc="time of the log that is played at time 0")
    between = Param("hold", choices=("hold", "linear"), doc="what happens between the rows")
    before = Param(
        "first", choices=("first", "missing"), doc="the value before the first row; missing is NaN"
    )
    after = Param(
        "last",
        choices=("last", "missing", "repeat"),
        doc="the value after the last row; repeat begins again, after the time between the last two rows",
    )

    example = """
        played:
          block: sources.recording
          rate: fast
          with: {file: "quadvis:recordings/motor.csv", signal: speed, between: linear}
    """

    @classmethod
    def ports(cls, file: str, signal: str, before: int, after: int) -> dict[str, Out]:
        """Return the output, like the signal."""
        log = read_once(read_recording, file)
        values = _played(log, signal).values
        missing = MISSING in (before, after) or bool(np.isnan(values.astype(float)).any())
        port = log.port(signal)
        size = f"[{','.join(map(str, port.shape))}]" if port.shape else ""
        return {"y": Out(f"{port.type}{size}", unit=port.unit, nan=missing, doc="the signal")}

    def check(self) -> None:
        """Refuse a signal without rows, with times that go back, or that is no number where it has to be."""
        stamps, values = self._rows()
        if not len(stamps):
            raise ParameterError("signal", f"signal '{self.signal}' has no rows in '{self.file}'")
        back = np.flatnonzero(np.diff(stamps) < 0)
        if len(back):
            later, earlier = (f"{stamp / SECOND:.9g} s" for stamp in stamps[back[0] : back[0] + 2])
            problem = f"the times of '{self.signal}' go back in '{self.file}'"
            raise ParameterError("file", f"{problem}: {earlier} comes after {later}")
        if values.dtype == np.float64:
            return
        for name, wrong, fitting in (
            ("between", self.between == LINEAR, "hold"),
            ("before", self.before == MISSING, "first"),
            ("after", self.after == MISSING, "last or repeat"),
        ):
            if wrong:
                kind = "truth values" if values.dtype == bool else "whole numbers"
                raise ParameterError(name, f"'{self.signal}' has {kind}, so {name} must be {fitting}")

    def doubts(self) -> list[ParameterError]:
        """Return the damage of the log."""
        damage = self.read_file("file", read_recording).damage
        return [ParameterError("file", damage)] if damage else []

    def open(self) -> None:
        """Have the rows ready."""
        self._played = self._rows()

    def _rows(self) -> _Played:
        return _played(self.read_file("file", read_recording), self.signal)

    def output(self, time: float) -> Any:
        """Return the value at this time."""
        stamps, values = self._played
        first, last = int(stamps[0]), int(stamps[-1])
        gap = last - int(stamps[-2]) if len(stamps) > 1 else 1  # ns from the last row to the first one again
        now = math.floor((self.begin + time) * SECOND + 0.5)
        if now > last and self.after == REPEAT:
            now = first + (now - first) % max(1, last + gap - first)
        if (now < first and self.before == MISSING) or (now > last and self.after == MISSING):
            return _plain(values[0] * np.nan)
        row = max(0, int(np.searchsorted(stamps, now, "right")) - 1)
        if self.between == HOLD or now <= first or (now >= last and self.after != REPEAT):
            return _plain(values[row])
        following = (row + 1) % len(stamps)
        length = int(stamps[following]) - int(stamps[row]) if following else gap
        return _plain(values[row] + (now - int(stamps[row])) / length * (values[following] - values[row]))


class _Played(NamedTuple):
    """The stamps (N,) in ns of a signal's rows, and their values (N, ...)."""

    stamps: NDArray[np.int64]
    values: NDArray[Any]


def _played(log: Played, signal: str) -> _Played:
    """Return the rows of a signal; ParameterError if the log has no such signal."""
    try:
        return _Played(log.stamps(signal), log[signal])
    except QuadvisError as error:
        raise ParameterError("signal", f"in '{log.path}' {error}") from None


def _plain(value: Any) -> Any:
    """Return a number as Python has it, or an array of its own."""
    return value.item() if np.ndim(value) == 0 else np.array(value)
