"""How much a smaller solver step changes a run: its accuracy, and the order of the solver that is seen.

The run is repeated with a half and with a quarter of the step. The first difference is an estimate of the
error, the ratio of both gives the order: Richardson's extrapolation, Hairer, Norsett, Wanner, Solving
Ordinary Differential Equations I, section II.4.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadvis.diagram.outputs import files_written
from quadvis.diagram.rewritten import refined
from quadvis.diagram.times import time_text
from quadvis.engine.engine import Engine
from quadvis.engine.solver import ORDERS
from quadvis.engine.stability import REMEDY, TooLargeStep, stiffness, too_large
from quadvis.errors import QuadvisError, sentence
from quadvis.graph.devices import refuse_devices
from quadvis.graph.graph import VARIABLE, Tolerances
from quadvis.native.choice import AUTO, choose, use
from quadvis.output.recording import Recording
from quadvis.output.statistics import finite
from quadvis.run.session import run

if TYPE_CHECKING:
    from quadvis.diagram.diagram import Diagram

REFINED = (0, 1, 2)  # the step is halved so many times
LOOKS = 50  # of so many instants of a run the poles are looked at
ROUNDING = 1e-12  # of a signal's range: differences below come from rounding
ACCURATE = 1e-2  # of a signal's range: the largest difference of a run that counts as converged
NEAR = 0.5  # an order seen that lacks no more is that of the solver

Say = Callable[[str], None]
Samples = NDArray[np.float64]


class SignalAccuracy(NamedTuple):
    """How much an element of a signal changes with half the step: the most of all elements of the signal.

    ``difference`` is the largest (in ``unit``), at ``time`` (s); ``share`` is its share of the element's
    range over the run. ``order`` is that with which it falls; NaN if rounding hides it.
    """

    name: str
    unit: str
    difference: float
    time: float
    share: float
    order: float

    def facts(self) -> dict[str, Any]:
        """Return it as plain data."""
        found = {key: finite(value) for key, value in self._asdict().items() if key not in ("name", "unit")}
        return {"signal": self.name, "unit": self.unit, **found}


@dataclass(frozen=True)
class Accuracy:
    """What a smaller step changes: ``signals`` have the largest change first.

    ``step`` is the solver's (s); None if no block has a continuous state, so that there is nothing to refine.
    ``noisy`` blocks draw noise at every step, which is other noise at a smaller one. ``too_large`` has the
    pole for which the step was, at some time of the run, too large to be stable; ``stiff`` is what is to be
    said of poles far apart, or empty. A solver that chooses its steps has ``tolerances``, which are made a
    tenth in place of the half of a step.
    """

    solver: str
    step: Fraction | None
    signals: tuple[SignalAccuracy, ...] = ()
    noisy: tuple[str, ...] = ()
    too_large: TooLargeStep | None = None
    stiff: str = ""
    tolerances: Tolerances | None = None

    @property
    def worst(self) -> SignalAccuracy | None:
        """The signal that changes most; None if none does beyond rounding."""
        return self.signals[0] if self.signals and self.signals[0].share > ROUNDING else None

    @property
    def converged(self) -> bool:
        """True if no signal changes by more than `ACCURATE` of its range, and the step was always stable."""
        return self.too_large is None and (self.worst is None or self.worst.share <= ACCURATE)

    @property
    def verdict(self) -> str:
        """One sentence for people."""
        if self.step is None:
            return "nothing to refine: no block has a continuous state"
        if self.too_large is not None:
            return sentence(self.too_large.problem, REMEDY)
        worst, step = self.worst, time_text(self.step)
        given = f"a step of {step}" if self.tolerances is None else f"'rtol: {self.tolerances.rtol:g}'"
        if worst is None:
            return f"converged: {self.less} changes nothing beyond rounding"
        if self.converged:
            order = f"; {self._order(worst.order)}" if self.tolerances is None else ""
            return f"converged to {worst.share:.2g} of the range of '{worst.name}' with {given}{order}"
        smaller = time_text(self._smaller(worst)) if self.tolerances is None else "a hundredth"
        changed = f"'{worst.name}' by {100 * worst.share:.3g} % of its range"
        return f"not converged: {self.less} changes {changed}; make it smaller, such as {smaller}"

    @property
    def less(self) -> str:
        """What has made the changes, in words."""
        if self.tolerances is not None:
            return f"a tenth of the tolerance of {self.tolerances.rtol:g}"
        return f"half the step of {time_text(self.step)}" if self.step is not None else ""

    def _order(self, seen: float) -> str:
        order = ORDERS[self.solver]
        if math.isnan(seen):
            return "rounding hides the order"
        if seen >= order - NEAR:
            return f"order seen: {seen:.1f}, of {order} for {self.solver}"
        return f"order seen: {seen:.1f}, not {order} as {self.solver} has: something jumps between two steps"

    def _smaller(self, worst: SignalAccuracy) -> Fraction:
        """Return a step with which the difference would be small enough, if it falls as was seen."""
        assert self.step is not None
        order = min(max(worst.order, 1.0), ORDERS[self.solver]) if math.isfinite(worst.order) else 1.0
        halves = math.ceil(math.log2(worst.share / ACCURATE) / order) if math.isfinite(worst.share) else 1
        return self.step * Fraction(1, 2 ** min(max(halves, 1), 10))

    @property
    def remarks(self) -> tuple[str, ...]:
        """What is to be said of the differences besides."""
        names = ", ".join(f"'{name}'" for name in self.noisy)
        noise = f"noise drawn at every step is other noise with half of it: {names}" if names else ""
        return tuple(filter(None, (noise, self.stiff)))

    def facts(self) -> dict[str, Any]:
        """Return it as plain data."""
        return {
            "solver": self.solver,
            "step_s": None if self.step is None else float(self.step),
            "converged": self.converged,
            "verdict": self.verdict,
            "too_large": None if self.too_large is None else self.too_large.facts(),
            "remarks": list(self.remarks),
            "signals": [signal.facts() for signal in self.signals],
        }


def accuracy(diagram: Diagram, say: Say | None = None, engine: str = AUTO) -> Accuracy:
    """Run a diagram with its step, with a half and with a quarter of it, and compare what it logs.

    ``say`` takes the progress in words, ``engine`` is that of `Diagram.run`. RunError if a run fails;
    QuadvisError if a block writes files, which each run would replace.
    """
    graph = diagram.graph
    if not any(node.block.interface.continuous for node in graph.nodes):
        return Accuracy(graph.solver, None)
    if written := files_written([node.block for node in graph.nodes]):
        problem = f"the accuracy takes {len(REFINED)} runs, and each would write '{written[0]}'"
        raise QuadvisError(f"{problem}; leave out the block that writes it")
    tolerances = graph.tolerances if graph.solver in VARIABLE else None
    unstable, stiff = _looked(diagram, say, engine) if tolerances is None else (None, "")
    runs = [_signals(diagram, times, say, engine) for times in REFINED]
    noisy = [
        node.path
        for node in graph.nodes
        if tolerances is None and node.task.continuous and node.block.interface.streams and not node.hidden
    ]
    found = sorted(_compared(runs), key=lambda each: (-each.share, each.name))
    return Accuracy(graph.solver, graph.step, tuple(found), tuple(noisy), unstable, stiff, tolerances)


def _looked(diagram: Diagram, say: Say | None, engine: str) -> tuple[TooLargeStep | None, str]:
    """Return what the poles at some instants of a run say: which asks for a smaller step, and if it is stiff.

    RunError if the run fails, which says this pole, too.
    """
    found: list[TooLargeStep] = []
    stiff = ""
    refuse_devices(diagram.graph)
    made = Engine(diagram.graph, diagram.seed)
    made.end_before(diagram.ticks)
    use(made, choose(made, diagram.ticks, engine))
    with made:
        for number in range(LOOKS + 1):
            if say is not None:
                say(f"poles at {made.time:.1f} of {diagram.duration:g} s")
            made.run(number * diagram.ticks // LOOKS - made.tick)
            poles = made.poles()
            excess = too_large(diagram.graph.solver, diagram.graph.tick, poles)
            found += [excess] if excess is not None else []
            stiff = stiff or stiffness(diagram.graph.solver, diagram.graph.tick, poles)
    least = min(found, key=lambda each: each.limit, default=None)
    return least, stiff if least is None else ""


def _signals(diagram: Diagram, times: int, say: Say | None, engine: str) -> Recording:
    """Return what is logged of a run with a smaller step."""
    finer = refined(diagram, times)

    def progress(time: float, _: float) -> None:
        if say is not None:
            how = time_text(finer.graph.tick)
            if finer.graph.solver in VARIABLE:
                how = f"{finer.graph.tolerances.rtol:g}"
            say(f"with {how}: {min(time, finer.duration):.1f} of {finer.duration:g} s")

    return run(finer, progress=progress, engine=engine).signals


def _compared(runs: Sequence[Recording]) -> Iterator[SignalAccuracy]:
    """Yield the change of each signal of real numbers."""
    for name in runs[0].names:
        port = runs[0].port(name)
        stamps = runs[0].stamps(name)
        if port.type != "float64" or not stamps.size or not port.size:
            continue
        rows = [_rows_at(each, name, stamps) for each in runs]
        first, second = (_differences(*pair) for pair in pairwise(rows))
        shares = _shares(first.max(axis=0), rows[-1])
        element = int(np.argmax(shares))
        row = int(np.argmax(first[:, element]))
        index = f"[{','.join(map(str, np.unravel_index(element, port.shape)))}]" if port.shape else ""
        units = port.unit.split(" ")
        yield SignalAccuracy(
            f"{name}{index}",
            units[element] if len(units) > 1 else port.unit,
            float(first[row, element]),
            float(stamps[row] / 1e9),
            float(shares[element]),
            _order(float(first[:, element].max()), float(second[:, element].max()), shares[element]),
        )


def _rows_at(recording: Recording, name: str, stamps: NDArray[np.int64]) -> Samples:
    """Return the rows (N, elements) of a signal at these stamps (N,), which are among its own."""
    places = np.searchsorted(recording.stamps(name), stamps)
    return np.asarray(recording[name][places].reshape(len(stamps), -1), np.float64)


def _differences(one: Samples, other: Samples) -> Samples:
    """Return the absolute differences; a number that is missing in one alone is an infinite one."""
    both = np.isnan(one) & np.isnan(other)
    same = both | (one == other)
    with np.errstate(invalid="ignore", over="ignore"):
        found = np.where(same, 0.0, np.abs(one - other))
    return np.where(np.isnan(found), np.inf, found)


def _shares(differences: Samples, rows: Samples) -> Samples:
    """Return differences (elements,) as shares of the range of each element, or of its size if it rests."""
    known = np.where(np.isfinite(rows), rows, 0.0)
    size = np.abs(known).max(axis=0)
    span = np.ptp(known, axis=0)
    scale = np.where(span > ROUNDING * size, span, size)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(differences > 0.0, differences / scale, 0.0)


def _order(first: float, second: float, share: float) -> float:
    """Return the order with which a difference falls; NaN where rounding hides it."""
    if share <= ROUNDING or not math.isfinite(share):
        return math.nan
    return math.log2(first / second) if second > 0.0 and math.isfinite(second) else math.nan
