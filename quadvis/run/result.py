"""The result of one run: its signals, its verdicts, its times."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from quadvis.engine.profile import ProfileReport
from quadvis.native.choice import PYTHON, Choice
from quadvis.output.recording import Recording
from quadvis.output.statistics import finite
from quadvis.run.verdict import Outcome

if TYPE_CHECKING:
    from quadvis.diagram.diagram import Diagram
    from quadvis.realtime.flight import Flight

PYTHON_ONLY = Choice(PYTHON)


@dataclass(frozen=True)
class Result:
    """The result of a run: ``result["plant.position"]`` is an array with a leading time axis.

    ``duration`` is the simulated time (s), ``wall`` the wall time (s), ``cpu`` the processor time (s).
    ``lost`` says which rows the log lacks because the disk refused them; "" without a log or without lost
    rows. ``engine`` is what ran the diagram, and why. ``flight`` has the times of the tasks of a real-time
    run; None after a simulation. ``profiles`` are the times of blocks by computer, if asked for.
    """

    diagram: Diagram
    signals: Recording
    outcome: Outcome
    duration: float
    wall: float
    cpu: float
    lost: str = ""
    engine: Choice = PYTHON_ONLY
    flight: Flight | None = None
    profiles: Mapping[str, ProfileReport] = field(default_factory=dict)

    def __getitem__(self, name: str) -> NDArray[Any]:
        return self.signals[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.signals)

    def __len__(self) -> int:
        return len(self.signals)

    def __contains__(self, name: object) -> bool:
        return name in self.signals

    def __repr__(self) -> str:
        passed = "passed" if self.passed else "failed"
        return f"<Result of {self.diagram.name}: {self.duration:g} s, {len(self)} signals, {passed}>"

    def times(self, name: str) -> NDArray[np.float64]:
        """Return the times of a signal's rows (s)."""
        return self.signals.times(name)

    def rate(self, name: str) -> str:
        """Return the name of the rate of a signal's block."""
        return self.signals.rate(name)

    def frame(self, signals: Sequence[str] = (), *, rate: str = "", every: str | float = 0.0) -> Any:
        """Return signals as a pandas.DataFrame; see `quadvis.output.recording.Recording.frame`."""
        return self.signals.frame(signals, rate=rate, every=every)

    def xarray(self, signals: Sequence[str] = ()) -> Any:
        """Return signals as an xarray.Dataset, each at its own times (s)."""
        return self.signals.xarray(signals)

    @property
    def units(self) -> Mapping[str, str]:
        """The unit of every signal."""
        return self.signals.units

    @property
    def passed(self) -> bool:
        """True if every expectation on a run is met, no row was lost, and no outputs had to be made safe.

        Expectations on the loop are judged by `analyse`.
        """
        return self.outcome.passed and (self.flight is None or self.flight.passed)

    @property
    def real_time_factor(self) -> float:
        """Simulated time divided by wall time."""
        return self.duration / self.wall if self.wall else float("inf")

    def facts(self) -> dict[str, Any]:
        """Return the outcome as plain data: what `quadvis run --json` prints.

        ``diagram``, ``variant`` (or None), ``params`` (the parameter files), ``hash`` and ``seed`` identify
        the run. ``passed`` says whether all expectations are met. ``duration_s`` is the simulated time,
        ``wall_s`` the wall time, ``cpu_s`` the processor time, ``engine`` "python" or "native";
        ``real_time_factor`` is simulated time divided by wall time. ``real_time`` holds what was granted and
        the times of all tasks, None for a simulation. ``summary``
        holds ``{signal, unit, rms, max, ...}`` by label; ``final`` of several elements is a list. ``expect``
        is a list of ``{expectation, signal, kind, unit, limit, found, met, lack, shown}``; ``lack`` says why
        the run cannot be judged, ``shown`` is ``found`` as text. ``margins`` is the number of expectations on
        the loop, which only an analysis judges. Numbers are in the unit beside them; None stands for a number
        that is unknown or infinite.
        """
        summary = {
            entry.label: {
                "signal": entry.selection.text,
                "unit": str(entry.selection.unit),
                **{name: finite(value) for name, value in self.outcome.summary[entry.label].items()},
            }
            for entry in self.diagram.summary
        }
        return {
            "diagram": self.diagram.name,
            "variant": self.diagram.variant,
            "params": [str(file.path) for file in self.diagram.parameter_files],
            "hash": self.diagram.hash,
            "seed": self.diagram.seed,
            "passed": self.passed,
            "duration_s": self.duration,
            "wall_s": self.wall,
            "cpu_s": self.cpu,
            "engine": self.engine.engine,
            "real_time_factor": finite(self.real_time_factor),
            "real_time": self.flight.facts() if self.flight else None,
            "summary": summary,
            "expect": [verdict.facts() for verdict in self.outcome.verdicts],
            "margins": len(self.diagram.loop_requirements),
        }
