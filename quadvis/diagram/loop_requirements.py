"""The requirements of a diagram on its linearised loop: margins, sensitivity, transfers, limits."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

from quadvis.diagram.sections.analyse import Limit
from quadvis.diagram.sections.cuts import Cut
from quadvis.diagram.sections.transfers import Transfer
from quadvis.units import Unit, format_ratio

MARGINS: Mapping[str, str] = {
    "gain": "the loop may be multiplied and divided by so much: 2, or 6 dB",
    "phase": "its phase may be turned so far, either way",
    "delay": "it may be so much later",
}


class TransferKind(NamedTuple):
    """A number of a transfer that can be expected: whether at least or at most so much, its unit, its words.

    The unit is "" for that of the transfer.
    """

    least: bool
    unit: str
    doc: str

    @property
    def words(self) -> str:
        """The comparison in words."""
        return "at least" if self.least else "at most"


TRANSFERS: Mapping[str, TransferKind] = {
    "bandwidth": TransferKind(True, "rad/s", "the gain falls by 3 dB at this frequency or later: 3 Hz"),
    "resonance": TransferKind(False, "1", "the largest gain over that at frequency 0: 1.3, or 2 dB"),
    "peak": TransferKind(False, "", "the largest gain at any frequency, in the unit of the transfer"),
    "rise_time": TransferKind(False, "s", "the step response goes from 10 % to 90 % in this time"),
    "overshoot": TransferKind(False, "1", "the step response goes beyond its end by so much: 20 %"),
    "settling_time": TransferKind(False, "s", "the step response stays within 2 % after this time"),
}
SENSITIVITIES = ("sensitivity", "complementary_sensitivity")


class RequiredMargin(NamedTuple):
    """A margin of the loop opened at a cut: at least ``bound``, a factor, rad or s by its ``kind``.

    ``shown`` is the unit of texts.
    """

    cut: Cut
    kind: str
    bound: float
    shown: str

    @property
    def label(self) -> str:
        """The name of the cut."""
        return self.cut.label

    @property
    def unit(self) -> str:
        """The unit of ``bound``."""
        return {"gain": "1", "phase": "rad", "delay": "s"}[self.kind]

    def __str__(self) -> str:
        return f"{self.label}: {self.kind} margin at least {self.shows(self.bound)}"

    def shows(self, value: float) -> str:
        """Return a margin as text."""
        if math.isinf(value):
            return "any"
        if self.kind == "gain":
            return format_ratio(value, self.shown)
        return f"{value / Unit.parse(self.shown).scale:.4g} {self.shown}"


class RequiredLimit(NamedTuple):
    """A range of a parameter in which the loop must be stable: from the start of its limit beyond ``bound``.

    ``bound`` is in SI units; ``kind`` is the direction, "above" or "below".
    """

    limit: Limit
    kind: str
    bound: float

    @property
    def label(self) -> str:
        """The name of the limit."""
        return self.limit.label

    @property
    def unit(self) -> str:
        """The unit of ``bound``."""
        return str(self.limit.variable.unit)

    def __str__(self) -> str:
        words = "up to more" if self.kind == "above" else "down to less"
        return f"{self.label}: stable {words} than {self.shows(self.bound)}"

    def shows(self, value: float) -> str:
        """Return a value of the parameter as text."""
        return self.limit.shows(value)


class RequiredSensitivity(NamedTuple):
    """A peak of the loop's sensitivity at a cut, less than ``bound``, a factor.

    ``kind`` is "sensitivity" (S) or "complementary_sensitivity" (T); ``shown`` is the unit of texts.
    """

    cut: Cut
    kind: str
    bound: float
    shown: str
    unit: str = "1"

    @property
    def label(self) -> str:
        """The name of the cut."""
        return self.cut.label

    def __str__(self) -> str:
        return f"{self.label}: peak of {self.kind.replace('_', ' ')} below {self.shows(self.bound)}"

    def shows(self, value: float) -> str:
        """Return a peak as text."""
        return format_ratio(value, self.shown)


class RequiredTransfer(NamedTuple):
    """A number of a transfer: ``kind`` is a key of TRANSFERS, ``bound`` in SI units.

    ``shown`` is the unit of texts.
    """

    transfer: Transfer
    kind: str
    bound: float
    shown: str

    @property
    def label(self) -> str:
        """The name of the transfer."""
        return self.transfer.label

    @property
    def unit(self) -> str:
        """The unit of ``bound``."""
        return TRANSFERS[self.kind].unit or str(self.transfer.unit)

    def __str__(self) -> str:
        found = TRANSFERS[self.kind]
        return f"{self.label}: {self.kind.replace('_', ' ')} {found.words} {self.shows(self.bound)}"

    def shows(self, value: float) -> str:
        """Return a value of the kind as text."""
        if self.kind == "resonance":
            return format_ratio(value, self.shown)
        if math.isinf(value):
            return "unlimited"
        if self.unit == "rad/s" and self.shown == "Hz":
            return f"{value / (2.0 * math.pi):.4g} Hz"
        scale = Unit.parse(self.shown).scale if self.shown else 1.0
        return f"{value / scale:.4g} {self.shown}".rstrip()


LoopRequirement = RequiredMargin | RequiredSensitivity | RequiredTransfer | RequiredLimit


def direction(limit: Limit) -> str:
    """Return the kind of requirement that a limit can meet: that of the direction in which it is sought."""
    return "above" if limit.end > limit.start else "below"
