"""Look for the values of parameters with which a number of the summary is least, by scipy's optimisers.

Each trial is a run, or one for each seed, as a sweep does it. The number may jump from trial to trial, and so
the methods are those that need no derivative.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from quadvis.diagram.sections.analyse import Limit
from quadvis.diagram.settings import Files, Given
from quadvis.engine.engine import Engine
from quadvis.errors import QuadvisError, counted, quoted, suggestion
from quadvis.errors.caller import as_given
from quadvis.graph.devices import refuse_devices
from quadvis.library.catalogue import OwnBlocks
from quadvis.native.choice import AUTO, Announce, choose
from quadvis.sweeps.sweep import setting_paths, setting_texts
from quadvis.sweeps.worker import Configuration, Job, Quantity, Row, perform, quantities

if TYPE_CHECKING:
    from quadvis.diagram.diagram import Diagram

METHODS = ("bounded", "nelder-mead", "powell", "evolution")
MOST = 60  # trials
CLOSE = 1e-3  # of a range: parameters are sought no closer

TrialProgress = Callable[["Trial", "Trial"], None]  # takes the last trial and the best one


@dataclass(frozen=True)
class Trial:
    """The values of a trial (SI), by parameter; the number that was found, and whether all runs passed.

    ``found`` is the mean over the seeds, infinite if a run stopped with an error, which ``failure`` then is.
    """

    values: Mapping[str, float]
    found: float
    passed: bool
    failure: str = ""


@dataclass(frozen=True)
class TuneResult:
    """All trials in their order; ``quantity`` is what was sought, in the unit of the summary."""

    diagram: str
    quantity: Quantity
    ranges: tuple[Limit, ...]
    seeds: int
    trials: tuple[Trial, ...]

    def __repr__(self) -> str:
        found = f"{self.quantity.label} {self.best.found:.4g} {self.quantity.unit}".rstrip()
        return f"<TuneResult of {self.diagram}: {found} in {counted(len(self.trials), 'trial')}>"

    @property
    def own(self) -> Trial | None:
        """The trial of the parameters' own values; None if these could not be read."""
        mine = {each.label: each.variable.value for each in self.ranges}
        return self.trials[0] if self.trials[0].values == mine else None

    @property
    def best(self) -> Trial:
        """The trial with the least number, the first of equal ones."""
        return min(self.trials, key=lambda trial: trial.found)

    @property
    def settings(self) -> dict[str, str]:
        """The best values as texts, as `settings` of `quadvis.load` and ``--set`` take them."""
        return {each.label: _text(each, self.best.values[each.label]) for each in self.ranges}

    @property
    def at_ends(self) -> list[str]:
        """The parameters whose best value is at an end of its range: a wider one may be better."""
        return [each.label for each in self.ranges if _is_end(each, self.best.values[each.label])]


def tune(
    path: str | Path,
    minimise: str,
    over: Mapping[str, str],
    *,
    variant: str | None = None,
    settings: Given = (),
    params: Files = (),
    stop_time: str | float | None = None,
    seeds: Sequence[int] = (),
    method: str | None = None,
    most: int = MOST,
    passing: bool = False,
    own_blocks: OwnBlocks = True,
    engine: str = AUTO,
    announce: Announce | None = None,
    progress: TrialProgress | None = None,
) -> TuneResult:
    """Return the trials of a search for the least value of a number of the summary, such as "xy.rms".

    ``over`` maps parameters to ranges: ``{"bandwidth": "1..6 rad/s"}``; their own values are the first
    trial, also if they lie outside. With ``seeds`` the number is the mean over runs with these seeds.

    ``method`` is "bounded" (Brent's, of one parameter), "nelder-mead" (default for several), "powell", or
    "evolution" (differential evolution, for many valleys). The search ends after ``most`` trials, or if it
    moves by less than a thousandth of the ranges. With ``passing`` a trial that misses an expectation counts
    as infinite. The other arguments are those of `quadvis.sweep`.

    QuadvisError if there is no such number, or if no trial gave one.
    """
    texts = setting_texts(settings)
    base = Configuration(str(path), variant, texts, setting_paths(params), stop_time, bool(own_blocks))
    diagram = base.load(own_blocks)
    refuse_devices(diagram.graph)
    quantity, number = _quantity(diagram, minimise)
    ranges = _ranges(diagram, over)
    chosen = _method(method, len(ranges))
    ticks = diagram.ticks * most * max(1, len(seeds))
    search = _Search(
        base, ranges, tuple(seeds), number, most, passing,
        choose(Engine(diagram.graph), ticks, engine, announce).engine, progress,
    )  # fmt: skip
    search.run(chosen)
    result = TuneResult(diagram.name, quantity, ranges, max(1, len(seeds)), tuple(search.trials))
    if not math.isfinite(result.best.found):
        reason = next((trial.failure for trial in search.trials if trial.failure), "none passed")
        raise QuadvisError(f"no trial gave a number for {quoted(quantity.label)}: {reason}")
    return result


def _quantity(diagram: Diagram, name: str) -> tuple[Quantity, int]:
    """Return a number of the summary by its name, and its place in a row."""
    found = {each.label: (each, place) for place, each in enumerate(quantities(diagram)) if each.summary}
    if name not in found:
        remedy = suggestion(name, found) or "the diagram's 'summary' says what there is"
        raise QuadvisError(f"the summary has no {quoted(name)}; {remedy}")
    return found[name]


