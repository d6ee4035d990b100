"""The target scopes on the terminal of the target itself, as on the screen of xPC Target."""

from __future__ import annotations

import shutil
from collections import deque
from collections.abc import Callable, Sequence
from typing import Any, TextIO

from quadvis.machine.status_line import StatusLine, shows_colours
from quadvis.target.scopes import ShownScope

HOME, CLEAR_LINE, CLEAR_REST, CLEAR = "\x1b[H", "\x1b[K", "\x1b[J", "\x1b[H\x1b[2J"
SENTENCES = 3  # that stay below the scopes


class TargetDisplay:
    """Shows target scopes as long as there are some; meanwhile the terminal belongs to them.

    ``say`` prints sentences when there are none. ``size`` gives columns and lines.
    """

    def __init__(
        self,
        screen: TextIO,
        say: Callable[[str], object],
        size: Callable[[], tuple[int, int]] = shutil.get_terminal_size,
    ) -> None:
        self._terminal, self._say, self._size = StatusLine(screen), say, size
        self._colours = shows_colours(screen)
        self._said: deque[str] = deque(maxlen=SENTENCES)
        self._shown: tuple[Any, ...] = ()
        self._drawn: dict[int, tuple[Any, list[str]]] = {}  # by the number of a scope: of what, and the lines

    def say(self, sentence: str) -> None:
        """Print a sentence, or keep it below the scopes."""
        if self._shown:
            self._said.append(sentence)
        else:
            self._say(sentence)

    def show(self, head: str, scopes: Sequence[ShownScope], view: int | None) -> None:
        """Show scopes below a line about the target; only that with the number ``view``, if it is there."""
        chosen = [each for each in scopes if each.number == view] or list(scopes)
        if not chosen:
            self.close()
            return
        width, height = self._size()
        room = (height - 2 - len(self._said)) // len(chosen) - 1
        found = [line for each in chosen for line in self._lines(each, width, room)]
        lines = tuple([head, *found, *self._said][: height - 1])
        if lines != self._shown:
            start = HOME if self._shown else CLEAR
            self._shown = lines
            self._terminal.put(start + "".join(f"{line}{CLEAR_LINE}\r\n" for line in lines) + CLEAR_REST)

    def _lines(self, scope: ShownScope, width: int, room: int) -> list[str]:
        """Return the lines of a scope, which are drawn once for each of its packages."""
        from quadvis.scopes.panel import panel

        key = (scope.package, scope.settings, width, room)
        drawn = self._drawn.get(scope.number)
        if drawn is None or drawn[0] != key:
            text = panel(scope.package, width, room, scope.settings, self._colours) if scope.package else ""
            drawn = self._drawn[scope.number] = key, text.splitlines()[: max(0, room)]
        return [f"scope {scope.number}: {scope.status}", *drawn[1]]

    def close(self) -> None:
        """Give the terminal back."""
        if self._shown:
            self._shown = ()
            self._terminal.put(CLEAR)
            while self._said:
                self._say(self._said.popleft())
        self._drawn.clear()
