"""A status line on the terminal."""

from __future__ import annotations

import os
import select
import sys
from time import monotonic
from types import TracebackType
from typing import Self, TextIO

PATIENCE, RENEWED = 2.0, 0.1  # s until a line is shown first, and until it is renewed


class StatusLine:
    """A status line, rewritten in place on standard error; silent if that is no terminal.

    A terminal that takes no text, or has closed, never delays the program: then the line is not shown. Nor
    does a pipe that nobody reads: then what would be said is not.
    """

    def __init__(self, stream: TextIO | None = None) -> None:
        self.stream = stream or sys.stderr
        self.shown = self.stream.isatty()
        self._terminal = _open_terminal(self.stream) if self.shown else None

    def __enter__(self) -> Self:
        return self

    def show(self, text: str) -> None:
        """Show a text in place of the previous one."""
        self.put(f"\r\x1b[K{text} ")

    def say(self, text: str) -> None:
        """Show a text in place of the previous one; print it where there is no terminal."""
        if self.shown:
            self.show(text)
        elif _takes_text(self.stream):
            print(text, file=self.stream, flush=True)

    def put(self, text: str) -> None:
        """Write a text as it is, if there is a terminal; what it does not take at once is lost."""
        if not self.shown:
            return
        try:
            if self._terminal is None:
                self.stream.write(text)
                self.stream.flush()
            else:
                os.write(self._terminal, text.encode(errors="replace"))
        except BlockingIOError:
            pass  # the terminal is full now; the next text may succeed
        except (OSError, ValueError):  # the terminal has closed; the program goes on
            self.shown = False

    @staticmethod
    def bar(part: float) -> str:
        """Return a bar that is filled to a share from 0 to 1."""
        filled = int(24 * min(1.0, part))
        return f"[{'#' * filled}{'.' * (24 - filled)}]"

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.put("\r\x1b[K")
        if self._terminal is not None:
            os.close(self._terminal)
            self._terminal = None
            self.shown = False


def shows_colours(stream: TextIO) -> bool:
    """Return whether a text may have colours there: on a terminal, unless NO_COLOR is set."""
    return stream.isatty() and not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"


def _open_terminal(stream: TextIO) -> int | None:
    """Open the terminal behind a stream again for writing without waiting; None if this is impossible."""
    try:
        return os.open(os.ttyname(stream.fileno()), os.O_WRONLY | os.O_NOCTTY | os.O_NONBLOCK)
    except (OSError, ValueError, AttributeError):
        return None


def _takes_text(stream: TextIO) -> bool:
    """Return whether a stream takes a line at once; a pipe must have a page free for that."""
    try:
        return bool(select.select([], [stream.fileno()], [], 0)[1])
    except (OSError, ValueError, AttributeError):  # it has no descriptor, or the system cannot say
        return True


class AnalysisLine(StatusLine):
    """The present step of an analysis, shown once the analysis has taken a while."""

    def __init__(self, stream: TextIO | None = None) -> None:
        super().__init__(stream)
        self.next = monotonic() + PATIENCE

    def __call__(self, text: str) -> None:
        """Show the present step."""
        if monotonic() >= self.next:
            self.show(text)
            self.next = monotonic() + RENEWED

    def clear(self) -> None:
        """Clear the status line, to make room for a permanent line."""
        self.put("\r\x1b[K")


class ProgressLine(StatusLine):
    """The progress of a run of ``duration`` (s), and its speed."""

    def __init__(self, duration: float, stream: TextIO | None = None) -> None:
        super().__init__(stream)
        self.duration = duration

    def __call__(self, time: float, wall: float) -> None:
        """Show the simulated time reached and the speed. The next tick may lie beyond the end."""
        time = min(time, self.duration)
        bar = self.bar(time / self.duration if self.duration else 1.0)
        self.show(f"{bar} {time:6.1f} / {self.duration:g} s  {time / max(wall, 1e-9):.0f} x real time")