def _ranges(diagram: Diagram, over: Mapping[str, str]) -> tuple[Limit, ...]:
    """Return the ranges of parameters; DiagramError if one is not there, or is no number."""
    if not over:
        raise QuadvisError("there is nothing to tune; name a parameter and its range")
    split = {name: _ends(name, text) for name, text in over.items()}
    sought = {name: (name, *ends) for name, ends in split.items()}
    return diagram.questions.others({}, sought, as_given("--over", "over"))[1]


def _ends(name: str, text: str) -> tuple[str, str]:
    """Return both ends of a range with their units: "1..6 rad/s", or "1 rad/s..6 rad/s"."""
    start, dots, end = (part.strip() for part in text.partition(".."))
    if not dots or not start or not end:
        raise QuadvisError(f"{name}: {quoted(text)} is no range; write one such as '1..6 rad/s'")
    number, _, unit = end.partition(" ")
    return (start if not unit or " " in start else f"{start} {unit.strip()}"), f"{number} {unit}".strip()


def _method(name: str | None, count: int) -> str:
    chosen = name or ("bounded" if count == 1 else "nelder-mead")
    if chosen not in METHODS:
        remedy = suggestion(chosen, METHODS) or f"choose from {', '.join(METHODS)}"
        raise QuadvisError(f"there is no method {quoted(chosen)}; {remedy}")
    if chosen == "bounded" and count > 1:
        raise QuadvisError("the method 'bounded' is for one parameter; take 'nelder-mead' for several")
    return chosen


def _text(each: Limit, value: float) -> str:
    """Return a value as text, in the unit of its range."""
    unit = str(each.shown) if each.shown.symbols else ""
    return f"{value / each.shown.scale:.8g} {unit}".rstrip()


def _is_end(each: Limit, value: float) -> bool:
    return min(abs(value - each.start), abs(value - each.end)) < 2 * CLOSE * abs(each.end - each.start)


class _Enough(Exception):
    """The trials are used up."""


class _Search:
    """Trials, counted, at points of the unit cube."""

    def __init__(
        self,
        base: Configuration,
        ranges: tuple[Limit, ...],
        seeds: tuple[int, ...],
        number: int,
        most: int,
        passing: bool,
        engine: str,
        progress: TrialProgress | None,
    ) -> None:
        self._base, self._ranges, self._seeds, self._number = base, ranges, seeds, number
        self._most, self._passing, self._engine, self._progress = most, passing, engine, progress
        self.trials: list[Trial] = []

    def run(self, method: str) -> None:
        """Search until the method ends, or the trials are used up."""
        library: Any = import_module("scipy.optimize")
        bounds = [(0.0, 1.0)] * len(self._ranges)
        own = [each.variable.value for each in self._ranges]
        begin = np.array([self._unit(each) for each in self._ranges])
        try:
            if np.isfinite(own).all():
                self.trial(own)
            if method == "bounded":
                library.minimize_scalar(
                    lambda place: self.at([place]),
                    bounds=bounds[0],
                    method="bounded",
                    options={"xatol": CLOSE},
                )
            elif method == "evolution":
                library.differential_evolution(self.at, bounds, rng=1, x0=begin, tol=CLOSE, polish=False)
            else:
                options = {"xatol": CLOSE, "fatol": 0.0} if method == "nelder-mead" else {"xtol": CLOSE}
                library.minimize(self.at, begin, method=method, bounds=bounds, options=options)
        except _Enough:
            return

    @staticmethod
    def _unit(each: Limit) -> float:
        """Return the place of a parameter's own value in its range, 0 to 1; the middle if it lies outside."""
        place = (each.variable.value - each.start) / (each.end - each.start)
        return place if 0.0 <= place <= 1.0 else 0.5

    def at(self, point: Sequence[float]) -> float:
        """Return the number that is found at a point of the unit cube."""
        places = zip(self._ranges, point, strict=True)
        return self.trial(
            [each.start + float(place) * (each.end - each.start) for each, place in places]
        ).found

    def trial(self, values: Sequence[float]) -> Trial:
        """Do one trial at values in SI."""
        if len(self.trials) >= self._most:
            raise _Enough
        settings = tuple(
            each.variable.setting(value) for each, value in zip(self._ranges, values, strict=True)
        )
        configuration = replace(self._base, settings=self._base.settings + settings)
        rows = list(self._rows(configuration))
        failure = next((row.failure for row in rows if not row.numbers), "")
        passed = all(row.passed for row in rows)
        counts = not failure and (passed or not self._passing)
        found = float(np.mean([row.numbers[self._number] for row in rows])) if counts else math.inf
        named = {each.label: value for each, value in zip(self._ranges, values, strict=True)}
        trial = Trial(named, found if math.isfinite(found) else math.inf, passed, failure)
        self.trials.append(trial)
        if self._progress is not None:
            self._progress(trial, min(self.trials, key=lambda each: each.found))
        return trial

    def _rows(self, configuration: Configuration) -> Iterator[Row]:
        for number, seed in enumerate(self._seeds or (None,)):
            yield perform(Job(number, configuration, seed, engine=self._engine))
