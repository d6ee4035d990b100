"""What a real-time run that has reached its stop time did, computer by computer."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from quadvis.errors import counted
from quadvis.native.choice import Choice
from quadvis.realtime.profiles import BlockTimes
from quadvis.realtime.system import Grants
from quadvis.realtime.times import TaskTimes


@dataclass(frozen=True)
class Share:
    """What one computer did in a real-time run; ``computer`` is "" in a diagram without computers.

    ``ticks`` is the number of its ticks, those left out included. ``unsafe`` says why its outputs have held
    their safe values before the end, if they have. ``blocks`` are the times of its blocks, if they were asked
    for. ``problem`` says what has failed without an end to the flight, such as a device that was gone at the
    stop time; "" if nothing did.
    """

    computer: str
    engine: Choice
    grants: Grants
    tasks: tuple[TaskTimes, ...]
    ticks: int
    unsafe: str = ""
    blocks: BlockTimes | None = None
    problem: str = ""

    def facts(self) -> dict[str, Any]:
        """Return it as plain data."""
        return {
            "computer": self.computer or None,
            "engine": self.engine.engine,
            "granted": list(self.grants.granted),
            "not_granted": list(self.grants.refused),
            "tasks": {task.task: task.facts() for task in self.tasks},
            "unsafe": self.unsafe or None,
            "problem": self.problem or None,
        }


@dataclass(frozen=True)
class Flight:
    """A real-time run that has reached its stop time, or was stopped.

    ``lost`` is the number of rows that found no room on their way to the log and the verdicts. ``early`` says
    why it ended at another time than its diagram says, ``duration`` is the time that it lasted then (s).
    """

    shares: tuple[Share, ...]
    lost: int
    early: str = ""
    duration: float | None = None

    @property
    def engine(self) -> Choice:
        """What ran the diagram: the engine of all its computers, or of each."""
        names = {share.engine.engine for share in self.shares}
        if len(self.shares) == 1 or (len(names) == 1 and not any(each.engine.reason for each in self.shares)):
            return self.shares[0].engine
        said = [f"{share.computer}: {share.engine}" for share in self.shares]
        return Choice(" and ".join(sorted(names)), f"({'; '.join(said)})")

    @property
    def loss(self) -> str:
        """A sentence about the rows that were lost; "" if none were."""
        found = counted(self.lost, "row")
        return f"{found} found no room on the way to the log and the verdicts" if self.lost else ""

    @property
    def problems(self) -> list[str]:
        """What has failed on its computers without an end to the flight, in sentences."""
        return [share.problem for share in self.shares if share.problem]

    @property
    def passed(self) -> bool:
        """True if nothing has failed, no row was lost, and no outputs had to be made safe."""
        return not (self.problems or self.lost or any(share.unsafe for share in self.shares))

    @property
    def complaints(self) -> list[str]:
        """Sentences on why it has not passed."""
        unsafe = [
            f"{share.unsafe}; the outputs have held their safe values from then on"
            for share in self.shares
            if share.unsafe
        ]
        return [*self.problems, *unsafe, *([self.loss] if self.loss else [])]

    def facts(self) -> dict[str, Any]:
        """Return it as plain data."""
        return {"computers": [share.facts() for share in self.shares], "lost_rows": self.lost}
