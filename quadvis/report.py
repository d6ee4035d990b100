"""What `quadvis run` shows: a line of progress while it runs, a summary at the end."""

from __future__ import annotations

import math
import sys
from types import TracebackType
from typing import Self, TextIO

from quadvis.run import Result


class ProgressLine:
    """One line on standard error that is rewritten while a run goes on; nothing where no one watches."""

    def __init__(self, duration: float, stream: TextIO | None = None) -> None:
        self.stream = stream or sys.stderr
        self.duration = duration
        self.shown = self.stream.isatty()

    def __enter__(self) -> Self:
        return self

    def __call__(self, time: float, wall: float) -> None:
        """Show the simulated time reached and how fast it goes."""
        if self.shown:
            filled = int(24 * min(1.0, time / self.duration)) if self.duration else 24
            bar = "#" * filled + "." * (24 - filled)
            self.stream.write(f"\r[{bar}] {time:6.1f} / {self.duration:g} s  {time / max(wall, 1e-9):.0f} x real time ")
            self.stream.flush()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self.shown:
            self.stream.write("\r\x1b[K")
            self.stream.flush()


def summary_lines(result: Result) -> list[str]:
    """Return the summary of a run, for people."""
    diagram = result.diagram
    variant = f" ({diagram.variant})" if diagram.variant else ""
    lines = [f"{diagram.name}{variant}: {result.duration:g} s, seed {diagram.seed}"]
    width = max((len(entry.label) for entry in diagram.summary), default=0)
    for entry in diagram.summary:
        values = result.outcome.summary[entry.label]
        shown = [f"{name} {_number(value, entry.scale, entry.unit)}" for name, value in values.items()]
        stretch = f"  ({entry.part.after:g} s on)" if entry.part.after else ""
        lines.append(f"  {entry.label.ljust(width)}  {', '.join(shown)}{stretch}")
    lines += [f"  {verdict}" for verdict in result.outcome.verdicts]
    lines.append(f"  {result.wall:.1f} s of wall time, {result.real_time_factor:.0f} x real time")
    met = sum(verdict.met for verdict in result.outcome.verdicts)
    if result.outcome.verdicts:
        lines.append(f"{'PASSED' if result.passed else 'FAILED'}: {met} of {len(result.outcome.verdicts)} expectations met")
    return lines


def _number(value: float, scale: float, unit: str) -> str:
    if math.isnan(value):
        return "none"
    return f"{value / scale:.4g}" + ("" if unit == "1" else f" {unit}")
