"""The requirements of a diagram on its linearised loop: margins at cuts, and limits of parameters."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

from quadvis.diagram.sections.analyse import Cut, Limit
from quadvis.units import Unit, format_ratio

MARGINS: Mapping[str, str] = {
    "gain": "the loop may be multiplied and divided by so much: 2, or 6 dB",
    "phase": "its phase may be turned so far, either way",
    "delay": "it may be so much later",
}


class RequiredMargin(NamedTuple):
    """A margin of the loop opened at a cut: at least ``least``, a factor, rad or s by its ``kind``.

    ``shown`` is the unit of texts.
    """

    cut: Cut
    kind: str
    least: float
    shown: str

    @property
    def label(self) -> str:
        """The name of the cut."""
        return self.cut.label

    @property
    def unit(self) -> str:
        """The unit of ``least``."""
        return {"gain": "1", "phase": "rad", "delay": "s"}[self.kind]

    def __str__(self) -> str:
        return f"{self.label}: {self.kind} margin at least {self.shows(self.least)}"

    def shows(self, value: float) -> str:
        """Return a margin as text."""
        if math.isinf(value):
            return "any"
        if self.kind == "gain":
            return format_ratio(value, self.shown)
        return f"{value / Unit.parse(self.shown).scale:.4g} {self.shown}"


class RequiredLimit(NamedTuple):
    """A range of a parameter in which the loop must be stable: from the start of its limit beyond ``least``.

    ``least`` is in SI units; ``kind`` is the direction, "above" or "below".
    """

    limit: Limit
    kind: str
    least: float

    @property
    def label(self) -> str:
        """The name of the limit."""
        return self.limit.label

    @property
    def unit(self) -> str:
        """The unit of ``least``."""
        return str(self.limit.variable.unit)

    def __str__(self) -> str:
        words = "up to more" if self.kind == "above" else "down to less"
        return f"{self.label}: stable {words} than {self.shows(self.least)}"

    def shows(self, value: float) -> str:
        """Return a value of the parameter as text."""
        return self.limit.shows(value)


LoopRequirement = RequiredMargin | RequiredLimit


def direction(limit: Limit) -> str:
    """Return the kind of requirement that a limit can meet: that of the direction in which it is sought."""
    return "above" if limit.end > limit.start else "below"
