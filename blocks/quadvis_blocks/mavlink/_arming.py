"""Arming: the mode, then the command, each asked for again until the autopilot's heartbeat shows it."""

from __future__ import annotations

from typing import NamedTuple

AGAIN = 1.0  # s between two requests
TRIES = 5
IDLE, READING, MODE, ARM, DONE, GIVEN_UP = range(6)
NO_MODE = -1


class ArmingRequest(NamedTuple):
    """What to ask for: a ``mode`` if it is not `NO_MODE`, else to arm or to disarm."""

    mode: int
    arm: bool


class Arming:
    """Follows the wish to be armed; ``mode`` is asked for before, `NO_MODE` if any will do."""

    def __init__(self, mode: int) -> None:
        self._mode = mode
        self._wish = False
        self._asked, self._tries = -AGAIN, 0
        self.state = IDLE

    def step(self, time: float, wish: bool, armed: bool, mode: int, *, may: bool) -> ArmingRequest | None:
        """Return what to ask for now; ``may`` says that all that must be known before is known."""
        if wish != self._wish:
            self._wish, self._tries, self._asked = wish, 0, -AGAIN
            self.state = IDLE if wish == armed and not wish else READING
        if self.state in (IDLE, DONE, GIVEN_UP):
            return None
        if armed == wish:
            self.state = DONE if wish else IDLE
            return None
        if wish and not may:
            self.state = READING
            return None
        wants_mode = wish and self._mode not in (NO_MODE, mode)
        state = MODE if wants_mode else ARM
        if state != self.state:
            self.state, self._tries, self._asked = state, 0, -AGAIN
        if time < self._asked + AGAIN:
            return None
        if self._tries >= TRIES:
            self.state = GIVEN_UP
            return None
        self._asked, self._tries = time, self._tries + 1
        return ArmingRequest(self._mode if wants_mode else NO_MODE, wish)
