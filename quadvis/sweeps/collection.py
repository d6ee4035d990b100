"""The finished runs of a sweep in memory, and their table in the order of the design."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from quadvis.sweeps.designs import Design
from quadvis.sweeps.stop_rule import StopRule
from quadvis.sweeps.table import FAILURE, HASH, PASSED, Table
from quadvis.sweeps.worker import Quantity, Row


@dataclass(frozen=True)
class TableMaker:
    """Makes tables of rows; all of one sweep have the same columns."""

    name: str
    design: Design
    quantities: Sequence[Quantity]
    margins: int

    def table(self, rows: Sequence[Row]) -> Table:
        """Return the table of some rows, in their order."""
        numbers_of = np.array([row.index for row in rows], np.int64)
        columns = self.design.columns(numbers_of)
        missing = (math.nan,) * len(self.quantities)
        numbers = np.array([row.numbers or missing for row in rows], np.float64)
        numbers = numbers.reshape(len(rows), len(self.quantities))
        columns |= {quantity.column: numbers[:, number] for number, quantity in enumerate(self.quantities)}
        columns[PASSED] = np.array([row.passed for row in rows], np.bool_)
        columns[FAILURE] = np.array([row.failure for row in rows], np.str_)
        columns[HASH] = np.array([row.hash for row in rows], np.str_)
        wall = np.array([row.wall for row in rows], np.float64)
        return Table(self.name, self.design, self.quantities, numbers_of, columns, wall, self.margins)


class Collection:
    """The rows so far; ``enough`` is true once the rule, if there is one, says so."""

    def __init__(self, make: TableMaker, rule: StopRule | None = None) -> None:
        self.make, self.rule = make, rule
        self.units = tuple(quantity.unit for quantity in make.quantities)
        self.rows: dict[int, Row] = {}
        self.finished = self.failed = 0
        self.known = 0  # so many of the first runs of the design are finished

    def add(self, row: Row) -> None:
        """Add the row of one run."""
        if not row.failure and row.units != self.units:
            row = Row(row.index, row.hash, failure="its numbers have other units than those of the first run")
        self.rows[row.index] = row
        self.finished += 1
        self.failed += not row.passed
        while not self.enough and self.known in self.rows:
            if self.rule is not None:
                self.rule.add(self.rows[self.known])
            self.known += 1

    @property
    def enough(self) -> bool:
        """True if no more runs are wanted."""
        return self.rule is not None and self.rule.enough_at is not None

    def drop_surplus(self) -> None:
        """Forget the runs after those that were enough, which were finished all the same."""
        if self.enough:
            for index in [index for index in self.rows if index >= self.known]:
                self.failed -= not self.rows.pop(index).passed
                self.finished -= 1

    def table(self, after: int = 0) -> Table:
        """Return the table of the rows so far, without the first ``after`` rows that came."""
        return self.make.table([self.rows[index] for index in sorted(list(self.rows)[after:])])
