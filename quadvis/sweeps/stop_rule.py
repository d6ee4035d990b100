"""`--until 'failing within 2 %'`: a sweep that stops when it knows something well enough.

The rule looks at the first runs of the design alone, at numbers of runs that are fixed beforehand, so that
the table does not depend on which runs were finished earlier.
"""

from __future__ import annotations

import math
import re
from array import array
from collections.abc import Sequence

import numpy as np

from quadvis.errors import QuadvisError, quoted, suggestion
from quadvis.errors.caller import as_given
from quadvis.sweeps.axes import GRID, SEED
from quadvis.sweeps.designs import DESIGNS, ONE_AT_A_TIME, SALTELLI, Design
from quadvis.sweeps.estimates import IntervalEstimate, estimate_mean, estimate_probability
from quadvis.sweeps.worker import Quantity, Row
from quadvis.units import Unit, UnitError, split_quantity

FAILING = "failing"
FEWEST = 50  # runs before the first look
GROWTH = 1.1  # from one look to the next

_WITHIN = re.compile(r"(?P<what>.+)\s+within\s+(?P<size>.+)", re.DOTALL)


class StopRule:
    """What is to be known how well: half of the 95 % interval of a mean, or of a probability of failing."""

    def __init__(self, text: str, quantities: Sequence[Quantity], design: Design) -> None:
        """Read the rule; QuadvisError if it names nothing, its size is none, or the design is ordered."""
        _refuse_ordered(design)
        match = _WITHIN.fullmatch(text.strip())
        if match is None:
            problem = f"{quoted(text)} does not say what is to be known how well"
            raise QuadvisError(f"{problem}; write such as '{FAILING} within 2 %'")
        self.what, size = match["what"].strip(), match["size"].strip()
        self.place = _place(self.what, quantities)
        self.quantity = None if self.place is None else quantities[self.place]
        self.is_relative = self.quantity is not None and self.quantity.summary and size.endswith("%")
        self.size = _size(text, size, self.quantity)
        self.enough_at: int | None = None  # runs, when it is known well enough
        self.estimate = IntervalEstimate(math.nan, math.nan, math.nan)  # at the last look
        self._values, self._count, self._failed, self._next = array("d"), 0, 0, FEWEST
        self._runs = design.runs

    def add(self, row: Row) -> None:
        """Take one more run, in the order of the design."""
        if self.enough_at is not None:
            return
        self._count += 1
        if self.quantity is None:
            self._failed += not row.passed
        else:
            value = row.numbers[self.place] if row.numbers and self.place is not None else math.nan
            if self.quantity.summary:
                self._values.append(value)
            else:
                self._failed += not self.quantity.holds(value)
        if self._count >= self._next or self._count == self._runs:
            self._next = math.ceil(self._count * GROWTH)
            self._look()

    def _look(self) -> None:
        if self.quantity is not None and self.quantity.summary:
            values = np.array(self._values)
            self.estimate = estimate_mean(values[np.isfinite(values)])
        else:
            self.estimate = estimate_probability(self._failed, self._count)
        if self.half_width <= self.size * (abs(self.estimate.value) if self.is_relative else 1.0):
            self.enough_at = self._count

    @property
    def half_width(self) -> float:
        """Half of the interval at the last look."""
        return (self.estimate.high - self.estimate.low) / 2

    @property
    def words(self) -> str:
        """What came of it, as a sentence."""
        found = f"{self.what} is known within {self._shown(self.half_width)}"
        if self.enough_at is None:
            return f"after all {self._count} runs {found}, not {self._shown_size}"
        return f"stopped after {self.enough_at} of {self._runs} runs: {found}"

    @property
    def _shown_size(self) -> str:
        return f"{100 * self.size:.3g} %" if self.is_relative else self._shown(self.size)

    def _shown(self, width: float) -> str:
        if self.quantity is None or not self.quantity.summary:
            return f"{100 * width:.2g} %"
        return f"{width:.2g} {self.quantity.unit}".rstrip()


def _refuse_ordered(design: Design) -> None:
    """Refuse a design whose first runs are no sample of all of them."""
    others = [axis for axis in design.axes if axis.name != SEED]
    is_grid = design.name == GRID and any(len(axis.values) > 1 for axis in others if hasattr(axis, "values"))
    if is_grid or design.name in (ONE_AT_A_TIME, SALTELLI):
        problem = f"{as_given('--until', 'until')} is for runs of which some stand for all"
        remedy = "sweep over seeds alone, or give a design such as random"
        raise QuadvisError(f"{problem}, and not for '{DESIGNS[design.name]}'; {remedy}")


def _place(what: str, quantities: Sequence[Quantity]) -> int | None:
    """Return the place of a quantity among the numbers of a run; None means all expectations."""
    if what == FAILING:
        return None
    names = {quantity.label: place for place, quantity in enumerate(quantities)}
    if what not in names:
        remedy = suggestion(what, [FAILING, *names]) or f"write '{FAILING}', or one of {', '.join(names)}"
        raise QuadvisError(f"the runs give no {quoted(what)}; {remedy}")
    return names[what]


def _size(text: str, size: str, quantity: Quantity | None) -> float:
    """Return a share, or a number in the unit of the quantity."""
    number, unit = split_quantity(size)
    try:
        value = float(number)
        if unit == "%":
            value /= 100.0
        elif unit or (quantity is not None and quantity.summary and quantity.unit):
            own = (
                Unit.parse(quantity.unit or "1")
                if quantity is not None and quantity.summary
                else Unit.parse("1")
            )
            given = Unit.parse(unit or "1")
            if not given.dimension_equals(own) or given.variables:
                raise ValueError
            value *= given.scale / own.scale
    except (ValueError, UnitError):
        value = math.nan
    if not 0.0 < value < math.inf:
        own_unit = quantity.unit if quantity is not None and quantity.summary else ""
        wanted = f"a share such as 2 %{f', or a size in {own_unit}' if own_unit else ''}"
        raise QuadvisError(f"{quoted(size)} in {quoted(text)} is no size; give {wanted}")
    return value
