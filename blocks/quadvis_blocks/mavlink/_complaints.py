"""What people should know of a link during a run: each once, in a sentence."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from quadvis.errors import sentence
from quadvis_blocks.mavlink._dialect import MessageDefinition
from quadvis_blocks.mavlink._scanner import PacketCounts, Sender

SILENCE = 2.0  # s after which it is said that nothing answers
SENDERS = 4  # others at most that are named


class Complaints:
    """Reports what is wrong with a link, by ``report``; ``names`` are those of the known messages."""

    def __init__(
        self,
        report: Callable[[str], None],
        names: Mapping[int, MessageDefinition],
        counts: PacketCounts,
        signed: bool,
    ) -> None:
        self._report, self._names, self._counts, self._signed = report, names, counts, signed
        self._said: set[object] = set()
        self._waiting = math.nan  # since when an answer is waited for

    def asked(self, time: float) -> None:
        """Take note of a request."""
        if math.isnan(self._waiting):
            self._waiting = time

    def answered(self) -> None:
        """Take note of a message of the autopilot."""
        self._waiting = math.nan

    def look(self, time: float) -> None:
        """Report what has become wrong."""
        for number in [each for each in self._counts.differs if each not in self._said]:
            name = self._names[number].name
            problem = f"message {number} ({name}) comes with another definition than that of the dialect"
            self.once(number, sentence(problem, "give the dialect that the autopilot speaks"))
        if time - self._waiting >= SILENCE:
            self.once("silence", f"no message of the autopilot has come for {SILENCE:g} s{self._cause()}")

    def slow(self, number: int, rate: float, wanted: float) -> None:
        """Report that a message comes at a lower rate (Hz) than was asked for."""
        name = self._names[number].name
        self.once(
            "slow", f"{name} comes at {rate:.3g} Hz, not at {wanted:g} Hz as asked; it is asked for again"
        )

    def farewell(self, others: Mapping[Sender, int]) -> None:
        """Report what has come besides the messages of the autopilot."""
        counts = self._counts
        first = sorted(others.items(), key=lambda item: -item[1])[:SENDERS]
        said = [f"{count} of {system}/{component}" for (system, component), count in first]
        said += [f"{count} with the unknown number {number}" for number, count in counts.unknown.items()]
        said += [
            f"{count} of {self._names[number].name} with another definition"
            for number, count in counts.differs.items()
        ]
        said += [f"{count} with '{why}'" for why, count in counts.rejected.items()]
        if said:
            self.once("farewell", f"messages that did not count: {', '.join(said)}")

    def once(self, key: object, text: str) -> None:
        """Report a sentence, if none with this key was reported."""
        if key not in self._said:
            self._said.add(key)
            self._report(text)

    def _cause(self) -> str:
        if self._counts.version_1:
            return "; it speaks MAVLink 1: set SERIALn_PROTOCOL of ArduPilot to 2, MAV_PROTO_VER of PX4 to 2"
        if self._signed:
            return "; the keys of the two sides, or their times, may not be the same"
        return ""
