"""The pictures of a target that somebody looks at, each once."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from quadvis.bridge.follower import FollowedTarget
from quadvis.errors import QuadvisError

OFTEN = 0.1  # s between two pictures of a signal: a loop gives no more


class PictureWatch:
    """A thread that asks for pictures; ``take`` gets the name of a signal and what the target answers."""

    def __init__(self, target: FollowedTarget, take: Callable[[str, Mapping[str, Any]], None]) -> None:
        self._target, self._take = target, take
        self._names: frozenset[str] = frozenset()
        self._shown: dict[str, tuple[Any, Any]] = {}
        self._wake, self._ended = threading.Event(), False
        self._thread = threading.Thread(target=self._look, name="pictures", daemon=True)
        self._thread.start()

    def want(self, names: Iterable[str]) -> None:
        """Ask for the pictures of these signals from now on."""
        self._names = frozenset(names)
        self._wake.set()

    def close(self) -> None:
        """End; a request that is under way is not waited for."""
        self._ended = True
        self._wake.set()

    def _look(self) -> None:
        while not self._ended:
            names = sorted(self._names)
            for name in names:
                self._ask(name)
            self._wake.wait(OFTEN if names else None)
            self._wake.clear()

    def _ask(self, name: str) -> None:
        try:
            found = self._target.request("picture", signal=name)
        except QuadvisError:  # nothing runs, or no picture has come; so there is none to be seen
            return
        mark = found["began"], found["sequence"]
        if mark != self._shown.get(name) and found["began"] is not None:
            self._shown[name] = mark
            self._take(name, found)
