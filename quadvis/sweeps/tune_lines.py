"""What a search for the best parameters prints, and the parameter file with them."""

from __future__ import annotations

import math

from quadvis.errors.caller import as_given
from quadvis.machine.columns import table
from quadvis.machine.status_line import StatusLine
from quadvis.sweeps.tune import Trial, TuneResult


class TuneLine(StatusLine):
    """The number of trials so far and the best number, while a search goes on."""

    def __init__(self) -> None:
        super().__init__()
        self._count = 0

    def __call__(self, trial: Trial, best: Trial) -> None:
        """Show one more trial."""
        self._count += 1
        self.show(f"trial {self._count}, best so far {best.found:.4g}")


def tune_lines(result: TuneResult) -> list[str]:
    """Return the summary: the number before and after, the values, and what is to be thought of."""
    best, own, unit = result.best, result.own, result.quantity.unit
    rows = [("", result.quantity.label, *(each.label for each in result.ranges), "")]
    for name, trial in (("as it is", own), ("best", best)):
        if trial is not None:
            values = [each.shows(trial.values[each.label]) for each in result.ranges]
            rows.append((name, _number(trial.found, unit), *values, "passes" if trial.passed else "FAILS"))
    lines = [*table(rows), f"{len(result.trials)} trials" + (f" of {result.seeds} runs" * (result.seeds > 1))]
    for label in result.at_ends:
        lines.append(f"'{label}' is at an end of its range; a wider one may give more")
    if not best.passed:
        lines.append(
            f"the best trial misses an expectation; {as_given('--passing', 'passing=True')} leaves such out"
        )
    return lines


def _number(value: float, unit: str) -> str:
    return f"{value:.4g} {unit}".rstrip() if math.isfinite(value) else "none"


def parameter_file(result: TuneResult) -> str:
    """Return a file for `--params` with the best values."""
    head = (
        f"# {result.quantity.label} is {_number(result.best.found, result.quantity.unit)} in {result.diagram}"
    )
    lines = [head, "quadvis: 1", f"name: {result.diagram}-tuned", "set:"]
    return "\n".join([*lines, *(f"  {name}: {text}" for name, text in result.settings.items()), ""])
